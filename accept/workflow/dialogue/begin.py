"""The orders of the first screen to the bench: a unit that is begun, and the questions before it is."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Begun:
    """The technician's entries at the start. reason: of a new attempt at a known unit; None continues the present
    one. confirmed: whether the serial was asked about and typed once more."""

    serial: str
    kind: str
    operator: str
    parts: Mapping[str, str] = field(default_factory=dict)
    reason: str | None = None
    confirmed: bool = False


@dataclass(frozen=True)
class BenchKinds:
    """The kinds of unit of a bench. kinds: those for which the bench has a spec; problem: returns why a serial is not
    valid for a unit of a kind, None if it is; described: returns the kind whose spec alone says itself that its serials
    look like this one."""

    kinds: tuple[str, ...]
    problem: Callable[[str, str], str | None] = field(repr=False)
    described: Callable[[str], str | None] = field(repr=False)


@dataclass(frozen=True)
class LookForPassphrase:
    """Look for a passphrase of this bench among texts, each with its field; `recognized` follows. then: the key that is
    answered unless one was typed."""

    texts: tuple[tuple[str, str], ...] = field(repr=False)
    then: str


@dataclass(frozen=True)
class LookUp:
    """Look up a serial among the units of this bench, and whether the operator can sign here, "" to leave that out."""

    serial: str = field(repr=False)
    operator: str = ""
