"""One technician at one unit: every entry goes to the store first, and the screens show the state folded from there.

`accept.workflow.session.open_session` returns a `Session`: the open unit, and five subjects that each serve by
themselves: `entries`, `records`, `judgements`, `gap`, `undo`. Their methods may block (disk, lock, physics): screens
call them from thread workers. One lock keeps events in order."""

from accept.workflow.session.session import Session

__all__ = ["Session"]
