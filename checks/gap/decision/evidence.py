"""What is known of an effect of an explanation, for the gates of a name: its gain, its values, where it acts, and what
is left there."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from checks import distributions as stats
from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.fitting.fit import Fit
from checks.gap.modelling.augmented import Augmented, Values
from checks.gap.modelling.effect import AT_LEAST, Effect
from checks.gap.modelling.element import GenericElement
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.modelling.unmodelled_modes import UnmodelledMode
from checks.gap.search.candidates import Search
from checks.gap.search.disagreement import ROUNDS, required_gain, settle
from checks.gap.search.explanation import MATTERS, Explanation
from checks.gap.search.forward import SearchResult, is_within_tolerance
from checks.gap.statistics.disagreement import left_by_cell
from checks.gap.statistics.projected_residual import Adequacy
from checks.model.model import frequency_and_damping

LOOKED = 300  # places tried by a search, for the chance of a gain
BEYOND_CHANCE = 0.1  # of the chance at which a model counts as inadequate
POLE = {"f_Hz", "damping_ratio"}  # parameters of a member that adds a mode
AGREES = 1.0  # G of a channel up to which model and data agree: what happens below is chance
SMALL_BESIDE = 0.01  # of the gain of an effect: so little left, within the tolerance, leaves its name
ACTS = 1.0  # of Q: an effect that changes a cell by more acts there
EXPLAINED_CELL = 1.5  # of Q, as of G of a channel
CONFIRMING = 2  # rounds of weights, from values that are nearly right
HARDLY_LEFT = 0.01  # of a channel's G: an effect that leaves no more needs no more evidence than another name


@dataclass(frozen=True)
class ActingCells:
    """The residual in the cells in which an effect acts. share: of the logarithms of Q; worse: how many it makes worse;
    worst: Q of the cell that it changes most, in the channel with the largest."""

    share: float
    worse: int
    worst: float


@dataclass(frozen=True, eq=False)
class NameEvidence:
    """Evidence for a name, which the gates test. result: of the search; full: its best explanation fitted to all bins
    or, beside a disagreement, as the search left it; final: the fit to all bins; slow: the slow sines."""

    effect: Effect
    search: Search
    result: SearchResult
    full: Explanation
    final: Fit
    slow: Slow | None

    @property
    def table(self) -> Thresholds:
        return self.search.table

    @property
    def best(self) -> Explanation:
        return self.result.best

    # --- its gain

    @cached_property
    def without(self) -> Explanation:
        """Return the explanation without the effect, everything else fitted anew: its loss in log-likelihood of unseen
        records is the gain of the effect."""
        less = self.best.without(self.effect.name)
        if self.best.beside:
            return settle(self.search, less.response, less.at, ROUNDS)
        known = [c for c in (self.result.base, *self.result.tried) if c.names == less.names]
        # The base was calibrated from several places; only the way from this explanation's values is new.
        fit = self.search.fit_from_one_place if self.result.base in known else self.search.fit
        return max([*known, fit(less.response, less.at)], key=lambda c: c.lnL)

    @property
    def gain(self) -> float:
        return self.best.lnL - self.without.lnL

    @property
    def required_gain(self) -> float:
        """Return the gain that a name needs; beside a disagreement, what a step of the search needs, and that of a name
        on top if the effect leaves something of every channel, as what is no effect of the library may be one in
        part."""
        if not self.best.beside:
            return self.table.delta_lnL
        more = 0.0 if self.left_of_channel < HARDLY_LEFT else self.table.delta_lnL
        return required_gain(self.table, self.effect) + more

    @cached_property
    def exchanged_gain(self) -> float:
        """Return the same gain with the realisations exchanged. -inf if the strut is not held."""
        try:
            with_it, without = (self._exchanged(c) for c in (self.best, self.without))
            return with_it.lnL - without.lnL
        except ModelError:
            return -np.inf

    def _exchanged(self, c: Explanation) -> Explanation:
        """Return an explanation fitted to B and judged on A."""
        other = self.search.exchanged
        return settle(other, c.response, c.at, CONFIRMING) if c.beside else other.refit(c.response, c.at)

    @property
    def gap(self) -> float:
        """Return the gain in log-likelihood by the whole explanation."""
        return max(self.best.lnL - self.result.base.lnL, 1.0)

    @property
    def percent(self) -> float:
        """Return the part of the gap in log-likelihood that the effect explains."""
        return 100 * self.gain / self.gap

    @property
    def needless(self) -> bool:
        """Return whether every channel agrees without the effect: one of several, or beside a hysteresis at two levels;
        or one on a bench that is fitted too or was learned from a few units, which says little of what single bins may
        hold."""
        best, response = self.best, self.best.response
        if len(response.members) - len(response.paths) - len(response.unmodelled_modes) > 1:
            return is_within_tolerance(best, self.effect, self.table.G)
        of_bench = response.model.learned is not None or bool(response.paths)
        return of_bench and is_within_tolerance(best, self.effect, AGREES)

    # --- its values

    @property
    def significant(self) -> bool:
        return is_significant(self.table, self.effect, self.final, self.full.response)

    @property
    def at_limit(self) -> list[str]:
        """Return the parameters of the effect whose value lies on a physical bound."""
        return [n for p in self.effect.parameters if (n := f"{self.effect.name}.{p.name}") in self.final.at_bound]

    @property
    def is_early(self) -> bool:
        """Return whether a lag is below zero with its whole interval: something else turns the phase."""
        name = f"{self.effect.name}.tau_us"
        return self.effect.lags and name in self.final.names and self.final.interval(name)[1] < 0.0

    @cached_property
    def contradiction(self) -> str:
        """Return why slow sines contradict the fitted values, or ""."""
        if self.slow is None:
            return ""
        return self.effect.slow.contradicts(self.slow, self.full.response.of(self.final.at, self.effect.name))

    @property
    def far_from_priors(self) -> bool:
        """Return whether a calibrated value lies so far from its prior that the calibration explains what it should
        not."""
        at = self.full.at
        free = [p for p in self.full.response.free() if np.isfinite(p.sd)]
        return any(abs(at[p.name] - p.prior) > self.table.pull * p.sd for p in free)

    @property
    def on_a_mode(self) -> bool:
        return on_a_mode(self.effect, self.full.response, self.final.at)

    # --- where it acts

    @cached_property
    def acting_on(self) -> tuple[str, ...]:
        """Return the channels on which the effect acts."""
        return self.full.acting_on(self.effect)

    @cached_property
    def is_any_filter(self) -> bool:
        """Return whether an effect of every channel acts on one alone, where any filter acts the same. An element does
        not count if its gain exceeds that of every filter of this channel by the gain that is required of a name; both
        have the cost of their parameters."""
        if len(self.effect.channels) <= AT_LEAST or len(self.acting_on) != 1:
            return False
        if not isinstance(self.effect, GenericElement):
            return True
        of_channel = (m for m in self.search.library if isinstance(m, UnmodelledMode) and m.channels == self.acting_on)
        filters = replace(self.search, library=tuple(replace(m, stands_in=False) for m in of_channel))
        least = self.best.score - self.table.delta_lnL
        return any(c.score > least for c in filters.add_one(self.without))

    @property
    def channels(self) -> str:
        """Return the channels on which the effect must show, for a sentence."""
        return ", ".join(self.effect.channels)

    @property
    def missing_channels(self) -> str:
        """Return the channels on which the effect must show and that were not measured, if too few others remain."""
        if isinstance(self.effect, GenericElement):
            return ""
        channels = set(self.effect.channels)
        missing = channels - set(self.search.A.channels)
        return ", ".join(sorted(missing)) if len(channels) - len(missing) < AT_LEAST else ""

    # --- what else the explanation holds, and what it leaves

    @property
    def complete(self) -> bool:
        """Return whether the explanation is adequate without unmodelled modes."""
        return self.full.adequate and not self.full.response.unmodelled_modes

    @property
    def needs_unmodelled_mode(self) -> bool:
        """Return whether an unmodelled mode acts only on channels in which the effect must show: then the effect does
        not explain even its own channels. A mode of all channels is no rival of an effect of some."""
        modes = self.full.response.unmodelled_modes
        return any(set(mode.channels) <= set(self.effect.channels) for mode in modes)

    @property
    def shares_pole(self) -> bool:
        """Return whether an unmodelled mode has its pole within the half-widths of the effect's: they undo each other
        on some channels, and together are one mode on the others."""
        own = self.full.of(self.effect.name)
        others = [self.full.of(mode.name) for mode in self.full.response.unmodelled_modes]
        return _adds_mode(self.effect, own) and any(_same_pole(own, other) for other in others if POLE <= other.keys())

    @property
    def leaves_residual(self) -> bool:
        """Return whether the explanation leaves a residual that matters where the effect acts."""
        full = self.full
        if full.adequate:
            return False
        if self.far_from_priors:
            return True
        if is_small_beside(self.gain, -self.best.lnL, full.worst_G):
            return False
        spread_out = matters_without_band(full.adequacy, self.result.base.worst_G, full.table)
        return self._in_excess_band() or spread_out

    def _in_excess_band(self) -> bool:
        """Return whether a channel on which the effect acts holds a band that chance does not explain."""
        full, data = self.full, self.full.unseen
        white = data.whitener(full.change_by(self.effect))
        energy = (np.abs(full.seen.by_bin(white)) ** 2 / 2.0).mean(axis=0)
        return any(energy[data.channels.index(w.channel)] > MATTERS for w in full.adequacy.windows)

    @cached_property
    def _bare_residual(self) -> Complex:
        """Return the residual (F, C) of B without the effect, everything else at the same values."""
        return self.full.without(self.effect.name).residual

    @cached_property
    def cells(self) -> ActingCells:
        """Return the residual of the explanation where the effect acts."""
        full, data, bare = self.full, self.full.unseen, self._bare_residual
        change, before, after = left_by_cell(data, bare - full.residual), left_by_cell(data, bare), full.Q
        acts = change > ACTS
        if not acts.any():
            return ActingCells(1.0, 0, np.inf)
        larger = np.maximum(before, change)
        share = float(_log(after)[acts].sum() / max(_log(larger)[acts].sum(), 1e-9))
        worse = int((acts & (after > np.maximum(larger, EXPLAINED_CELL))).sum())
        most = np.argmax(change, axis=0)
        worst = max(float(after[k, c]) for c, k in enumerate(most) if change[k, c] > ACTS)
        return ActingCells(share, worse, worst)

    @property
    def percent_left(self) -> float:
        return 100 * self.cells.share

    @cached_property
    def left_of_channel(self) -> float:
        """Return G after over G before the effect, everything else at the same values: of the channel that it explains
        best; 0 if it makes a channel agree that did not."""
        residuals, variance = (self._bare_residual, self.full.residual), self.full.unseen.variance
        before, after = (np.mean(np.abs(residual) ** 2 / variance, axis=0) for residual in residuals)
        return 0.0 if np.any((after < AGREES) & (before > AGREES)) else float(np.min(after / before))

    @property
    def unexplained_beside(self) -> float:
        """Return the smallest G of the channels on which an effect of the signal path does not act: what is in the
        mechanics moves the zeros of all of them, and may do all that it seems to do; a channel that alone disagrees has
        a path of its own. 0 for an effect of the mechanics, or of every channel."""
        data, others = self.full.unseen, [c for c in self.full.unseen.channels if c not in self.effect.channels]
        if not self.effect.in_signal_path or not others:
            return 0.0
        G = np.mean(np.abs(self.full.residual) ** 2 / data.variance, axis=0)
        return float(min(G[data.channels.index(c)] for c in others))


def _log(Q: Array) -> Array:
    return np.log(np.maximum(Q, 1.0))


def chance_of_gain(gain: float, member: Effect) -> float:
    """Return the chance of a gain in log-likelihood by one of the places that a search looks at."""
    return float(min(1.0, LOOKED * stats.chi2.sf(2.0 * max(gain, 0.0), max(1, len(member.parameters)))))


def on_a_mode(effect: Effect, response: Augmented, at: Values) -> bool:
    """Return whether an effect that adds a mode has it within the half-widths of one of the strut's own. The modes of a
    lopsided APA are coupled in another way, which no factor on them explains: a small mode there does, but means
    nothing."""
    values = response.of(at, effect.name)
    if isinstance(effect, GenericElement | UnmodelledMode) or not _adds_mode(effect, values):
        return False  # an element's coupling is the model's
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
    point = [p.name for p in effect.parameters if p not in effect.sizes]
    at = [final.names.index(f"{effect.name}.{n}") for n in (*names, *point)]
    away = final.values[at] - np.array([off[n] for n in names] + [0.0] * len(point))
    # beside the axis it counts by its moments too, which may be all that is told: a value and its lever
    slopes = np.eye(len(at))
    for k in range(len(names), len(at)):
        slopes[k, 0], slopes[k, k] = away[k], away[0]
        away[k] *= away[0]
    cov = slopes @ final.cov[np.ix_(at, at)] @ slopes.T
    return bool(0.5 * away @ np.linalg.pinv(cov, hermitian=True) @ away > table.delta_lnL)


def is_small_beside(gain: float, left: float, worst_G: float) -> bool:
    """Return whether a residual is small beside what an effect explains, in log-likelihood, and no channel is off by
    more than the tolerance: single bins of a sharp mode that the model has very nearly in its place."""
    return left < SMALL_BESIDE * gain and worst_G < AGREES


def matters_without_band(adequacy: Adequacy, G_before: float, table: Thresholds) -> bool:
    """Return whether a residual matters although it lies in no band: if it is clearly more than chance (a p just below
    the limit occurs for one right explanation in a thousand), or if the tolerance could hide what was there before."""
    weighs = adequacy.p < BEYOND_CHANCE * table.p_global or G_before < table.G
    return weighs and not adequacy.windows
