"""The lines of a form: one for each value that is typed and each file that is linked."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from accept.workflow.dialogue.step_effects import Place
from accept.workflow.steps import section
from accept.workflow.steps.plan import is_needed
from checks.declare import CsvTable, Form, Input, Series


@dataclass(frozen=True)
class FieldPlace:
    """The place of one value or file; index: place in a vector."""

    declared: Input
    index: int | None = None
    among_optional: bool = False  # no input of the form is needed more than the others

    @property
    def key(self) -> Place:
        return self.declared.name, self.index

    @property
    def is_file(self) -> bool:
        return isinstance(self.declared, Series | CsvTable)

    @property
    def unit(self) -> str:
        return "" if self.is_file else str(getattr(self.declared, "unit", ""))

    @property
    def name(self) -> str:
        declared = self.declared
        return declared.label if self.index is None else f"{getattr(declared, 'item', 'value')} {self.index + 1}"

    @property
    def label(self) -> str:
        needed = "" if is_needed(self.declared) or self.among_optional else " (optional)"
        return self.name[0].upper() + self.name[1:] + needed

    @property
    def default(self) -> float | None:
        return getattr(self.declared, "default", None)

    @property
    def hint(self) -> str:
        if self.is_file:
            return "F2: choose a file"
        return f"{self.default:g} {self.unit}" if self.default is not None else self.unit


def places(form: Form) -> Iterator[FieldPlace]:
    """Yield the places of a form, one per value that is typed or file that is linked."""
    alike = not any(map(is_needed, form.inputs))
    for declared, index in section.places(form.inputs):
        yield FieldPlace(declared, index, alike)


@dataclass(frozen=True)
class FieldLine:
    """One line. text: typed, not saved; pending: entries on their way to the store; doubted: the entry in question, as
    typed, or None; repeats: it is one more reading; refusal: why the last entry was not saved, "" for none."""

    place: FieldPlace
    text: str = field(default="", repr=False)
    pending: int = 0
    doubted: str | None = field(default=None, repr=False)
    question: str = field(default="", repr=False)
    repeats: bool = False
    refusal: str = field(default="", repr=False)
