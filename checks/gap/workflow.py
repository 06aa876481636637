"""The gap workflow on arrays: calibrate, test, search, verify, name or report an unidentified effect ([GAP] 0 to
13)."""

from dataclasses import replace

from checks.gap.calibrate import calibrated, searching, turned_right
from checks.gap.decision.never_worse import grown
from checks.gap.decision.report import answer
from checks.gap.decision.result import AMBIGUOUS, EXPLAINED, NO_MISSING, UNEXPLAINED, Result
from checks.gap.modelling.thresholds import THRESHOLDS, Thresholds
from checks.gap.preparation.inputs import SAMPLE_OFFSET, GapRefused, Inputs, Prepared, as_recorded, prepared, same_unit
from checks.gap.search.candidate import Candidate
from checks.gap.search.candidates import Effort, Say, Search
from checks.gap.search.forward import SearchResult, explain, explain_beside

NEARLY = 10.0  # G up to which one more effect may be what is left of an explanation


def run(inputs: Inputs, say: Say, table: Thresholds = THRESHOLDS) -> Result:
    """Run the whole workflow. Raises GapRefused, ModelError."""
    p = prepared(inputs, table)
    found = _run(p, say)
    if not any(e.effect == SAMPLE_OFFSET for e in p.early) or _is_enough(found, p):
        return found
    # Whole samples are found before any fit, by the slope of the phase alone: a filter or a delay may explain more.
    other = _run(as_recorded(p), say)
    return other if _explains(other) or not _explains(found) else found


def _is_enough(found: Result, p: Prepared) -> bool:
    """Return whether an answer names only effects that were found before any search."""
    return _explains(found) and len(found.named) <= len(p.early) + len(p.in_slow)


def _explains(found: Result) -> bool:
    return found.verdict in (NO_MISSING, EXPLAINED, AMBIGUOUS)


def _run(p: Prepared, say: Say) -> Result:
    """Return the answer for records that are corrected for their faults."""
    effort = Effort(p.table.effort)
    search = searching(p, p.A.channels, say, effort)
    say("calibrating the model")
    base = calibrated(search, p)
    if not base.adequate and (mended := turned_right(search, base, p)) is not None:
        again = searching(mended, p.A.channels, say, effort)
        turned = _explained(mended, again, calibrated(again, mended))
        if not grown(turned.gap_before, turned.gap_after):  # else no fault of the records: it explains none of them
            return turned
    return _explained(p, search, base)


def _explained(p: Prepared, search: Search, base: Candidate) -> Result:
    """Search for the effects that a calibrated model lacks."""
    table = p.table
    whole = replace(base, unseen=p.B)
    if whole.adequate:
        return answer(p, search, SearchResult(base, base, (), ()), whole)
    found = explain(search, base, 1, table.beam)
    if not found.best.adequate and found.best.worst_G < table.G:  # nearly: chance alone says that it is not all
        found = _deeper(search, found)
    if _by_name(found):
        return answer(p, search, found, whole)
    beside = explain_beside(search, found)
    if _by_name(beside):
        return answer(p, search, beside, whole)
    if beside.steps:
        if beside.best.worst_G < NEARLY and _by_name(deeper := _extended(found, explain(search, beside.best, 1, 1))):
            return answer(p, search, deeper, whole)
        partly = answer(p, search, beside, whole)
        if partly.verdict != UNEXPLAINED:
            return partly
    return answer(p, search, found if found.best.adequate else _deeper(search, found), whole)


def _by_name(found: SearchResult) -> bool:
    """Return whether an explanation is complete and consists of named effects only."""
    return found.best.adequate and not found.best.response.stand_ins


def _deeper(search: Search, found: SearchResult) -> SearchResult:
    """Add effects to the best so far, as many as one unit may have."""
    room = search.table.most_effects - len(found.best.response.counted)
    if room <= 0:
        return found
    deeper = explain(search, found.best, room, 1)
    return _extended(found, deeper) if deeper.best.response.counted else deeper


def _extended(found: SearchResult, deeper: SearchResult) -> SearchResult:
    """Return the result of a search that started from the end of another one."""
    return SearchResult(found.base, deeper.best, deeper.rivals, (*found.tried, *deeper.tried))


__all__ = ["GapRefused", "Inputs", "Say", "run", "same_unit"]
