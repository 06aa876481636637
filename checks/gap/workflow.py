"""The gap workflow on arrays: calibrate, test, search, verify, name or say that there is no name ([GAP] 0 to 13)."""

from dataclasses import replace

from checks.gap.calibrate import calibrated, searching, turned_right
from checks.gap.decision.never_worse import grown
from checks.gap.decision.report import answer
from checks.gap.decision.result import Result
from checks.gap.modelling.thresholds import THRESHOLDS, Thresholds
from checks.gap.preparation.inputs import GapRefused, Inputs, Prepared, prepared, same_unit
from checks.gap.search.candidates import Candidate, Effort, Say, Search
from checks.gap.search.forward import SearchResult, explain
from checks.gap.search.levenberg_marquardt import begin

FIRST = 2  # effects that are looked for before a channel is left out
GROSS = 1e4  # of a channel's G: most of it is no calibration's business
APART = 0.5  # of the effort that may be spent, on the way by the others


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
    found = _after_the_others(p, search, base) or explain(search, base, FIRST, table.beam)
    if not found.best.adequate and found.best.worst_G < table.G:  # nearly: chance alone says that it is not all
        found = _deeper(search, found)
    if not found.best.adequate:
        part = _without_a_channel(p, search)
        if part is not None:
            return answer(p, *part, whole)
        found = _deeper(search, found)
    return answer(p, search, found, whole)


def _after_the_others(p: Prepared, search: Search, base: Candidate) -> SearchResult | None:
    """Where model and data have nothing in common, and two channels are as the model says: what the third lacks beside
    them. A tall mode in one channel bends the calibration of all until no start finds it. None where that does not
    explain everything."""
    if len(p.A.channels) < 3 or base.worst_G < GROSS:
        return None
    so_far = search.effort
    sparing = replace(search, effort=Effort(so_far.spent + APART * so_far.most, so_far.spent))
    others = _of_two_channels(p, sparing, base)
    found = None if others is None else explain(sparing, _on(sparing, others), FIRST, p.table.beam)
    so_far.spent = sparing.effort.spent
    if found is None or not (found.best.adequate and found.best.response.counted):
        return None
    return replace(found, base=base)


def _of_two_channels(p: Prepared, search: Search, base: Candidate) -> Candidate | None:
    """The calibration of the channels without one of the two that are off the most, where nothing is missing in it.
    With effects of their own two channels take much for something that it is not."""
    for left_out in sorted(base.channel_G, key=lambda c: -base.channel_G[c])[:2]:
        search.say(f"looking at the channels without {left_out}")
        own = calibrated(_without(p, search, left_out), p)
        if own.adequate:
            return own
    return None


def _without(p: Prepared, search: Search, left_out: str) -> Search:
    """The same on the channels but one."""
    return searching(p, tuple(c for c in p.A.channels if c != left_out), search.say, search.effort)


def _on(search: Search, found: Candidate) -> Candidate:
    """A candidate of some channels on all, as it stands."""
    at = begin(found.response, search.A, found.at)
    return Candidate(found.response, found.at, at.cost, search.B, search.table)


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
    parts = [_without(p, search, left_out) for left_out in channels]
    bases = [calibrated(part, p) for part in parts]
    base, part = min(zip(bases, parts, strict=True), key=lambda each: each[0].cost)
    found = SearchResult(base, base, (), ()) if base.adequate else explain(part, base, FIRST, p.table.beam)
    return (part, found) if found.best.adequate else None


__all__ = ["GapRefused", "Inputs", "Say", "run", "same_unit"]
