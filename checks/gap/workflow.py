"""The gap workflow on arrays: calibrate, test, search, verify, name or report an unidentified effect ([GAP] 0 to
13)."""

from collections.abc import Iterator
from dataclasses import replace

from checks.errors import NotHeld
from checks.fitting.fit import CONTRADICTION
from checks.gap.calibrate import calibrate, correct_records, search_on
from checks.gap.conditions.trial import GapRefused
from checks.gap.decision.build_result import build_result
from checks.gap.decision.never_worse import gap_increased
from checks.gap.decision.result import AMBIGUOUS, EXPLAINED, NO_MISSING, UNEXPLAINED, Result
from checks.gap.modelling.thresholds import THRESHOLDS, Thresholds
from checks.gap.preparation.inputs import SAMPLE_OFFSET, Inputs, Problem, prepare
from checks.gap.search.bench_paths import in_words, on_bench, without_lags
from checks.gap.search.candidates import Effort, Say, Search
from checks.gap.search.explanation import Explanation
from checks.gap.search.forward import ELEMENTS, SearchResult, as_filter, explain, explain_beside, grow

MOST_ELEMENTS = 2
NEARLY = 10.0  # G up to which one more effect may be what is left of an explanation
NEARLY_ON_BENCH = 3.0  # the same on a bench of its own, whose guide leaves more than one effect could explain


def run(inputs: Inputs, say: Say, table: Thresholds = THRESHOLDS) -> Result:
    """Run the whole workflow. Raises GapRefused, ModelError."""
    try:
        return _run(inputs, say, table)
    except NotHeld as e:
        inputs.model.modal()  # raises if the model itself is not held, before any search
        raise GapRefused(f"{CONTRADICTION}; {e}") from e


def _run(inputs: Inputs, say: Say, table: Thresholds) -> Result:
    problem = prepare(inputs, table)
    result = _analyse(problem, say)
    if not any(e.effect == SAMPLE_OFFSET for e in problem.early):
        return result
    by_faults_alone = len(result.named) <= len(problem.early) + len(problem.in_slow)
    if _explains(result) and by_faults_alone:
        return result
    # Whole samples are found before any fit, by the slope of the phase alone: a filter or a delay may explain more.
    other = _analyse(problem.with_offsets(), say)
    return other if _explains(other) or not _explains(result) else result


def _explains(result: Result) -> bool:
    return result.verdict in (NO_MISSING, EXPLAINED, AMBIGUOUS)


def _analyse(problem: Problem, say: Say) -> Result:
    """Return the result for records that are corrected for their faults."""
    effort = Effort(problem.table.effort)
    search = search_on(problem, say, effort)
    say("calibrating the model")
    base = calibrate(search, problem)
    if not base.adequate and (corrected := correct_records(search, base, problem)) is not None:
        again = search_on(corrected, say, effort)
        result = _explain(corrected, again, calibrate(again, corrected))
        if not gap_increased(result.gap_before, result.gap_after):  # else no fault of the records: it explains nothing
            return result
    return _explain(problem, search, base)


def _explain(problem: Problem, search: Search, base: Explanation) -> Result:
    """Search for the effects that a calibrated model lacks."""
    whole = base.on(problem.B)
    if whole.adequate:
        return build_result(problem, search, SearchResult(base, base, (), ()), whole)
    if problem.inputs.model.learned is None and (bench := on_bench(search, base)) is not None:
        return _explain_on_bench(problem, search, base, bench)
    refused, last = None, SearchResult(base, base, (), ())
    for found in _stages(search, base):
        if found.is_final or found.best.beside:
            result = build_result(problem, search, found, whole)
            if found.is_filter:  # tells where and how, and no cause
                answer = refused or build_result(problem, search, last, whole)
                return replace(answer, elements=tuple(replace(e, fitted="") for e in result.elements))
            if result.verdict != UNEXPLAINED:
                return result
            refused = refused or (result if found.is_final else None)
        last = found
    return refused or build_result(problem, search, last, whole)


def _stages(search: Search, base: Explanation) -> Iterator[SearchResult]:
    """Yield what each stage finds: the answer is the first that is final or beside a disagreement and passes the gates;
    else the first that is final, or the last. After effects that the gates refuse, elements may explain all. A filter
    comes after all others, and beside their answer."""
    library = explain(search, base, 1, search.table.beam)
    if not library.best.adequate and library.best.worst_G < search.table.G:  # chance alone says that it is not all
        library = _search_deeper(search, library)
    yield library
    most = 1 if library.is_one_mode else MOST_ELEMENTS  # what one member explains is explained by no more of them
    elements = grow(search.with_effort_of_its_own(), base, ELEMENTS, most)
    if not library.best.adequate or elements.best.score >= library.best.score:
        yield elements
    if library.is_final:
        return
    if not elements.is_final:
        beside = explain_beside(search, library)
        if not beside.best.beside:
            yield beside
        elif not library.is_one_mode:
            if beside.best.worst_G < NEARLY:
                beyond = search.begin(beside.best.response, beside.best.at)  # as if it left nothing
                yield library.before(explain(search, beyond, 1, 1))
            yield beside
    deeper = library if library.best.adequate else _search_deeper(search, library)
    if not elements.best.adequate or deeper.best.score > elements.best.score:  # refused, they still do as well
        yield deeper
    if (path := as_filter(search, library, elements)) is not None:
        yield path


def _explain_on_bench(problem: Problem, search: Search, base: Explanation, bench: Explanation) -> Result:
    """Search for the effects that a calibrated model lacks on a bench with lags of its own."""
    whole = base.on(problem.B)
    alone = found = SearchResult(bench, bench, (), (base,))
    beyond = without_lags(search)
    if not bench.adequate:
        found = explain_beside(beyond, alone)  # it finds a complete explanation too, and sooner than a full search
        if not found.best.beside and not found.is_named and bench.worst_G < NEARLY_ON_BENCH:
            found = max(found, explain(beyond, bench, 1, 1), key=lambda f: f.is_named)
    if found.is_named:
        named = in_words(search, found)
        if named is not None and _explains(result := build_result(problem, search, named, whole)):
            return result
    result = build_result(problem, search, found, whole)
    said = result.named or any(a.or_bench for a in result.ambiguous)
    return result if said or found is alone else build_result(problem, search, alone, whole)


def _search_deeper(search: Search, found: SearchResult) -> SearchResult:
    """Add effects to the best so far, as many as one unit may have."""
    room = search.table.most_effects - len(found.best.response.counted)
    if room <= 0:
        return found
    deeper = explain(search, found.best, room, 1)
    return found.before(deeper) if deeper.best.response.counted else deeper


__all__ = ["GapRefused", "Inputs", "Say", "run"]
