"""What the technician is told at each step: what the check says, else what its declaration tells."""

from checks.declare import Check, CsvTable, Form, Guide, Series


def guide_of(check: Check) -> Guide:
    """The guide of a check, made of its declaration where nobody wrote one."""
    return check.guide or Guide(f"{check.title}. Needed: {_ways(check)}.")


def _ways(check: Check) -> str:
    return ", or ".join(_needs(form) for form in check.forms)


def _needs(form: Form) -> str:
    words = [f"the file '{i.label}'" if isinstance(i, Series | CsvTable) else i.label for i in form.inputs]
    return " and ".join(words)
