"""The check on simulated hammer tests with known modes, and on the recorded units."""

import numpy as np
import pytest
from scipy.io import loadmat

from checks.acceptance.spurious_modes import CHECK, HAMMER_RECORDS
from checks.cause import Cause, because
from checks.record import Record
from specs.spec import CheckSpec, Limit, load
from tests.causes import causes, no_result
from tests.checks.signals.hammer_plant import FS, Struck, clean, noisy

FILES = dict(zip(HAMMER_RECORDS, ("bending_X_top", "bending_Y_top", "torsion_left", "torsion_top"), strict=True))
SPEC = CheckSpec(limits={"x_bending_Hz": Limit(lower=257.6, upper=302.4, unit="Hz", rule="guarded", source="test")})

X, Y = (281.0, 0.008, 1e-6), (411.0, 0.007, 1e-6)
TORSION = (795.0, 0.006, 4e-7)
MODES = {
    "x_bending": (X, (843.0, 0.008, 1.2e-7), (1405.0, 0.008, 5e-8)),
    "y_bending": (Y, (1219.0, 0.008, 8e-8)),
    "torsion_left": ((268.0, 0.008, 5e-7), (414.0, 0.008, 1e-6), TORSION),
    "torsion_top": ((268.0, 0.008, 4e-7), (414.0, 0.008, 1e-6), (801.0, 0.006, 5e-9)),
}


def record(force, rotation, name="record.mat", fs=FS):
    t = np.arange(force.size) / fs
    return Record(t, {"Track1": force, "Track2": rotation}, {"Track1": "N", "Track2": "rad"}, name)


@pytest.fixture(scope="module")
def unit():
    rng = np.random.default_rng(11)
    return {key: record(*noisy(clean(Struck(modes)), rng), name=key) for key, modes in MODES.items()}


def measured(values, spec=SPEC):
    outcome = CHECK.measure(values, spec)
    assert [q.name for q in outcome.quantities] == sorted({q.name for q in outcome.quantities}, key=_declared)
    return {q.name: q for q in outcome.quantities}, outcome


def _declared(name):
    return list(CHECK.quantities).index(name)


def test_three_modes_their_damping_and_harmonics(unit):
    found, _ = measured(unit)
    truth = {
        "x_bending_Hz": 281.0,
        "y_bending_Hz": 411.0,
        "z_torsion_Hz": 795.0,
        "x_bending_harmonic_3_Hz": 843.0,
        "x_bending_harmonic_5_Hz": 1405.0,
        "y_bending_harmonic_3_Hz": 1219.0,
        "x_bending_damping_percent": 0.8,
        "y_bending_damping_percent": 0.7,
        "z_torsion_damping_percent": 0.6,
    }
    assert set(truth) == set(CHECK.quantities)
    for name, value in truth.items():
        # Twice the interval: nine of them are looked at together.
        assert abs(found[name].value - value) < 2 * found[name].U, name
        assert found[name].U < 2e-3 * value, name


def test_pictures_and_remarks(unit):
    _, outcome = measured(unit)
    assert set(outcome.panels) == {f"{key}_{what}" for key in HAMMER_RECORDS for what in ("impacts", "frf")}
    words = " ".join(outcome.notes)
    assert "sqrt 2" in words
    assert "hit at the left, also shows 268, 414 Hz" in words


@pytest.mark.parametrize("absent", HAMMER_RECORDS)
def test_an_absent_record_leaves_the_others_alone(unit, absent):
    found, _ = measured({k: v for k, v in unit.items() if k != absent})
    touched = {n for n, q in found.items() if q.reason}
    name = "z_torsion" if absent.startswith("torsion") else absent
    assert touched == {n for n in CHECK.quantities if n.startswith(name)}
    assert next(found[f"{name}_Hz"].reason.all()) == because(Cause.NOT_MEASURED, record=absent)


def test_without_the_top_impact_torsion_is_not_guessed(unit):
    found, _ = measured({k: v for k, v in unit.items() if k != "torsion_top"})
    assert Cause.TORSION_WITHOUT_TOP in causes(found["z_torsion_Hz"])


def test_top_impact_that_shows_every_mode_tells_nothing(unit):
    found, _ = measured({**unit, "torsion_top": unit["torsion_left"]})
    assert causes(found["z_torsion_Hz"]) == {Cause.TORSION_NO_CONTRAST}


def test_softer_top_impacts_make_no_torsion_of_bending(unit):
    """The same top record with a tenth of the response: every mode is weaker, only one is left out."""
    soft = record(unit["torsion_top"]["Track1"], 0.1 * unit["torsion_top"]["Track2"])
    found, _ = measured({**unit, "torsion_top": soft})
    assert found["z_torsion_Hz"].value == pytest.approx(795.0, rel=1e-4)


def test_double_hits_give_no_result_with_the_count(unit):
    hits = tuple((0.5 + k, 80.0) for k in range(6)) + tuple((0.52 + k, 30.0) for k in range(2, 6))
    force, rotation = noisy(clean(Struck(MODES["x_bending"], hits)), np.random.default_rng(3))
    found, outcome = measured({**unit, "x_bending": record(force, rotation)})
    assert "2 of 6 impacts good: 4 double hits" in str(found["x_bending_Hz"].reason)
    assert np.isnan(found["x_bending_Hz"].value)
    assert found["y_bending_Hz"].reason is None
    assert any("second peak" in note for note in outcome.notes)
    assert "x_bending_impacts" in outcome.panels


@pytest.mark.parametrize(
    ("force", "rotation", "words"),
    [
        (np.zeros(4000), np.ones(4000), "force is constant"),
        (np.r_[np.nan, np.arange(3999.0)], np.arange(4000.0), "force is nan at sample 0"),
        (np.arange(4000.0) % 7, np.full(4000, 2.0), "rotation is constant"),
    ],
)
def test_unusable_tracks_are_reasons(unit, force, rotation, words):
    found, _ = measured({**unit, "x_bending": record(force, rotation)})
    assert words.replace("rotation", "response") in str(found["x_bending_Hz"].reason)
    assert found["z_torsion_Hz"].reason is None


def test_noise_alone_is_no_result(unit):
    rng = np.random.default_rng(5)
    nothing = record(rng.standard_normal(40000), rng.standard_normal(40000))
    found, _ = measured({"x_bending": nothing})
    assert causes(found["x_bending_Hz"]) == {Cause.NO_IMPACT}
    tapped = record(unit["x_bending"]["Track1"], 1e-6 * rng.standard_normal(unit["x_bending"].t.size))
    found, _ = measured({"x_bending": tapped})
    assert found["x_bending_Hz"].reason


def test_two_good_impacts_are_too_few_whatever_the_spec_says(unit):
    hits = ((0.5, 80.0), (2.0, 85.0))
    two = record(*noisy(clean(Struck(MODES["x_bending"], hits, 4.0)), np.random.default_rng(2)))
    found, _ = measured({"x_bending": two}, CheckSpec(limits=SPEC.limits, settings={"impacts_min": 2}))
    assert causes(found["x_bending_Hz"]) == {Cause.IMPACTS_BAD}


def test_sampled_too_slowly_is_said(unit):
    slow = record(unit["x_bending"]["Track1"], unit["x_bending"]["Track2"], fs=100.0)
    found, _ = measured({"x_bending": slow})
    assert causes(found["x_bending_Hz"]) == {Cause.SAMPLING_SLOW}


def _garbage(rng, n, hits):
    spikes = np.zeros(n)
    spikes[rng.integers(0, n, rng.integers(1, 9))] = rng.uniform(1, 100)
    kinds = (
        rng.standard_normal(n),
        rng.standard_cauchy(n),
        np.sin(np.arange(n) * rng.uniform(0.001, 1)),
        np.cumsum(rng.standard_normal(n)),
        np.where(rng.random(n) < 0.01, 100.0, 0.0),
        np.arange(n) * 1.0,
        spikes,
        np.resize(hits, n) * rng.uniform(-2, 2) + rng.standard_normal(n) * 10.0 ** rng.uniform(-6, 1),
    )
    return kinds[rng.integers(len(kinds))] * 10.0 ** rng.integers(-12, 12)


@pytest.mark.parametrize("seed", range(60))
def test_garbage_gives_reasons_or_finite_values(unit, seed):
    rng = np.random.default_rng(seed)
    n = int(rng.choice([2, 3, 17, 100, 3000, 20000]))
    tracks = (_garbage(rng, n, unit["x_bending"]["Track1"]), _garbage(rng, n, unit["x_bending"]["Track2"]))
    values = dict.fromkeys(("x_bending", "torsion_left", "torsion_top"), record(*tracks))
    for quantity in CHECK.measure(values, SPEC).quantities:
        assert quantity.reason or np.isfinite([quantity.value, quantity.U]).all()


def test_a_spec_may_state_the_instrument(unit):
    stated = {"x_bending_Hz": {"U": 0.5, "source": "analyser"}}
    found, _ = measured(unit, CheckSpec(limits=SPEC.limits, uncertainty=stated))
    assert found["x_bending_Hz"].U == pytest.approx(0.5, rel=1e-3)


@pytest.mark.parametrize("third_Hz", [709.0, 795.0, 1909.0])
def test_the_third_mode_is_reported_with_its_doubt_and_decides_nothing(unit, third_Hz):
    """The source prints "800 Hz?"; by the public matrices of the frame no torsion lies near it."""
    left = (*MODES["torsion_left"][:2], (third_Hz, 0.006, 4e-7))
    record_left = record(*noisy(clean(Struck(left)), np.random.default_rng(5)))
    spec = load("apa").checks["spurious_modes"]
    found, outcome = measured({**unit, "torsion_left": record_left}, spec)
    assert found["z_torsion_Hz"].value == pytest.approx(third_Hz, rel=1e-4)
    assert set(spec.limits) == {"x_bending_Hz", "y_bending_Hz"}
    (doubt,) = (note for note in outcome.notes if "not known" in note)
    assert f"{third_Hz:.4g} Hz" in doubt
    assert "709 Hz" in doubt
    assert "1909 Hz" in doubt


def test_a_spec_of_the_bench_may_limit_the_third_mode(unit):
    limits = {"z_torsion_Hz": Limit(lower=750.0, upper=780.0, unit="Hz", rule="guarded", source="this bench")}
    _, outcome = measured(unit, CheckSpec(limits=limits))
    assert not any("not known" in note for note in outcome.notes)


def recorded(units, serial):
    folder, out = units.folder(serial), {}
    for key, stem in FILES.items():
        m = loadmat(folder / f"{stem}.mat", squeeze_me=True)
        out[key] = record(m["Track1"], m["Track2"], f"{stem}.mat", 1.0 / float(m["Track1_X_Resolution"]))
    return out, units.truth(serial)["modes_Hz"]


@pytest.mark.parametrize("serial", ["A-01", "A-02"])
def test_recorded_units_within_half_a_percent(serial, recorded_units):
    values, truth = recorded(recorded_units, serial)
    found, _ = measured(values)
    for name, f in zip(("x_bending_Hz", "y_bending_Hz", "z_torsion_Hz"), truth, strict=True):
        assert found[name].value == pytest.approx(f, rel=0.005)


@pytest.mark.needs_data
def test_recorded_double_hits(recorded_units):
    values, truth = recorded(recorded_units, "A-03")
    found, _ = measured(values)
    assert "0 of 11 impacts good: 11 double hits" in str(found["x_bending_Hz"].reason)
    assert found["y_bending_Hz"].value == pytest.approx(truth[1], rel=0.005)
    assert found["z_torsion_Hz"].value == pytest.approx(truth[2], rel=0.005)


def slower(given, factor):
    return Record(given.t * factor, given.channels, given.units, given.name)


def test_a_top_impact_of_another_thing_makes_no_torsion(unit):
    """Every mode of the left impact is missing in it, and the lowest of them would be taken for torsion."""
    other = record(*noisy(clean(Struck(((330.0, 0.008, 1e-6),))), np.random.default_rng(6)), name="other")
    for top in (other, slower(unit["torsion_top"], 2.0)):
        found, _ = measured({**unit, "torsion_top": top})
        assert causes(found["z_torsion_Hz"]) == {Cause.TORSION_OTHER_UNIT}
        assert found["x_bending_Hz"].reason is None


def test_a_hit_too_soft_to_tell_torsion_from_the_top_is_no_result(unit):
    """A soft tip has no force at 800 Hz: that the top impact does not show torsion then means nothing."""
    modes = (*MODES["torsion_top"][:2], TORSION)
    top = record(*noisy(clean(Struck(modes, width=3e-3)), np.random.default_rng(7)), name="soft")
    found, _ = measured({**unit, "torsion_top": top})
    assert causes(found["z_torsion_Hz"]) == {Cause.TORSION_NO_CONTRAST}


def test_two_clocks_a_little_apart_or_another_one_than_stated_are_no_result(unit):
    with no_result(Cause.SAMPLING_RATES):
        measured({**unit, "x_bending": slower(unit["x_bending"], 1.01)})
    stated = CheckSpec(limits=SPEC.limits, settings={"sampling_Hz": [5120.0]})
    assert measured(unit, stated)[0]["x_bending_Hz"].reason is None
    with no_result(Cause.SAMPLING_RATE, expected="5120"):
        measured({key: slower(r, 1.01) for key, r in unit.items()}, stated)
    _, odd = measured({key: slower(r, 1.01) for key, r in unit.items()})
    assert sum("seldom set to" in note for note in odd.notes) == len(HAMMER_RECORDS)


def test_built_in_limits_state_the_clock(unit):
    """The scatter of impacts alone is a ten-thousandth of what the time base may be off."""
    found, _ = measured(unit, load("apa").checks["spurious_modes"])
    assert all(found[f"{m}_Hz"].U >= 2e-4 * found[f"{m}_Hz"].value for m in ("x_bending", "y_bending", "z_torsion"))
