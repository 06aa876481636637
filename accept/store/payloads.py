"""Every kind of event that a store holds, each with the typed payload that writes and reads it.

A kind grows by keys with a default, so that stores of earlier versions are read. No key changes its name or meaning."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Self

from accept.base.documents.document import Document, DocumentError, Number, only_if, unwritten
from accept.base.documents.results import CONCESSION, Information, UnitRecord
from accept.store.event import Event, NewEvent, StoreError
from checks.cause import Reason
from checks.verdict import Finding

KINDS: dict[str, type["Payload"]] = {}  # by what events of the kind are called


@dataclass(frozen=True)
class Payload(Document):
    """The content of an event of one kind. The store sets `typed` when it writes the event."""

    KIND: ClassVar[str]
    typed: Annotated[bool, only_if(bool), "no key was opened for the name of who acted"] = field(
        default=False, kw_only=True, compare=False
    )

    def __init_subclass__(cls, what: str) -> None:
        cls.KIND = what
        KINDS[what] = cls

    def about(self, subject: str = "", spec: str = "") -> NewEvent:
        """Return the event to append. subject: a unit's serial; spec: `name@sha256`. Raises DocumentError if the
        payload is not of its types: an unreadable event would block the store for ever."""
        payload = self.to_json()
        self.from_json(payload)
        return NewEvent(self.KIND, subject, payload, spec)

    @classmethod
    def of(cls, event: Event) -> Self:
        """Read the payload of an event of this kind. Raises StoreError naming the event and every key that is wrong."""
        if event.what != cls.KIND:
            raise StoreError(f"{event.name}: expected an event {cls.KIND}")
        try:
            return cls.from_text(event.payload)
        except DocumentError as e:
            raise StoreError(f"{event.name}: its payload cannot be used: {e}") from e


def payload_of(event: Event, *kinds: type[Payload]) -> Payload | None:
    """Read an event of one of these kinds, default any; None for another or later kind. Raises StoreError."""
    kind = KINDS.get(event.what)
    return kind.of(event) if kind is not None and (not kinds or kind in kinds) else None


@dataclass(frozen=True)
class PlaceInBatch(Document):
    """The place of a unit in the batch that judged it."""

    seq: Annotated[int, "number of the event `batch_started`"]
    place: Annotated[int, "place of the unit among its folders, 0, 1, 2 ..."]


@dataclass(frozen=True)
class UnitJudged(Payload, what="unit_judged"):
    """A unit was judged. Two judgements with equal hashes are the same judgement."""

    path: Annotated[str, "its folder"]
    inputs: Annotated[Mapping[str, str], "sha256 of every file that was read, by name"]
    spec_sha256: str
    code_sha256: Annotated[str, "hash of the program that judged"]
    result: Annotated[UnitRecord, "the unit's entry in results.json"]
    batch: Annotated[PlaceInBatch | None, only_if(), "if a batch judged it"] = None
    bench: Annotated[str, only_if(bool), "public key of the bench that judged it"] = ""
    reason: Annotated[str | None, only_if(), "why it was judged again; empty if no reason was given"] = None


@dataclass(frozen=True)
class UnitRefused(Payload, what="unit_refused"):
    """A folder could not be judged at all. It has no subject."""

    path: str
    reason: str


@dataclass(frozen=True)
class CertificateWritten(Payload, what="certificate_written"):
    """A certificate was written unsigned. Only early versions stored this."""

    path: str
    sha256: str


@dataclass(frozen=True)
class SignedBy(Document):
    """The person who decided, with a signature by a key of quality assurance."""

    person: str
    time: Annotated[str, "UTC, ISO 8601"]
    certificate: Annotated[str, "of the key, PEM"]
    signature: Annotated[str, "ECDSA with SHA-256 over kind, content, person and time, hexadecimal"]


MARK = "NONCONFORMANCE: "  # how the line of a nonconformance in `unit.toml` begins
CHOICES: Mapping[str, str] = {  # dispositions: as they are stored, and in words
    CONCESSION: "use as it is",
    "rework": "rework and measure again",
    "measure-again": "measure again",
    "return": "return to the supplier",
    "scrap": "scrap",
}


@dataclass(frozen=True)
class Disposition(Document):
    """The disposition of a unit that was not accepted."""

    choice: Annotated[str, "`use-as-is`, `rework`, `measure-again`, `return` or `scrap`"]
    reason: str
    signed: Annotated[SignedBy | None, only_if(), "it releases a nonconformance only with it"] = None

    def __str__(self) -> str:
        return f"{CHOICES[self.choice]}: {self.reason}"


@dataclass(frozen=True)
class CertificateSigned(Payload, what="certificate_signed"):
    """A certificate was signed and written."""

    path: str
    sha256: Annotated[str, "of the file with this signature"]
    role: Annotated[str, "`technician` or `qa`"]
    disposition: Annotated[Disposition | None, only_if(), "QA's decision about a unit that was not accepted"] = None
    before: Annotated[str | None, only_if(), "sha256 of the certificate that was countersigned"] = None
    number: Annotated[str, only_if(bool), "of the certificate, by the scheme of `laboratory.toml`"] = ""
    reason: Annotated[
        str, only_if(bool), "why the technician signed a unit that was not accepted, or replaced a certificate"
    ] = ""
    judged: Annotated[int, only_if(bool), "number of the event of the judgement that the technician signed"] = 0


@dataclass(frozen=True)
class BenchStated(Payload, what="bench_stated"):
    """A bench states this on its certificates beside their results, until its next such event. It has no subject."""

    bench: Annotated[str, "public key of the bench"]
    laboratory: Annotated[Mapping[str, Any] | None, "the keys of its `laboratory.toml`"]
    authority: Annotated[bool, "the authority's key lies at the bench"]
    crl: Annotated[str | None, "sha256 of the authority's list of revoked keys"]


@dataclass(frozen=True)
class KeysRevoked(Payload, what="keys_revoked"):
    """The authority revoked keys, or its newer list was brought to the bench. The list only grows. It has no
    subject."""

    authority: Annotated[str, "sha256 of its certificate"]
    number: Annotated[int, "of the list, which grows with every change"]
    crl: Annotated[str, "the list in full, PEM"]
    reason: Annotated[str, only_if(bool), "whose keys were revoked, and why"] = ""


@dataclass(frozen=True)
class BatchStarted(Payload, what="batch_started"):
    """A batch was started."""

    out: Annotated[str, "folder of its results"]
    units: Annotated[int, "how many unit folders were found"]
    specs: Annotated[Mapping[str, str], "spec of each kind of unit, `name@sha256`"]


@dataclass(frozen=True)
class BatchFinished(Payload, what="batch_finished"):
    """A batch came to its end."""

    verdicts: Annotated[Mapping[str, int], "number of units by verdict"]
    refused: Annotated[int, "number of folders that could not be judged"]


@dataclass(frozen=True)
class BaselineSet(Payload, what="baseline_set"):
    """The values of a quantity were made the baseline that later values are compared with."""

    quantity: str
    group: Annotated[str, "`all`, or what the chart is of, `bench: B1`"]
    since: Annotated[str, "first day of measuring, ISO"]
    until: Annotated[str, "last day"]
    mean: float
    sigma: Annotated[float, "standard deviation within the process"]
    n: Annotated[int, "values behind it"]
    left_out: Annotated[int, "gross values among them"]
    reason: Annotated[str, "why it was revised; empty for the first"] = ""
    scale: Annotated[
        str, only_if(bool), "of mean and sigma if not as measured: `square root`, `cube root`, `logarithm`"
    ] = ""
    signed: Annotated[SignedBy | None, only_if(), "without it, it replaces none that has it"] = None


@dataclass(frozen=True)
class SpecApproved(Payload, what="spec_approved"):
    """Quality assurance approved a spec. It has no subject; earlier programs stored none."""

    approval: Annotated[
        Mapping[str, Any], "name, hashes, person and time, with the signature, as certificates state it"
    ]


@dataclass(frozen=True)
class SerialConfirmed(Payload, what="serial_confirmed"):
    """A person confirmed the serial of a unit and told it apart from those that look like it."""

    unlike: Annotated[tuple[str, ...], "the serials that it was asked about"]


@dataclass(frozen=True)
class NonconformanceDecided(Payload, what="nonconformance_decided"):
    """Quality assurance decided about nonconformances of a unit, with a countersignature or without one."""

    nonconformances: tuple[str, ...]
    disposition: Disposition
    certificate: Annotated[
        str | None, only_if(), "of results.json alone: sha256 of what an earlier program countersigned with it"
    ] = None
    judged: Annotated[str, only_if(bool), "hash of the unit's last judgement; earlier programs did not sign it"] = ""


@dataclass(frozen=True)
class CopiesResolved(Payload, what="copies_resolved"):
    """Quality assurance decided to which unit a recording belongs that several units share."""

    parties: Annotated[
        tuple[tuple[str, str, str], ...], "serial, record and hash of its content, wherever it was found"
    ]
    measured: Annotated[tuple[tuple[str, str], ...], "serial and record of those that it does belong to"]
    reason: str
    signed: Annotated[SignedBy | None, only_if(), "the decision counts only with it"] = None


VOIDED = "voided"  # how an attempt ended that quality assurance declared void


@dataclass(frozen=True)
class AttemptVoided(Payload, what="attempt_voided"):
    """Quality assurance declared a judgement void: it counts in no statistic, and no certificate of it is valid."""

    attempt: Annotated[int, "number of the judgement of the unit, 1, 2, 3 ..."]
    judged: Annotated[int, "number of its event"]
    reason: str
    signed: Annotated[SignedBy | None, only_if(), "the decision counts only with it"] = None
    event: Annotated[str, only_if(bool), "hash of that event; earlier programs did not sign it"] = ""

    @property
    def words(self) -> str:
        """The decision in words: `wrong lead (Grace, 2026-10-12)`."""
        return f"{self.reason} ({self.signed.person}, {self.signed.time[:10]})" if self.signed else self.reason


@dataclass(frozen=True)
class Reference(Document):
    """Value that a quantity of a golden unit must have."""

    value: Number
    U: Annotated[Number | None, "expanded uncertainty (k = 2)"]
    unit: str
    n: Annotated[int, "judgements that it is the mean of"]


@dataclass(frozen=True)
class GoldenNamed(Payload, what="golden_named"):
    """A unit was made a golden unit, or its reference was changed."""

    expect: Annotated[str, "its verdict, `accepted` or `rejected`"]
    reference: Annotated[Mapping[str, Reference], only_if(bool), "by quantity; fixed until the unit is named again"] = (
        field(default_factory=dict)
    )
    reason: Annotated[str, only_if(bool), "why the reference was changed"] = ""
    signed_changes: Annotated[bool, only_if(bool), "later changes of golden units count only with a signature"] = False
    after: Annotated[int, only_if(bool), "number of the unit's last `golden_named` or `golden_retired`"] = 0
    signed: Annotated[SignedBy | None, only_if(), "a change counts only with it"] = None


@dataclass(frozen=True)
class GoldenRetired(Payload, what="golden_retired"):
    """A unit is no longer a golden unit."""

    reason: str
    after: Annotated[int, only_if(bool), "number of the unit's last `golden_named` or `golden_retired`"] = 0
    signed: Annotated[SignedBy | None, only_if(), "a change counts only with it"] = None


@dataclass(frozen=True)
class GoldenMet(Payload, what="golden_met"):
    """Every golden unit agreed with its reference. It lifts no stop."""

    serials: tuple[str, ...]
    bench: Annotated[str, only_if(bool), "public key of the bench"] = ""
    signed_changes: Annotated[bool, only_if(bool), "later changes of golden units count only with a signature"] = False


@dataclass(frozen=True)
class GoldenMissed(Payload, what="golden_missed"):
    """Golden units disagreed with their references: the bench is stopped."""

    serials: tuple[str, ...]
    reasons: Annotated[Mapping[str, tuple[str, ...]], "what differs, by serial"]
    bench: Annotated[str, only_if(bool), "public key of the bench; every bench of the store without it"] = ""
    signed_changes: Annotated[bool, only_if(bool), "later changes of golden units count only with a signature"] = False


@dataclass(frozen=True)
class GoldenResolved(Payload, what="golden_resolved"):
    """Quality assurance ended a stop of the bench by its golden units."""

    reason: str
    bench: Annotated[str, only_if(bool), "public key of the bench"] = ""
    missed: Annotated[int, only_if(bool), "number of the event that stopped it"] = 0
    signed: Annotated[SignedBy | None, only_if(), "the decision counts only with it"] = None


@dataclass(frozen=True)
class InstrumentCalibration(Document):
    """Certificate and due day of an instrument's calibration."""

    certificate: str
    due: Annotated[str, "ISO date"]


@dataclass(frozen=True)
class _Capture(Document):
    """The common keys of `captured` and `capture_failed`."""

    section: Annotated[str, "section of `unit.toml`"]
    instrument: Annotated[str, "its name in the bench file"]
    model: str | None
    serial: Annotated[str | None, "of the instrument"]
    calibration: InstrumentCalibration | None
    settings: Annotated[Mapping[str, Any], "what it was asked before the first reading"]
    readings: Annotated[tuple[Mapping[str, Any], ...], "both ends, if they are many; all are in the journal"]
    journal: Annotated[str, "file with all readings, in the unit's folder"]
    transcript: Annotated[tuple[tuple[Number, str, str], ...], "what went over the line: time [s], direction, text"]


@dataclass(frozen=True)
class SectionCaptured(_Capture, Payload, what="captured"):
    """An instrument was read into a unit folder."""

    entries: Annotated[Mapping[str, Any], "what was entered into the section"]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class CaptureFailed(_Capture, Payload, what="capture_failed"):
    """An instrument was read and gave no result."""

    reason: str


@dataclass(frozen=True)
class InstrumentChecked(Payload, what="instrument_checked"):
    """An instrument read a certified artefact. It has no subject; values are in `unit`, each U is expanded (k = 2)."""

    instrument: Annotated[str, "its name in the bench file"]
    serial: Annotated[str | None, "of the instrument"]
    time: Annotated[str, "ISO 8601, UTC"]
    what: Annotated[str, "the artefact"]
    certificate: Annotated[str, "of the artefact"]
    unit: str
    reference: Annotated[Number, "value of the artefact"]
    U_reference: Number
    value: Annotated[Number, "mean of the readings"]
    U: Annotated[Number, "of the instrument at that value"]
    readings: tuple[Number, ...]
    E_n: Annotated[Number, "difference over both uncertainties together"]
    passed: Annotated[bool, "E_n is at most 1"]
    evidence: Annotated[Mapping[str, Any], "what went over the line"]


@dataclass(frozen=True)
class RecordPickedUp(Payload, what="record_picked_up"):
    """A record was copied from a watched folder into a unit folder."""

    section: str
    input: str
    file: Annotated[str, "its name in the unit folder"]
    sha256: str
    origin: Annotated[str, "where it came from"]


@dataclass(frozen=True)
class AttemptStarted(Payload, what="attempt_started"):
    """An attempt at a unit began in the workflow."""

    number: Annotated[int, "1, 2, 3 ..."]
    kind: str
    parts: Mapping[str, str]
    reason: Annotated[str, "why there is another attempt"]
    channels: Annotated[
        Mapping[str, Any], only_if(bool), "channel -> its name in the laboratory's records, or where and in which unit"
    ] = field(default_factory=dict)
    simulated: Annotated[bool, only_if(bool), "no instrument measures the unit"] = False


@dataclass(frozen=True)
class RunOpened(Payload, what="run_opened"):
    """The present attempt of a unit was taken up again."""

    number: Annotated[int, "of the attempt"]


@dataclass(frozen=True)
class StepEntry:
    """An entry at a step, or a note. seq, who: those of its event; on: the day of measuring, ISO, as the fold of a unit
    states it."""

    seq: Annotated[int, *unwritten(0)] = field(default=0, kw_only=True)
    who: Annotated[str, *unwritten("")] = field(default="", kw_only=True)
    on: Annotated[str, *unwritten("")] = field(default="", kw_only=True)


@dataclass(frozen=True)
class ValueTaken(StepEntry, Payload, what="value_taken"):
    """A value was typed or read."""

    step: str
    form: str
    input: str
    value: Annotated[Number, "in `unit`"]
    U: Annotated[Number | None, "expanded uncertainty that was typed or read with it"]
    unit: str
    index: Annotated[int | None, "place in a vector"] = None
    repeat: Annotated[bool, "one more reading of the same value, not a correction"] = False
    text: Annotated[str, "what it was read from"] = ""
    source: Annotated[str, "`typed`, or the instrument's model and serial number"] = "typed"
    day: Annotated[str | None, only_if(), "day of measuring, ISO, if not the day of the entry"] = None
    evidence: Annotated[Mapping[str, Any] | None, only_if(), "of an instrument: its calibration and its line"] = None


@dataclass(frozen=True)
class ReadingFailed(Payload, what="reading_failed"):
    """An instrument gave no value."""

    step: str
    input: Annotated[str, "empty if it was read for several inputs of the step"]
    reason: str
    source: str
    evidence: Mapping[str, Any]


@dataclass(frozen=True)
class RecordLinked(StepEntry, Payload, what="record_linked"):
    """A record was copied into the folder of an attempt."""

    step: str
    form: str
    input: str
    file: str
    sha256: str
    origin: Annotated[str, "where it came from"]
    day: Annotated[str | None, only_if(), "as of a value"] = None
    source: Annotated[str | None, only_if(), "as of a value, if an instrument was read for it"] = None
    evidence: Annotated[Mapping[str, Any] | None, only_if(), "as of a value"] = None


@dataclass(frozen=True)
class RecordRefused(Payload, what="record_refused"):
    """A record that was given could not be taken."""

    step: str
    form: str
    input: str
    file: str
    origin: Annotated[str, "the path of the file"]
    written: Annotated[float, "when the file was written [s since 1970]"]
    cause: Reason
    action: Annotated[str, "what to do about it"]

    @property
    def line(self) -> str:
        """Return that the file was refused, and why."""
        why = str(self.cause)
        return f"refused: {why}" if self.file in why else f"{self.file} refused: {why}"


@dataclass(frozen=True)
class NotedFile(Document):
    """A photo or another file that belongs to a note, copied into the folder `notes` of the attempt."""

    name: Annotated[str, "in that folder"]
    sha256: str
    origin: Annotated[str, "where it came from"]
    printed: Annotated[str, only_if(bool), "the same picture scaled for print, which the certificate shows"] = ""


@dataclass(frozen=True)
class StepNoted(StepEntry, Payload, what="step_noted"):
    """The operator wrote a note."""

    step: str
    text: str
    nonconformance: Annotated[bool, "it says what is wrong with the part"]
    files: Annotated[tuple[NotedFile, ...], only_if(bool), "photos and other files"] = ()
    internal: Annotated[bool, only_if(bool), "it stays in the store and off the certificate"] = False

    def line(self, who: str) -> str:
        """Return the note as it stands in `unit.toml` and on the certificate, with the hashes of its files."""
        files = "".join(f"; file {file.name}, SHA-256 {file.sha256}" for file in self.files)
        return f"{self.text}{files} ({who})"

    @property
    def pictures(self) -> list[str]:
        """Return the pictures that the certificate shows."""
        return [file.printed for file in self.files if file.printed and not self.internal]


_HASHED = re.compile(r"; file ([^;]+), SHA-256 [0-9a-f]{64}")


def without_hashes(line: str) -> str:
    """Return a note's line with its files by their names alone, as screens show it."""
    return _HASHED.sub(r" [\1]", line)


@dataclass(frozen=True)
class StepRemeasured(Payload, what="step_remeasured"):
    """A step is measured again."""

    step: str
    reason: str


@dataclass(frozen=True)
class EntryUndone(Payload, what="entry_undone"):
    """An entry was taken back, or the beginning of an attempt at which nothing was done."""

    undoes: Annotated[int, "number of its event"]


@dataclass(frozen=True)
class StepJudged(Payload, what="step_judged"):
    """A step was judged by itself.

    spec, code: those of its event. Entries after `upto` make it stale."""

    step: str
    upto: Annotated[int, "number of the last entry that was judged"]
    findings: Annotated[tuple[Finding, ...], "as in results.json"]
    information: Annotated[tuple[Information, ...], "as in results.json"]
    notes: tuple[str, ...]
    spec: Annotated[str, *unwritten("")] = ""
    code: Annotated[str, *unwritten("")] = ""


@dataclass(frozen=True)
class GapExplained(Payload, what="gap_explained"):
    """The gap workflow explained the responses of an attempt."""

    upto: Annotated[int, "number of the last entry of the responses"]
    gap: Annotated[Mapping[str, Any], "as gap.json"]
