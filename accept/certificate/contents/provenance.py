"""The provenance of a certificate: the statements beside its result, each declared once with its type, its way of
checking, what a store must have, and its row on the page. One that a certificate lacks has its default."""

import hashlib
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from datetime import datetime
from enum import StrEnum
from typing import Annotated, Any, get_args, get_type_hints

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field

from accept.base.documents.document import Document, Number, only_if
from accept.certificate.contents.laboratory import LaboratoryFile, StatedLaboratory, statement_of
from accept.store.payloads import VOIDED, BenchStated
from checks.verdict import UnitVerdict


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


AT_THE_BENCH = "its key lies at this bench"


def _with_zone(text: str) -> str:
    if datetime.fromisoformat(text).tzinfo is None:
        raise ValueError(f"'{text}' is stated, expected a time with its zone")
    return text


def _given(value: Any) -> Any:
    if value is None or value is False:
        raise ValueError("expected a value or no such key")
    return value


_filled = only_if(bool)
_GIVEN = BeforeValidator(_given)
_Text = Annotated[str, Field(min_length=1)]
_Time = Annotated[str, AfterValidator(_with_zone)]
_Hex = Annotated[str, Field(pattern="^[0-9a-f]{64,128}$")]
_End = Annotated[str, Field(pattern=f"^({'|'.join((*UnitVerdict, VOIDED))})$")]


class Part(Document):
    """A part of the provenance, of exactly its keys."""

    __pydantic_config__ = ConfigDict(strict=True, allow_inf_nan=False, extra="forbid")


@dataclass(frozen=True)
class Replaced(Part):
    """The judgement before: verdict, time and certificate; if it had none, the last certificate, of which attempt."""

    verdict: _End
    time: _Time
    certificate: str | None
    earlier_attempt: Annotated[int, _filled] = 0
    earlier_certificate: Annotated[str, _filled] = ""

    def __post_init__(self) -> None:
        if bool(self.earlier_attempt) != bool(self.earlier_certificate):
            raise ValueError("expected both earlier_attempt and earlier_certificate, or neither")


@dataclass(frozen=True)
class Stopped(Part):
    """An attempt that was not accepted."""

    attempt: int
    verdict: _End
    time: _Time

    @property
    def words(self) -> str:
        return f"accepted after attempt {self.attempt} was {self.verdict} on {self.time[:10]}"


@dataclass(frozen=True)
class Earlier(Part):
    """The ends of the attempts before: how many with which verdict, and the last that was not accepted."""

    verdicts: Mapping[_End, Annotated[int, Field(gt=0)]]
    not_accepted: Stopped | None

    def __post_init__(self) -> None:
        if (self.not_accepted is None) is bool({*self.verdicts} - {UnitVerdict.ACCEPTED, VOIDED}):
            raise ValueError("not_accepted does not agree with its verdicts")


@dataclass(frozen=True)
class ValueBefore(Part):
    """A value of the judgement that is replaced."""

    value: Number
    U: Number


@dataclass(frozen=True)
class Head(Part):
    """The head of the bench's store when the unit was judged, signed by the bench."""

    seq: int
    hash: _Hex
    bench: _Hex
    signature: _Hex


@dataclass(frozen=True)
class History:
    """The statements that a store expects of a certified judgement. judged: its time; numbers: of its attempt;
    replaced: the judgements that it may replace with their values, in the workflow also the one before its attempt.
    checks: of its spec. bench: one of the bench's statements of itself until the signature; numbered: numbers by its
    scheme then, "" without one."""

    judged: str
    reason: str | None
    signed_because: str
    numbers: Collection[int]
    replaced: Sequence[tuple[Replaced | None, Mapping[str, ValueBefore] | None]]
    earlier: Earlier | None
    amends: str
    checks: Collection[str]
    bench: BenchStated | None = None
    numbered: Collection[str] = ()

    @property
    def laboratory(self) -> StatedLaboratory | None:
        file = None if self.bench is None else self.bench.laboratory
        return None if file is None else statement_of(LaboratoryFile(**file), self.checks)


@dataclass(frozen=True)
class Provenance(Document):
    """The statements of a certificate beside its result. Each is absent from certificates that had no cause to state
    it, and from those of programs that did not know it."""

    # fmt: off
    attempt: Annotated[int, Field(ge=1), _filled, Statement(
        LOOKED_UP, "number of the unit's judgements", "Attempt", due=True, called="attempt",
        stored=lambda p, known: p.attempt in known.numbers)] = 0
    replaces: Annotated[Replaced | None, Statement(
        LOOKED_UP, "judgement and certificate before, also in a list; signed later than that", "Attempt", due=True,
        called="replaced judgement",
        stored=lambda p, known: p.replaces in [replaced for replaced, _ in known.replaced])] = None
    earlier: Annotated[Earlier | None, _GIVEN, only_if(), Statement(
        LOOKED_UP, "how its judgements ended; in a list, how many they are and when", "Attempt",
        due=lambda p, own: own and p.replaces is not None, called="end of the attempts before", later=True,
        stored=lambda p, known: p.earlier == known.earlier)] = None
    amends: Annotated[_Text, _filled, Statement(
        LOOKED_UP, "number and result of the certificate before", "Amended", called="amended certificate", later=True,
        stored=lambda p, known: p.amends == known.amends)] = ""
    judged: Annotated[_Time, _filled, Statement(
        LOOKED_UP, "time of the judgement, also in a list", "Attempt", called="time of the judgement",
        stored=lambda p, known: p.judged in ("", known.judged))] = ""
    before: Annotated[Mapping[str, ValueBefore] | None, _GIVEN, only_if(), Statement(
        LOOKED_UP, "values of the judgement that is replaced, in the store", "Changed",
        called="values before", later=True, stored=lambda p, known: (p.replaces, p.before) in known.replaced)] = None
    reason: Annotated[str | None, _GIVEN, only_if(), Statement(
        SIGNED_AND_LOOKED_UP, "the bench's key; the stored judgement", "Attempt", called="reason",
        stored=lambda p, known: p.reason == known.reason)] = None
    signed_because: Annotated[_Text, _filled, Statement(
        SIGNED_AND_LOOKED_UP, "the bench's key; the stored signature", "Signed", called="reason of signing",
        stored=lambda p, known: p.signed_because == known.signed_because)] = ""
    laboratory: Annotated[StatedLaboratory | None, _GIVEN, only_if(), Statement(
        SIGNED_AND_LOOKED_UP, "the bench's key; laboratory.toml as the store has it", "Laboratory",
        stored=lambda p, known: p.laboratory == known.laboratory)] = None
    number: Annotated[_Text, _filled, Statement(
        SIGNED_AND_LOOKED_UP, "the bench's key; its scheme in the store, where it stands once", "Number",
        stored=lambda p, known: not {p.number, re.sub(r"(?<=.)-\d+$", "", p.number)}.isdisjoint(known.numbered))] = ""
    approval: Annotated[Mapping[str, Any] | None, Statement(
        DERIVED_AND_SIGNED, "the program's own; a QA key's, of spec and models", "Spec", due=True)] = None
    head: Annotated[Head | None, only_if(), Statement(
        SIGNED_AND_LOOKED_UP, "signature of the bench; that event in its store", "Store", due=True)] = None
    bench: Annotated[_Text, _filled, Statement(
        SIGNED, "certificate of the authority; its key signs head and provenance", "Bench")] = ""
    result: Annotated[Mapping[str, str], Field(min_length=2, max_length=2), _filled, Statement(
        DERIVED_AND_SIGNED, "results.json and spec.toml; the bench's key",
        due=lambda p, own: own and bool(p.signature))] = field(default_factory=dict)
    authority: Annotated[_Text, _filled, Statement(
        SIGNED_AND_LOOKED_UP, "the bench's key; in the store, as that day", "Bench",
        stored=lambda p, known: bool(p.authority) is known.bench.authority)] = ""
    signature: Annotated[_Text, _filled, Statement(
        SIGNED, "the bench's key, over the serial and all of the provenance")] = ""
    crl: Annotated[_Text, _filled, Statement(
        SIGNED_AND_LOOKED_UP, "signature of the authority; its hash in the store",
        stored=lambda p, known: (digest_of(p.crl) if p.crl else None) == known.bench.crl)] = ""
    demo: Annotated[bool, _GIVEN, _filled, Statement(
        DERIVED, "the kind of authority that signed")] = False
    # fmt: on

    @property
    def head_bench(self) -> str | None:
        """Public key of the bench that signed the head, None without a head."""
        return self.head.bench if self.head else None


def _declared() -> Iterator[Statement]:
    hints = get_type_hints(Provenance, include_extras=True)
    for name in (each.name for each in fields(Provenance)):
        yield from (replace(s, field=f"provenance.{name}") for s in get_args(hints[name]) if isinstance(s, Statement))


PROVENANCE = tuple(_declared())


def differences(stated: Provenance, known: History, own: bool = True) -> list[str]:
    """Return the statements that the store has otherwise, by name: those of the bench if `known` is of one time of the
    bench, else those of the judgement. own: this program made the certificate; earlier ones stated less."""
    compared = [each for each in PROVENANCE if each.stored is not None and bool(each.called) is (known.bench is None)]
    nothing = Provenance()
    known_then = [s for s in compared if own or not s.later or getattr(stated, s.name) != getattr(nothing, s.name)]
    return [each.called or each.field for each in known_then if each.stored and not each.stored(stated, known)]


def needs_reason(verdict: str, *replaced: str | None) -> bool:
    """Return whether a certificate with another result is made with a reason only: one of an accepted unit in place of
    one of an accepted unit. A change of the verdict does not wait for words."""
    return verdict == UnitVerdict.ACCEPTED and UnitVerdict.ACCEPTED in replaced


def digest_of(listed: str) -> str:
    """Return the hash of a list of revoked keys, as the store keeps it."""
    return hashlib.sha256(listed.encode()).hexdigest()
