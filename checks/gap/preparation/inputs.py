"""The problem of a search: records of one unit, corrected for the faults that show before any search."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce
from itertools import combinations

from checks.fitting.dataset import Dataset
from checks.gap.conditions.trial import ConditionTrial, GapRefused, check_same_unit
from checks.gap.effects import EFFECTS
from checks.gap.modelling.effect import Effect, SlowFinding
from checks.gap.modelling.slow_sines import Slow, slow_record
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.preparation import record_faults as faults
from checks.gap.preparation.record_faults import RecordFault
from checks.model.model import Model
from checks.record import Record, motion_of

SAMPLE_OFFSET = "sample_offset"


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
class Problem:
    """The task of a search: inputs with A and B corrected for the faults that are found before any search. early: those
    faults; slow: the slow sines; in_slow: effects that they name."""

    inputs: Inputs
    A: Dataset
    B: Dataset
    early: tuple[RecordFault, ...]
    slow: Slow | None
    in_slow: Mapping[Effect, SlowFinding]
    table: Thresholds

    @property
    def effects(self) -> list[Effect]:
        """Return the effects of the library that may be named."""
        return [e for e in EFFECTS.values() if e.name not in self.inputs.without]

    @property
    def measured_B(self) -> Dataset:
        """Return B as it was measured, in the usable channels."""
        return self.inputs.B.select(self.B.channels)

    @property
    def depends_on_level(self) -> bool:
        """Return whether the slow sines show that responses depend on the level of drive."""
        return bool(self.in_slow) or (self.slow is not None and self.slow.is_bent(self.table))

    @property
    def trials(self) -> tuple[ConditionTrial, ...]:
        """Return the experiments, corrected for the same faults."""
        return tuple(replace(t, A=self._corrected(t.A), B=self._corrected(t.B)) for t in self.inputs.trials)

    def _corrected(self, data: Dataset) -> Dataset:
        data = data.select(self.A.channels)
        for fault in self.early:
            if set(fault.channels) <= set(data.channels):
                samples = fault.parameters.get("samples")
                if samples is None:
                    data = faults.correct(data, fault)
                else:
                    late = dict.fromkeys(fault.channels, int(samples))
                    data = faults.with_offsets(data, late, self.inputs.fs)
        return data

    def with_offsets(self) -> "Problem":
        """Return the same with whole samples of offset put back into the records."""
        late = {e.channels[0]: -int(e.parameters["samples"]) for e in self.early if e.effect == SAMPLE_OFFSET}
        A, B = (faults.with_offsets(d, late, self.inputs.fs) for d in (self.A, self.B))
        return replace(self, A=A, B=B, early=tuple(e for e in self.early if e.effect != SAMPLE_OFFSET))


def prepare(inputs: Inputs, table: Thresholds) -> Problem:
    """Return the inputs corrected for faults found before any search. Raises GapRefused if the records are not of one
    unit."""
    check_same_unit(inputs.A, inputs.B)
    early, A, B = _find_faults(inputs)
    record, learned = inputs.slow, inputs.model.learned
    slow = None if record is None else slow_record(record, motion_of(record.channels), learned)
    problem = Problem(inputs, A, B, early, slow, {}, table)
    if slow is None:
        return problem
    findings = {e: e.slow.named(slow, table) for e in problem.effects}
    return replace(problem, in_slow={e: finding for e, finding in findings.items() if finding is not None})


def _find_faults(inputs: Inputs) -> tuple[tuple[RecordFault, ...], Dataset, Dataset]:
    """Return the faults of the records, and A and B corrected for them. Raises GapRefused if every channel is dead."""
    A, B, model = inputs.A, inputs.B, inputs.model
    pair = faults.find_exchanged(A, model)  # first: a motion [m] under the name of a voltage looks like no signal
    exchanged = [] if pair is None else [exchange_fault(pair)]
    A, B = (reduce(faults.correct, exchanged, d) for d in (A, B))
    silent = faults.find_dead(A, model)
    alive = tuple(c for c in A.channels if c not in silent)
    if not alive:
        raise GapRefused("no channel answers the drive: is the amplifier on, and are these the right records?")
    A, B = A.select(alive), B.select(alive)
    dead = [*map(dead_fault, silent)]
    signs = [fault for c in faults.find_inverted(A, model) if (fault := sign_fault(c)).effect not in inputs.without]
    A, B = (reduce(faults.correct, signs, d) for d in (A, B))
    late = faults.find_offsets(A, model, inputs.fs)
    A, B = (faults.with_offsets(d, late, inputs.fs) for d in (A, B))
    offsets = [offset_fault(channel, n) for channel, n in late.items()]
    return (*dead, *exchanged, *signs, *offsets), A, B


def dead_fault(channel: str) -> RecordFault:
    """Return the fault of a channel that does not follow the drive."""
    return RecordFault("dead_channel", (channel,), {}, f"{channel} does not answer the drive.")


def offset_fault(channel: str, samples: int) -> RecordFault:
    """Return the fault of a channel that comes late by whole samples."""
    words = f"{channel} comes {samples} samples late."
    return RecordFault(SAMPLE_OFFSET, (channel,), {"samples": float(samples)}, words)


def sign_fault(channel: str) -> RecordFault:
    """Return the fault of a channel of the wrong sign, as an effect of the library if it has one for this channel."""
    effect = next((e for e in EFFECTS.values() if e.turns and e.channels == (channel,)), None)
    if effect is None:
        return RecordFault(f"polarity_{channel}", (channel,), {}, f"{channel} has the wrong sign.")
    return RecordFault(effect.name, (channel,), {}, effect.sentence)


def exchange_fault(pair: tuple[str, str]) -> RecordFault:
    """Return the fault of two channels that are exchanged."""
    return RecordFault("swapped_channels", pair, {}, f"{pair[0]} and {pair[1]} are exchanged.", exchanges=True)


def possible_faults(problem: Problem) -> list[RecordFault]:
    """Return the faults of sign and of exchanged channels that are not corrected yet."""
    channels = problem.A.channels
    every = [*map(sign_fault, channels), *(exchange_fault(pair) for pair in combinations(channels, 2))]
    known = {(e.effect, e.channels) for e in problem.early}
    return [e for e in every if e.effect not in problem.inputs.without and (e.effect, e.channels) not in known]


def with_fault(problem: Problem, fault: RecordFault) -> Problem:
    """Return the problem with the records corrected for one more fault."""
    A, B = (faults.correct(d, fault) for d in (problem.A, problem.B))
    return replace(problem, A=A, B=B, early=(*problem.early, fault))
