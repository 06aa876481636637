"""The result of the gap workflow: plain numbers, no files."""

from __future__ import annotations  # so that reading results does not load what computes them

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from checks.fitting.fit import Fit
    from checks.fitting.goodness import Gap
    from checks.gap.modelling.slow_sines import Slow
    from checks.gap.preparation.record_faults import RecordFault
    from checks.gap.statistics.projected_residual import ExcessBand, Projected


class GapVerdict(StrEnum):
    """Outcome of a search for what is missing."""

    NO_MISSING = "no_missing_effect"
    EXPLAINED = "explained"
    AMBIGUOUS = "ambiguous"
    PARTLY = "partly_explained"
    UNEXPLAINED = "unexplained"


NO_MISSING, EXPLAINED, AMBIGUOUS, PARTLY, UNEXPLAINED = GapVerdict


@dataclass(frozen=True)
class ModeGap:
    """G within 5 Hz about a mode of the strut."""

    f_Hz: float
    G: float


@dataclass(frozen=True)
class Gaps:
    """On records that were not fitted: overall, by channel, about every mode."""

    G: float
    channels: Mapping[str, Gap]
    modes: tuple[ModeGap, ...] = ()


@dataclass(frozen=True)
class NamedValue:
    """A parameter of a named effect with its 95 % interval."""

    value: float
    lo: float
    hi: float


@dataclass(frozen=True)
class Named:
    """An effect with its parameters, the gain in log-likelihood on unseen records, and the chance of so much."""

    effect: str
    title: str
    sentence: str
    parameters: Mapping[str, NamedValue]
    delta_lnL: float
    p: float


@dataclass(frozen=True)
class Ambiguous:
    """Explanations (each a set of effects) that the data do not distinguish, and the experiment that would. or_bench:
    whether losses of the bench are one of them; separation: of the pair that the experiment separates least, predicted,
    in standard deviations of the records; None if it was not predicted."""

    effects: tuple[str, ...]
    experiment: str
    or_bench: bool = False
    separation: float | None = None


@dataclass(frozen=True)
class FoundPlace:
    """The place of an element: a part, what it acts against ("ground" or another part), along a direction, at a point
    [mm] from the part's node; None where the place has none."""

    part: str
    against: str
    direction: str
    point_mm: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class FoundElement:
    """Something without a name: kind, the places that explain the records as well (the best first), values there,
    likely causes in words, and the measurement that tells more. alike: library effects that explain them as well;
    fitted: name of the member of the explanation, "" if another is in its place there."""

    kind: str
    places: tuple[FoundPlace, ...]
    parameters: Mapping[str, NamedValue]
    sentence: str
    looks_like: tuple[str, ...]
    experiment: str
    alike: tuple[str, ...] = ()
    fitted: str = ""


@dataclass(frozen=True)
class Nameless:
    """An unidentified effect: poles and zeros [Hz] on a channel; words: nearest effect of the library, and why it was
    not named; ci95: interval of every pole; at_edge: whether a pole lies at an end of the band, where a slope that goes
    on outside looks like one."""

    channel: str
    poles_Hz: tuple[float, ...]
    zeros_Hz: tuple[float, ...]
    level_dependent: bool
    words: str = ""
    ci95: tuple[tuple[float, float], ...] = ()
    at_edge: bool = False


@dataclass(frozen=True)
class Tried:
    """One explanation that was tried: names, log-likelihood on unseen records against the base model's, adequacy.
    reason: why a gate refused it, or ""; p is then the chance of its gain."""

    names: tuple[str, ...]
    delta_lnL: float
    p: float
    reason: str = ""


@dataclass(frozen=True)
class StepShown:
    """The gap after one more effect: G by channel. effect: None for the model alone."""

    effect: str | None
    channels: Mapping[str, float]


@dataclass(frozen=True)
class Tested:
    """The explanation tested by an experiment's records that were not fitted. words: what was done; channels: G of
    each; against: where and how it does not hold, or why it could not be tested, "" if it holds; level: channels that
    respond differently to another level of drive."""

    kind: str
    value: float | None
    words: str
    channels: Mapping[str, Gap]
    against: str = ""
    level: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        return not self.against

    @property
    def refutes(self) -> bool:
        """Return whether it refutes the explanation: another response to another level is no linear effect's."""
        return bool(self.against and self.channels and not self.level)


@dataclass(frozen=True, eq=False)
class Result:
    """The result of the whole analysis. before, after: residuals on unseen records; fit: of the augmented model to
    A; bench_latency: values of the model's latencies that stand for the paths of a bench; written_G: G of every channel
    of the model that is written, with these latencies instead of the paths."""

    model: str
    verdict: str
    gap_before: Gaps
    gap_after: Gaps
    where: tuple[ExcessBand, ...]
    named: tuple[Named, ...]
    ambiguous: tuple[Ambiguous, ...]
    unnamed: tuple[Nameless, ...]
    detection_limits: Mapping[str, Mapping[str, float]]
    tried: tuple[Tried, ...]
    before: Projected
    after: Projected
    fit: Fit
    p_before: float
    p_after: float
    early: tuple[RecordFault, ...] = ()
    slow: Slow | None = None
    notes: tuple[str, ...] = ()
    damping: str = "full"
    experiments: tuple[Tested, ...] = ()
    steps: tuple[StepShown, ...] = ()
    bench_latency: Mapping[str, float] = field(default_factory=dict)
    elements: tuple[FoundElement, ...] = ()
    written_G: Mapping[str, float] = field(default_factory=dict)

    @property
    def found(self) -> bool:
        """Return whether a cause was found: effects, or elements."""
        return bool(self.named or self.elements)
