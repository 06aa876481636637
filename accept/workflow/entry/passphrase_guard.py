"""Guard against a passphrase that is typed where words are kept: as a serial, a name, a reason, a note.

What was typed is compared with the passphrases of the bench by trying to open its keys, a tenth of a second for each:
only for a text that is about to be stored, in a thread."""

from collections.abc import Iterable
from pathlib import Path

from accept.certificate import trust
from accept.workflow.entry.parse_entry import EntryError, is_value
from accept.workflow.entry.shift import NOT_TAKEN


def may_be_passphrase(text: str) -> bool:
    """Return whether text is long enough for a passphrase and reads as none of the values that are measured."""
    return len(text.strip()) >= trust.SHORTEST_PASSPHRASE and (text.strip().isdigit() or not is_value(text))


def is_passphrase(home: Path, text: str) -> bool:
    """Return whether text opens a key at this bench: of a person, of quality assurance, of the authority."""
    return may_be_passphrase(text) and trust.opens_a_key(home, text)


def refuse_passphrases(home: Path, texts: Iterable[str]) -> None:
    """Raise EntryError if one of the texts, which are about to be stored, is a passphrase of this bench."""
    if any(is_passphrase(home, text) for text in texts):
        raise EntryError(NOT_TAKEN)
