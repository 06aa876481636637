"""The gates before a name ([GAP] 10): conditions that an effect of the best explanation has to meet.

Each gate is named and has a test of the evidence and a reason, the sentence if the test fails. `FULL_GATES` judge an
effect of an explanation of everything; `beside_gates.BESIDE_GATES` one that leaves something unexplained. An effect
that fails any gate is not named; its reasons stand in gap.json.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from checks import distributions as stats
from checks.arrays import Complex
from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit
from checks.gap.modelling.augmented import Augmented, Member, Values
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.element import GenericElement
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.search.candidate import Candidate, Fitted
from checks.gap.search.candidates import Search
from checks.gap.search.disagreement import left_by_cell
from checks.gap.search.forward import SearchResult, is_within_tolerance
from checks.gap.statistics.adequacy import Adequacy
from checks.model.model import frequency_and_damping

LOOKED = 300  # places tried by a search, for the chance of a gain
AT_LEAST = 2  # channels of an effect that shows on several: on one alone it is any filter
BEYOND_CHANCE = 0.1  # of the chance at which a model counts as inadequate
POLE = {"f_Hz", "damping_ratio"}  # parameters of a member that adds a mode
AGREES = 1.0  # G of a channel up to which model and data agree: what happens below is chance
SMALL_BESIDE = 0.01  # of the gain of an effect: so little left, within the tolerance, leaves its name
MATTERS = 1.0  # mean energy of an effect on a channel, in units of chance, from which on it acts there


@dataclass(frozen=True)
class Claim:
    """An effect that a search wants to name. reasons: of the gates that it did not pass."""

    effect: Effect
    delta_lnL: float
    p: float
    reasons: tuple[str, ...]


def accepted(claims: Sequence[Claim]) -> tuple[Claim, ...]:
    """Return the claims that passed every gate."""
    return tuple(c for c in claims if not c.reasons)


@dataclass(frozen=True, eq=False)
class NameEvidence(ABC):
    """What is known of an effect of an explanation. fitted: the explanation; final: its fit to all bins; slow: the slow
    sines."""

    effect: Effect
    fitted: Fitted
    final: Fit
    slow: Slow | None
    table: Thresholds
    search: Search

    @property
    def best(self) -> Fitted:
        """Return the explanation as the search left it."""
        return self.fitted

    @property
    @abstractmethod
    def without(self) -> Fitted:
        """Return the explanation without the effect, everything else fitted anew: its loss in log-likelihood of unseen
        records is the gain of the effect."""

    @abstractmethod
    def refitted(self, c: Fitted) -> Fitted:
        """Return an explanation fitted to B and judged on A."""

    @property
    def gain(self) -> float:
        return self.best.lnL - self.without.lnL

    @property
    def required_gain(self) -> float:
        """Return the gain that a name needs."""
        return self.table.delta_lnL

    @cached_property
    def exchanged_gain(self) -> float:
        """Return the same gain with the realisations exchanged. -inf if the strut is not held."""
        try:
            return self.refitted(self.best).lnL - self.refitted(self.without).lnL
        except ModelError:
            return -np.inf

    def claim(self, reasons: Sequence[str]) -> Claim:
        return Claim(self.effect, self.gain, chance_of_gain(self.gain, self.effect), tuple(reasons))

    @property
    def significant(self) -> bool:
        return is_significant(self.table, self.effect, self.final, self.fitted.response)

    @property
    def at_limit(self) -> list[str]:
        """Return the parameters of the effect whose value lies on a physical bound."""
        return [n for p in self.effect.parameters if (n := f"{self.effect.name}.{p.name}") in self.final.at_bound]

    @cached_property
    def acting_on(self) -> tuple[str, ...]:
        """Return the channels on which the effect acts."""
        return acting_on(self.effect, self.fitted.response, self.fitted.at, self.fitted.unseen)

    @property
    def channels(self) -> str:
        """Return the channels on which the effect must show, for a sentence."""
        return ", ".join(self.effect.channels)

    @property
    def on_a_mode(self) -> bool:
        return on_a_mode(self.effect, self.fitted.response, self.final.at)

    @cached_property
    def contradiction(self) -> str:
        """Return why slow sines contradict the fitted values, or ""."""
        if self.slow is None:
            return ""
        return self.effect.slow.contradicts(self.slow, self.fitted.response.of(self.final.at, self.effect.name))

    @property
    def far_from_priors(self) -> bool:
        """Return whether a calibrated value lies so far from its prior that the calibration explains what it should
        not."""
        at = self.fitted.at
        free = [p for p in self.fitted.response.free() if np.isfinite(p.sd)]
        return any(abs(at[p.name] - p.prior) > self.table.pull * p.sd for p in free)


E = TypeVar("E", bound=NameEvidence)
Judged = TypeVar("Judged", bound=NameEvidence, contravariant=True)


@dataclass(frozen=True)
class Gate(Generic[Judged]):
    """A condition of a name. reason: what is wrong if the test fails, with attributes of the evidence `e` in braces;
    after: a gate that must pass before this one is tested, because it covers the same fault more severely."""

    name: str
    reason: str
    test: Callable[[Judged], bool]
    _: KW_ONLY
    after: str = ""


def failed_reasons(gates: Sequence[Gate[E]], evidence: E) -> list[str]:
    """Return the reasons of the gates that fail, in order."""
    failed: set[str] = set()
    reasons = []
    for gate in gates:
        if gate.after in failed:
            failed.add(gate.name)
        elif not gate.test(evidence):
            failed.add(gate.name)
            reasons.append(gate.reason.format(e=evidence))
    return reasons


GAIN = Gate[NameEvidence](
    "gain", "explains too little of unseen records (gain {e.gain:.0f})", lambda e: e.gain > e.required_gain
)
CONFIRMED = Gate[NameEvidence](
    "confirmed",
    "is not confirmed with the records exchanged (gain {e.exchanged_gain:.0f})",
    lambda e: e.exchanged_gain > e.required_gain,
    after="gain",
)
SIGNIFICANT = Gate[NameEvidence]("significant", "parameters not significant", lambda e: e.significant)
WITHIN_LIMITS = Gate[NameEvidence](
    "within_limits", "{e.at_limit[0]} is at its physical limit", lambda e: not e.at_limit
)
# Acting on one channel only, an effect of every channel is not distinguished from any filter there.
ON_ITS_CHANNELS = Gate[NameEvidence](
    "on_its_channels",
    "acts on {e.acting_on[0]} alone, and would show on {e.channels}",
    lambda e: len(e.effect.channels) <= AT_LEAST or len(e.acting_on) != 1,
)
OFF_MODES = Gate[NameEvidence](
    "off_modes",
    "lies on a mode of the strut, which looks the same when its coupling is not that of the model",
    lambda e: not e.on_a_mode,
)
SLOW_SINES = Gate[NameEvidence]("slow_sines", "{e.contradiction}", lambda e: not e.contradiction)


@dataclass(frozen=True, eq=False)
class FullEvidence(NameEvidence):
    """NameEvidence of an effect of an explanation of everything. result: of the search; left_out: channels that no
    explanation covers."""

    fitted: Candidate
    result: SearchResult
    left_out: Sequence[str] = ()

    @property
    def best(self) -> Candidate:
        return self.result.best

    @cached_property
    def without(self) -> Candidate:
        result, name = self.result, self.effect.name
        less = result.best.response.without(name)
        known = [c for c in (result.base, *result.tried) if c.names == frozenset(less.names)]
        start = {k: v for k, v in result.best.at.items() if not k.startswith(f"{name}.")}
        # The base was calibrated from several places; only the way from this explanation's values is new.
        fit = self.search.fit_from_one_place if result.base in known else self.search.fit
        return max([*known, fit(less, start)], key=lambda c: c.lnL)

    def refitted(self, c: Fitted) -> Candidate:
        return self.search.exchanged.refit(c.response, c.at)

    @property
    def needless(self) -> bool:
        """Return whether every channel agrees without the effect: one of several, or beside a hysteresis at two levels;
        or one on a bench that is fitted too or was learned from a few units, which says little of what single bins may
        hold."""
        best, response = self.result.best, self.result.best.response
        if len(response.members) - len(response.paths) - len(response.unmodelled_modes) > 1:
            return is_within_tolerance(best, self.effect, self.table.G)
        of_bench = response.model.learned is not None or bool(response.paths)
        return of_bench and is_within_tolerance(best, self.effect, AGREES)

    @property
    def gap(self) -> float:
        """Return the gain in log-likelihood by the whole explanation."""
        return max(self.result.best.lnL - self.result.base.lnL, 1.0)

    @property
    def percent(self) -> float:
        """Return the part of the gap in log-likelihood that the effect explains."""
        return 100 * self.gain / self.gap

    @property
    def complete(self) -> bool:
        """Return whether the explanation is adequate without unmodelled modes."""
        return self.fitted.adequate and not self.fitted.response.unmodelled_modes

    @property
    def needs_unmodelled_mode(self) -> bool:
        """Return whether an unmodelled mode acts only on channels in which the effect must show: then the effect does
        not explain even its own channels. A mode of all channels is no rival of an effect of some."""
        modes = self.fitted.response.unmodelled_modes
        return any(set(mode.channels) <= set(self.effect.channels) for mode in modes)

    @property
    def shares_pole(self) -> bool:
        """Return whether an unmodelled mode has its pole within the half-widths of the effect's: they undo each other
        on some channels, and together are one mode on the others."""
        of, at = self.fitted.response.of, self.fitted.at
        own = of(at, self.effect.name)
        others = [of(at, mode.name) for mode in self.fitted.response.unmodelled_modes]
        return _adds_mode(self.effect, own) and any(_same_pole(own, other) for other in others if POLE <= other.keys())

    @property
    def leaves_residual(self) -> bool:
        """Return whether the explanation leaves a residual that matters where the effect acts."""
        full = self.fitted
        if full.adequate:
            return False
        if self.far_from_priors:
            return True
        if is_small_beside(self.gain, -self.result.best.lnL, full.worst_G):
            return False
        spread_out = matters_without_band(full.adequacy, self.result.base.worst_G, full.table)
        return self._in_excess_band() or spread_out

    def _in_excess_band(self) -> bool:
        """Return whether a channel on which the effect acts holds a band that chance does not explain."""
        full = self.fitted
        data, change = full.unseen, change_by(self.effect, full.response, full.at, full.unseen)
        energy = (np.abs(full.seen.by_bin(data.whitener(change))) ** 2 / 2.0).mean(axis=0)
        return any(energy[data.channels.index(w.channel)] > MATTERS for w in full.adequacy.windows)

    @property
    def missing_channels(self) -> str:
        """Return the channels on which the effect must show and that were not measured, if too few others remain."""
        channels = set(self.effect.channels)
        missing = channels - set(self.search.A.channels) - set(self.left_out)
        return ", ".join(sorted(missing)) if len(channels) - len(missing) < AT_LEAST else ""

    @property
    def unexplained_channels(self) -> str:
        return ", ".join(self.left_out) if set(self.left_out) & set(self.effect.channels) else ""


FULL_GATES: tuple[Gate[FullEvidence], ...] = (
    GAIN,
    CONFIRMED,
    Gate("needed", "is not needed: every channel agrees without it", lambda e: not e.needless),
    SIGNIFICANT,
    WITHIN_LIMITS,
    Gate(
        "share",
        "explains {e.percent:.1f} % of the gap beside an unidentified effect",
        lambda e: e.complete or not e.gain < e.table.share * e.gap,
    ),
    Gate(
        "own_evidence",
        "explains the data only together with an unidentified effect",
        lambda e: not e.needs_unmodelled_mode,
    ),
    Gate(
        "own_pole",
        "has the pole of an unidentified mode, with which it is one",
        lambda e: not e.shares_pole,
    ),
    ON_ITS_CHANNELS,
    OFF_MODES,
    Gate(
        "gap_left",
        "leaves too much unexplained, beside which its evidence does not stand",
        lambda e: not e.fitted.worst_G > e.table.G,
    ),
    Gate("residual_left", "leaves a residual where it acts", lambda e: not e.leaves_residual, after="gap_left"),
    SLOW_SINES,
    Gate("measured", "must show on {e.missing_channels}, which was not measured", lambda e: not e.missing_channels),
    Gate(
        "explained",
        "must show on {e.unexplained_channels}, which nothing explains",
        lambda e: not e.unexplained_channels,
    ),
)


def judge_claims(
    search: Search, result: SearchResult, final: Fit, full: Candidate, slow: Slow | None, left_out: Sequence[str] = ()
) -> tuple[Claim, ...]:
    """Judge every named effect of the best explanation by the gates. A claim is valid only with its whole explanation:
    one that depends on another effect of the same channels that has to be refused is refused too."""
    claims = []
    for effect in result.best.response.effects:
        evidence = FullEvidence(effect, full, final, slow, search.table, search, result, left_out)
        reasons = failed_reasons(FULL_GATES, evidence)
        claims.append(evidence.claim(reasons))
    return tuple(_refused_with_others(c, claims, search.table) for c in claims)


def _refused_with_others(claim: Claim, every: Sequence[Claim], table: Thresholds) -> Claim:
    for other in every:
        shared = set(other.effect.channels) & set(claim.effect.channels)
        if not claim.reasons and other.reasons and other.delta_lnL > table.delta_lnL and shared:
            return replace(claim, reasons=(f"stands beside {other.effect.name}, which could not be named",))
    return claim


def chance_of_gain(gain: float, member: Member) -> float:
    """Return the chance of a gain in log-likelihood by one of the places that a search looks at."""
    return float(min(1.0, LOOKED * stats.chi2.sf(2.0 * max(gain, 0.0), max(1, len(member.parameters)))))


def change_by(effect: Effect, response: Augmented, at: Values, data: Dataset) -> Complex:
    """Return the change (F, C) of a response by an effect in it, everything else at the same values."""
    less = response.without(effect.name)
    bare = less.frf(data.f, less.own_values(at), data.channels)
    return np.asarray(response.frf(data.f, at, data.channels) - bare)


def acting_on(effect: Effect, response: Augmented, at: Values, data: Dataset) -> tuple[str, ...]:
    """Return the channels in which an effect in a response changes a half octave by more than noise and tolerance."""
    most = left_by_cell(data, change_by(effect, response, at, data)).max(axis=0)
    return tuple(c for c, Q in zip(data.channels, most, strict=True) if Q > MATTERS)


def on_a_mode(effect: Effect, response: Augmented, at: Values) -> bool:
    """Return whether an effect that adds a mode has it within the half-widths of one of the strut's own. The modes of a
    lopsided APA are coupled in another way, which no factor on them explains: a small mode there does, but means
    nothing."""
    values = response.of(at, effect.name)
    if isinstance(effect, GenericElement) or not _adds_mode(effect, values):  # an element's coupling is the model's
        return False
    f, ratio = frequency_and_damping(response.model.poles(response.changes(at)))
    mode, width = values["f_Hz"], values["f_Hz"] * values["damping_ratio"]
    return bool(np.any(np.abs(f - mode) < f * ratio + width))


def _adds_mode(effect: Effect, values: Values) -> bool:
    return POLE <= values.keys() and any(p.linear for p in effect.parameters)


def _same_pole(a: Values, b: Values) -> bool:
    """Return whether two poles lie within their half-widths of each other."""
    return bool(abs(a["f_Hz"] - b["f_Hz"]) < a["f_Hz"] * a["damping_ratio"] + b["f_Hz"] * b["damping_ratio"])


def is_significant(table: Thresholds, effect: Effect, final: Fit, response: Augmented) -> bool:
    """Return whether the fitted values lie as far from those of no effect as a significant gain requires."""
    off = effect.off(response.model)
    names = [p.name for p in effect.sizes if p.linear and np.isfinite(off[p.name])]
    if not names:
        return True
    at = [final.names.index(f"{effect.name}.{n}") for n in names]
    away = final.values[at] - np.array([off[n] for n in names])
    return bool(0.5 * away @ np.linalg.pinv(final.cov[np.ix_(at, at)], hermitian=True) @ away > table.delta_lnL)


def is_small_beside(gain: float, left: float, worst_G: float) -> bool:
    """Return whether a residual is small beside what an effect explains, in log-likelihood, and no channel is off by
    more than the tolerance: single bins of a sharp mode that the model has very nearly in its place."""
    return left < SMALL_BESIDE * gain and worst_G < AGREES


def matters_without_band(adequacy: Adequacy, G_before: float, table: Thresholds) -> bool:
    """Return whether a residual matters although it lies in no band: if it is clearly more than chance (a p just below
    the limit occurs for one right explanation in a thousand), or if the tolerance could hide what was there before."""
    weighs = adequacy.p < BEYOND_CHANCE * table.p_global or G_before < table.G
    return weighs and not adequacy.windows
