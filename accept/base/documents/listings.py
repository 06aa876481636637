"""The answers of commands that list or show, for `--json`: each one document."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from accept.base.documents.document import Document, Number, only_if


@dataclass(frozen=True)
class SpecListed(Document):
    """A spec that comes with the program."""

    name: str
    kind: Annotated[str, "the product that it judges"]
    title: str
    checks: tuple[str, ...]
    sha256: str


@dataclass(frozen=True)
class SpecList(Document):
    """Specs that come with the program."""

    specs: tuple[SpecListed, ...]


@dataclass(frozen=True)
class LimitShown(Document):
    """A limit of a spec."""

    check: str
    required: Annotated[bool, "whether a unit without this check is incomplete"]
    quantity: str
    lower: Number | None
    upper: Number | None
    unit: str
    rule: str
    source: str
    assumed: Annotated[bool, "no document states it"]


@dataclass(frozen=True)
class SpecShown(Document):
    """A spec with its limits."""

    name: str
    kind: str
    title: str
    sha256: str
    limits: tuple[LimitShown, ...]


@dataclass(frozen=True)
class SpecValueDiffers(Document):
    """A value that two specs state otherwise."""

    key: Annotated[str, "its place in the file, by dots"]
    first: Annotated[Any, "null if not stated"]
    second: Any


@dataclass(frozen=True)
class SpecsCompared(Document):
    """Two specs, or two revisions of one."""

    first: SpecListed
    second: SpecListed
    differences: tuple[SpecValueDiffers, ...]


@dataclass(frozen=True)
class ProductListed(Document):
    """An installed product."""

    name: str
    title: str
    spec: str
    model: str | None
    parts: tuple[str, ...]
    package: Annotated[str, "`built-in`, or name and version of the package that brings it"]


@dataclass(frozen=True)
class ProductList(Document):
    """Installed products."""

    products: tuple[ProductListed, ...]


@dataclass(frozen=True)
class ModelListed(Document):
    """A model that comes with the program."""

    name: str
    about: str


@dataclass(frozen=True)
class ModelList(Document):
    """Models that come with the program."""

    models: tuple[ModelListed, ...]


@dataclass(frozen=True)
class ParameterShown(Document):
    """A parameter of a model."""

    name: str
    value: Annotated[Number | None, "null: infinite, which leaves its element out"]
    unit: str
    calibrated: bool
    sd: Annotated[Number | None, "of its prior; null without one"]


@dataclass(frozen=True)
class ModelShown(Document):
    """A model with its parameters."""

    name: str
    apa: Annotated[str, "type of the APA's model"]
    sha256: str
    tolerance: Annotated[Number, "of |H|, relative"]
    channels: tuple[str, ...]
    parameters: tuple[ParameterShown, ...]
    effects: Annotated[tuple[Mapping[str, Any], ...], "added to it, in order: name and parameters"]


@dataclass(frozen=True)
class EffectListed(Document):
    """An effect that `accept gap` can name."""

    name: str
    title: str
    parameters: tuple[str, ...]
    channels: tuple[str, ...]
    sign: Annotated[str, "how it shows"]
    experiment: Annotated[str, "the measurement that shows it alone"]
    sources: tuple[str, ...]


@dataclass(frozen=True)
class EffectList(Document):
    """Effects of the gap analysis."""

    effects: tuple[EffectListed, ...]


@dataclass(frozen=True)
class TableListed(Document):
    """A precomputed table of the misalignment."""

    file: str
    model: str
    grid: Annotated[str, "values of dx x values of dy"]
    state: Annotated[str, "`whole`, `yes` for the model that was asked about, or `no` and why"]


@dataclass(frozen=True)
class TableList(Document):
    """Tables that are there."""

    tables: tuple[TableListed, ...]


@dataclass(frozen=True)
class FaultListed(Document):
    """A fault of a simulated unit."""

    name: str
    kinds: Annotated[tuple[str, ...], "products that can have it"]
    about: str
    shows: Annotated[tuple[tuple[str, str], ...], "quantity and verdict"]


@dataclass(frozen=True)
class FaultList(Document):
    """Faults that a simulated unit can have."""

    faults: tuple[FaultListed, ...]


@dataclass(frozen=True)
class InstrumentListed(Document):
    """An instrument or a recorder of the bench file."""

    name: str
    driver: str
    measures: tuple[str, ...]
    model: str | None
    serial: str | None
    recorder: bool
    place: Annotated[str | None, "its port or resource"]
    there: Annotated[bool | None, "whether its port is there; null without a port"]
    calibrated_until: Annotated[str | None, "day, ISO; null if it is not known"]
    days_left: Annotated[int | None, "until that day"]
    problem: Annotated[str | None, "why no driver takes its entry"]


@dataclass(frozen=True)
class BenchListing(Document):
    """The bench file, and the serial ports that are there."""

    bench: str | None
    file: str
    instruments: tuple[InstrumentListed, ...]
    serial_ports: tuple[str, ...]


@dataclass(frozen=True)
class InstrumentAsked(Document):
    """The answer of an instrument."""

    name: str
    model: Annotated[str | None, "as it says itself"]
    serial: str | None
    value: Annotated[Number | None, "in `unit`; null of a recorder, or if it failed"]
    unit: str | None
    more: Annotated[Mapping[str, Number], "values that came with it"]
    connect_s: Number | None
    reading_s: Number | None
    problem: Annotated[str | None, "why it failed"]


@dataclass(frozen=True)
class InstrumentsAsked(Document):
    """Instruments that were asked for one reading."""

    file: str
    instruments: tuple[InstrumentAsked, ...]


@dataclass(frozen=True)
class PlaceSeen(Document):
    """A port or an instrument on a network."""

    place: str
    found: Annotated[str, "in words"]
    entry: Annotated[str, "proposed for the bench file; may be empty"]


@dataclass(frozen=True)
class PlacesSeen(Document):
    """Ports and network instruments that were found."""

    places: tuple[PlaceSeen, ...]


@dataclass(frozen=True)
class KeyListed(Document):
    """A key of the bench."""

    role: str
    person: str
    valid_from: Annotated[str, "UTC, ISO 8601"]
    valid_to: str
    revoked: Annotated[str | None, "since when"]
    sha256: Annotated[str, "of the certificate"]


@dataclass(frozen=True)
class KeyList(Document):
    """The authority and every person's key."""

    keys: tuple[KeyListed, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class EventListed(Document):
    """An event of the store."""

    seq: int
    time: Annotated[str, "UTC, ISO 8601"]
    who: str
    what: str
    subject: str
    spec: str
    code: str
    hash: str
    words: Annotated[str, "its verdict, role or reason"]
    payload: Any


@dataclass(frozen=True)
class EventList(Document):
    """Events of the store, in their order."""

    holds: Annotated[bool, "whether the chain is unbroken"]
    problem: str | None
    events: tuple[EventListed, ...]


@dataclass(frozen=True)
class EvidenceFolder(Document):
    """A folder for an auditor."""

    made: Annotated[str, "day and time, UTC"]
    units: tuple[str, ...]
    files: Annotated[Mapping[str, str], "sha256 of each file of the folder, by name"]
    missing: Annotated[tuple[str, ...], "what was not there when it was made"]
    signature: Annotated[str, only_if(bool), "by the bench's key, over all the other keys"] = ""


@dataclass(frozen=True)
class StoreChecked(Document):
    """The chain of events, walked."""

    holds: bool
    lines: tuple[str, ...]


@dataclass(frozen=True)
class TouchListed(Document):
    """An event in which an instrument touched a unit."""

    unit: str
    time: Annotated[str, "UTC, ISO 8601"]
    how: str
    seq: int


@dataclass(frozen=True)
class Recall(Document):
    """Units that an instrument touched, or that a bench judged."""

    instrument: Annotated[str, "empty: all that this bench judged"]
    since: str
    known: Annotated[bool, "whether it ever touched a unit"]
    units: tuple[str, ...]
    touches: tuple[TouchListed, ...]
    until: str | None = None


@dataclass(frozen=True)
class ReferenceListed(Document):
    """The reference of a golden unit for a quantity."""

    quantity: str
    value: Number
    U: Number | None
    unit: str
    n: Annotated[int, "judgements that it is from"]


@dataclass(frozen=True)
class GoldenListed(Document):
    """A golden unit."""

    serial: str
    expected: str
    named_by: str
    time: Annotated[str, "UTC, ISO 8601"]
    references: tuple[ReferenceListed, ...]


@dataclass(frozen=True)
class GoldenList(Document):
    """Golden units, and whether they stop the bench."""

    units: tuple[GoldenListed, ...]
    stopped: Annotated[Mapping[str, tuple[str, ...]] | None, "problems by serial; null: the bench is not stopped"]


@dataclass(frozen=True)
class GoldenCompared(Document):
    """A golden unit against its reference."""

    serial: str
    expected: str
    measured: Annotated[bool, "whether it was judged since the shift began"]
    problems: tuple[str, ...]


@dataclass(frozen=True)
class GoldensCompared(Document):
    """Golden units against their references."""

    units: tuple[GoldenCompared, ...]


@dataclass(frozen=True)
class SignatureVerified(Document):
    """A signature on a certificate."""

    person: str
    role: str
    time: Annotated[str, "UTC, ISO 8601"]


@dataclass(frozen=True)
class VerificationDocument(Document):
    """The verification of a certificate."""

    outcome: Annotated[str, "`valid`, `signed` (not fully verified) or `not_valid`"]
    reason: str
    unfulfilled: Annotated[tuple[str, ...], "of what `--require` and `--spec` asked"]
    serial: str
    verdict: str
    spec_sha256: str
    demo: bool
    approved: Annotated[bool, "quality assurance signed its spec, or the spec comes with the program"]
    current: Annotated[bool | None, "no later attempt is known; null: neither a store nor a list was asked"]
    countersigned: bool
    signatures: tuple[SignatureVerified, ...]
    details: Annotated[tuple[str, ...], "a line for each thing that was checked"]
    simulated: Annotated[bool, "no instrument measured the unit: it is no acceptance of a real one"] = False
