"""Simulated units: exact in time, true to the model, judged as what was put in, the same every time."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import linalg
from typer.testing import CliRunner

from accept import rejudge
from accept import unit as units
from accept.campaign import judge_unit, load_spec
from accept.certificate import Attachments
from accept.certificate.refused import Refused
from accept.cli import app
from accept.result import UnitResult
from accept.simulate import FAULTS, Order, OrderError, simulate, write
from accept.simulate import demo as demo_unit
from accept.simulate.apa import heights
from accept.simulate.order import drawn
from accept.simulate.records import Bench, axial_Hz, noise_record, slow_record
from checks.acceptance import CHECKS
from checks.acceptance.flatness import POSITIONS_MM, minimum_zone
from checks.model.converters import LSB_V, Converters
from checks.model.effects import with_effects
from checks.model.fractions import Fractions, _mechanics, paths
from checks.model.hammer_test import ShellMode, hammer_record
from checks.model.modal import modal
from checks.model.model import Model, frequency_and_damping
from checks.model.simulate import answer
from checks.model.slow import creep, loops_of, mass_steps, stroke_of
from checks.model.superelement import ModelError
from checks.record import Record
from checks.signals.cycles import last_cycles
from checks.signals.lpm import lpm
from hw.model import open_model

MISALIGNED = ("misalignment", {"dx_um": 15.0, "dy_um": -40.0})
EVERYTHING: list[tuple[str, dict[str, float]]] = [
    MISALIGNED,
    ("sensor_highpass", {"f_Hz": 3.0}),
    ("crosstalk", {"V_per_V": 0.01}),
    ("amplifier_bandwidth", {"f_Hz": 3000.0}),
    ("bench_mode", {"f_Hz": 110.0, "ratio": 0.03, "damping_ratio": 0.01}),
    ("encoder_bracket_mode", {"f_Hz": 800.0, "damping_ratio": 0.01}),
    ("encoder_scale", {"relative": 0.03}),
    ("loop_delay", {"tau_us": 130.0}),
]
SHORT = 10.5  # the specs ask for 10 s


@pytest.fixture(scope="module")
def strut() -> Model:
    return open_model("strut")


@pytest.fixture(scope="module")
def apa() -> Model:
    return open_model("apa-frame").with_values({"bench.payload_kg": 5.0})


def order(model: Model, kind: str = "strut", **changes: Any) -> Order:
    made = Order("T-1", kind, model, 1, repeats=False, low_s=SHORT, high_s=SHORT, compact=False)
    made = replace(made, effects=(MISALIGNED,)) if kind == "strut" else made
    return replace(made, **changes)


def judged(of: Order, folder: Path) -> UnitResult:
    write(simulate(of), folder)
    return judge_unit(units.read(folder), load_spec(of.kind))


# --- exact in time


@pytest.mark.parametrize("name", ["strut", "strut-2dof", "apa-frame", "apa-2dof"])
def test_paths_are_the_model(name: str) -> None:
    """The sum over poles is another way to the same response: only round-off is between them."""
    model = open_model(name)
    held = {effect for effect, _ in EVERYTHING} - (set() if "strut" in name else {"misalignment"})
    known = [(e, p) for e, p in EVERYTHING if e in held and not (e.startswith("encoder") and "apa" in name)]
    model = with_effects(model, known)
    f = np.geomspace(0.5, 4900.0, 300)
    late = np.exp(2j * np.pi * f * 1e-6 * model.values["delay.tau_us"])
    for channel, path in paths(model).items():
        H = model.frf(f, channels=(channel,))[:, 0] * late
        np.testing.assert_allclose(path.at(2j * np.pi * f), H, rtol=1e-8, atol=1e-9 * np.abs(H).max())


def test_a_held_drive_against_the_matrix_exponential() -> None:
    """Truth by another way: the states of M, C, K stepped by expm."""
    system, fs = open_model("apa-2dof").system(), 1e4
    # a coordinate without mass cannot be stepped: give each a gram, here and there
    M = system.M + 1e-3 * np.eye(len(system.M))
    form, n = modal(replace(system, M=M)), len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, system.K), -np.linalg.solve(M, system.C)]])
    b = np.concatenate([np.zeros(n), np.linalg.solve(M, system.force)])
    step = linalg.expm(np.block([[A, b[:, None]], [np.zeros((1, 2 * n + 1))]]) / fs)
    u = np.random.default_rng(3).standard_normal(400)
    states = np.zeros((u.size, 2 * n))
    for k in range(u.size - 1):
        states[k + 1] = step[:-1, :-1] @ states[k] + step[:-1, -1] * u[k]
    for i, channel in enumerate(form.channels):
        truth = states[:, :n] @ system.outputs[i]
        np.testing.assert_allclose(
            _mechanics(form, channel).held(u, fs), truth, rtol=0, atol=1e-9 * np.abs(truth).max()
        )


@pytest.mark.parametrize("tau_us", [0.0, 30.0, 100.0, 170.0])
def test_a_delay_of_any_part_of_a_sample(tau_us: float) -> None:
    """What is held for a sample may be held for ten samples of a tenth: at the finer rate every delay here is whole,
    and a whole delay is a shift."""
    path = paths(with_effects(open_model("strut"), EVERYTHING[:2]))["de"]
    u = np.random.default_rng(4).standard_normal(500)
    fine = path.held(np.repeat(u, 10), 1e5)
    late = round(tau_us / 10.0)
    expected = np.concatenate([np.zeros(late), fine])[::10][: u.size]
    np.testing.assert_allclose(path.held(u, 1e4, 1e-6 * tau_us), expected, atol=1e-9 * np.abs(fine).max())


def test_what_is_joined_up_is_the_response_of_a_steady_sine(strut: Model) -> None:
    model = with_effects(strut, EVERYTHING)
    fs, f = 1e4, 130.0
    t = np.arange(60_000) / fs
    y = answer(model, t.size, fs)(np.sin(2 * np.pi * f * t))
    H = model.frf([f])[0]
    late = t > 5.0  # what rang at the start has died away to 1e-6
    for i, channel in enumerate(model.channels):
        truth = np.abs(H[i]) * np.sin(2 * np.pi * f * t[late] + np.angle(H[i]))
        np.testing.assert_allclose(y[channel][late], truth, atol=2e-4 * np.abs(H[i]))  # the sine starts with a kink


def test_joined_and_held_agree_below_the_sampling(strut: Model) -> None:
    """A slow drive is the same either way, half a sample apart."""
    fs = 1e4
    t = np.arange(30_000) / fs
    Va = np.sin(2 * np.pi * 3.0 * t) * np.minimum(t, 1.0) ** 2
    one, two = (answer(strut, t.size, fs, hold=hold)(Va) for hold in (False, True))
    for channel in ("de", "da"):
        half = np.interp(t - 0.5 / fs, t, one[channel])
        np.testing.assert_allclose(two[channel][10:], half[10:], atol=1e-4 * np.abs(half).max())


def test_answers_refuse_what_they_cannot_give(strut: Model) -> None:
    with pytest.raises(ModelError, match="20000 Hz"):
        answer(strut, 100, 2e4)
    with pytest.raises(ModelError, match="101"):
        answer(strut, 100, 1e4)(np.zeros(101))
    with pytest.raises(ModelError, match="before its cause"):
        answer(strut.with_values({"delay.tau_us": -5.0}), 100, 1e4, hold=True)


# --- slow


@pytest.mark.parametrize("width", [0.0, 0.02, 0.1, 0.3])
def test_loops_open_as_stated(width: float) -> None:
    """Read off directly: drive at its middle, on the way up and on the way down."""
    amplitude = 2.0
    turns = np.arange(4000) / 1000.0
    v = amplitude * np.sin(2 * np.pi * turns)
    y = loops_of(width, amplitude)(v)
    up, down = y[3000], y[3500]  # both at v = 0, after the first rise has been forgotten
    assert (down - up) / np.ptp(y[2000:]) == pytest.approx(width, abs=2e-4)  # 120 plays
    small = 0.01 * v
    assert np.ptp(loops_of(width, amplitude)(small)) == pytest.approx(np.ptp(small), rel=0.02)


def test_a_stroke_is_reached_on_the_first_rise_and_loops_open() -> None:
    v = 85.0 - 85.0 * np.cos(2 * np.pi * np.arange(2001) / 1000.0)
    d = stroke_of(360e-6, 170.0, 0.1)(v)
    assert d.max() == pytest.approx(360e-6, rel=1e-4)
    assert (d[750] - d[1250]) / (d[500:1501].max() - d[500:1501].min()) == pytest.approx(0.1, abs=3e-4)


def test_hysteresis_does_not_know_the_rate() -> None:
    rng = np.random.default_rng(0)
    turning = rng.standard_normal(40)
    slow = np.interp(np.linspace(0, 39, 4000), np.arange(40), turning)
    bend = loops_of(0.1, 2.0)
    np.testing.assert_allclose(bend(np.repeat(slow, 3))[::3], bend(slow), atol=1e-12)


def test_creep_grows_with_log_time() -> None:
    path = creep(0.02)
    t = np.logspace(-2, 2, 200)
    share = (path.residues / -path.poles).real
    step = path.direct + (share[:, None] * (1 - np.exp(np.outer(path.poles.real, t)))).sum(axis=0)
    slope = np.polyfit(np.log10(t), step, 1)[0]
    assert slope == pytest.approx(0.02, rel=0.02)
    assert abs(path.at(np.array([2j * np.pi * 500.0]))[0]) == pytest.approx(1.0, abs=0.002)


def test_mass_steps_are_stated_at_a_tenth_of_a_second() -> None:
    t = np.arange(3000) / 100.0
    y = mass_steps(t, (15.0, 22.0), -4e-5, 0.0)
    assert y[t < 15].max() == 0.0
    assert y[(t > 18) & (t < 22)] == pytest.approx(-4e-5)
    assert y[t > 25] == pytest.approx(0.0, abs=1e-12)


def test_mass_steps_creep_from_there() -> None:
    t = np.arange(3000) / 100.0
    y = mass_steps(t, (15.0, 22.0), -4e-5, 0.02)
    np.testing.assert_allclose(y[[1600, 2100]] / -4e-5, [1.02, 1.02 + 0.02 * np.log10(6.0)], rtol=1e-5)  # 1 s, 6 s on


def test_hits_are_as_hard_as_asked() -> None:
    force, angle = hammer_record([ShellMode(280.0, 0.008, 3e-7)], np.random.default_rng(1))
    peaks = force.reshape(12, -1).max(axis=1)[:11]
    assert np.all((peaks > 0.8 * 75.0) & (peaks < 1.05 * 130.0))  # 0.6 ms at 5 kHz: the crest falls between samples
    # a hit of p = F 2 T / pi sets the mode off at p w k, at most that
    assert np.abs(angle).max() < 130.0 * 2 * 6e-4 / np.pi * (2 * np.pi * 280.0) * 3e-7 * 1.02


# --- records


@pytest.mark.parametrize("effects", [(MISALIGNED,), tuple(EVERYTHING)], ids=["good", "everything"])
@pytest.mark.parametrize(("high", "lo", "hi"), [(False, 5.0, 350.0), (True, 350.0, 2000.0)])
def test_measured_responses_are_the_model_within_noise(
    strut: Model, effects: tuple[Any, ...], high: bool, lo: float, hi: float
) -> None:
    """Steps of converters and encoder and noise of sensors are all that is between them, and the estimator says how
    much that is: squared distance over its variance has median ln 2 and mean one over independent bins, more by what
    the estimated variance scatters (17 degrees of freedom) and the local polynomials leave at the sharpest peaks."""
    bench = Bench(order(strut, effects=effects, low_s=20.0, high_s=20.0), with_effects(strut, effects))
    record = noise_record(bench, "x", high)
    found = lpm(record["Va"], {c: record[c] for c in strut.channels}, 1e4, f_lo=lo, f_hi=hi, step=17)
    z = np.abs(found.H - bench.model.frf(found.f)) ** 2 / found.var
    assert np.all((np.median(z, axis=0) > 0.45) & (np.median(z, axis=0) < 0.95))
    assert np.all((z.mean(axis=0) > 0.8) & (z.mean(axis=0) < 1.4))


def test_converters_step_and_end() -> None:
    c, rng = Converters(), np.random.default_rng(0)
    V = c.dac(np.array([0.1, 11.0, -11.0]))
    assert V[0] == pytest.approx(0.1, abs=LSB_V / 2)
    assert V[1] == 10.0 - LSB_V
    assert V[2] == -10.0
    de = c.read("de", np.linspace(0, 1e-6, 1000), rng) / 2.5e-9
    np.testing.assert_allclose(de, np.round(de), atol=1e-9)
    quiet = c.noisier(0.0).read("Vs", np.zeros(10), rng)
    assert not quiet.any()


def test_hysteresis_of_the_drive_is_in_every_channel(strut: Model) -> None:
    bench = Bench(order(strut, effects=(MISALIGNED, ("hysteresis", {"relative_width": 0.12}))), strut)
    record = slow_record(bench, "x")
    spec = load_spec("strut").checks["hysteresis"]
    made = Record(record["t"], {c: record[c] for c in ("Va", "Vs", "de")}, {"Va": "V", "Vs": "V", "de": "m"})
    outcome = CHECKS["hysteresis"].measure({"record": made}, spec)
    found = {q.name: q for q in outcome.quantities}
    assert found["hysteresis_percent"].value == pytest.approx(12.0, abs=0.05)  # 120 plays, converter steps
    assert len(last_cycles(record["Va"])) == 6
    assert found["sensor_hysteresis_percent"].value == pytest.approx(12.0, abs=1.5)  # Vs: 1 mV of noise in 1.8 V


@pytest.mark.parametrize("hold", [False, True])
def test_creep_of_the_drive_is_in_the_records(strut: Model, hold: bool) -> None:
    """A slow sine sees the relaxations by their factor; it is well away from one."""
    share = creep(0.02)
    t = np.arange(20_000) / 1e4
    Va = np.sin(2 * np.pi * 5.0 * t)
    plain, crept = (answer(strut, t.size, 1e4, hold, ("da",), before)(Va)["da"] for before in (None, share))
    factor = share.at(np.array([2j * np.pi * 5.0]))[0]
    late = t > 1.0
    basis = np.column_stack([np.sin(2 * np.pi * 5.0 * t), np.cos(2 * np.pi * 5.0 * t), np.ones_like(t), t])[late]
    one, two = (np.linalg.lstsq(basis, y[late], rcond=None)[0][:2] @ [1.0, 1j] for y in (plain, crept))
    assert two / one == pytest.approx(factor, abs=3e-4)  # the slow relaxations have not yet settled


# --- whole units


def test_a_good_strut_is_accepted_and_told_right(strut: Model, tmp_path: Path) -> None:
    result = judged(order(strut), tmp_path)
    assert result.verdict == "accepted"
    found = {f.quantity: f for f in result.findings}
    f, _ = frequency_and_damping(with_effects(strut, [MISALIGNED]).poles())
    for name in ("axial_resonance_Hz", "x_bending_Hz", "y_bending_Hz"):
        assert np.abs(f - found[name].value).min() < 2 * found[name].U  # U is k = 2: beyond it twice is a mistake


def test_a_good_apa_is_accepted_and_told_right(apa: Model, tmp_path: Path) -> None:
    result = judged(order(apa, "apa"), tmp_path)
    assert result.verdict == "accepted"
    figures = json.loads((tmp_path / "truth.json").read_text())["figures"]
    found = {f.quantity: f for f in result.findings} | {q.name: q for _, q in result.information}
    truth = {
        "flatness_um": figures["flatness_um"],
        "stroke_um": figures["stroke_um"],
        "k_closed_N_per_um": figures["k_closed_N_per_um"],
        "k_open_N_per_um": figures["k_open_N_per_um"],
        "sensor_highpass_Hz": figures["sensor_highpass_Hz"],
        **dict(zip(("x_bending_Hz", "y_bending_Hz", "z_torsion_Hz"), figures["modes_Hz"], strict=True)),
        "axial_resonance_Hz": axial_Hz(apa),
        "creep_per_decade_percent": 100 * figures["creep"],
        "x_bending_damping_percent": 100 * figures["damping_ratio"],
    }
    # where U shows scatter alone: how the mass rings and how neighbouring modes lean on one another
    shape = {"creep_per_decade_percent": 0.01, "x_bending_damping_percent": 1e-3}
    for name, value in truth.items():
        # 1.5 U: of eleven, one beyond its U (k = 2) is no surprise
        assert abs(found[name].value - value) < 1.5 * found[name].U + shape.get(name, 0.0) * value, name
    assert found["hysteresis_percent"].value == pytest.approx(100 * figures["loop"], abs=0.1)


@pytest.mark.parametrize("kind", ["apa", "strut"])
def test_every_fault_is_found_and_nothing_else(kind: str, apa: Model, strut: Model, tmp_path: Path) -> None:
    for name in (n for n, f in FAULTS.items() if kind in f.kinds):
        result = judged(order(apa if kind == "apa" else strut, kind, fault=name), tmp_path / name)
        shown = {(f.quantity, str(f.verdict)) for f in result.findings}
        expected = FAULTS[name].shows
        assert set(expected) <= shown, name
        # a section without a result has none for all of its findings; no other section is touched
        sections = {CHECKS[f.check].reads for f in result.findings if (f.quantity, str(f.verdict)) in expected}
        assert {CHECKS[f.check].reads for f in result.findings if f.verdict != "pass"} == sections, name


def test_equal_orders_give_equal_bytes_and_other_seeds_others(strut: Model) -> None:
    one, again, other = (simulate(order(strut, seed=seed)) for seed in (1, 1, 2))
    assert dict(one.files) == dict(again.files)
    assert one.truth == again.truth
    assert all(one.files[n] != other.files[n] for n in one.files if n.startswith("frf"))


def test_repeats_are_other_realisations(strut: Model) -> None:
    files = simulate(order(strut, repeats=True)).files
    assert files["frf_noise.mat"] != files["frf_noise_2.mat"]
    assert files["frf_noise_hf.mat"] != files["frf_noise_hf_2.mat"]


def test_measured_data_are_never_replaced(strut: Model, tmp_path: Path) -> None:
    (tmp_path / "unit.toml").write_text('serial = "REAL"\n')
    with pytest.raises(OrderError, match="not simulated"):
        write(simulate(order(strut)), tmp_path)
    assert (tmp_path / "unit.toml").read_text() == 'serial = "REAL"\n'


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"serial": "a/b"}, "a/b"),
        ({"kind": "apa"}, "has joints"),
        ({"fault": "flatness"}, "an strut can have|a strut can have"),
        ({"low_s": 0.1}, "0.1 s"),
        ({"seed": -1}, "-1"),
        ({"effects": (("hysteresis", {"width": 0.1}),)}, "relative_width"),
    ],
)
def test_impossible_orders_are_refused(strut: Model, changes: dict[str, Any], words: str) -> None:
    with pytest.raises(OrderError, match=words):
        simulate(order(strut, **changes))


def test_drawn_parameters_stay_near_their_priors(strut: Model) -> None:
    c = strut.calibrated
    rows = np.array([[drawn(strut, seed).values[n] for n in c.names] for seed in range(200)])
    assert np.all(np.abs(rows - c.values) <= 2.0 * c.sds + 1e-12)
    # the spread of 200 draws is known to 5 %; clipping at two takes 4 % off; cR is held above zero
    free = [n != "joint.cR_Nm_s_per_rad" for n in c.names]
    np.testing.assert_allclose((rows.std(axis=0) / c.sds)[free], 0.95, atol=0.2)
    assert drawn(strut, 7).values == drawn(strut, 7).values


def test_heights_are_as_flat_as_asked() -> None:
    x, y = np.array(POSITIONS_MM).T
    z = np.array(heights(np.random.default_rng(2), 5.0))
    # mm and um in one: tilts of up to 1 um/mm do not matter; probe steps of 0.5 um move the zone by a quarter at most
    assert minimum_zone(x, y, z / 1e3).half_width * 1e3 == pytest.approx(5.0, abs=0.3)


# --- the demo


def test_the_demo_trusts_its_own_strut_and_no_altered_one() -> None:
    strut = demo_unit.demo_strut()
    own = Attachments({}, load_spec("strut-basic").text, dict(strut.files))  # by which the demo judges
    assert rejudge.rejudge_demo(own)["verdict"] == "accepted"
    altered = dict(strut.files)
    altered["hysteresis.mat"] = altered["frf_noise.mat"]
    with pytest.raises(Refused, match="no unit of the demo"):
        rejudge.rejudge_demo(replace(own, files=altered))


# --- the command line


def run(*words: object) -> Any:
    return CliRunner().invoke(app, [str(w) for w in words])


def test_command_line(tmp_path: Path) -> None:
    model = tmp_path / "mine.toml"
    builtin = Path(units.__file__).parents[1] / "specs" / "models" / "strut.toml"
    slow = '[[effects]]\nname = "hysteresis"\nrelative_width = 0.05\n'
    model.write_text(builtin.read_text() + slow)
    done = run(
        "simulate", "unit", "--out", tmp_path / "U", "--model", model, "--dx-um", 20, "--effect",
        "bench_mode:f_Hz=110,ratio=0.02,damping_ratio=0.01", "--set", "joint.kz_N_per_um=80", "--draw", "--noise", 2,
        "--low-s", 4, "--high-s", 4, "--no-repeats", "--hold", "--serial", "U-7",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    truth = json.loads((tmp_path / "U" / "truth.json").read_text())
    assert [e["name"] for e in truth["effects"]] == ["hysteresis", "bench_mode", "misalignment"]
    assert truth["parameters"]["joint.kz_N_per_um"] == 80.0
    assert truth["parameters"]["misalignment.dx_um"] == 20.0
    assert truth["noise"]["Vs"] == 2e-3
    assert units.read(tmp_path / "U").serial == "U-7"


@pytest.mark.parametrize(
    "words",
    [
        ["--kind", "wing"],
        ["--effect", "foo:a=1"],
        ["--effect", "bench_mode:f_Hz"],
        ["--effect", "misalignment:dx_um=1,dy_um=2", "--dx-um", "3"],
        ["--fault", "soft"],
        ["--set", "joint.kz_N_per_um=-3"],
        ["--set", "joint.nothing=3"],
        ["--model", "nothing"],
        ["--low-s", "nan"],
    ],
)
def test_bad_input_is_one_clear_line(words: list[str], tmp_path: Path) -> None:
    done = run("simulate", "unit", "--out", tmp_path / "U", *words)
    assert done.exit_code == 6, done.output
    assert "Traceback" not in done.output
    assert not (tmp_path / "U").exists()


def test_faults_are_listed() -> None:
    done = run("simulate", "faults")
    assert done.exit_code == 0
    assert all(name in done.output for name in FAULTS)


def test_fractions_in_a_row_and_side_by_side() -> None:
    """Products and sums of simple fractions against the same done with numbers."""
    one = Fractions(np.array([-3.0 + 0j, -1.0 + 20.0j]), np.array([2.0 + 0j, 1.0 - 4.0j]), 0.5)
    two = Fractions(np.array([-7.0 + 0j]), np.array([5.0 + 0j]), -0.2)
    s = np.array([0.3 + 1.0j, 5.0j, 2.0 + 0j])
    np.testing.assert_allclose(one.times(two).at(s), one.at(s) * two.at(s), rtol=1e-12)
    np.testing.assert_allclose(one.plus(two).at(s), one.at(s) + two.at(s), rtol=1e-12)
