"""Slow records, which have few turning points, are told apart by their noise: a copy however cut, no honest repeat."""

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest

from accept.judging.samples import DRIVES
from accept.units import unit_folder
from accept.units.loaded_unit import LoadedUnit
from checks.acceptance import CHECKS
from checks.declare import Series
from checks.record import Record
from checks.signals.sketch import Sketch
from tests.shared.recorded_units import RecordedUnits

T = np.arange(20_000) / 1000.0
PULLS = np.concatenate([a * np.sin(2 * np.pi * np.arange(3000) / 1000) for a in (0.5, 2, 8, 30)])
CREEP = 1.0 + 0.02 * np.log10(1.0 + np.arange(3000) % 1500)
TAPS = np.where(np.arange(60_000) % 7000 < 12, np.sin(np.pi * (np.arange(60_000) % 7000) / 12), 0.0)
SLOW = {  # motion, step of the channel, noise: as recorded
    "stroke, sine": (60e-6 * np.sin(2 * np.pi * 0.15 * T), 1e-7, 3e-8),
    "stroke, triangle": (60e-6 * np.abs(2 * (0.15 * T % 1) - 1), 1e-7, 3e-8),
    "stiffness": (-38e-6 * CREEP * ((np.arange(3000) > 1500) & (np.arange(3000) < 2200)), 2.5e-9, 4e-9),
    "hysteresis": (3e-6 * PULLS, 2.5e-9, 2e-9),
    "creep": (40e-6 * (1.0 + 0.02 * np.log10(0.01 + T)), 2.5e-9, 2e-9),
    "taps": (120.0 * TAPS, 1e-3, 2e-2),
}
CUTS = (1, 2, 10, 37)


def measured(kind: str, seed: int) -> np.ndarray:
    """The motion recorded once more: a little further, about another zero, with noise of its own."""
    motion, step, noise = SLOW[kind]
    rng = np.random.default_rng(seed)
    moved = motion * (1.0 + 1e-4 * rng.standard_normal()) + step * rng.uniform()
    return step * np.round((moved + noise * rng.standard_normal(motion.size)) / step)


def sketched(x: np.ndarray) -> Sketch:
    found = Sketch.of(x)
    assert found is not None
    return Sketch.parse(str(found))


def digits(x: np.ndarray) -> np.ndarray:
    return np.array([float(f"{v:.5g}") for v in x])


COPIES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    **{f"{n} off the start": lambda x, n=n: x[n:] for n in CUTS},
    **{f"{n} off the end": lambda x, n=n: x[:-n] for n in CUTS},
    "scaled, other zero": lambda x: -0.97e6 * x[3:] + 4.0,
    "five digits": lambda x: digits(x[1:]),
    "backwards": lambda x: x[::-1],
    "a row of every hundred dropped": lambda x: np.delete(x, np.arange(0, x.size, 100)),
    "every second sample": lambda x: x[1::2],
    "the middle half": lambda x: x[x.size // 4 : -x.size // 4],
}


@pytest.mark.parametrize("kind", SLOW)
def test_a_copy_of_a_slow_record_is_known_by_its_noise(kind: str) -> None:
    x = measured(kind, 1)
    one = sketched(x)
    for how, changed in COPIES.items():
        other = sketched(changed(x))
        assert one.same(other), how
        assert other.same(one), how
        assert set(one.keys()) & set(other.keys()), how  # the index finds it


@pytest.mark.parametrize("kind", SLOW)
def test_at_most_one_of_a_hundred_pairs_of_honest_repeats_is_taken_for_a_copy(kind: str) -> None:
    """210 pairs of each kind; none is expected."""
    repeats = [sketched(measured(kind, seed)) for seed in range(21)]
    pairs = list(combinations(repeats, 2))
    assert len(pairs) >= 200
    assert sum(a.same(b) for a, b in pairs) <= len(pairs) // 100


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.1, 0.15, 0.2])
@pytest.mark.parametrize("kind", ["stroke, sine", "stroke, triangle"])
def test_the_steps_of_a_coarse_channel_are_not_noise(kind: str, noise: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """noise: of a step. Its staircase is the same for every repeat, but for where it begins."""
    motion, step, _ = SLOW[kind]
    monkeypatch.setitem(SLOW, kind, (motion, step, noise * step))
    repeats = [found for seed in range(15) if (found := Sketch.of(measured(kind, seed))) is not None]
    pairs = list(combinations(repeats, 2))
    assert sum(a.same(b) for a, b in pairs) <= len(pairs) // 100


def test_a_motion_without_noise_has_none() -> None:
    """Its residual is smooth: also of a fine channel."""
    found = Sketch.of(40e-6 * np.sin(2 * np.pi * 0.5 * T) + 2e-6 * np.sin(2 * np.pi * 94.0 * T))
    assert found is not None
    assert not any(hashes.size for hashes in found.noise)


def slow_channels(units: RecordedUnits) -> dict[str, np.ndarray]:
    """Every channel, but for drives, of every record that a check declares, of the first recorded unit; without the
    frequency response, whose records have turning points."""
    held = LoadedUnit(unit_folder.read(units.folder("A-01")))
    found = {}
    for section in sorted({check.reads for check in CHECKS.values()} - {"frf"}):
        declared = [name for name, each in CHECKS[section].inputs.items() if isinstance(each, Series)]
        for name, record in held.values(section).items() if declared else ():
            if isinstance(record, Record):
                found |= {f"{section}/{name} {c}": x for c, x in record.channels.items() if c not in DRIVES}
    return found


def test_a_cut_at_either_end_of_every_slow_record_is_known(recorded_units: RecordedUnits) -> None:
    channels = slow_channels(recorded_units)
    assert {"stroke", "stiffness", "hysteresis", "sensor_highpass", "spurious_modes"} <= {
        name.partition("/")[0] for name in channels
    }
    sketches = {name: sketched(x) for name, x in channels.items()}
    for name, x in channels.items():
        for n in CUTS:
            for cut in (x[n:], x[:-n]):
                assert sketches[name].same(sketched(cut)), (name, n)
    assert not [(a, b) for a, b in combinations(sketches, 2) if sketches[a].same(sketches[b])]
