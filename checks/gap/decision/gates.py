"""The gates before a name ([GAP] 10), and the unidentified effects (step 12)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares

from checks import distributions as stats
from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit
from checks.gap.decision.result import Nameless
from checks.gap.modelling.augmented import Augmented, Values
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.modelling.unmodelled_modes import MODE, UnmodelledMode
from checks.gap.search.candidate import Candidate
from checks.gap.search.candidates import MANY, Search
from checks.gap.search.disagreement import left_by_cell
from checks.gap.search.forward import SearchResult
from checks.gap.search.refit import begin
from checks.gap.search.screen import screen
from checks.model.model import frequency_and_damping

LOOKED = 300  # places tried by a search, for the chance of a gain
AT_LEAST = 2  # channels of an effect that shows on several: on one alone it is any filter
BEYOND_CHANCE = 0.1  # of the chance at which a model counts as inadequate
POLE_STEPS = 30  # of the fit of a pole to what is left
TWO_SIDED = 1.96
EDGE = 1.05  # times an end of the band: as near, a pole is not told from a slope
MATTERS = 1.0  # mean energy of an effect on a channel, in units of chance, from which on it acts there


class HasResponse(Protocol):
    """A candidate or another fitted response."""

    @property
    def response(self) -> Augmented:
        """Return the fitted response."""


@dataclass(frozen=True)
class Claim:
    """An effect that a search wants to name. reasons: gates that it did not pass."""

    effect: Effect
    delta_lnL: float
    p: float
    reasons: tuple[str, ...]


def kept(made: Sequence[Claim]) -> tuple[Claim, ...]:
    """Return the claims that passed every gate."""
    return tuple(c for c in made if not c.reasons)


def claims(
    search: Search, found: SearchResult, final: Fit, full: Candidate, slow: Slow | None, left_out: Sequence[str] = ()
) -> tuple[Claim, ...]:
    """Judge every named effect of the best explanation by the gates. left_out: channels that no explanation covers."""
    out = []
    total = max(found.best.lnL - found.base.lnL, 1.0)
    for effect in found.best.response.effects:
        without = _without(search, found, effect)
        gain, confirmed = found.best.lnL - without.lnL, _confirmed(search, found, without)
        p = float(min(1.0, LOOKED * stats.chi2.sf(2.0 * max(gain, 0.0), max(1, len(effect.parameters)))))
        reasons = _reasons(search.table, effect, gain, total, confirmed, final, full, found.base)
        if slow is not None and (words := effect.slow.contradicts(slow, full.response.of(final.at, effect.name))):
            reasons.append(words)
        unseen = set(effect.channels) - set(search.A.channels) - set(left_out)
        if unseen and len(effect.channels) - len(unseen) < AT_LEAST:
            reasons.append(f"must show on {', '.join(sorted(unseen))}, which was not measured")
        if set(left_out) & set(effect.channels):
            reasons.append(f"must show on {', '.join(left_out)}, which nothing explains")
        out.append(Claim(effect, gain, p, tuple(reasons)))
    return tuple(_beside_refused(c, out, search.table) for c in out)


def _beside_refused(claim: Claim, every: Sequence[Claim], table: Thresholds) -> Claim:
    """Refuse a claim that depends on another effect on the same channels that has to be refused: a claim is valid only
    with its whole explanation."""
    for other in every:
        leans = set(other.effect.channels) & set(claim.effect.channels)
        if not claim.reasons and other.reasons and other.delta_lnL > table.delta_lnL and leans:
            return replace(claim, reasons=(f"stands beside {other.effect.name}, which could not be named",))
    return claim


def _reasons(
    table: Thresholds,
    effect: Effect,
    gain: float,
    total: float,
    confirmed: float,
    final: Fit,
    full: Candidate,
    base: Candidate,
) -> list[str]:
    out = []
    if not gain > table.delta_lnL:
        out.append(f"explains too little of unseen records (gain {gain:.0f})")
    if not confirmed > table.delta_lnL:
        out.append(f"is not confirmed with the records exchanged (gain {confirmed:.0f})")
    if not off_zero(table, effect, final, full):
        out.append("parameters not significant")
    names = [f"{effect.name}.{p.name}" for p in effect.parameters]
    bound = [n for n in names if n in final.at_bound]
    if bound:
        out.append(f"{bound[0]} is at its physical limit")
    alone = full.adequate and not full.response.stand_ins
    if not alone and gain < table.share * total:
        out.append(f"explains {100 * gain / total:.1f} % of the gap beside an unidentified effect")
    if any(_on_its_ground(effect, u) for u in full.response.stand_ins):
        out.append("explains the data only together with an unidentified effect")
    if lonely := acts_alone(effect, full.response, full.at, full.unseen):
        out.append(lonely)
    if on_a_mode(effect, full.response, final.at):
        out.append("lies on a mode of the strut, which looks the same when its coupling is not that of the model")
    if full.worst_G > table.G:
        out.append("leaves too much unexplained, beside which its evidence does not stand")
    elif not full.adequate and (_astray(full) or _disturbed(full, effect) or _spread_out(full, base)):
        out.append("leaves a residual where it acts")
    return out


def acting_on(effect: Effect, response: Augmented, at: Values, data: Dataset) -> tuple[str, ...]:
    """Return the channels in which an effect in a response changes a half octave by more than noise and tolerance."""
    less = response.without(effect.name)
    bare = {p.name: at.get(p.name, p.begin) for p in less.free()}
    change = response.frf(data.f, at, data.channels) - less.frf(data.f, bare, data.channels)
    most = left_by_cell(data, change).max(axis=0)
    return tuple(c for c, Q in zip(data.channels, most, strict=True) if Q > MATTERS)


def acts_alone(effect: Effect, response: Augmented, at: Values, data: Dataset) -> str:
    """Return why an effect that belongs to every channel but acts on only one gets no name: there any filter could do
    the same."""
    acting = acting_on(effect, response, at, data)
    if len(effect.channels) <= AT_LEAST or len(acting) != 1:
        return ""
    return f"acts on {acting[0]} alone, and would show on {', '.join(effect.channels)}"


def on_a_mode(effect: Effect, response: Augmented, at: Values) -> bool:
    """Return whether an effect that adds a mode has it within the half-widths of one of the strut's own. The modes of a
    lopsided APA are coupled in another way, which no factor on them explains: a small mode there does, but means
    nothing."""
    values = response.of(at, effect.name)
    if not {"f_Hz", "damping_ratio"} <= values.keys() or not any(p.linear for p in effect.parameters):
        return False
    f, ratio = frequency_and_damping(response.model.poles(response.changes(at)))
    mode, width = values["f_Hz"], values["f_Hz"] * values["damping_ratio"]
    return bool(np.any(np.abs(f - mode) < f * ratio + width))


def off_zero(table: Thresholds, effect: Effect, final: Fit, full: HasResponse) -> bool:
    """Return whether the fitted values lie as far from those of no effect as a significant gain requires."""
    off = effect.off(full.response.model)
    names = [p.name for p in effect.parameters if p.linear and np.isfinite(off[p.name])]
    if not names:
        return True
    at = [final.names.index(f"{effect.name}.{n}") for n in names]
    away = final.values[at] - np.array([off[n] for n in names])
    return bool(0.5 * away @ np.linalg.pinv(final.cov[np.ix_(at, at)], hermitian=True) @ away > table.delta_lnL)


def _on_its_ground(effect: Effect, u: UnmodelledMode) -> bool:
    """Return whether an unmodelled mode acts on the channels in which the effect must show: then the effect does not
    explain even its own channels. A mode of all channels is not a rival of an effect of some."""
    return set(u.channels) <= set(effect.channels)


def _without(search: Search, found: SearchResult, effect: Effect) -> Candidate:
    """Return the explanation without an effect, everything else fitted anew: its loss in log-likelihood of unseen
    records is the gain of the effect."""
    less = found.best.response.without(effect.name)
    known = [c for c in (found.base, *found.tried) if c.names == frozenset(less.names)]
    start = {k: v for k, v in found.best.at.items() if not k.startswith(f"{effect.name}.")}
    # The base was calibrated from several places; only the way from this explanation's values is new.
    again = search.led_to_its_end(less, start) if found.base in known else search.fitted(less, start)
    return max([*known, again], key=lambda c: c.lnL)


def _confirmed(search: Search, found: SearchResult, without: Candidate) -> float:
    """Return the same gain with the realisations exchanged: fitted to B, judged on A."""
    try:
        best = search.go_on(begin(found.best.response, search.B, found.best.at), MANY)
        less = search.go_on(begin(without.response, search.B, without.at), MANY)
    except ModelError:
        return -np.inf
    return _judged(best.response, best.at, search) - _judged(less.response, less.at, search)


def _judged(response: object, at: dict[str, float], search: Search) -> float:
    return Candidate(response, at, 0.0, search.A, search.table).lnL  # type: ignore[arg-type]


def _disturbed(full: Candidate, effect: Effect) -> bool:
    """Return whether a channel on which the effect acts holds a window that chance does not explain."""
    response, data = full.response, full.unseen
    without = response.without(effect.name)
    at = {p.name: full.at.get(p.name, p.begin) for p in without.free()}
    change = response.frf(data.f, full.at, data.channels) - without.frf(data.f, at, data.channels)
    energy = (np.abs(full.seen.by_bin(data.whitener(change))) ** 2 / 2.0).mean(axis=0)
    return any(energy[data.channels.index(w.channel)] > MATTERS for w in full.adequacy.windows)


def _spread_out(full: Candidate, base: Candidate) -> bool:
    """Return whether the residual that is left matters although it lies in no band: if it is clearly more than chance
    (a p just below the limit occurs for one right explanation in a thousand), or if the tolerance could hide what was
    there before."""
    weighs = full.adequacy.p < BEYOND_CHANCE * full.table.p_global or base.worst_G < full.table.G
    return weighs and not full.adequacy.windows


def _astray(full: Candidate) -> bool:
    """Return whether a calibrated value lies so far from its prior that the calibration explains what it should not."""
    free = [p for p in full.response.free() if np.isfinite(p.sd)]
    return any(abs(full.at[p.name] - p.prior) > full.table.pull * p.sd for p in free)


def nameless(
    best: Candidate, full: Candidate, final: Fit, made: Sequence[Claim], slow: Slow | None, table: Thresholds
) -> tuple[Nameless, ...]:
    """Return the unidentified effects: unmodelled modes of the best explanation, and, if it still does not fit, a mode
    fitted to the residual of the worst window of every channel."""
    out = []
    level = slow is not None and is_bent(slow, table)
    for u in best.response.stand_ins:
        poles, zeros = u.poles_and_zeros(full.response.of(full.at, u.name))
        f = full.unseen.f
        ends = tuple(final.interval(f"{u.name}.f_Hz") for _ in poles)
        edge = any(_at_edge(pole, *end, f) for pole, end in zip(poles, ends, strict=True))
        out.append(Nameless(u.channel, tuple(poles), tuple(zeros), level, _stand_in_words(u, full), ends, edge))
    seen = {n.channel for n in out}
    if not full.adequate:
        for w in full.adequacy.windows:
            if w.channel not in seen:
                seen.add(w.channel)
                out.append(from_window(full, w.channel, level))
    refused = [c for c in made if c.reasons]
    words = "; ".join(f"{c.effect.name} was not named: it {c.reasons[0]}" for c in refused)
    if refused and not out:
        out = [_refused(c, full, level) for c in refused]
    return tuple(replace(n, words="; ".join(w for w in (n.words, words) if w)) for n in out)


def is_bent(slow: Slow, table: Thresholds) -> bool:
    """Return whether the static curve between drive and displacement bends enough to be reported."""
    return abs(slow.bends.value) > max(table.bend, 6.0 * slow.bends.u)


def _refused(claim: Claim, full: Candidate, level: bool) -> Nameless:
    """Return a refused effect as an unidentified one: what it explains is missing all the same."""
    values = full.response.of(full.at, claim.effect.name)
    poles = (values["f_Hz"],) if "f_Hz" in values else ()
    acting = acting_on(claim.effect, full.response, full.at, full.unseen) or claim.effect.channels
    return Nameless(acting[0], poles, (), level)


def _stand_in_words(u: UnmodelledMode, full: Candidate) -> str:
    values = full.response.of(full.at, u.name)
    numbers = ", ".join(f"{k} {v:.4g}" for k, v in values.items())
    return f"{u.channel} times a {u.shape.name} ({numbers}) would explain it"


def from_window(full: Candidate, channel: str, level: bool) -> Nameless:
    """Return the pole, with its interval, and the zero of a mode that would explain most of a channel's residual."""
    mode, seen = UnmodelledMode(MODE, channel), full.seen
    start = {"ratio": 0.0, "damping_ratio": 0.01, **screen(seen, mode, starts=1).starts[0]}
    data, c = seen.data, seen.data.channels.index(channel)
    names = [p.name for p in mode.parameters]
    lo, hi = (np.array([getattr(p, end) for p in mode.parameters]) for end in ("lo", "hi"))
    s = np.asarray(2j * np.pi * data.f, dtype=np.complex128)

    def left(x: Array) -> Array:
        change = np.zeros_like(data.H)
        change[:, c] = seen.modelled[:, c] * (mode.factor(dict(zip(names, x, strict=True)), s) - 1.0)
        return np.asarray(seen.left - seen.rows(change))

    x = np.clip([start[n] for n in names], lo * (1 + 1e-9), hi * (1 - 1e-9))
    scale = np.array([p.scale for p in mode.parameters])
    found = least_squares(left, x, bounds=(lo, hi), x_scale=scale, max_nfev=POLE_STEPS)
    spread = max(1.0, 2.0 * found.cost / max(seen.left.size, 1))  # what the mode leaves counts as its noise
    sd = float(np.sqrt(max(np.linalg.pinv(found.jac.T @ found.jac, hermitian=True)[0, 0], 0.0) * spread))
    values = dict(zip(names, (float(v) for v in found.x), strict=True))
    poles, zeros = mode.poles_and_zeros(values)
    ends = (values["f_Hz"] - TWO_SIDED * sd, values["f_Hz"] + TWO_SIDED * sd)
    return Nameless(
        channel, tuple(poles), tuple(zeros), level, ci95=(ends,), at_edge=_at_edge(values["f_Hz"], *ends, data.f)
    )


def _at_edge(pole: float, lo: float, hi: float, f: Array) -> bool:
    """Return whether a pole, or its interval, reaches an end of the band."""
    return bool(min(pole, lo) < f[0] * EDGE or max(pole, hi) > f[-1] / EDGE)
