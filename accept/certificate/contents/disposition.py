"""The disposition of a unit that was not accepted: quality assurance decides it when it countersigns.

It is part of the countersignature itself (the signed `/Reason` of its dictionary), of the page and of the store."""

from accept.store.payloads import CHOICES, Disposition
from checks.verdict import UnitVerdict
from specs.errors import AcceptError

LONGEST = 120  # characters of the reason: what the box of the countersignature shows
_HEAD = "; disposition: "


class DispositionError(AcceptError, ValueError):
    """A disposition or reason that is missing, not needed, or not understood; the text names what is expected."""


def parse_disposition(serial: str, verdict: str, choice: str, reason: str) -> Disposition | None:
    """Return the disposition of a unit with this verdict, None for an accepted unit. Raises DispositionError."""
    choice, reason = choice.strip().lower(), " ".join(reason.split())
    choices = ", ".join(CHOICES)
    if verdict == UnitVerdict.ACCEPTED:
        if choice or reason:
            raise DispositionError(f"{serial} is accepted and needs no disposition")
        return None
    if choice not in CHOICES:
        given = f"'{choice}' is not a disposition" if choice else "decide what is to be done with it"
        raise DispositionError(f"{serial} is {verdict}: {given}; expected one of {choices}, and a reason")
    return Disposition(choice, _one_line(reason, "a disposition"))


def parse_signing_reason(verdict: str, reason: str, amends: str = "") -> str:
    """Return why the technician signs a unit that is not accepted, or a certificate that replaces another one; "" for
    an accepted unit, which needs no reason. amends: the certificate that is replaced. Raises DispositionError."""
    if verdict == UnitVerdict.ACCEPTED:
        return _one_line(reason, f"replacing certificate {amends}") if amends else ""
    return _one_line(reason, f"signing a unit that is {verdict}")


def _one_line(text: str, of: str) -> str:
    reason = " ".join(text.split())
    if not reason or not reason.isprintable() or len(reason) > LONGEST:
        raise DispositionError(f"the reason of {of} is one line of 1 to {LONGEST} characters, got '{reason}'")
    return reason


def in_signature(reviewed: str, disposition: Disposition | None) -> str:
    """Return the reason that the signature states."""
    return reviewed if disposition is None else f"{reviewed}{_HEAD}{disposition}"


def parse_stated(words: str) -> Disposition | None:
    """Return the disposition of the words that a signature states, None for none. Raises DispositionError."""
    if not words:
        return None
    for choice, called in CHOICES.items():
        if words.startswith(f"{called}: "):
            return Disposition(choice, words.removeprefix(f"{called}: "))
    raise DispositionError(f"'{words}' is not a disposition of this program")


def of_signature(reason: str) -> str:
    """Return the disposition in the words of a signature's reason, "" if the reason states none."""
    return reason.partition(_HEAD)[2]
