"""The one door for a file that nothing is known of: its tables of objects are checked before any parser sees them, and
what a parser reads before the signatures hold is read under limits of time and memory.

A parser makes what such a table promises, and a stream of some bytes can promise milliards of objects. The program
writes plain tables and trailers of five keys; what says it in another way was written by another program.
"""

import re
from collections.abc import Callable
from typing import Any, TypeVar

from accept.base.child_processes import Exhausted, bounded
from accept.certificate.contents.outcome import InvalidCertificate

T = TypeVar("T")
LIMIT_S, LIMIT_GB = 6, 0.15  # the signatures of 100 MB take half a second, and 0.01 GB beside the streams of the file
MOST_REVISIONS = 8  # the program writes three; a file with a few more is told what was added
_MOST_OBJECTS = 10_000  # in each revision; a certificate has some hundred, and two for every attached file
_LONGEST = 4096  # bytes of a trailer, or of a number with the white space around it
SAVED_AGAIN = "another program has saved it again (a signature is valid only for the file as it was signed)"

_HEAD = re.compile(rb"xref ?\r?\n")
_END = re.compile(rb"[\r\n]startxref[ \r\n]{1,2}(\d{1,10})[ \r\n]{1,2}%%EOF[ \r\n]*\Z")
_PART = re.compile(rb"(\d{1,10}) (\d{1,10}) ?\r?\n")
_ENTRIES = re.compile(rb"(?:\d{10} \d{5} [nf](?: \r| \n|\r\n))*")
_ROW = 20  # bytes of an entry
_TRAILER = re.compile(
    rb"trailer\s+<<\s*(?:/(?:Size|Prev) \d{1,10}\s+|/(?:Root|Info|Encrypt) \d{1,10} \d{1,5} R\s+"
    rb"|/ID \[\s*(?:(?:<[0-9A-Fa-f]*>|\((?:[^()\\]|\\.)*\))\s*){2}\]\s+)*>>\s+startxref\s",
    re.DOTALL,
)
_KEY = re.compile(rb"/(Size|Prev|Root|Info|Encrypt|ID) ")
_PREVIOUS = re.compile(rb"/Prev (\d+)")


def read_unknown(work: Callable[..., T], pdf: bytes, *given: Any) -> T:
    """Return what a function of a module reads from a file. Raises what it raises, and InvalidCertificate."""
    check_structure(pdf)
    try:
        return bounded(work, pdf, *given, seconds=LIMIT_S, gigabytes=LIMIT_GB + len(pdf) / 1e9)
    except Exhausted as e:
        raise InvalidCertificate(f"not a certificate of this program: reading it {e}") from e


def check_structure(pdf: bytes) -> None:
    """Raise InvalidCertificate if a file is no PDF, or its tables are not bounded ones as the program writes them."""
    if not pdf.startswith(b"%PDF-"):
        raise InvalidCertificate("not a PDF file" if pdf else "the file is empty")
    end = _END.search(pdf, max(0, len(pdf) - _LONGEST))
    if end is None:
        raise _damaged("it does not end with the place of its table of objects")
    at = int(end[1])
    for _ in range(MOST_REVISIONS):
        before = _previous(pdf, at)
        if before is None:
            return
        if before >= at:
            raise _damaged(f"the table of objects at byte {at} is followed by an earlier one at byte {before}")
        at = before
    raise InvalidCertificate(f"the file has more than {MOST_REVISIONS} revisions: something else was added")


def _previous(pdf: bytes, at: int) -> int | None:
    head = _HEAD.match(pdf, at)
    if head is None:
        raise _damaged(f"at byte {at} stands no plain table of objects")
    position, objects = head.end(), 0
    while part := _PART.match(pdf, position):
        first, count = int(part[1]), int(part[2])
        objects += count
        if not count or max(first + count, objects) > _MOST_OBJECTS:
            raise _damaged(f"the table at byte {at} lists {count} objects from {first}, expected 1 to {_MOST_OBJECTS}")
        position = part.end() + _ROW * count
        if not _ENTRIES.fullmatch(pdf, part.end(), position) or position > len(pdf):
            raise _damaged(f"the table at byte {at} lists {count} objects from {first} and has not so many rows")
    trailer = _TRAILER.match(pdf, position, position + _LONGEST)
    if trailer is None or not objects:
        raise _damaged(f"the table at byte {at} has no trailer of the keys that a certificate has")
    keys = _KEY.findall(trailer[0])
    if len(set(keys)) != len(keys):
        raise _damaged(f"the trailer of the table at byte {at} has a key twice")
    found = _PREVIOUS.search(trailer[0])
    return None if found is None else int(found[1])


def _damaged(what: str) -> InvalidCertificate:
    return InvalidCertificate(f"the PDF is damaged, or {SAVED_AGAIN}: verify the file as it was issued ({what})")
