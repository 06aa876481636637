"""Effects that the dialogue at the summary asks for, and what they bring back. Passphrases are in effects only, for one
turn, and no representation has them."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

# Effects without a parameter. RING: a new result can be heard.
Do = Enum("Do", "JUDGE RING LOCK NEXT_UNIT STOP_OR_LEAVE ASK_REMEDY TELL_HIDDEN OPEN_PAGE")


class AskedLine(Enum):
    """A line of a question: its label."""

    WHY = "Why it is signed so (on the certificate)"
    WHY_REPLACED = "Why its certificate is replaced (on the certificate)"
    PASSPHRASE = "Passphrase"
    REPEATED = "Repeat passphrase"
    DISPOSITION = "Disposition"
    REASON = "Reason"
    QA_PASSPHRASE = "QA passphrase"

    @property
    def is_secret(self) -> bool:
        return "passphrase" in self.value.lower()


@dataclass(frozen=True)
class LookForKeys:
    """Look for the keys of a role at this bench; `keys_found` follows. ahead: there is no result yet."""

    role: str
    ahead: bool = False


@dataclass(frozen=True)
class BenchKeys:
    """Keys of a role at the bench. problem: why the operator cannot sign in the role; exist: the bench has keys;
    replaces: certificate of another result that a signature replaces; kept: the shift's passphrase opens it."""

    problem: str = ""
    exist: bool = True
    replaces: str = ""
    kept: bool = False


@dataclass(frozen=True)
class Ask:
    """Ask in front of the summary; `answered` follows. then: `ahead`, `sign`, `first keys` or `countersign`; states:
    the question begins with what is signed; kept: the passphrase of the shift signs."""

    then: str
    title: str
    words: str
    lines: tuple[AskedLine, ...]
    states: bool = False
    kept: bool = False


@dataclass(frozen=True)
class KeepPassphrase:
    """Keep the passphrase that opened the technician's key for this shift."""

    passphrase: str = field(repr=False)


@dataclass(frozen=True)
class SignAsTechnician:
    """Sign as technician; `signed` follows. passphrase: "" for that of the shift, or its key once more if it was
    forgotten meanwhile. makes_keys: make the keys instead, `keys_made` follows; first: words to read before."""

    passphrase: str = field(default="", repr=False)
    reason: str = field(default="", repr=False)
    makes_keys: bool = False
    first: str = ""


@dataclass(frozen=True)
class Countersign:
    """Sign as quality assurance; `signed` follows."""

    passphrase: str = field(repr=False)
    choice: str = field(default="", repr=False)
    reason: str = field(default="", repr=False)


class Report(Protocol):
    """The result of verifying a certificate. outcome: `valid`, `signed` or `not valid`."""

    @property
    def outcome(self) -> str: ...

    @property
    def reason(self) -> str: ...

    @property
    def countersigned(self) -> bool: ...
