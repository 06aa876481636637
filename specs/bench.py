"""The bench file: which instruments there are, how they are connected, how accurate, and until when calibrated."""

import datetime
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator

from specs.spec import StatedU
from specs.strict import Strict, Words, file_bytes, parse_as

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,40}$")]
OFFLINE = "offline"  # no wire to it: it stands in the file for its calibration


class LineEntry(Strict):
    """How the serial line is set; every key is required, for no value can be assumed."""

    port: Words
    baud: Annotated[int, Field(ge=50, le=921_600)]
    data_bits: Annotated[int, Field(ge=7, le=8)]
    parity: Words
    stop_bits: Annotated[int, Field(ge=1, le=2)]
    handshake: Words


class CalibrationEntry(Strict):
    """certificate: its number. calibrated: the first, due: the last day on which it holds."""

    certificate: Words
    calibrated: datetime.date | None = None
    due: datetime.date

    @field_validator("calibrated", "due", mode="before")
    @classmethod
    def _a_day(cls, day: object) -> object:
        if isinstance(day, datetime.datetime) or not isinstance(day, datetime.date):
            raise ValueError(f"expected a date such as 2027-05-01, got {day!r}")
        return day

    @model_validator(mode="after")
    def _in_order(self) -> "CalibrationEntry":
        if self.calibrated is not None and self.calibrated > self.due:
            raise ValueError(f"calibrated = {self.calibrated} is after due = {self.due}")
        return self


class InstrumentEntry(Strict):
    """One instrument. driver: which driver speaks to it, `offline` for none. measures: the checks it serves. link: its
    serial line; resource: where it is otherwise, a VISA name or host:number. settings: the driver's own. accuracy:
    expanded uncertainty (k = 2) of what it reads, by the check's input."""

    driver: Words
    measures: list[Words]
    model: Words | None = None
    serial: Words | None = None
    link: LineEntry | None = None
    resource: Words | None = None
    settings: dict[str, Any] = Field(default_factory=dict)
    accuracy: StatedU | None = None
    calibration: CalibrationEntry | None = None


class BenchDocument(Strict):
    """The TOML document. stage: file in which a simulated bench is told what the technician would do by hand."""

    name: Words
    stage: Words | None = None
    instruments: dict[Name, InstrumentEntry] = Field(min_length=1)

    @model_validator(mode="after")
    def _no_port_twice(self) -> "BenchDocument":
        ports = [entry.link.port for entry in self.instruments.values() if entry.link is not None]
        ports += [entry.resource for entry in self.instruments.values() if entry.resource is not None]
        twice = sorted({port for port in ports if ports.count(port) > 1})
        if twice:
            raise ValueError(f"port {', '.join(twice)} is given to two instruments")
        return self


class BenchFile(BenchDocument):
    """A bench file together with the bytes it was read from."""

    sha256: str
    text: str
    path: str


def load_bench(path: Path) -> BenchFile:
    """Bench of a TOML file. Raises SpecError listing every problem with its key path."""
    return parse_bench(file_bytes(path), str(path))


def parse_bench(raw: bytes, path: str) -> BenchFile:
    """Bench from the bytes of a TOML file; `path` is for messages. Raises SpecError."""
    return parse_as(BenchFile, BenchDocument, raw, path, path=path)
