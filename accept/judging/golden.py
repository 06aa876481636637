"""Golden units: known good and known bad ones that show, at the start of a shift, that the bench measures as before.

A bench whose golden units differ from their history judges nothing else until a person has said why. All of it is
events of the store: golden_named {expect}, golden_met {serials}, golden_missed {serials, reasons}, golden_resolved
{reason}.
"""

from collections.abc import Mapping

from accept.store import Store
from accept.store.indexes import JUDGED
from specs.errors import AcceptError

EXPECTED = ("accepted", "rejected")
NAMED, MET, MISSED, RESOLVED = "golden_named", "golden_met", "golden_missed", "golden_resolved"


class GoldenError(AcceptError, ValueError):
    """A unit that cannot be a golden one, or nothing to resolve; the text says why."""


class BenchStopped(GoldenError):
    """The golden units were missed: nothing is judged until this is resolved."""


def name_golden(store: Store, serial: str, expected: str, who: str) -> None:
    """Make a judged unit a golden one. Raises GoldenError if it has not been judged as expected."""
    if expected not in EXPECTED:
        raise GoldenError(f"'{expected}' is not a verdict of a golden unit; write {' or '.join(EXPECTED)}")
    last = store.latest(serial, JUDGED)
    if last is None:
        raise GoldenError(f"{serial} was never judged: judge it first, on a bench that is known to be right")
    verdict = last.data["result"]["verdict"]
    if verdict != expected:
        raise GoldenError(f"{serial} was last {verdict}, not {expected}")
    store.append(NAMED, serial, {"expect": expected}, who=who)


def goldens(store: Store) -> dict[str, str]:
    """Return the expected verdict of every golden unit, by serial."""
    return {event.subject: str(event.data["expect"]) for event in store.events(what=NAMED)}


def resolve(store: Store, reason: str, who: str) -> None:
    """Let the bench judge again. Raises GoldenError without a reason, or if nothing is to be resolved."""
    if not reason.strip():
        raise GoldenError("say what was wrong with the bench and what was done: --reason")
    if missed(store) is None:
        raise GoldenError("nothing to resolve: the golden units were not missed")
    store.append(RESOLVED, "", {"reason": reason.strip()}, who=who)


def missed(store: Store) -> Mapping[str, list[str]] | None:
    """Return what was missed of each golden unit, None unless the last event about them says that they were missed."""
    last = max(
        (e for what in (MET, MISSED, RESOLVED) if (e := store.latest("", what))), key=lambda e: e.seq, default=None
    )
    return dict(last.data["reasons"]) if last is not None and last.what == MISSED else None


def check_may_judge(store: Store, serial: str) -> None:
    """Raise BenchStopped if the bench has missed its golden units and the unit is not one of them."""
    problems = missed(store)
    if problems is None or serial in goldens(store):
        return
    words = "; ".join(f"{golden}: {', '.join(differences)}" for golden, differences in problems.items())
    raise BenchStopped(
        f"{serial}: not judged, because the bench missed its golden units ({words}); "
        "find out why, then: accept golden resolve --reason '...'"
    )
