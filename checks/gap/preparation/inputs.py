"""What the workflow works on: records that are those of one unit, turned the right way round before any search."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import combinations

import numpy as np

from checks.fitting.dataset import Dataset
from checks.gap.conditions.trial import ConditionTrial
from checks.gap.effects import EFFECTS
from checks.gap.modelling.effect import Effect, SlowFinding
from checks.gap.modelling.slow_sines import Slow, slow_record
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.preparation import record_faults as early_checks
from checks.gap.preparation.record_faults import Early
from checks.model.model import Model
from checks.record import Record
from specs.errors import AcceptError

SAMPLE_OFFSET = "sample_offset"


class GapRefused(AcceptError, ValueError):
    """Records or a model that the workflow refuses; the text gives the reason."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """A: to fit; B: to judge with, the same channels; fs [Hz] of the records; slow: slow sines, or None;
    trials: the unit's experiments."""

    model: Model
    A: Dataset
    B: Dataset
    fs: float
    merge_Hz: float = 350.0
    slow: Record | None = None
    without: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()
    trials: tuple[ConditionTrial, ...] = ()


@dataclass(frozen=True, eq=False)
class Prepared:
    """Inputs with A and B corrected for everything that is found before any search; early: those findings; slow: the
    slow sines; in_slow: effects that they name."""

    inputs: Inputs
    A: Dataset
    B: Dataset
    early: tuple[Early, ...]
    slow: Slow | None
    in_slow: Mapping[Effect, SlowFinding]
    table: Thresholds


def prepared(inputs: Inputs, table: Thresholds) -> Prepared:
    """Return the inputs corrected for faults found before any search. Raises GapRefused if the records are not of one
    unit."""
    same_unit(inputs.A, inputs.B)
    early, A, B = _before(inputs)
    slow = None if inputs.slow is None else slow_record(inputs.slow)
    return Prepared(inputs, A, B, early, slow, _in_slow(slow, inputs, table), table)


def same_unit(A: Dataset, B: Dataset) -> None:
    """Raise GapRefused if the two realisations differ by more than noise and tolerance: not the same thing twice."""
    both = A.noise + B.noise + 2.0 * (max(A.tolerance, 1e-3) * np.abs(A.H)) ** 2 if A.H.shape == B.H.shape else None
    if both is None:
        raise GapRefused(f"the two realisations have {A.f.size} and {B.f.size} bins; expected records of equal length")
    G = np.median(np.abs(A.H - B.H) ** 2 / both, axis=0)
    for channel, g in zip(A.channels, G, strict=True):
        if g > 4.0:
            raise GapRefused(
                f"{channel} of the two realisations differs by {np.sqrt(g):.1f} times noise and tolerance in half of "
                "the bins: these are not records of one unit on one bench"
            )


def _before(inputs: Inputs) -> tuple[tuple[Early, ...], Dataset, Dataset]:
    A, B, model = inputs.A, inputs.B, inputs.model
    pair = early_checks.exchanged(A, model)  # first: a motion [m] under the name of a voltage looks like no signal
    found = [swapped(pair)] if pair is not None else []
    A, B = (_mended(d, found) for d in (A, B))
    silent = early_checks.dead(A, model)
    alive = tuple(c for c in A.channels if c not in silent)
    if not alive:
        raise GapRefused("no channel answers the drive: is the amplifier on, and are these the right records?")
    A, B = A.select(alive), B.select(alive)
    without = [Early("dead_channel", (c,), {}, f"{c} does not answer the drive.") for c in silent]
    signs = [fault for c in early_checks.turned(A, model) if (fault := opposed(c)).effect not in inputs.without]
    A, B = (_mended(d, signs) for d in (A, B))
    late = early_checks.offsets(A, model, inputs.fs)
    A, B = (early_checks.with_offsets(d, late, inputs.fs) for d in (A, B))
    offsets = [
        Early(SAMPLE_OFFSET, (channel,), {"samples": float(n)}, f"{channel} comes {n} samples late.")
        for channel, n in late.items()
    ]
    return (*without, *found, *signs, *offsets), A, B


def raw(p: Prepared) -> Dataset:
    """Return B as it was measured, in the usable channels."""
    return p.inputs.B.select(p.B.channels)


def trials_of(p: Prepared, channels: Sequence[str]) -> tuple[ConditionTrial, ...]:
    """Return the experiments, corrected for what was found before any search."""
    return tuple(replace(t, A=_as_found(t.A, p), B=_as_found(t.B, p)).select(channels) for t in p.inputs.trials)


def _as_found(data: Dataset, p: Prepared) -> Dataset:
    data = data.select(p.A.channels)
    for fault in p.early:
        if set(fault.channels) <= set(data.channels):
            late = fault.parameters.get("samples")
            if late is None:
                data = early_checks.mended(data, fault)
            else:
                data = early_checks.with_offsets(data, dict.fromkeys(fault.channels, int(late)), p.inputs.fs)
    return data


def _mended(data: Dataset, faults: Sequence[Early]) -> Dataset:
    return reduce(early_checks.mended, faults, data)


def opposed(channel: str) -> Early:
    """Return the fault of a channel of the wrong sign, as an effect of the library if it has one for this channel."""
    effect = next((e for e in EFFECTS.values() if e.turns and e.channels == (channel,)), None)
    if effect is None:
        return Early(f"polarity_{channel}", (channel,), {}, f"{channel} has the wrong sign.")
    return Early(effect.name, (channel,), {}, effect.sentence)


def swapped(pair: tuple[str, str]) -> Early:
    """Return the two channels that are exchanged."""
    return Early("swapped_channels", pair, {}, f"{pair[0]} and {pair[1]} are exchanged.", exchanges=True)


def as_recorded(p: Prepared) -> Prepared:
    """Return the same with whole samples of offset put back."""
    late = {e.channels[0]: -int(e.parameters["samples"]) for e in p.early if e.effect == SAMPLE_OFFSET}
    A, B = (early_checks.with_offsets(d, late, p.inputs.fs) for d in (p.A, p.B))
    return replace(p, A=A, B=B, early=tuple(e for e in p.early if e.effect != SAMPLE_OFFSET))


def possible_faults(p: Prepared) -> list[Early]:
    """Return the new faults of sign and of channels, one by one."""
    channels = p.A.channels
    every = [*map(opposed, channels), *(swapped(pair) for pair in combinations(channels, 2))]
    known = {(e.effect, e.channels) for e in p.early}
    return [e for e in every if e.effect not in p.inputs.without and (e.effect, e.channels) not in known]


def with_fault(p: Prepared, fault: Early) -> Prepared:
    """Return the inputs with the records corrected for one more fault."""
    A, B = (early_checks.mended(d, fault) for d in (p.A, p.B))
    return replace(p, A=A, B=B, early=(*p.early, fault))


def _in_slow(slow: Slow | None, inputs: Inputs, table: Thresholds) -> dict[Effect, SlowFinding]:
    """Return the effects that the slow sines show."""
    if slow is None:
        return {}
    found = {e: e.slow.named(slow, table) for e in EFFECTS.values() if e.name not in inputs.without}
    return {e: finding for e, finding in found.items() if finding is not None}
