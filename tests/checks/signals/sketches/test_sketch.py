"""Sketches of samples: a copy is known in whatever form it is stored, what was measured again is never one."""

import warnings
from collections.abc import Callable

import numpy as np
import pytest
from scipy import ndimage, signal

from checks.signals.sketch import Sketch, Sketches, _different, _median, _turning

RNG = np.random.default_rng(5)
T = np.arange(20_000) / 1000.0
CLEAN = 4e-5 * np.sin(2 * np.pi * 0.5 * T) * np.exp(-T / 30) + 2e-6 * np.sin(2 * np.pi * 94.0 * T)


def measured(noise: float, seed: int, step: float = 0.0) -> np.ndarray:
    """The same motion, recorded once more. noise: part of the span; step: of the converter [m]."""
    x = CLEAN + noise * np.ptp(CLEAN) * np.random.default_rng(seed).standard_normal(T.size)
    return step * np.round(x / step) if step else x


def digits(n: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda x: np.array([float(f"{v:.{n}g}") for v in x])


STORED = {
    "as it is": lambda x: x,
    "single precision": lambda x: x.astype(np.float32).astype(float),
    "text of six digits": digits(6),
    "text of five digits": digits(5),
    "in micrometres about another zero": lambda x: 1e6 * x + 3.0,
    "with the other sign": lambda x: -x,
    "calibrated anew": lambda x: 1.017 * x,
}


@pytest.mark.parametrize("step", [0.0, 2.5e-9, 1e-7], ids=["fine", "encoder", "gauge"])
@pytest.mark.parametrize("how", STORED)
def test_a_copy_is_known_in_whatever_form(how: str, step: float) -> None:
    x = measured(2e-4, 1, step)
    one, other = Sketch.of(x), Sketch.of(STORED[how](x))
    assert one is not None
    assert other is not None
    assert one.same(other)
    assert other.same(Sketch.parse(str(one)))
    assert set(one.keys()) & set(other.keys())


@pytest.mark.parametrize("step", [0.0, 2.5e-9, 1e-7], ids=["fine", "encoder", "gauge"])
@pytest.mark.parametrize("noise", [1e-5, 1e-4, 1e-2])
def test_what_is_measured_again_is_no_copy(noise: float, step: float) -> None:
    """1e-5 of the span is 0.8 nm of 80 um: no encoder and no interferometer on air repeats so well. 40 repeats;
    the gauge has steps of twelve times its noise."""
    many = [Sketch.of(measured(noise, seed, step)) for seed in range(40)]
    found = [s for s in many if s is not None]
    assert len(found) == 40
    assert not [1 for n, a in enumerate(found) for b in found[:n] if a.same(b)]


def test_rounding_about_the_levels_changes_none() -> None:
    """Parts of 1e-9 of the span, as arithmetic on a stored copy leaves them: two values of one level have one count."""
    x = measured(2e-4, 1, 1e-7)
    rounded = x + 1e-9 * np.ptp(x) * RNG.standard_normal(x.size)
    assert np.unique(rounded).size > 2 * np.unique(x).size
    one, other = Sketch.of(x), Sketch.of(rounded)
    assert one is not None
    assert other is not None
    assert one.levels
    assert one.levels == other.levels


def test_levels_of_a_converter_that_is_not_quite_even_are_counted_one_by_one() -> None:
    """Every fifth step is short by a fifth, so that after some steps two levels lie within one."""
    level = np.cumsum(np.where(np.arange(400) % 5 == 0, 0.8, 1.0))
    at = RNG.integers(0, 400, 5000)
    uneven, even = Sketch.of(level[at]), Sketch.of(at.astype(float))
    assert uneven is not None
    assert even is not None
    assert uneven.levels
    assert uneven.levels == even.levels


def test_what_tells_nothing_has_no_sketch() -> None:
    assert Sketch.of(np.zeros(5000)) is None
    assert Sketch.of(np.arange(20.0)) is None
    assert Sketch.of((np.arange(5000) % 3).astype(float)) is None  # a force at rest between two levels


@pytest.mark.parametrize("text", ["", "x", "AAAA:", "!!!!:00"])
def test_what_is_no_sketch_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="no sketch"):
        Sketch.parse(text)


def excited(seed: int, resonance_Hz: float = 95.0, noise: float = 2e-4) -> np.ndarray:
    """Response of a plant to the noise that excites every unit, with noise of its own."""
    drive = np.random.default_rng(11).standard_normal(40_000)
    w = 2 * np.pi * resonance_Hz / 4000.0
    pole = 0.99 * np.exp(1j * w)
    x = signal.lfilter([1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], drive)
    return x + noise * np.ptp(x) * np.random.default_rng(seed).standard_normal(x.size)


COPIES = {
    "the first sample": lambda x: x[1:],
    "the last sample": lambda x: x[:-1],
    "seven samples": lambda x: x[7:],
    "a tenth at either end": lambda x: x[len(x) // 10 : -len(x) // 10],
    "a sample, in other units and sign": lambda x: -1e6 * x[1:] + 3.0,
    "a sample, noise of 3e-6 added": lambda x: x[1:] + 3e-6 * np.ptp(x) * RNG.standard_normal(x.size - 1),
    "half the rate, from the first sample": lambda x: x[::2],
    "half the rate, from the second, in other units and sign": lambda x: -1e6 * x[1::2] + 3.0,
    "half the rate, cut, and noise of 1e-6 added": lambda x: (
        x[101:-500:2] + 1e-6 * np.ptp(x) * RNG.standard_normal(x[101:-500:2].size)
    ),
}


@pytest.mark.parametrize("how", COPIES)
def test_a_copy_that_was_cut_or_thinned_is_known(how: str) -> None:
    """Whichever of the two was filed first."""
    x = excited(1)
    one, other = Sketch.of(x), Sketch.of(COPIES[how](x))
    assert one is not None
    assert other is not None
    for first, second in ((one, other), (other, one)):
        assert Sketch.parse(str(first)).same(Sketch.parse(str(second)))
        assert set(first.keys()) & set(second.keys())  # the index finds it


@pytest.mark.parametrize("rate", [slice(None, None, 2), slice(1, None, 2)])
def test_honest_records_at_half_the_rate_are_no_copies(rate: slice) -> None:
    one = Sketch.of(excited(1))
    assert one is not None
    for other in (excited(2), excited(3, 95.1), excited(4, 95.1, 0.0)):
        found = Sketch.of(other[rate])
        assert found is not None
        assert not one.same(found)


def test_honest_records_of_the_same_excitation_are_no_copies() -> None:
    """The same unit measured again, and another one whose resonance is a thousandth higher."""
    one = Sketch.of(excited(1))
    assert one is not None
    assert one.swings.size
    for other in (excited(2), excited(3, 95.1), excited(4, 95.1, 0.0), excited(5, 97.0)):
        found = Sketch.of(other)
        assert found is not None
        assert not one.same(found)


def test_a_sketch_of_before_is_read_and_keeps_its_keys() -> None:
    new = Sketch.of(excited(1))
    assert new is not None
    text = ":".join(str(new).split(":")[:2])
    old = Sketch.parse(text)
    assert str(old) == text
    assert old.same(new)
    assert set(old.keys()) <= set(new.keys())


@pytest.mark.parametrize("length", [513, 600, 20_000])
@pytest.mark.parametrize("steps", [2, 40, 10_000])
def test_turning_points_are_the_extremes_that_scipy_finds(length: int, steps: int) -> None:
    x = np.round(steps * np.random.default_rng(length).standard_normal(length))
    for width, at in zip((16, 256), _turning(x, (16, 256)), strict=True):
        size = 2 * width + 1
        extreme = (x == ndimage.maximum_filter1d(x, size)) | (x == ndimage.minimum_filter1d(x, size))
        assert np.array_equal(at, np.flatnonzero(extreme[1:-1]) + 1)


@pytest.mark.parametrize("step", [1.0, 2.5e-9, 0.7])
def test_levels_that_are_found_by_their_steps_are_those_of_a_sort(step: float) -> None:
    x = step * np.round(300 * np.random.default_rng(3).standard_normal(5000)) + 1e-9 * step
    for given, near in ((x, step), (x, 5.0 * step), (np.append(x, x[0] + 1e-4 * step), step)):
        there, place = _different(given, near)
        assert np.array_equal(there, np.unique(given))
        assert place is None or np.array_equal(there[place], given)
    assert _different(x, step)[1] is not None  # and without sorting


@pytest.mark.parametrize("length", [0, 1, 2, 7, 1000, 1001])
@pytest.mark.parametrize("size", [0.0, 3.0, 1e4, 3e4, 1e9])
def test_a_median_by_counting_is_the_median(length: int, size: float) -> None:
    counts = np.abs(np.round(size * np.random.default_rng(length).standard_normal(length)))
    with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):
        assert np.array_equal(_median(counts), np.median(counts), equal_nan=True)


def test_many_are_compared_at_once_as_one_by_one() -> None:
    """Copies of every kind of several records, honest repeats, a channel at rest between pulls, one with three other
    samples, one far from zero that was written with five digits, eight hashes of noise in common, and sketches that
    no program writes: of equal values, without anything."""
    fine, coarse, at_rest = measured(2e-4, 1), measured(2e-4, 2, 1e-7), np.where(T < 15, 0.0, measured(1e-3, 3))
    stored = [how(x) for how in STORED.values() for x in (fine, coarse, at_rest)]
    cut = [how(x) for how in COPIES.values() for x in (excited(1), excited(4, 95.1, 0.0))]
    again = [measured(2e-4, 9, 1e-7), np.where(T < 15, 0.0, measured(1e-3, 8)), excited(2), excited(3, 95.1)]
    found = [s for x in (*stored, *cut, *again, fine, excited(1)) if (s := Sketch.of(x)) is not None]
    made = [Sketch(np.ones(64), ""), Sketch(np.zeros(0), ""), Sketch(np.zeros(0), found[1].levels)]
    values, hashes = found[0].values, np.arange(128, dtype="<u4")
    spoiled = np.where(np.isin(np.arange(64), (0, 9, 63)), 1.0, values)
    far = 1.0 + 40.0 * values  # spans two thousandths: its fifth digit is more than 1e-5 of that
    made += [Sketch(x, "") for x in (values, spoiled, far, digits(5)(far))]
    made += [Sketch(np.zeros(0), "", noise=(hashes[n:][:64],)) for n in (0, 56, 57)]
    ours, theirs = [*found[::2], *made], [*found[1::2], *made]
    with np.errstate(invalid="ignore"):
        same = [(n, m) for n, a in enumerate(ours) for m, b in enumerate(theirs) if a.same(b)]
        assert Sketches(ours).same(Sketches(theirs)) == same
    assert len(found) < 3 * len(same) < len(ours) * len(theirs)  # many copies, and more that are told apart
    assert Sketches([]).same(Sketches(theirs)) == Sketches(theirs).same(Sketches([])) == []
