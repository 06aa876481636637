"""The result put together: the last fit on all bins, gates, names with their numbers, the gap before and after, and the
one word ([GAP] 10 to 12)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from checks.fitting.agreement import contradiction
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit, FitPoint, finish
from checks.gap.conditions.trial import Conditions
from checks.gap.decision.alternatives import Unnamed
from checks.gap.decision.detection_limits import detection_limits, spring_limits
from checks.gap.decision.elements import found_elements
from checks.gap.decision.evidence import chance_of_gain
from checks.gap.decision.experiments import (
    FinalExplanation,
    check_by_experiments,
    disagreements,
    resolve_by_experiments,
)
from checks.gap.decision.gates import Claim, accepted, judge_claims
from checks.gap.decision.never_worse import gaps_of, withdraw_harmful
from checks.gap.decision.next_experiment import choose_experiments
from checks.gap.decision.result import (
    AMBIGUOUS,
    EXPLAINED,
    NO_MISSING,
    PARTLY,
    UNEXPLAINED,
    Ambiguous,
    FoundElement,
    Gaps,
    Named,
    NamedValue,
    Nameless,
    Result,
    StepShown,
    Tested,
    Tried,
)
from checks.gap.decision.rivals import BESIDES, RULES, indistinguishable, lags_of_bench, rivals_by
from checks.gap.decision.unidentified import all_channels_agree, beyond_parts, static_bend, unidentified_effects
from checks.gap.effects import EFFECTS
from checks.gap.modelling.effect import Effect, SlowFinding
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.preparation.inputs import Problem
from checks.gap.preparation.record_faults import RecordFault
from checks.gap.search.candidates import Search
from checks.gap.search.explanation import Explanation
from checks.gap.search.forward import SearchResult
from checks.gap.statistics.disagreement import with_disagreement
from checks.gap.statistics.projected_residual import Projected, at_known, judge
from checks.model.channel_paths import LATENCIES
from checks.model.model import Model
from checks.quantity import TWO_SIDED_95
from specs.units import model_label

RIVALS = 3  # in the place of an effect, that are shown


def build_result(problem: Problem, search: Search, result: SearchResult, whole: Explanation) -> Result:
    """Return the result of the whole analysis. result: of the search; whole: the base model judged on all bins."""
    table, base, slow = problem.table, result.base, problem.slow
    search.say("fitting all bins")
    result, judged = _judge_needed(problem, search, result)
    decision, shown_before, after, experiments = _decide(problem, result, whole, judged)
    full, good = decision.full, accepted(decision.claims)
    rivals = decision.rivals if result.best.beside else choose_experiments(decision, search.A, problem.inputs.trials)
    named = named_effects(good, decision.fit, problem.early, problem.in_slow, full.response.model)
    rivals = (*rivals, *rivals_by(BESIDES, full, good))
    named = tuple(n for n in named if not any(n.effect in a.effects for a in rivals))
    rivals = tuple(dict.fromkeys((*rivals, *lags_of_bench(full))))
    elements = elements_of(problem, replace(decision, rivals=rivals))
    proposed = _predicted(rivals)
    rivals = tuple(a for a in rivals if any(n in EFFECTS for n in a.effects) or a.or_bench)
    as_given = whole.adequate and result.best is base
    missing = () if as_given else unidentified_effects(full, decision.fit, decision.claims, slow, table)
    if all_channels_agree(whole) and not (named or elements):
        fit = decision.fit if result.best is base else fit_all_bins(problem, whole)[0]
        missing = beyond_parts(whole, fit) or missing
    missing += static_bend(slow, table)
    missing += disagreements(experiments, problem.depends_on_level)
    verdict = verdict_of(full.adequate, (*named, *elements), rivals, missing)
    before = _left_before(whole, result, full, problem.B)
    gap_before = gaps_of(shown_before.on(problem.measured_B) if problem.early else shown_before)
    limits: dict[str, dict[str, float]] = {}
    springs: dict[str, float] = {}
    if verdict == NO_MISSING:
        search.say("detection limits")
        limits = detection_limits(base.seen, problem.effects, slow, table)
        springs = spring_limits(base.seen, table)
    return Result(
        model=problem.inputs.model.name,
        verdict=verdict,
        gap_before=gap_before,
        gap_after=gaps_of(after),
        where=judge(before, table.p_global).windows,
        named=named,
        ambiguous=rivals,
        unnamed=missing,
        detection_limits=limits,
        tried=_tried(result, decision.claims, search.failures),
        before=before,
        after=after.seen,
        fit=decision.fit,
        p_before=whole.adequacy.p,
        p_after=full.adequacy.p,
        early=problem.early,
        slow=slow,
        notes=(
            *problem.inputs.notes,
            *decision.notes,
            *proposed,
            *_notes(full, verdict),
            *_agrees_before(base, named, gap_before),
            *_ended(search, verdict),
            *_lags_of_bench(full),
            *_springs_seen(springs),
        ),
        damping=result.best.response.model.damping,
        experiments=experiments,
        steps=steps_of(after),
        elements=elements,
        bench_latency=(latency := _latency_of_bench(after)),
        written_G=_as_written(after, latency).channel_G,
    )


def _judge_needed(problem: Problem, search: Search, result: SearchResult) -> tuple[SearchResult, FinalExplanation]:
    """Return the result of a search and its judgement, both without effects that are too weak for a name."""
    judged = _judge(problem, search, result)
    weak = frozenset() if result.best.beside else _too_weak(judged.claims, problem.table)
    if not weak:
        return result, judged
    reduced = _without(search, result, weak)
    alone = _judge(problem, search, reduced)
    # with no name without it, the names stand with it only, and it stays without one
    return (reduced, alone) if accepted(alone.claims) else (result, judged)


def _too_weak(claims: Sequence[Claim], table: Thresholds) -> frozenset[str]:
    """Return the refused effects whose own evidence is less than a name needs, if others beside them passed."""
    refused = [c for c in claims if c.reasons]
    weak = [c.effect.name for c in refused if c.delta_lnL <= table.delta_lnL]
    return frozenset(weak if len(weak) == len(refused) < len(claims) else ())


def _without(search: Search, result: SearchResult, weak: frozenset[str]) -> SearchResult:
    """Return the result without effects that are too weak for a name, fitted again: at the values of a fit with them
    the others would look wrong. Its rivals are all that were tried with one other effect."""
    less = result.best.without(*weak)
    best = search.refit(less.response, less.at)
    rivals = [c for c in result.tried if len(c.names) == len(best.names) and len(c.names - best.names) == 1]
    return replace(result, best=best, rivals=tuple(rivals))


def _decide(
    problem: Problem, result: SearchResult, whole: Explanation, judged: FinalExplanation
) -> tuple[FinalExplanation, Explanation, Explanation, tuple[Tested, ...]]:
    """Return the explanation of all bins that passed the gates, with its rivals, told apart by experiments if there
    were any; the models with the gaps before and after; and the experiments, which leave no name of an explanation that
    one of them refutes."""
    A, B, trials = problem.A, problem.B, problem.trials
    decision, before, after = _withdraw(judged, whole, result.base)
    decision = _with_rivals(decision, result)
    if decision.rivals and trials and not result.best.beside:
        decision = resolve_by_experiments(decision, result, Conditions(A, B, trials))
        decision, before, after = _withdraw(decision, whole, result.base)
    tested = check_by_experiments(decision.full.response, decision.fit, A, B, trials)
    against = [t for t in tested if t.refutes]
    if against and accepted(decision.claims) and contradiction(judged.full.response, judged.fit, B) is None:
        decision, before, after = _withdraw(decision.refuted_by(against[0]), whole, result.base)
    return decision, before, after, tested


def _left_before(whole: Explanation, result: SearchResult, full: Explanation, B: Dataset) -> Projected:
    """Return what the base model leaves of B: at the values of the whole explanation if that explains all by effects. A
    calibration without the effects has followed what it cannot explain, and shows it everywhere."""
    if not (result.best.response.counted and full.adequate):
        return whole.seen
    return at_known(result.base.response, B, result.base.response.own_values(full.at))


def _judge(problem: Problem, search: Search, result: SearchResult) -> FinalExplanation:
    """Return the explanation fitted to all bins, with its claims judged by the gates."""
    best = result.best
    fit, full = fit_all_bins(problem, best, beside=best.beside)
    claims, rivals = judge_claims(search, result, fit, full, problem.slow)
    if accepted(claims) and not (best.beside or full.adequate):  # intervals have to hold beside what is left
        fit, full = fit_all_bins(problem, full, beside=True)
    return FinalExplanation(fit, full, claims, rivals)


def fit_all_bins(problem: Problem, c: Explanation, *, beside: bool = False) -> tuple[Fit, Explanation]:
    """Return the fit of a candidate's response to all bins of A from its values, and the candidate at its end. beside:
    with the disagreement that the candidate leaves in the covariance."""
    A, response = problem.A, c.response
    if beside:
        A = with_disagreement(A, c.on(A).residual)
    start = FitPoint(tuple(response.free(c.at)), c.cost)
    fit = finish(response, A, start, joint=response.model.joint)
    return fit, Explanation(response, fit.at, fit.cost, problem.B, problem.table)


def elements_of(problem: Problem, decision: FinalExplanation) -> tuple[FoundElement, ...]:
    """Return the elements of a decision in words, each with all that does as well."""
    classes = [decision.alternatives(c) for c in accepted(decision.claims)]
    return found_elements(classes, decision.fit, lambda c: fit_all_bins(problem, c)[0])


def _withdraw(
    decision: FinalExplanation, whole: Explanation, base: Explanation
) -> tuple[FinalExplanation, Explanation, Explanation]:
    """Withdraw the names that widen a channel's gap, and return the models with the gaps before and after. Before is
    the base model as it was calibrated, as it was given, or with the calibration (and the damping) of the whole
    explanation."""
    full, given = decision.full, base.response
    bare = replace(given, model=full.response.model)
    at_values = [(given, given.own_values({})), *((r, r.own_values(full.at)) for r in (given, bare))]
    without = [whole, *(replace(whole, response=r, at=at) for r, at in at_values)]
    claims, before, after = withdraw_harmful(without, full, decision.claims)
    return replace(decision, claims=claims), before, after


def _with_rivals(decision: FinalExplanation, result: SearchResult) -> FinalExplanation:
    """Return the decision with all that its responses cannot distinguish from the names that passed."""
    full, good = decision.full, accepted(decision.claims)
    beside = tuple(a for a in decision.rivals if any(c.effect.name in a.effects for c in good))
    if result.best.beside:
        full = full.on(with_disagreement(full.unseen, full.residual))
    rivals = (*indistinguishable(result, good, full.table), *beside, *rivals_by(RULES, full, good))
    return replace(decision, rivals=rivals, fitted=result.rivals)


def _tried(result: SearchResult, claims: Sequence[Claim], failures: Mapping[str, str]) -> tuple[Tried, ...]:
    """Return the refused claims, each with the reason; the effects that came near in the place of an effect that was
    found beside a disagreement; the best of what was tried; and what could not be evaluated."""
    base = result.base
    refused = [Tried((c.effect.name,), c.delta_lnL, c.p, "; ".join(c.reasons)) for c in claims if c.reasons]
    steps = result.steps if result.best.beside else ()
    others = ((r.added, r.lnL - s.before.lnL, s.member.name) for s in steps for r in s.rivals[:RIVALS])
    near = [Tried((m.label,), gain, chance_of_gain(gain, m), f"in the place of {name}") for m, gain, name in others]
    ranked = sorted(result.tried, key=lambda c: -c.lnL)
    every = (Tried(c.response.labels, c.lnL - base.lnL, c.adequacy.p) for c in ranked[:12])
    failed = (Tried((name,), np.nan, np.nan, f"could not be evaluated: {why}") for name, why in failures.items())
    return (*refused, *every, *near, *failed)


def steps_of(after: Explanation) -> tuple[StepShown, ...]:
    """Return the named effects in order of what each explains, at the values of the joint fit, with G by channel after
    each; first the model without any."""
    rest = {e.name for e in after.response.effects}
    out = [StepShown(None, after.without(*rest).channel_G)] if rest else []
    while rest:
        tried = {n: after.without(*(rest - {n})).channel_G for n in after.response.names if n in rest}
        name = min(tried, key=lambda n: sum(np.log(max(G, 1.0)) for G in tried[n].values()))
        rest.remove(name)
        out.append(StepShown(name, tried[name]))
    return tuple(out)


def _springs_seen(springs: Mapping[str, float]) -> tuple[str, ...]:
    """Return a note on the smallest elements that would have been seen."""
    words = " and ".join(f"{k:.2g} N/um at the {place.replace('_', ' ')}" for place, k in springs.items())
    return (f"a spring to ground, along z, would have been seen from {words}",) if words else ()


def _predicted(rivals: Sequence[Ambiguous]) -> tuple[str, ...]:
    """Return a note on what the experiments that are asked for are predicted to separate."""
    each = ((", ".join(a.effects).replace("_", " "), a.separation) for a in rivals if a.separation is not None)
    words = "by the experiment the nearest two of {} are predicted to differ by {:.1f} standard deviations"
    return tuple(words.format(*one) for one in each)


def _ended(search: Search, verdict: str) -> tuple[str, ...]:
    """Return a note on a search that reached its bound before it explained everything."""
    if not search.over or verdict in (NO_MISSING, EXPLAINED):
        return ()
    return ("the search ended at its bound of work; what it had not tried may explain more",)


def _lags_of_bench(full: Explanation) -> tuple[str, ...]:
    """Return a note on the lags of the bench's channels, if the explanation holds its paths."""
    paths = full.response.paths
    lags = ", ".join(f"{m.channel} {full.of(m.name)['tau_us']:.0f} us" for m in paths)
    words = f"lags and gains of the bench are fitted beside the effects; the written model has the lags: {lags}"
    return (words,) if paths else ()


def _latency_of_bench(c: Explanation) -> dict[str, float]:
    """Return the values of the model's latencies that stand for the paths of a bench; their gains, and what filters do
    beyond a delay, have no place in a model."""
    given = c.response.model.values
    keys = {m: LATENCIES[m.channel] for m in c.response.paths}
    return {key: given[key] + c.of(m.name)["tau_us"] for m, key in keys.items()}


def _as_written(c: Explanation, latency: Mapping[str, float]) -> Explanation:
    """Return a candidate with latencies in the place of the paths of a bench."""
    if not latency:
        return c
    bare = c.without(*(m.name for m in c.response.paths))
    return replace(bare, response=replace(bare.response, model=bare.response.model.with_values(latency)))


def _notes(full: Explanation, verdict: str) -> tuple[str, ...]:
    """Return the values that are far off, though each channel may agree; a single one only if it may be the reason why
    nothing fits."""
    out = _far(full, full.table.pull)
    if len(out) < (2 if verdict in (NO_MISSING, EXPLAINED) else 1):
        return ()
    one_or_more = "calibrated values are" if len(out) > 1 else "a calibrated value is"
    return (f"{one_or_more} far from the model file ({_worst(out)}): another model, or another unit?",)


def _agrees_before(base: Explanation, named: Sequence[Named], before: Gaps) -> tuple[str, ...]:
    """Return why an effect is named although every channel agrees without it."""
    if not named or any(gap.G > 1.0 for gap in before.channels.values()):
        return ()
    out = _far(base, base.table.pull)
    why = f"but only with values far from its file ({_worst(out)})" if out else "but for what lies in single bands"
    return (f"without what is named the model agrees as well, {why}",)


def _far(c: Explanation, most: float) -> dict[str, float]:
    """Return the calibrated values of the model further from its file than so many standard deviations of it, by how
    many."""
    return {n: z for n, z in c.off_file.items() if abs(z) > most}


def _worst(far: Mapping[str, float]) -> str:
    ranked = sorted(far.items(), key=lambda kv: -abs(kv[1]))[:3]
    return ", ".join(f"{model_label(n)} by {z:+.0f} sd" for n, z in ranked)


def named_effects(
    claims: Sequence[Claim],
    final: Fit,
    early: tuple[RecordFault, ...],
    in_slow: Mapping[Effect, SlowFinding],
    model: Model,
) -> tuple[Named, ...]:
    """Return the named effects in the order in which they were found: before the search, by it, in the slow sines.
    claims: those that passed every gate."""
    out = []
    for fault in early:
        exact = {k: NamedValue(v, v, v) for k, v in fault.parameters.items()}
        out.append(Named(fault.effect, fault.effect.replace("_", " "), fault.words, exact, float("inf"), 0.0))
    for claim in claims:
        effect = claim.effect
        if isinstance(effect, Unnamed):
            continue
        shown = {p.name: _fitted_value(final, effect, p.name, model) for p in effect.parameters}
        out.append(_named(effect, shown, claim.delta_lnL, claim.p))
    for effect, finding in in_slow.items():
        halves = finding.half_widths
        shown = {k: NamedValue(v, v - halves[k], v + halves[k]) for k, v in finding.values.items()}
        out.append(_named(effect, shown, finding.delta_lnL, finding.p))
    return tuple(out)


def _fitted_value(final: Fit, effect: Effect, name: str, model: Model) -> NamedValue:
    """Return a fitted value with its interval, which includes what the units of a learned batch have in common."""
    at, (lo, hi) = final.at[f"{effect.name}.{name}"], final.interval(f"{effect.name}.{name}")
    targets = (t for p in effect.parameters if p.name == name for t in p.targets(model))
    common = TWO_SIDED_95 * max((abs(model.common_offset(t)) for t in targets), default=0.0)
    half = float(np.hypot(hi - at, common))
    return NamedValue(at, at - half, at + half) if common else NamedValue(at, lo, hi)


def _named(effect: Effect, shown: Mapping[str, NamedValue], delta_lnL: float, p: float) -> Named:
    """Return an effect with the sentence of these values and intervals, which `made_again` compares."""
    words = effect.say({k: v.value for k, v in shown.items()}, {k: (v.hi - v.lo) / 2 for k, v in shown.items()})
    return Named(effect.name, effect.title, words, shown, delta_lnL, p)


def verdict_of(
    adequate: bool,
    named: Sequence[Named | FoundElement],
    rivals: Sequence[Ambiguous],
    missing: Sequence[Nameless],
) -> str:
    """Return the verdict. adequate: of the whole explanation, on unseen records; named: effects and elements."""
    if adequate and not missing:
        if rivals or any(isinstance(n, FoundElement) and (n.alike or len(n.places) > 1) for n in named):
            return AMBIGUOUS
        return EXPLAINED if named else NO_MISSING
    return PARTLY if named or rivals else UNEXPLAINED
