"""Golden units: known good and known bad ones that show, at the start of a shift, that the bench measures as before.

A bench whose golden units differ from their history judges nothing else until a person has said why. All of it is
events of the store: golden_named {expect}, golden_met {serials}, golden_missed {serials, reasons}, golden_resolved
{reason}.
"""

from collections.abc import Mapping

from accept.fleet.errors import FleetError
from accept.store import Store

EXPECTED = ("accepted", "rejected")
NAMED, MET, MISSED, RESOLVED = "golden_named", "golden_met", "golden_missed", "golden_resolved"


class BenchStopped(FleetError):
    """The golden units were missed: nothing is judged until this is resolved."""


def name_golden(store: Store, serial: str, expected: str, who: str) -> None:
    """Make a judged unit a golden one. Raises FleetError where it has not been judged as expected."""
    if expected not in EXPECTED:
        raise FleetError(f"'{expected}' is not a verdict of a golden unit; write {' or '.join(EXPECTED)}")
    last = store.latest(serial, "unit_judged")
    if last is None:
        raise FleetError(f"{serial} was never judged: judge it first, on a bench that is known to be right")
    verdict = last.data["result"]["verdict"]
    if verdict != expected:
        raise FleetError(f"{serial} was last {verdict}, not {expected}")
    store.append(NAMED, serial, {"expect": expected}, who=who)


def goldens(store: Store) -> dict[str, str]:
    """Serial -> expected verdict of every golden unit."""
    return {event.subject: str(event.data["expect"]) for event in store.events(what=NAMED)}


def resolve(store: Store, reason: str, who: str) -> None:
    """Let the bench judge again. Raises FleetError without a reason or where nothing is to be resolved."""
    if not reason.strip():
        raise FleetError("say what was wrong with the bench and what was done: --reason")
    if stopped(store) is None:
        raise FleetError("nothing to resolve: the golden units were not missed")
    store.append(RESOLVED, "", {"reason": reason.strip()}, who=who)


def stopped(store: Store) -> Mapping[str, list[str]] | None:
    """Serial -> what was missed, where the last word on the golden units is that they were; else None."""
    last = max(
        (e for what in (MET, MISSED, RESOLVED) if (e := store.latest("", what))), key=lambda e: e.seq, default=None
    )
    return dict(last.data["reasons"]) if last is not None and last.what == MISSED else None


def may_judge(store: Store, serial: str) -> None:
    """Raises BenchStopped where the bench has missed its golden units and `serial` is none of them."""
    missed = stopped(store)
    if missed is None or serial in goldens(store):
        return
    words = "; ".join(f"{golden}: {', '.join(problems)}" for golden, problems in missed.items())
    raise BenchStopped(
        f"{serial}: not judged, because the bench missed its golden units ({words}); "
        "find out why, then: accept golden resolve --reason '...'"
    )
