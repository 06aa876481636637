"""Where the document of an answer goes: a file, or stdout in place of what a person reads."""

import json
from pathlib import Path

from accept.base.atomic_files import check_place, write_atomic
from accept.base.documents.document import Document

STDOUT = Path("-")


def check_answer(place: Path | None) -> None:
    """Raise ReplaceError, or the OSError of writing, before the work if the answer cannot be written to its place."""
    if place is not None and place != STDOUT:
        check_place(place, ".json")


def wants_text(place: Path | None, document: Document) -> bool:
    """Write the document of an answer to its place, if one is named; return whether the answer is printed for a person
    too, which it is not if the document went to stdout. Raises OSError, DocumentError."""
    if place is None:
        return True
    text = json.dumps(document.to_json(), indent=1, allow_nan=False) + "\n"
    if place == STDOUT:
        print(text, end="", flush=True)
        return False
    write_atomic(place, text.encode())
    return True
