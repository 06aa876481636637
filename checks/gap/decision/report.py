"""The answer put together: the last fit on all bins, gates, verdict, and the gap before and after."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from checks.arrays import Complex
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Led, finish
from checks.gap.conditions.joint import Conditions
from checks.gap.decision.beside_gates import claims_beside, gain_p
from checks.gap.decision.detection_limits import detection_limits
from checks.gap.decision.gates import Claim, claims, from_window, is_bent, kept, nameless
from checks.gap.decision.held_by_experiments import missing_in, tested
from checks.gap.decision.never_worse import gaps_of, never_worse
from checks.gap.decision.next_experiment import asked
from checks.gap.decision.result import EXPLAINED, NO_MISSING, Ambiguous, Gaps, Named, Result, StepShown, Tried
from checks.gap.decision.told_apart import settled
from checks.gap.decision.verdict import bent, imitated, named_effects, not_told_apart, word
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented
from checks.gap.preparation.inputs import Prepared, raw, trials_of
from checks.gap.search.candidate import Candidate
from checks.gap.search.candidates import Search
from checks.gap.search.disagreement import with_disagreement
from checks.gap.search.forward import SearchResult
from checks.gap.statistics.adequacy import judge
from checks.gap.statistics.projected_residual import Projected, at_known
from specs.labels import model_label

RIVALS = 3  # in the place of an effect, that are shown


def answer(p: Prepared, search: Search, found: SearchResult, whole: Candidate) -> Result:
    """Return the result of the whole analysis. found: by the search, on the search's channels; whole: the base model
    judged on all bins of all channels."""
    table, base, best, slow = p.table, found.base, found.best, p.slow
    search.say("fitting all bins")
    told = search.A.channels
    left_out = [c for c in p.A.channels if c not in told]
    free, joint = tuple(best.response.free(best.at)), best.response.model.joint
    A = p.A.select(told)
    if found.steps:
        A = with_disagreement(A, _left(replace(best, unseen=A)))
    final = finish(best.response, A, Led(free, best.cost), joint=joint)
    full = Candidate(best.response, final.at, final.cost, p.B.select(told), table)
    made: tuple[Claim, ...] = ()
    alike: tuple[Ambiguous, ...] = ()
    if found.steps:
        made, alike = claims_beside(search, found.steps, final, slow)
    elif best is not base:
        made = claims(search, found, final, full, slow, left_out)
    everything = replace(full, unseen=p.B)
    shown = never_worse([whole, *_at_other_values(base, full, p.B)], everything, made)
    made = shown.made
    good = kept(made)
    alike = tuple(a for a in alike if any(c.effect.name in a.effects for c in good))
    at_sizes = replace(full, unseen=with_disagreement(full.unseen, _left(full))) if found.steps else full
    rivals = (*not_told_apart(found, good, table), *alike, *imitated(at_sizes, good))
    trials = trials_of(p, told)
    words: tuple[str, ...] = ()
    if rivals and trials and not found.steps:
        done = settled(found, full, made, rivals, Conditions(p.A.select(told), p.B.select(told), trials), table)
        final, full, made, rivals, words = done.fit, done.full, done.made, done.rivals, done.words
        everything = replace(full, unseen=p.B)
        shown = never_worse([whole, *_at_other_values(base, full, p.B)], everything, made)
        good = kept(shown.made)
    rivals = rivals if found.steps else asked(rivals, good, found, full, search.A)
    named = named_effects(good, final, p.early, p.in_slow)
    named = tuple(n for n in named if not any(n.effect in a.effects for a in rivals))
    missing = nameless(best, full, final, made, slow, table) if not (whole.adequate and best is base) else ()
    missing = (*missing, *(from_window(everything, c, False) for c in left_out), *bent(slow, table))
    experiments = tested(full.response, final, p.A.select(told), p.B.select(told), trials)
    missing = (*missing, *missing_in(experiments, bool(p.in_slow) or (slow is not None and is_bent(slow, table))))
    before = _without_members(base, full, p.B) if best.response.counted and full.adequate else whole.seen
    verdict = word(full.adequate, named, rivals, missing)
    gap_before = gaps_of(replace(shown.before, unseen=raw(p)) if p.early else shown.before)
    said = (*words, *_notes(full, verdict), *_agrees_before(base, named, gap_before), *_ended(search, verdict))
    return Result(
        model=p.inputs.model.name,
        verdict=verdict,
        gap_before=gap_before,
        gap_after=gaps_of(shown.after),
        where=judge(before, table.p_global).windows,
        named=named,
        ambiguous=rivals,
        unnamed=missing,
        detection_limits=_limits(p, search, base) if verdict == NO_MISSING else {},
        tried=_tried(found, made),
        before=before,
        after=shown.after.seen,
        fit=final,
        p_before=whole.adequacy.p,
        p_after=everything.adequacy.p,
        early=p.early,
        slow=slow,
        notes=(*p.inputs.notes, *said),
        damping=best.response.model.damping,
        experiments=experiments,
        steps=steps_of(shown.after),
    )


def _without_members(base: Candidate, full: Candidate, B: Dataset) -> Projected:
    """Return the residual without the found effects, with the calibration of the whole explanation: a calibration
    without them has followed what it cannot explain, and shows it everywhere."""
    return at_known(base.response, B, _values(base.response, full))


def _at_other_values(base: Candidate, full: Candidate, B: Dataset) -> list[Candidate]:
    """Return the base model as it was given, and with the calibration (and the damping) of the whole explanation."""
    begin = {q.name: q.begin for q in base.response.free()}
    model = full.response.model
    bare = replace(base.response, model=model)
    return [
        replace(base, at=begin, unseen=B),
        replace(base, at=_values(base.response, full), unseen=B),
        replace(base, response=bare, at=_values(bare, full), unseen=B),
    ]


def _values(response: Augmented, full: Candidate) -> dict[str, float]:
    """Return the free parameters of a response, at the values of the whole explanation."""
    return {q.name: full.at.get(q.name, q.begin) for q in response.free()}


def _limits(p: Prepared, search: Search, base: Candidate) -> dict[str, dict[str, float]]:
    search.say("detection limits")
    effects = [e for e in EFFECTS.values() if e.name not in p.inputs.without]
    return detection_limits(base.seen, effects, p.slow, p.table)


def _tried(found: SearchResult, made: Sequence[Claim]) -> tuple[Tried, ...]:
    """Return the refused claims, each with the reason; the effects that came near in the place of an effect that was
    found beside a disagreement; and the best of what was tried."""
    base = found.base
    refused = [Tried((c.effect.name,), c.delta_lnL, c.p, "; ".join(c.reasons)) for c in made if c.reasons]
    near = [
        Tried((m.label,), b.lnL - step.before.lnL, gain_p(b.lnL - step.before.lnL, m), f"in the place of {name}")
        for step in found.steps
        for name in [step.member.name]
        for m, b in step.rivals[:RIVALS]
    ]
    ranked = sorted(found.tried, key=lambda c: -c.lnL)
    every = (Tried(c.response.labels, c.lnL - base.lnL, c.adequacy.p) for c in ranked[:12])
    return (*refused, *every, *near)


def _left(c: Candidate) -> Complex:
    """Return the residual (F, C) of a candidate on the records that it is judged by."""
    return c.unseen.H - c.response.frf(c.unseen.f, c.at, c.unseen.channels)


def steps_of(after: Candidate) -> tuple[StepShown, ...]:
    """Return the named effects in order of what each explains, at the values of the joint fit, with G by channel after
    each; first the model without any."""
    rest, response, out = list(after.response.effects), after.response, []
    for effect in rest:
        response = response.without(effect.name)
    if rest:
        out.append(StepShown(None, _channel_G(replace(after, response=response))))
    while rest:
        tried = [(e, _channel_G(replace(after, response=response.with_member(e)))) for e in rest]
        effect, channels = min(tried, key=lambda each: sum(np.log(max(G, 1.0)) for G in each[1].values()))
        response = response.with_member(effect)
        rest.remove(effect)
        out.append(StepShown(effect.name, channels))
    return tuple(out)


def _channel_G(c: Candidate) -> dict[str, float]:
    at = {q.name: c.at.get(q.name, q.begin) for q in c.response.free()}
    return {channel: gap.G for channel, gap in gaps_of(replace(c, at=at)).channels.items()}


def _ended(search: Search, verdict: str) -> tuple[str, ...]:
    """Return a note on a search that reached its bound before it explained everything."""
    if not search.over or verdict in (NO_MISSING, EXPLAINED):
        return ()
    return ("the search ended at its bound of work; what it had not tried may explain more",)


def _notes(full: Candidate, verdict: str) -> tuple[str, ...]:
    """Return the values that are far off, though each channel may agree; a single one only if it may be the reason why
    nothing fits."""
    out = _far(full)
    if len(out) < (2 if verdict in (NO_MISSING, EXPLAINED) else 1):
        return ()
    one_or_more = "calibrated values are" if len(out) > 1 else "a calibrated value is"
    return (f"{one_or_more} far from the model file ({_worst(out)}): another model, or another unit?",)


def _agrees_before(base: Candidate, named: Sequence[Named], before: Gaps) -> tuple[str, ...]:
    """Return why an effect is named although every channel agrees without it."""
    if not named or any(gap.G > 1.0 for gap in before.channels.values()):
        return ()
    out = _far(base)
    why = f"but only with values far from its file ({_worst(out)})" if out else "but for what lies in single bands"
    return (f"without what is named the model agrees as well, {why}",)


def _far(c: Candidate) -> dict[str, float]:
    """Return the calibrated values of the model far from its file, in standard deviations of it."""
    free = {p.name: p for p in c.response.free()}
    far = {n: (c.at[n] - p.prior) / p.sd for n, p in free.items() if np.isfinite(p.sd) and n in c.at}
    return {n: z for n, z in far.items() if abs(z) > c.table.pull and n in c.response.model.values}


def _worst(far: Mapping[str, float]) -> str:
    ranked = sorted(far.items(), key=lambda kv: -abs(kv[1]))[:3]
    return ", ".join(f"{model_label(n)} by {z:+.0f} sd" for n, z in ranked)
