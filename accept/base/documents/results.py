"""The record of a unit, which is its form from judging to store and certificate; and results.json, which lists them."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Self

from accept.base.documents.document import Document, only_if, unwritten
from checks.cause import Cause, because
from checks.declare import Measured
from checks.quantity import Contribution, Quantity
from checks.rounding import rounded, with_U
from checks.verdict import Finding, UnitVerdict

_filled = only_if(bool)

ALIKE, CONFIRMED, NAME = "alike", "confirmed_by", "name"  # keys of `folder` of a record
TYPED = "typed values"  # stands among `samples` for the input of a section that holds no record
CONCESSION = "use-as-is"  # the disposition by which a unit passes as it is
_TYPED = ": typed note: "  # between a check and the words of a note of `unit.toml`
SIMULATED = "SIMULATED - NOT A MEASUREMENT"  # of a unit of a training or a simulation, beside its verdict


def marked(word: str, simulated: bool) -> str:
    """Return the word of a verdict, with the mark of a unit that no instrument measured."""
    return f"{word}, {SIMULATED}" if simulated else word


def typed_note(check: str, words: str) -> str:
    """Return a note of `unit.toml` as a result lists it: marked and quoted, since others are the program's own."""
    quoted = words.replace('"', "'")
    return f'{check}{_TYPED}"{quoted}"'


def is_typed_note(note: str) -> bool:
    """Return whether a note of a result is marked as typed. Earlier programs did not mark them."""
    return note.partition(_TYPED)[0].isidentifier() and _TYPED in note


def unit_word(verdict: str, nonconformances: Collection[str], dispositions: Collection[Mapping[str, Any]] = ()) -> str:
    """Return the verdict of a unit for people, a key of `UNITS` in `accept.pictures.signs`: a held unit is called held
    everywhere, and a unit used as is, used as is."""
    called = {"conditional": "held", "incomplete": "held, incomplete"} if nonconformances else {}
    if any(given["disposition"]["choice"] == CONCESSION for given in dispositions):
        called["accepted"] = "accepted by concession"
    return called.get(str(verdict), str(verdict))


@dataclass(frozen=True)
class Information(Document):
    """A measured quantity that the spec does not limit."""

    check: Annotated[str, "the check that measured it"]
    quantity: Annotated[str, "its name, which ends in its unit"]
    value: Annotated[float | None, "null if it has none"]
    unit: str
    U: Annotated[float | None, "expanded uncertainty (k = 2), null if unknown"]
    reason: Annotated[str | None, "why it has no value"] = None
    note: str | None = None
    budget: Annotated[tuple[Contribution, ...], "contributions to U: `source`, `u`, `kind`"] = ()

    @classmethod
    def of(cls, check: str, quantity: Quantity) -> Self:
        """Return the entry of a measured quantity."""
        known = math.isfinite(quantity.value)
        reason = str(quantity.reason) if quantity.reason is not None else None if known else "no value"
        U = quantity.U if quantity.U is not None and math.isfinite(quantity.U) else None
        value = quantity.value if known else None
        return cls(check, quantity.name, value, quantity.unit, U, reason, quantity.note, quantity.budget)

    def measured(self) -> Quantity:
        """Return the quantity; its cause is known in words only."""
        reason = because(Cause.IN_WORDS, detail=self.reason) if self.reason else None
        return Quantity(
            self.quantity, math.nan if self.value is None else self.value, self.U, self.budget, reason, self.note
        )


@dataclass(frozen=True, kw_only=True)
class UnitHeader(Document):
    """The keys and sections of `unit.toml` that are carried into the record as they are: each is read by its type or by
    its rule in `accept.units.folder_header`, and its name is one of `checks.acceptance.RESERVED`."""

    serial: str
    kind: Annotated[str, "name of the product, such as `apa` or `strut`"]
    parts: Annotated[Mapping[str, str], "serials of the parts, by place"] = field(default_factory=dict)
    origin: Annotated[Mapping[str, str], _filled, "where it comes from: `lot`, `supplier`, `order`, `shift` ..."] = (
        field(default_factory=dict)
    )
    environment: Annotated[Mapping[str, Measured], _filled, "`temperature_C`, `humidity_percent`: `value`, `U`"] = (
        field(default_factory=dict)
    )
    provided: Annotated[
        Mapping[str, str], _filled, "who provided the values of a section, `customer` or an external provider"
    ] = field(default_factory=dict)
    simulated: Annotated[bool, _filled, "true: the unit was simulated, so its verdict is not about a real one"] = False


@dataclass(frozen=True, kw_only=True)
class UnitRecord(UnitHeader):
    """A unit in `units` of results.json. Keys from `copies` on are there only if they are not empty.

    From its judging to its certificate a unit is this record: events hold it, and results.json, results.csv, junit.xml,
    tables and screens are views of it. spec (as events name it) and panels (pictures as data by name) are not written.
    """

    verdict: UnitVerdict
    findings: Annotated[tuple[Finding, ...], "one for each quantity that the spec limits"]
    information: Annotated[tuple[Information, ...], "measured quantities without a limit"] = ()
    not_judged: Annotated[tuple[str, ...], "sections of `unit.toml` that the spec does not ask about"] = ()
    notes: tuple[str, ...] = ()
    inputs: Annotated[Mapping[str, str], "sha256 of every file that was read, by name"] = field(default_factory=dict)
    copies: Annotated[tuple[Mapping[str, Any], ...], _filled, "recordings that are filed elsewhere too"] = ()
    part_doubts: Annotated[tuple[str, ...], _filled, "doubts about its parts"] = ()
    action: Annotated[str | None, only_if(), "what to put right at the bench before it is measured again"] = None
    nonconformances: Annotated[tuple[str, ...], _filled, "what was found wrong with the part, and holds the unit"] = ()
    superseded: Annotated[
        Mapping[str, str], _filled, "of them by check: what earlier attempts hold against its evidence"
    ] = field(default_factory=dict)
    dispositions: Annotated[
        tuple[Mapping[str, Any], ...],
        _filled,
        "what released nonconformances, each as `nonconformance_decided`",
    ] = ()
    folder: Annotated[
        Mapping[str, str],
        _filled,
        "`name` of its folder if that is another serial, `confirmed_by` a person; `alike`: a serial like it",
    ] = field(default_factory=dict)
    calibration: Annotated[Mapping[str, Any] | None, only_if(), "the instruments behind the findings"] = None
    gap: Annotated[Mapping[str, Any] | None, only_if(), "the answer of the gap workflow, as gap.json"] = None
    models: Annotated[Mapping[str, Mapping[str, str]], _filled, "sha256 of the files of each model"] = field(
        default_factory=dict
    )
    samples: Annotated[Mapping[str, Mapping[str, str]], _filled, "sketches of its records, by record and channel"] = (
        field(default_factory=dict)
    )
    measured: Annotated[Mapping[str, str], _filled, "day of measuring, ISO, of each check that states it"] = field(
        default_factory=dict
    )
    rereadings: Annotated[
        Mapping[str, Mapping[str, str]],
        _filled,
        "quantities of recordings that were read otherwise before: `words`, `was`",
    ] = field(default_factory=dict)
    spec: Annotated[str, *unwritten("")] = field(default="", compare=False)
    panels: Annotated[Mapping[str, Any], *unwritten({})] = field(default_factory=dict, compare=False)

    @property
    def rows(self) -> tuple[Information | Finding, ...]:
        """What was measured: quantities without a limit, then the findings."""
        return *self.information, *self.findings

    @property
    def word(self) -> str:
        """The verdict as people read it."""
        return unit_word(self.verdict, self.nonconformances, self.dispositions)

    @property
    def marked_word(self) -> str:
        """The same, with the mark of a unit that no instrument measured."""
        return marked(self.word, self.simulated)

    def __repr__(self) -> str:
        """Return a line for the unit and one for each finding: what a notebook shows."""
        by_spec = f" by spec {self.spec.partition('@')[0]}" if self.spec else ""  # the store has it beside the record
        lines = [f"{self.serial} ({self.kind}): {marked(self.word + by_spec, self.simulated)}"]
        for f in self.findings:
            value = "" if f.value is None else f" {with_U(f.value, f.U) if f.U else rounded(f.value, None)}"
            why = "" if f.reason is None else f", {f.reason}"
            lines.append(f"  {f.quantity}{value}: {f.verdict.replace('_', ' ')}{why}")
        return "\n".join(lines)


@dataclass(frozen=True, kw_only=True, repr=False)
class ListedUnit(UnitRecord):
    """A unit as results.json lists it: its record, its certificate, and its attempts before if there were any."""

    certificate: Annotated[str | None, "its file beside results.json; null if none was asked for or written"] = None
    attempt: Annotated[int | None, only_if(), "number of its judgement"] = None
    earlier: Annotated[Mapping[str, Any] | None, only_if(), "how the attempts before ended, as in a certificate"] = None


@dataclass(frozen=True)
class SpecName(Document):
    """A spec that units were judged by."""

    name: str
    sha256: str


@dataclass(frozen=True)
class Refused(Document):
    """A folder that could not be judged."""

    path: str
    reason: str


@dataclass(frozen=True)
class ResultsDocument(Document):
    """The results of a batch."""

    accept_version: str
    spec: Annotated[SpecName | None, "the first of `specs`"]
    units: tuple[ListedUnit, ...]
    specs: Annotated[tuple[SpecName, ...], "one for each kind of unit"] = ()
    refused: Annotated[tuple[Refused, ...], "folders that could not be judged"] = ()
