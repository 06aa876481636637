"""The gap workflow on arrays: calibrate, test, search, verify, name or say that there is no name (gap-method, 0 to
13)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from checks.gap import before as early_checks
from checks.gap.augmented import Augmented, Member
from checks.gap.before import Early
from checks.gap.effects import EFFECTS, Effect
from checks.gap.effects.effect import NOT_SEEN
from checks.gap.experiments import experiment
from checks.gap.limits import detection_limits
from checks.gap.naming import Claim, claims, from_window, is_bent, kept, nameless
from checks.gap.result import (
    AMBIGUOUS,
    EXPLAINED,
    NO_MISSING,
    PARTLY,
    UNEXPLAINED,
    Ambiguous,
    Gaps,
    ModeGap,
    Named,
    NamedValue,
    Nameless,
    Result,
    Tried,
)
from checks.gap.search import BEYOND_DOUBT, Candidate, Found, Search, explain
from checks.gap.slow import Slow, slow_record
from checks.gap.thresholds import THRESHOLDS, Thresholds
from checks.gap.unnamed import levels, stand_ins
from checks.model.dataset import Dataset
from checks.model.fit import Fit, fit
from checks.model.goodness import gaps, overall
from checks.model.model import Model
from checks.model.superelement import ModelError
from checks.record import Record

Say = Callable[[str], None]
BENT = 0.1  # of a cubic share at the largest sine: noise of a tenth of its power
ABOUT_MODE_HZ = 5.0
FIRST = 2  # effects that are looked for before a channel is left out
SECOND = {"full": "modal", "modal": "full"}


class GapRefused(ValueError):
    """Records or a model that the workflow must not work on; the text says why."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """A: to fit; B: to judge with, the same channels; fs [Hz] of the records; slow: slow sines, or None."""

    model: Model
    A: Dataset
    B: Dataset
    fs: float
    merge_Hz: float = 350.0
    slow: Record | None = None
    without: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()


def run(inputs: Inputs, say: Say, table: Thresholds = THRESHOLDS) -> Result:
    """The whole workflow. Raises GapRefused, ModelError."""
    same_unit(inputs.A, inputs.B)
    early, A, B = _before(inputs)
    slow = None if inputs.slow is None else slow_record(inputs.slow)
    loops = _hysteresis(slow, inputs, table)
    library = _library(inputs, A.channels)
    search = Search(A.thinned(table.search_bins), B.thinned(table.search_bins), library, table, say)
    say("calibrating the model")
    base = _calibrated(search, inputs, loops, slow)
    whole = _on_all_bins(base, B)
    found = Found(base, base, (), ()) if whole.adequate else explain(search, base, FIRST, table.beam)
    if whole.adequate:
        return _answer(inputs, search, found, whole, A, B, early, loops, slow)
    if not found.best.adequate and found.best.worst_G < table.G:  # nearly: chance alone says that it is not all
        found = _deeper(search, found)
    if not found.best.adequate:
        part = _without_a_channel(inputs, search, A, B, loops, slow)
        if part is not None:
            return _answer(inputs, *part, whole, A, B, early, loops, slow)
        found = _deeper(search, found)
    return _answer(inputs, search, found, whole, A, B, early, loops, slow)


def _deeper(search: Search, found: Found) -> Found:
    """More effects beside the best so far, as many as one unit may have."""
    room = search.table.most_effects - len(found.best.response.counted)
    if room <= 0:
        return found
    deeper = explain(search, found.best, room, 1)
    if not deeper.best.response.counted:
        return deeper
    return Found(found.base, deeper.best, deeper.rivals, (*found.tried, *deeper.tried))


def _without_a_channel(
    inputs: Inputs, search: Search, A: Dataset, B: Dataset, loops: bool, slow: Slow | None
) -> tuple[Search, Found] | None:
    """What the other channels say when one is left out: something without a name on one channel leads the calibration
    astray and hides what the others could name. None where they are not explained either."""
    if len(A.channels) < 3:
        return None
    search.say("looking at the channels two by two")
    pairs = [tuple(c for c in A.channels if c != left_out) for left_out in A.channels]
    bins = search.table.search_bins
    parts = [replace(search, A=A.select(p).thinned(bins), B=B.select(p).thinned(bins)) for p in pairs]
    bases = [_calibrated(part, inputs, loops, slow) for part in parts]
    base, part = min(zip(bases, parts, strict=True), key=lambda each: each[0].cost)
    part = replace(part, library=_library(inputs, part.A.channels))
    found = Found(base, base, (), ()) if base.adequate else explain(part, base, FIRST, part.table.beam)
    return (part, found) if found.best.adequate else None


def same_unit(A: Dataset, B: Dataset) -> None:
    """Raises GapRefused where the two realisations differ by more than noise and tolerance: not the same thing
    twice."""
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
    found: list[Early] = []
    pair = early_checks.exchanged(A, model)
    if pair is not None:
        found.append(Early("swapped_channels", pair, {}, f"{pair[0]} and {pair[1]} are exchanged."))
        A, B = (early_checks.with_names(d, pair) for d in (A, B))
    turned = early_checks.turned(A, model)
    for channel in turned:
        name = "sensor_polarity" if channel == "Vs" else f"polarity_{channel}"
        if name not in inputs.without:
            words = EFFECTS[name].sentence if name in EFFECTS else f"{channel} has the wrong sign."
            found.append(Early(name, (channel,), {}, words))
            A, B = (early_checks.with_signs(d, (channel,)) for d in (A, B))
    late = early_checks.offsets(A, model, inputs.fs)
    for channel, n in late.items():
        found.append(Early("sample_offset", (channel,), {"samples": float(n)}, f"{channel} comes {n} samples late."))
    if late:
        A, B = (early_checks.with_offsets(d, late, inputs.fs) for d in (A, B))
    return tuple(found), A, B


def _library(inputs: Inputs, channels: tuple[str, ...]) -> tuple[Member, ...]:
    named = [e for e in EFFECTS.values() if e.name not in inputs.without and e.fits(inputs.model)]
    seen = [e for e in named if set(e.channels) & set(channels)]
    return (*seen, *stand_ins(channels))


def _hysteresis(slow: Slow | None, inputs: Inputs, table: Thresholds) -> bool:
    """Whether the slow loops open with the amplitude, beyond what is worth a name."""
    if slow is None or "hysteresis" in inputs.without:
        return False
    grows = slow.grows
    return grows.value > table.loop_width and grows.value > 6.0 * grows.u


def _calibrated(search: Search, inputs: Inputs, loops: bool, slow: Slow | None) -> Candidate:
    """The base model fitted to A, with the form of damping that the data ask for."""
    members: tuple[Member, ...] = ()
    width = _level_dependence(slow, loops, search.table)
    if width:
        members = (levels(inputs.merge_Hz, width),)
    own = search.fitted(Augmented(inputs.model, members), {})
    try:
        other = search.fitted(Augmented(_other_damping(inputs.model), members), own.at)
    except ModelError:
        return own
    return other if other.cost < own.cost - BEYOND_DOUBT else own


def _level_dependence(slow: Slow | None, loops: bool, table: Thresholds) -> float:
    """By how much two levels of drive may differ, as the slow sines show: loops that open, a curve that bends."""
    if slow is None:
        return 0.0
    bends = BENT * abs(slow.bends.value) if is_bent(slow, table) else 0.0
    return max(slow.grows.value if loops else 0.0, bends)


def _other_damping(model: Model) -> Model:
    return replace(model, damping=SECOND[model.damping])


def _on_all_bins(c: Candidate, B: Dataset) -> Candidate:
    return replace(c, unseen=B)


def _answer(
    inputs: Inputs,
    search: Search,
    found: Found,
    whole: Candidate,
    A: Dataset,
    B: Dataset,
    early: tuple[Early, ...],
    loops: bool,
    slow: Slow | None,
) -> Result:
    table, base, best = search.table, found.base, found.best
    search.say("fitting all bins")
    told = search.A.channels
    left_out = [c for c in A.channels if c not in told]
    final = fit(best.response, A.select(told), best.response.free(best.at))
    full = Candidate(best.response, final.at, final.cost, B.select(told), table)
    made = claims(search, found, final, full, slow, left_out) if best is not base else ()
    good = kept(made)
    named = _named(good, final, early, loops, slow)
    rivals = _ambiguous(found, good, table)
    named = tuple(n for n in named if not any(n.effect in a.effects for a in rivals))
    missing = nameless(best, full, made, slow, table) if not (whole.adequate and best is base) else ()
    everything = replace(full, unseen=B)
    missing = (*missing, *(from_window(everything, c, False) for c in left_out), *_bent(slow, table))
    after = _named_only(everything, good)
    verdict = _verdict(full.adequate, named, rivals, missing)
    limits = {}
    if verdict == NO_MISSING:
        search.say("detection limits")
        effects = [e for e in EFFECTS.values() if e.name not in inputs.without]
        limits = detection_limits(base.seen, effects, slow, table)
    return Result(
        model=inputs.model.name,
        verdict=verdict,
        gap_before=_gaps(whole),
        gap_after=_gaps(after),
        where=whole.adequacy.windows,
        named=named,
        ambiguous=rivals,
        unnamed=missing,
        detection_limits=limits,
        tried=_tried(found),
        before=whole.seen,
        after=after.seen,
        fit=final,
        p_before=whole.adequacy.p,
        p_after=everything.adequacy.p,
        early=early,
        slow=slow,
        notes=(*inputs.notes, *_notes(full)),
        damping=best.response.model.damping,
    )


def _named(
    good: Sequence[Claim], final: Fit, early: tuple[Early, ...], loops: bool, slow: Slow | None
) -> tuple[Named, ...]:
    out = [Named(e.effect, e.effect.replace("_", " "), e.words, _exact(e), float("inf"), 0.0) for e in early]
    for claim in good:
        effect = claim.effect
        values = {p.name: final.at[f"{effect.name}.{p.name}"] for p in effect.parameters}
        shown = {k: NamedValue(v, *final.interval(f"{effect.name}.{k}")) for k, v in values.items()}
        out.append(Named(effect.name, effect.title, effect.say(values), shown, claim.delta_lnL, claim.p))
    if loops and slow is not None:
        out.append(_loops_named(slow))
    return tuple(out)


def _exact(e: Early) -> dict[str, NamedValue]:
    return {k: NamedValue(v, v, v) for k, v in e.parameters.items()}


def _loops_named(slow: Slow) -> Named:
    effect = EFFECTS["hysteresis"]
    g = slow.grows
    half = 1.96 * float(np.hypot(g.u, 0.01 * g.value))
    z = g.value / g.u
    value = {"relative_width": NamedValue(g.value, g.value - half, g.value + half)}
    words = effect.say({"relative_width": g.value})
    return Named(effect.name, effect.title, words, value, 0.5 * z * z, float(2.0 * stats.norm.sf(z)))


def _ambiguous(found: Found, good: Sequence[Claim], table: Thresholds) -> tuple[Ambiguous, ...]:
    """Other adequate explanations by name that unseen records do not tell from the best."""
    names = found.best.names
    out = []
    for claim in good:
        alike = {claim.effect.name}
        for rival in found.rivals:
            swapped = rival.names - names
            if rival.response.stand_ins or names - rival.names != {claim.effect.name} or len(swapped) != 1:
                continue
            if 2.0 * (found.best.lnL - rival.lnL) < table.two_delta_lnL:
                alike |= swapped
        if len(alike) > 1:
            out.append(Ambiguous(tuple(sorted(alike)), experiment(sorted(alike))))
    return tuple(out)


def _bent(slow: Slow | None, table: Thresholds) -> tuple[Nameless, ...]:
    """A static curve between drive and displacement: none of the library."""
    if slow is None or not is_bent(slow, table):
        return ()
    words = f"under slow sines de bends: the cubic part of the curve is {slow.bends.value:.3f} of the straight one"
    return (Nameless("de", (), (), True, words),)


def _named_only(full: Candidate, good: Sequence[Claim]) -> Candidate:
    """The model as it will be written: without stand-ins and without what was not named, at the values of the joint
    fit."""
    names = {c.effect.name for c in good}
    response = full.response
    for m in response.members:
        counts = not (hasattr(m, "counts") and not m.counts)
        if m.name not in names and counts:
            response = response.without(m.name)
    inside = {p.name for p in response.free()}
    at = {k: v for k, v in full.at.items() if k in inside}
    for p in response.free():
        at.setdefault(p.name, p.begin)
    return replace(full, response=response, at=at)


def _verdict(adequate: bool, named: Sequence[Named], rivals: Sequence[Ambiguous], missing: Sequence[Nameless]) -> str:
    if adequate and not missing:
        if rivals:
            return AMBIGUOUS
        return EXPLAINED if named else NO_MISSING
    return PARTLY if named or rivals else UNEXPLAINED


def _gaps(c: Candidate) -> Gaps:
    data, model = c.unseen, c.response.frf(c.unseen.f, c.at, c.unseen.channels)
    data = data.around(model)
    residual = data.H - model
    found = gaps([data], [residual])
    about = []
    for f0 in _modes(c, data):
        near = np.abs(data.f - f0) <= ABOUT_MODE_HZ
        if near.any():
            G = overall(gaps([data.at(near)], [residual[near]])).G
            about.append(ModeGap(f0, G))
    return Gaps(overall(found).G, found, tuple(about))


def _modes(c: Candidate, data: Dataset) -> list[float]:
    """Frequencies [Hz] of the model's modes within the data."""
    poles = np.abs(c.response.model.poles(c.response.changes(c.at))) / (2.0 * np.pi)
    return [float(f) for f in poles if data.f[0] <= f <= data.f[-1]]


def _tried(found: Found) -> tuple[Tried, ...]:
    ranked = sorted(found.tried, key=lambda c: -c.lnL)
    return tuple(Tried(c.response.names, c.lnL - found.base.lnL, c.adequacy.p) for c in ranked[:12])


def _notes(full: Candidate) -> tuple[str, ...]:
    free = {p.name: p for p in full.response.free()}
    far = {n: (full.at[n] - p.prior) / p.sd for n, p in free.items() if np.isfinite(p.sd) and n in full.at}
    out = {n: z for n, z in far.items() if abs(z) > full.table.pull and not n.startswith("unnamed")}
    if len(out) < 2:
        return ()
    worst = ", ".join(f"{n} by {z:+.0f}" for n, z in sorted(out.items(), key=lambda kv: -abs(kv[1]))[:3])
    return (f"calibrated values lie far off what the model file expects ({worst} sd): another model, or another unit?",)


__all__ = ["NOT_SEEN", "Effect", "GapRefused", "Inputs", "run"]
