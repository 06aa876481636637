"""The declaration of a statement of a certificate: how it is checked, and where the page shows it."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class Way(StrEnum):
    """The way in which a statement is checked."""

    DERIVED = "derived"  # again from the attached bytes
    SIGNED = "signed"  # it carries a signature of its own
    LOOKED_UP = "looked up"  # in the bench's store or its published list; without them it is the signers' word
    STATED = "stated"  # by the unit's folder alone: always the signers' word


DERIVED, SIGNED, LOOKED_UP = (Way.DERIVED,), (Way.SIGNED,), (Way.LOOKED_UP,)
SIGNED_AND_LOOKED_UP, DERIVED_AND_SIGNED = (Way.SIGNED, Way.LOOKED_UP), (Way.DERIVED, Way.SIGNED)


@dataclass(frozen=True)
class Statement:
    """One statement. ways, how: the way it is checked and the source that it is compared with.

    row: of the page that shows it; words: the sentence of a row of its own, from the content of a certificate.
    called, stored: its name in the comparison with a store, and whether the store has it as stated, from the provenance
    and the `History` of the judgement; without a name it is compared with each statement that the bench made of itself.
    due: whether the provenance should have it, also by whether this program made it; what is due and absent is said.
    later: earlier programs did not state it, so that it may be absent in what they made.
    document, field: the file that holds it and its key there, with all below it.
    """

    ways: tuple[Way, ...]
    how: str
    row: str = ""
    words: Callable[[Any], str] | None = None
    called: str = ""
    stored: Callable[[Any, Any], bool] | None = None
    due: Callable[[Any, bool], bool] | bool = False
    later: bool = False
    document: str = ""
    field: str = ""

    @property
    def name(self) -> str:
        """The field without the document that it is part of."""
        return self.field.removeprefix("provenance.")
