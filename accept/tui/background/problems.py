"""Which errors are told to the technician, and how; any other is a fault of the program and ends it loudly."""

import errno

from accept.base.console import KNOWN_ERRORS
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.instruments.fault_words import fault_words
from accept.workflow.session.unit import UnitBusy
from accept.workflow.worker.not_done import NotDone
from hw.errors import InstrumentError

_KEPT = "earlier entries are saved; your input is still in its field"
_OS = {
    errno.ENOSPC: f"the disk is full: free some space and press Enter again; {_KEPT}",
    errno.EROFS: f"the disk is read-only; {_KEPT}",
    errno.EACCES: f"no permission; {_KEPT}",
}


def words_of(error: BaseException) -> str:
    """Return the error in a line. Raises the error itself if it is a fault of the program."""
    if isinstance(error, InstrumentError):
        return fault_words(error)
    if isinstance(error, EntryError | UnitBusy | NotDone):
        return str(error)
    if not isinstance(error, KNOWN_ERRORS):
        raise error
    if isinstance(error, OSError) and error.errno is not None:
        where = f"{error.filename}: " if error.filename else ""
        return where + _OS.get(error.errno, error.strerror or str(error))
    return " ".join(str(error).split())
