"""The steps of a unit, from its spec; the inputs of each are those that its check declares."""

from dataclasses import dataclass

from checks.acceptance import CHECKS
from checks.declare import Check, CsvTable, Form, Guide, Input, Scalar, Series
from specs.spec import CheckSpec, Spec


@dataclass(frozen=True, eq=False)
class WorkflowStep:
    """One check of one spec, with the technician's guide. derived: it evaluates the data of another step."""

    check: Check
    asked: CheckSpec
    guide: Guide
    derived: bool = False

    @property
    def name(self) -> str:
        return self.check.name

    @property
    def title(self) -> str:
        return self.check.title

    @property
    def short(self) -> str:
        return self.check.short or self.check.title[:16].rstrip()

    def form(self, name: str | None) -> Form:
        """Return the form of that name, else the first that needs no file, else the first."""
        named = [form for form in self.check.forms if form.name == name]
        typed = [form for form in self.check.forms if not has_files(form)]
        return (named or typed or list(self.check.forms))[0]

    def form_with(self, declared: str) -> Form:
        """Return the first form that holds an input of this name."""
        return next(form for form in self.check.forms if any(i.name == declared for i in form.inputs))


def steps_of(spec: Spec) -> tuple[WorkflowStep, ...]:
    """Return a step per check, in the order of the spec."""
    asked = [(CHECKS.of_kind(name, spec.kind), section) for name, section in spec.checks.items()]
    return tuple(
        WorkflowStep(check, section, guide_of(check), check.reads != check.name and check.reads in spec.checks)
        for check, section in asked
    )


def has_files(form: Form) -> bool:
    """Return whether a form asks for a file."""
    return any(isinstance(i, Series | CsvTable) for i in form.inputs)


def needs_rig(step: WorkflowStep) -> bool:
    """Return whether a step takes records of its own, which are made at the rig."""
    return not step.derived and any(isinstance(i, Series) for form in step.check.forms for i in form.inputs)


def is_needed(declared: Input) -> bool:
    """Return whether a form is incomplete without this input."""
    has_default = isinstance(declared, Scalar) and declared.default is not None
    return not declared.optional and not has_default


def guide_of(check: Check) -> Guide:
    """Return the guide of a check, or one made of its declaration if it has none."""
    ways = [
        " and ".join(f"the file '{i.label}'" if isinstance(i, Series | CsvTable) else i.label for i in form.inputs)
        for form in check.forms
    ]
    return check.guide or Guide(f"{check.title}. Needed: {', or '.join(ways)}.")
