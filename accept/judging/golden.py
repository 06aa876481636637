"""Golden units: known good and known bad ones that show, at the start of a shift, that the bench measures as before.

A bench whose golden units differ from their history judges nothing else until a person has said why. All of it is
events of the store.
"""

from collections.abc import Mapping

from accept.store import Store
from accept.store.payloads import GoldenMet, GoldenMissed, GoldenNamed, GoldenResolved, UnitJudged
from specs.errors import AcceptError

EXPECTED = ("accepted", "rejected")


class GoldenError(AcceptError, ValueError):
    """A unit that cannot be a golden one, or nothing to resolve; the text says why."""


class BenchStopped(GoldenError):
    """The golden units were missed: nothing is judged until this is resolved."""


def name_golden(store: Store, serial: str, expected: str, who: str) -> None:
    """Make a judged unit a golden one. Raises GoldenError if it has not been judged as expected."""
    if expected not in EXPECTED:
        raise GoldenError(f"'{expected}' is not a verdict of a golden unit; write {' or '.join(EXPECTED)}")
    last = store.latest(serial, UnitJudged.KIND)
    if last is None:
        raise GoldenError(f"{serial} was never judged: judge it first, on a bench that is known to be right")
    verdict = UnitJudged.of(last).result.verdict
    if verdict != expected:
        raise GoldenError(f"{serial} was last {verdict}, not {expected}")
    store.write(GoldenNamed(expected), serial, who=who)


def goldens(store: Store) -> dict[str, str]:
    """Return the expected verdict of every golden unit, by serial."""
    return {event.subject: GoldenNamed.of(event).expect for event in store.events(what=GoldenNamed.KIND)}


def resolve(store: Store, reason: str, who: str) -> None:
    """Let the bench judge again. Raises GoldenError without a reason, or if nothing is to be resolved."""
    if not reason.strip():
        raise GoldenError("say what was wrong with the bench and what was done: --reason")
    if missed(store) is None:
        raise GoldenError("nothing to resolve: the golden units were not missed")
    store.write(GoldenResolved(reason.strip()), who=who)


def missed(store: Store) -> Mapping[str, list[str]] | None:
    """Return what was missed of each golden unit, None unless the last event about them says that they were missed."""
    kinds = (GoldenMet, GoldenMissed, GoldenResolved)
    last = max((e for kind in kinds if (e := store.latest("", kind.KIND))), key=lambda e: e.seq, default=None)
    if last is None or last.what != GoldenMissed.KIND:
        return None
    return {serial: list(problems) for serial, problems in GoldenMissed.of(last).reasons.items()}


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
