"""The inputs and the result of a recipe."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from accept.capture.operator_actions import OperatorActions
from accept.capture.reading_loop import ReadingLoop, Say
from checks.declare import Measured
from specs.spec import StatedU


@dataclass(frozen=True)
class CaptureSetup:
    """The inputs of a recipe. accuracy: of the instrument, by the bench file; known: values that are not asked for."""

    read: ReadingLoop
    actions: OperatorActions
    say: Say
    accuracy: StatedU | None = None
    known: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class RecordFile:
    """A record that a recipe made: the name that it should have, and its bytes."""

    name: str
    content: bytes


@dataclass(frozen=True)
class CaptureResult:
    """The result of a recipe by input of its check: values that were read, records, typed values; notes in words."""

    values: Mapping[str, Measured] = field(default_factory=dict)
    files: Mapping[str, RecordFile] = field(default_factory=dict)
    typed: Mapping[str, Measured] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def to_toml(self) -> dict[str, Any]:
        """Return the entries of a section of `unit.toml`; of U six digits."""
        values = {
            name: m.value if m.U is None else {"value": m.value, "U": float(f"{m.U:.6g}")}
            for name, m in {**self.values, **self.typed}.items()
        }
        return {**values, **{name: file.name for name, file in self.files.items()}}
