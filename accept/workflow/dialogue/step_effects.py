"""Effects that the dialogue at a step asks for. Text that was typed may be a passphrase: no representation has it."""

from dataclasses import dataclass, field
from enum import Enum

from accept.workflow.steps.unit_list import Queue
from checks.declare import CsvTable, Form, Input, Measured, Series

Place = tuple[str, int | None]  # name of an input, index in a vector


Do = Enum("Do", "JUDGE MEASURE STOP UNDO END_QUEUE ASK_REASON ASK_NOTE ASK_REMEDY")


@dataclass(frozen=True)
class LookForRecords:
    """Look for records that fit the forms. then: `opened`, `chosen`, `mended` lay out a form with what was found;
    `again` and `turn` run beside everything else."""

    forms: tuple[Form, ...]
    then: str


@dataclass(frozen=True)
class Recognize:
    """Look up a text that was typed. is_file: it may name a file; may_be_serial: no entry of this line reads so."""

    place: Place
    text: str = field(repr=False)
    is_file: bool
    may_be_serial: bool
    repeat: bool = False


@dataclass(frozen=True)
class StoreEntry:
    """Store an entry: a value that was typed; a file, by its name in the folder of the records or its path; a reading
    of the instrument, without a text."""

    place: Place
    declared: Input
    text: str = field(default="", repr=False)
    measured: Measured | None = None
    repeat: bool = False

    @property
    def is_file(self) -> bool:
        return isinstance(self.declared, Series | CsvTable)

    @property
    def is_reading(self) -> bool:
        return self.measured is None and not self.is_file


@dataclass(frozen=True)
class Settle:
    """Wait until all is saved, and judged if that is asked for; `settled` follows."""

    then: str
    judged: bool = False


@dataclass(frozen=True)
class Leave:
    """Close the screen. result: True for the next step, False for the list of steps, the name of a step for its place
    there, None for the summary."""

    result: bool | str | None


@dataclass(frozen=True)
class GoToUnit:
    """Open the unit whose serial was scanned."""

    serial: str
    queue: Queue


@dataclass(frozen=True)
class NextUnit:
    """Open the next unit of a queue. words: about the unit that is left; goes_on: the queue from there, None for the
    same; ends: the queue is over if no other unit waits."""

    queue: Queue
    words: str
    goes_on: Queue | None = None
    ends: bool = False


@dataclass(frozen=True)
class PickFile:
    """List the files of the folder. first: the one on top."""

    place: Place
    declared: Series | CsvTable
    first: str


@dataclass(frozen=True)
class ReturnLater:
    """Wait until everything that was typed ahead has arrived; `returned` follows."""

    place: Place
