"""The checks in words, from what they declare: `docs/reference/checks.md` is written by this."""

import inspect
from collections.abc import Iterable

from checks.acceptance import CHECKS
from checks.consistency import RELATIONS, check_consistency
from checks.declare import Check, CsvTable, Form, Input, Scalar, Series, Vector

HEAD = """# The checks

Written by `accept spec checks` from the checks' own declarations.
"""


def all_checks() -> str:
    """Return Markdown of every check: what it needs, what it measures, what a spec may set."""
    return "\n".join([HEAD, *(_check(check) for check in CHECKS.values()), _relations()])


def _relations() -> str:
    rows = "\n".join(
        f"- {r.title} (`{r.one}`, `{r.other}`): {r.lo:g} to {r.hi:g}. Why so wide: {r.why}." for r in RELATIONS
    )
    about = inspect.getdoc(inspect.getmodule(check_consistency))
    return f"## Measurements that must agree\n\n{about}\n\n{rows}\n"


def _check(check: Check) -> str:
    own = check.reads == check.name
    forms = "\n".join(_form(form) for form in check.forms) if own else f"- reads the data of `{check.reads}`"
    settings = "".join(f"\n- setting `{s.name}` = `{s.default}`: {s.meaning}" for s in check.settings)
    stated = f"\n- a spec may state the uncertainty of: {_codes(check.stated)}" if check.stated else ""
    return f"""## {check.name}: {check.title}

{_about(check)}

{forms}
- measures: {_codes(check.quantities)}{stated}{settings}
"""


def _about(check: Check) -> str:
    """Return the module's docstring, which says what is measured, and the kinds of unit."""
    text = inspect.getdoc(inspect.getmodule(check.measure)) or ""
    kinds = ", ".join(check.kinds)
    return f"{text}\n\nFor: {kinds}."


def _form(form: Form) -> str:
    return f"- give ({form.name}): " + "; ".join(_input(i) for i in form.inputs)


def _input(declared: Input) -> str:
    optional = ", optional" if declared.optional else ""
    match declared:
        case Scalar():
            return f"`{declared.name}`, {declared.label} [{declared.unit}]{optional}"
        case Vector():
            return f"`{declared.name}`, {declared.size} values [{declared.unit}], {declared.label}{optional}"
        case CsvTable():
            return f"`{declared.name}`, {declared.label}: columns {', '.join(declared.columns)}{optional}"
        case Series():
            channels = ", ".join(f"{name} [{unit}]" for name, unit in declared.channels.items())
            return f"`{declared.name}`, {declared.label}: record with {channels}{optional}"


def _codes(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
