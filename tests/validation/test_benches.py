"""The blind benches, the effects outside the library, and struts by beams: against closed forms; their sets: a fair
mixture for any number of units, reproducible, sealed; their scores against made-up answers."""

import json
from collections import Counter
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import linalg, stats

from validation import outsiders
from validation import strut as struts
from validation.beams import Section, chain
from validation.bench import FS, Drifting, Playing, Sampling, Setting, World, frf, record
from validation.benches import Bench, draw_benches, drifting_gains, power_of_frequency
from validation.cases import seal
from validation.challenge import chosen_units
from validation.outsiders import OUTSIDERS
from validation.rational import butterworth, highpass_of_second_order, in_channels, resonance
from validation.scoring.scores import Lesson, Outcome
from validation.scoring.scores_laboratory import false_names_by_kind, scores_of, upper_limit
from validation.sets import SETS, draw_set, order_of
from validation.strut import Flexible, Support

Array = NDArray[np.float64]
pytestmark = pytest.mark.takes_data
ON_BENCHES = [name for name, it in SETS.items() if it.benches is not None]


def sampling(n: int, index: int = 0) -> Sampling:
    return Sampling(np.zeros(n), FS, index, np.random.default_rng(3))


# --- filters and paths ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_a_butterworth_falls_as_its_formula_says(order: int) -> None:
    f = np.array([10.0, 900.0, 1500.0, 4000.0])
    H = butterworth(1500.0, order).frf(f)[0]
    np.testing.assert_allclose(np.abs(H), 1 / np.sqrt(1 + (f / 1500.0) ** (2 * order)), rtol=1e-9)
    assert np.all(np.diff(np.unwrap(np.angle(H))) < 0)


def test_a_highpass_of_second_order_is_its_formula() -> None:
    f = np.array([1.0, 8.0, 80.0])
    s, w = 2j * np.pi * f, 2 * np.pi * 8.0
    expected = s**2 / (s**2 + 2 * 0.7 * w * s + w**2)
    np.testing.assert_allclose(highpass_of_second_order(8.0, 0.7).frf(f)[0], expected, rtol=1e-9)


# --- benches ----------------------------------------------------------------------------------------------------------


def plain_bench(**more: object) -> Bench:
    still = {"latency_us": (0.0, 0.0, 0.0), "amplifier": {"f_Hz": 1e4}, "antialias": {}, "gains": (1.0, 1.0, 1.0)}
    calm = {"drift": (0.0, 0.0, 0.0), "drifts_within": True, "mains_m": 0.0, "mains_V": 0.0, "mains_lines": ()}
    return Bench(**(still | calm | {"interpolation_m": 0.0, "period_m": 1e-6} | more))


def test_latency_amplifier_filter_and_gains_are_exact_factors() -> None:
    """The skew of each channel is a phase in proportion to frequency, to rounding."""
    late, gains = (13.0, 2.0, 7.5), (1.004, 0.99, 1.0)
    filtered = {"channel": 2, "f_Hz": 9e3, "order": 4}
    bench = plain_bench(latency_us=late, gains=gains, antialias=filtered)
    f = np.geomspace(10, 2000, 30)
    world = World(struts.nominal())
    factor = np.exp(-2j * np.pi * f * 1e-6 * np.array(late)[:, None]) * np.array(gains)[:, None] / (1 + 1j * f / 1e4)
    factor[2] *= butterworth(9e3, 4).frf(f)[0]
    np.testing.assert_allclose(frf(bench.hold(world), f), frf(world, f) * factor, rtol=1e-7)
    assert set(bench.names) == {"channel_latency_de", "channel_latency_Vs", "amplifier_bandwidth", "channel_lowpass_Vs"}


def test_a_guide_that_holds_is_the_payload_that_moves_along_z_alone() -> None:
    """A thousand times stiffer than any: 1e-4 of the response is left of its giving way."""
    rigid = Support(1e13, 1e13, 1e10, 1e10, 1e10, (0.1, 0.1, 0.1), 0.01)
    f, strut = np.geomspace(10, 2000, 20), struts.nominal()
    held = frf(World(replace(strut, support=rigid)), f)
    np.testing.assert_allclose(held, frf(World(strut), f), rtol=2e-3)


def test_a_guide_has_its_modes_where_it_is_drawn() -> None:
    """Half of the benches yield, their modes at 350 to 800 Hz: the strut moves what was drawn at 400 to 680."""
    benches = draw_benches(12, np.random.default_rng(4))
    yielding = [b for b in benches if b.support]
    assert len(yielding) == 6
    assert Counter(b.nuisance for b in benches) == {None: 6, "dispersion": 2, "two_modes": 2, "drifting_mode": 2}
    for bench in yielding:
        without = struts.modes_Hz(struts.nominal())
        modes = struts.modes_Hz(replace(struts.nominal(), support=bench.support))
        more = [np.sum((m > 350) & (m < 800)) for m in (modes, without)]
        assert more[0] - more[1] == 5
        assert json.loads(json.dumps(bench.truth()))["support"]["kx"] == bench.support.kx


def test_gains_drift_in_a_record_or_between_records() -> None:
    y = np.ones((3, 1001))
    within = drifting_gains((0.01, 0.0, 0.01), True)(y, sampling(1001))
    assert abs(within[0, 500] - 1) < 1e-12
    assert 0 < abs(within[0, -1] - within[0, 0]) <= 0.01
    np.testing.assert_array_equal(within[1], 1.0)
    between = drifting_gains((0.01, 0.01, 0.01), False)(y, sampling(1001))
    assert np.all(np.ptp(between, axis=1) == 0)
    assert np.all(np.abs(between - 1) <= 0.005)


def test_dispersion_is_one_phase_at_every_frequency() -> None:
    H = power_of_frequency(-0.01)(np.array([10.0, 100.0, 1000.0]))
    np.testing.assert_allclose(np.angle(H), -0.01 * np.pi / 2, rtol=1e-9)
    np.testing.assert_allclose(np.abs(H), [10**0.01, 1.0, 10**-0.01], rtol=1e-9)


def test_a_mode_that_drifts_by_nothing_is_a_mode_and_one_that_drifts_moves() -> None:
    """1e-3 of it: its steps are straight lines between samples of twice the rate."""
    mode = Drifting(500.0, 0.01, (1e-6, 0.0, 0.1), 0.0)
    still = in_channels(resonance(500.0, 0.01), mode.gains)
    u = np.sin(2 * np.pi * 500.0 * np.arange(20_000) / FS)
    world, strut = World(struts.nominal()), struts.nominal()
    base = Playing(world).drive(u, FS, 2)[2]
    a, b, c = (
        Playing(w).drive(u, FS, 2)[2] - base
        for w in (
            World(strut, added=(still,)),
            World(strut, drifting=(mode,)),
            World(strut, drifting=(replace(mode, relative=0.1),)),
        )
    )
    assert np.std(a[5000:] - b[5000:]) < 0.01 * np.std(a[5000:])
    # through the drive's frequency in the middle, past it at the end
    assert np.std(c[9000:11000]) > 2 * np.std(c[-2000:])


# --- outsiders --------------------------------------------------------------------------------------------------------


DAY = Setting(seconds=3.0)


def recorded(world: World, high: bool) -> dict[str, Array]:
    return record(Playing(world), DAY, np.random.default_rng(8), high, index=3)


@cache
def recorded_alone(high: bool) -> dict[str, Array]:
    """The strut without an outsider: the same record for all of them."""
    return recorded(World(struts.nominal()), high)


QUICK = ("dead_zone", "echo", "loose_plug", "skew_of_one_channel", "sticking_guide", "tuned_mass_on_payload")


@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.soak) for n in sorted(OUTSIDERS)]
)
def test_every_outsider_is_far_above_noise_and_tolerance(name: str) -> None:
    """In some channel, record and twelfth of an octave the records of the same drive and noise differ by ten times the
    noise (power) and by more than 1 % of the response."""
    p = OUTSIDERS[name].draw(np.random.default_rng(2))
    found = 0.0
    for high in (False, True):
        a, b = recorded_alone(high), recorded(OUTSIDERS[name].add(World(struts.nominal()), p), high)
        for channel, noise in (("de", DAY.encoder_m), ("da", DAY.interferometer_m), ("Vs", DAY.sensor_V)):
            f = np.fft.rfftfreq(a[channel].size, 1 / FS)
            off, there = (np.abs(np.fft.rfft(x)) ** 2 / a[channel].size for x in (b[channel] - a[channel], a[channel]))
            for lo in np.geomspace(10, 1500, 60):
                row = (f >= lo) & (f < lo * 2 ** (1 / 12))
                if np.any(row):
                    found = max(found, off[row].mean() / (10 * noise**2 + 1e-4 * there[row].mean()))
    assert found > 1.0, p
    allowed = OUTSIDERS[name].names(p)
    assert all("{" not in each for each in allowed)


def test_there_are_fifteen_kinds_and_more_of_both_sorts() -> None:
    without = [name for name, each in OUTSIDERS.items() if not each.alike]
    assert len(OUTSIDERS) >= 15
    assert len(without) >= 10


def test_what_changes_samples_does_as_its_words_say() -> None:
    y = np.vstack([np.sin(2 * np.pi * 20 * np.arange(2000) / FS)] * 3)
    dead = outsiders.dead_zone(2, 0.2)(y, sampling(2000))
    np.testing.assert_allclose(dead[2].max(), 0.8, atol=1e-3)
    np.testing.assert_array_equal(dead[:2], y[:2])
    slipped = outsiders.play(0, 0.1)(y, sampling(2000))
    assert np.max(np.abs(slipped[0] - y[0])) <= 0.1 + 1e-12
    lines = outsiders.interpolated(1, 5e-3, 40.0)(y, sampling(2000))
    assert np.sum(np.abs(np.diff(lines[1], 2)) < 1e-12) > 100
    slewed = outsiders.slew_limit(50.0)(y[0], 1 / FS)
    assert np.max(np.abs(np.diff(slewed))) <= 50.0 / FS + 1e-12
    held = outsiders.hold(2500.0)(y[0], 1 / FS)
    np.testing.assert_array_equal(held[:8], np.repeat(y[0, [0, 4]], 4))
    np.testing.assert_array_equal(outsiders.gain_step(2, 0.1)(y, sampling(2000, 1))[2], 1.1 * y[2])


def test_friction_holds_up_to_its_force_and_a_contact_opens() -> None:
    law = outsiders.friction(2.0, 1e6)()
    pulled = np.array([law(x) for x in np.linspace(0, 1e-4, 20_000)])
    assert pulled[1] == pytest.approx(-1e6 * 1e-4 / 19_999, rel=1e-2)
    assert pulled[-1] == pytest.approx(-2.0, rel=1e-2)
    assert [outsiders.contact(1e5, 1e-6)()(x) for x in (-5e-6, 0.5e-6, 3e-6)] == pytest.approx([0.0, 0.0, 0.2])


# --- struts by beams --------------------------------------------------------------------------------------------------


def test_a_cantilever_bends_and_rings_as_in_the_books() -> None:
    """Euler and Bernoulli: L^3 / 3 EI, L^2 / 2 EI; 1.8751^2 sqrt(EI / m L^4), 4.6941^2; eight elements, hardly any
    shear."""
    EI, mass, L, n = 3.0, 0.4, 0.3, 8
    section = Section(EA=2e6, EI=EI, GJ=2.0, GA=1e9, mass=mass, inertia=1e-12)
    for direction in (np.array([0, 0, 1.0]), np.array([0, 0.6, -0.8]), np.array([0.0, 1.0, 0.0])):
        K, M = (each[6:, 6:] for each in chain([section] * n, [direction * L * k / n for k in range(n + 1)]))
        across = np.array([1.0, 0.0, 0.0])  # at right angles to every direction here
        force = np.zeros(6 * n)
        force[-6:-3] = across
        moved = np.linalg.solve(K, force)[-6:]
        assert across @ moved[:3] == pytest.approx(L**3 / (3 * EI), rel=1e-5)
        np.testing.assert_allclose(moved[3:], L**2 / (2 * EI) * np.cross(direction, across), atol=1e-8)
        omega = np.sqrt(linalg.eigvalsh(K, M)[:4])
        roots = np.array([1.87510, 1.87510, 4.69409, 4.69409]) ** 2
        np.testing.assert_allclose(omega, roots * np.sqrt(EI / (mass * L**4)), rtol=2e-4)


def test_a_flat_bar_bends_across_its_thickness_by_the_third_power_of_it() -> None:
    """L^3 / 3 EI along either side of the section, wherever the bar points in the plane of its thickness; along its
    width shear adds 3 EI / (GA L^2), 0.6 %."""
    E, width, thick, L, n = 200e9, 20e-3, 1.5e-3, 0.2, 8
    section = Section.rectangle(E, 0.3, 7850.0, width, thick)
    assert section.mass == pytest.approx(7850.0 * width * thick)
    for direction in (np.array([0, 0, 1.0]), np.array([0.6, 0, 0.8]), np.array([-1.0, 0, 0])):
        K, _ = chain([section] * n, [direction * L * k / n for k in range(n + 1)])
        flexible = np.linalg.inv(K[6:, 6:])[-6:-3, -6:-3]
        normal, across = np.cross([0.0, 1.0, 0.0], direction), np.array([0.0, 1.0, 0.0])
        for along, h, b in ((normal, thick, width), (across, width, thick)):
            assert along @ flexible @ along == pytest.approx(L**3 / (3 * E * b * h**3 / 12), rel=1e-2)


def test_a_short_beam_shears_and_a_beam_has_its_mass() -> None:
    section = Section(EA=2e6, EI=3.0, GJ=2.0, GA=1e3, mass=0.4)
    K, M = chain([section] * 3, [np.array([0, 0, 0.1 * k]) for k in range(4)])
    force = np.zeros(18)
    force[-6] = 1.0
    assert np.linalg.solve(K[6:, 6:], force)[-6] == pytest.approx(0.3**3 / 9 + 0.3 / 1e3, rel=1e-9)
    together = np.tile([1.0, 0, 0, 0, 0, 0], 4)
    assert together @ M @ together == pytest.approx(0.4 * 0.3)
    np.testing.assert_allclose(K @ together, 0, atol=1e-6)


def test_a_strut_by_beams_is_one_of_joints_where_it_bends_little() -> None:
    """Stiff brackets: static gains within 0.2 %, clamped modes within 3 % (blocks have their own rotary inertia);
    brackets at 1.2 kHz change de by 5 % and more below 1 kHz and leave the gain."""
    strut = struts.nominal()
    stiff = replace(strut, flexible=Flexible(1e-3, 1e5, 1e5, 0.01))
    np.testing.assert_allclose(struts.modes_Hz(stiff, True)[:5], struts.modes_Hz(strut, True)[:5], rtol=0.03)
    soft = replace(strut, flexible=Flexible(1.5e-3, 1200.0, 1500.0, 0.01))
    f = np.array([5.0, 450.0, 600.0])
    ratio = frf(World(soft), f) / frf(World(strut), f)
    np.testing.assert_allclose(np.abs(ratio[:, 0]), 1.0, atol=2e-3)
    assert np.all(np.abs(np.abs(ratio[0, 1:]) - 1) > 0.05)


def test_a_bracket_that_is_clamped_rings_at_its_frequency() -> None:
    strut = replace(struts.nominal(), flexible=Flexible(1e-3, 1200.0, 1500.0, 0.01))
    a = struts._Assembly(strut)
    body = struts._bracket(a, strut.flexible, struts.NODES["top"], struts.ENCODER_COM, strut.head, 1200.0)
    own = slice(int(np.argmax(body[0])) - 6 * (struts.PARTS - 1), int(np.argmax(body[0])) + 6)
    modes = np.sqrt(linalg.eigvalsh(a.K[own, own], a.M[own, own])) / (2 * np.pi)
    assert modes[0] == pytest.approx(1200.0, rel=1e-6)


# --- sets -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ON_BENCHES)
def test_the_first_so_many_units_are_a_fair_mixture_and_the_same(name: str) -> None:
    it, batches = SETS[name], draw_set(name, 6)
    cases = sorted((c for b in batches for c in b.judge), key=order_of)
    assert len(cases) == it.units
    few = draw_set(name, 6, 15)
    assert seal(sorted((c for b in few for c in b.judge), key=order_of)) == seal(cases[:15])
    assert seal(cases) != seal(sorted((c for b in draw_set(name, 7) for c in b.judge), key=order_of))
    for number in (8, 13, 20):
        kinds = Counter(c.kind for c in cases[:number])
        assert all(abs(kinds[kind] - number * share) < 1.01 for kind, share in it.shares.items())
    taken = chosen_units(it, batches, len(batches))
    assert {len(each) for each in taken.values()} == {1}
    assert len(taken) == len(batches)


def test_benches_are_shared_and_learned_from_other_units() -> None:
    batches = draw_set("laboratory", 6)
    assert len({json.dumps(b.judge[0].bench.truth()) for b in batches}) == 12
    for b in batches:
        assert len({id(c.bench) for c in (*b.learn, *b.judge)}) == 1
        assert len(b.learn) == 8
        assert not {c.serial for c in b.learn} & {c.serial for c in b.judge}
        assert all(c.setting.interpolation_m == c.bench.interpolation_m for c in b.judge)
        assert not any(c.alike for c in b.judge if c.kind != "outsider")
    hiding = [bool(c.effects) for b in batches for c in b.learn]
    assert 2 <= sum(hiding) <= 20  # of 96, one in ten: three standard deviations and more on either side
    seen = Counter(name for c in draw_set("outsiders", 6)[0].judge for name in c.outside)
    assert seen == dict.fromkeys(OUTSIDERS, 2)


def test_the_folder_of_a_unit_does_not_tell_its_truth(tmp_path) -> None:
    case = next(c for b in draw_set("laboratory", 6) for c in b.judge if c.kind == "outsider")
    folder = replace(case, setting=replace(case.setting, seconds=1.0)).write(tmp_path)
    held = b"".join(p.read_bytes() for p in folder.iterdir() if p.suffix == ".toml")
    assert not any(word.encode() in held for word in (*OUTSIDERS, "outsider", "latency", "support", "truth"))
    stated = json.loads(seal([case])[0])[case.serial]
    assert stated["laboratory"]["latency_us"] == list(case.bench.latency_us)


# --- scores -----------------------------------------------------------------------------------------------------------


def unit(kind: str, effects: dict, gap: dict, alike: tuple[str, ...] = (), **more: object) -> Outcome:
    outside = {"echo": {}} if kind == "outsider" else {}
    truth = {"kind": kind, "effects": effects, "outside": outside, "alike": list(alike), "bench": {}}
    return Outcome("X", truth, gap, more.pop("seconds", 2.0), memory_MB=300.0, **more)


NOTHING = {"verdict": "no_missing_effect", "named": []}
OPEN = {"verdict": "unexplained", "named": [], "where": [{"channel": "de"}]}
LESSON = Lesson("A", "population.toml", 8, 60.0, 400.0, None)


def named(*effects: str, off: float = 0.0) -> dict:
    p = {"tau_us": {"value": 50.0 + off, "ci95": [48.0 + off, 52.0 + off]}}
    return {"verdict": "explained", "named": [{"effect": e, "parameters": p} for e in effects]}


def offsets(dx: float, U: float = 3.0) -> dict:
    return {"dx_um": {"value": dx, "U": U}, "dy_um": {"value": 0.0, "U": U}, "reason": None}


def right_set() -> list[Outcome]:
    true = {"loop_delay": {"tau_us": 50.0}}
    asked = {"misalign_seconds": 3.0, "misalign_memory_MB": 200.0}
    units = [unit("none", {}, NOTHING, misalign=offsets(1.0), **asked) for _ in range(30)]
    units += [unit("one", true, named("loop_delay", off=0.0 if k else 3.0)) for k in range(30)]
    return units + [unit("outsider", {}, OPEN) for _ in range(20)]


def unmet(outcomes: list[Outcome], name: str = "laboratory", lessons: tuple[Lesson, ...] = (LESSON,)) -> set[str]:
    return {s.name for s in scores_of(name, outcomes, lessons) if s.target and not s.met}


def test_a_right_answer_meets_every_target_and_each_can_fail() -> None:
    good = right_set()
    assert unmet(good) == set()
    false, failed = "a false name, all cases", "errors"
    silent, exactly = "outsider: no false name", "one effect: named exactly"
    for more, rows in (
        ([unit("none", {}, OPEN)] * 3, {"nothing hidden: nothing is missing"}),
        ([unit("one", {"loop_delay": {"tau_us": 50.0}}, OPEN)] * 5, {exactly}),
        ([unit("one", {"loop_delay": {"tau_us": 50.0}}, named("loop_delay", "creep"))] * 5, {exactly, false}),
        ([unit("outsider", {}, named("creep"))] * 2, {silent, false}),
        ([unit("outsider", {}, {}, error="KeyError: 3")], {failed, silent}),
        (
            [unit("none", {}, NOTHING, misalign={"reason": "no"}, misalign_seconds=1.0)] * 3,
            {"misalignment: dx and dy answered"},
        ),
        (
            [unit("none", {}, NOTHING, misalign=offsets(9.0), misalign_seconds=1.0)] * 8,
            {"misalignment: inside U, of the answers"},
        ),
        (
            [unit("one", {"loop_delay": {"tau_us": 90.0}}, named("loop_delay"))] * 5,
            {"95 % intervals of what is named cover"},
        ),
        ([unit("none", {}, NOTHING, seconds=41.0)], {"gap: seconds of one core, worst"}),
    ):
        assert unmet([*good, *more]) == rows
    outside = unit(
        "one", {"misalignment": {"dx_um": 60.0, "dy_um": 0.0}}, OPEN, misalign=offsets(40.0), misalign_seconds=1.0
    )
    assert "misalignment: accepted, and outside a limit" in unmet([*good, outside])
    slow = replace(LESSON, seconds=200.0)
    assert unmet(good, lessons=(LESSON, slow)) == {"learn: seconds of one core, worst"}
    assert "learned benches" in unmet(good, lessons=(replace(LESSON, error="exit 4"),))


def test_names_that_mean_the_same_are_no_lie() -> None:
    alike = unit("outsider", {}, named("channel_lowpass_Vs"), ("channel_lowpass_Vs",))
    assert alike.false_names == []
    own = unit("one", {"loop_delay": {"tau_us": 50.0}}, named("loop_delay", "support_mode"), ("support_mode",))
    rows = {s.name: s.value for s in scores_of("laboratory-unlearned", [own], ())}
    assert rows["one effect: named exactly"] == 1.0


def test_the_upper_limit_is_that_of_clopper_and_pearson() -> None:
    """So many false names or fewer would occur in 5 % of such sets, were it the true rate; none in 59: 5.0 %."""
    for k, n in ((0, 59), (3, 100), (1, 12)):
        assert stats.binom.cdf(k, n, upper_limit(k, n)) == pytest.approx(0.05, rel=1e-6)
    assert upper_limit(0, 59) == pytest.approx(0.0495, abs=1e-3)
    assert upper_limit(4, 4) == 1.0
    rows = false_names_by_kind([unit("none", {}, named("creep")), unit("outsider", {}, OPEN)])
    assert [(kind, k, n) for kind, k, n, _ in rows] == [("none", 1, 1), ("outsider", 0, 1), ("all", 1, 2)]
