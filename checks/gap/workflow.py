"""The gap workflow on arrays: calibrate, test, search, verify, name or say that there is no name ([GAP] 0 to 13)."""

from dataclasses import replace

from checks.gap.calibrate import calibrated, searching, turned_right
from checks.gap.decision.never_worse import grown
from checks.gap.decision.report import answer
from checks.gap.decision.result import Result
from checks.gap.modelling.thresholds import THRESHOLDS, Thresholds
from checks.gap.preparation.inputs import GapRefused, Inputs, Prepared, prepared, same_unit
from checks.gap.search.candidate import Candidate
from checks.gap.search.candidates import Effort, Say, Search
from checks.gap.search.forward import SearchResult, explain

FIRST = 2  # effects that are looked for before a channel is left out


def run(inputs: Inputs, say: Say, table: Thresholds = THRESHOLDS) -> Result:
    """The whole workflow. Raises GapRefused, ModelError."""
    p, effort = prepared(inputs, table), Effort(table.effort)
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
    """What is missing beside a calibrated model."""
    table = p.table
    whole = replace(base, unseen=p.B)
    if whole.adequate:
        return answer(p, search, SearchResult(base, base, (), ()), whole)
    found = explain(search, base, FIRST, table.beam)
    if not found.best.adequate and found.best.worst_G < table.G:  # nearly: chance alone says that it is not all
        found = _deeper(search, found)
    if not found.best.adequate:
        part = _without_a_channel(p, search)
        if part is not None:
            return answer(p, *part, whole)
        found = _deeper(search, found)
    return answer(p, search, found, whole)


def _deeper(search: Search, found: SearchResult) -> SearchResult:
    """More effects beside the best so far, as many as one unit may have."""
    room = search.table.most_effects - len(found.best.response.counted)
    if room <= 0:
        return found
    deeper = explain(search, found.best, room, 1)
    if not deeper.best.response.counted:
        return deeper
    return SearchResult(found.base, deeper.best, deeper.rivals, (*found.tried, *deeper.tried))


def _without_a_channel(p: Prepared, search: Search) -> tuple[Search, SearchResult] | None:
    """What the other channels say when one is left out: something without a name on one channel leads the calibration
    astray and hides what the others could name. None where they are not explained either."""
    channels = p.A.channels
    if len(channels) < 3 or search.over:
        return None
    search.say("looking at the channels two by two")
    others = [tuple(c for c in channels if c != left_out) for left_out in channels]
    parts = [searching(p, two, search.say, search.effort) for two in others]
    bases = [calibrated(part, p) for part in parts]
    base, part = min(zip(bases, parts, strict=True), key=lambda each: each[0].cost)
    found = SearchResult(base, base, (), ()) if base.adequate else explain(part, base, FIRST, p.table.beam)
    return (part, found) if found.best.adequate else None


__all__ = ["GapRefused", "Inputs", "Say", "run", "same_unit"]
