"""Judging a unit by a spec, which gives findings. The workflow, the batch and the demo all call this."""

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from math import isfinite
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, ValidationError, create_model

from accept import units
from accept.base.documents.results import Information, UnitRecord, typed_note
from accept.base.fault_log import PLEASE_REPORT, log_fault
from accept.base.worker_process import memory_GB
from accept.judging.calibration import Statement
from accept.judging.rules import Case, judged
from accept.judging.samples import samples_of
from accept.models.evidence import Models, model_of
from accept.units import LoadedUnit, UnitError, UnitFolder, loaded
from checks.acceptance import CHECKS, with_temperature
from checks.cause import Cause, NoResult, Reason, because
from checks.declare import Check, Measured
from checks.errors import ModelError, RecordError
from checks.quantity import Outcome, Quantity
from checks.verdict import Finding, judge, largest_U, unit_verdict
from specs import plugins
from specs.plugins import BUILT_IN, product_named, products
from specs.spec import NAME, CheckSpec, Spec, load
from specs.strict import Finite, Positive, SpecError, Strict, problem_line

if TYPE_CHECKING:
    from checks.model import Model


def settings_problems(check: Check, given: Mapping[str, Any]) -> list[str]:
    """Return the errors in the settings that a spec gives a check, a line each with key path and value. A setting that
    the check does not declare is ignored."""
    declared: dict[str, Any] = {
        s.name: (_type(s.default, Positive if s.positive else Finite), ...) for s in check.settings if s.name in given
    }
    try:
        create_model("Settings", __base__=Strict, **declared).model_validate({name: given[name] for name in declared})
    except ValidationError as e:
        return [problem_line({**p, "loc": ("checks", check.name, "settings", *p["loc"])}) for p in e.errors()]
    return []


def _type(default: Any, number: Any) -> Any:
    """Return the type of a setting, derived from its default: a number, not negative if the default is not; a text; a
    pair, from and to; so many numbers or points; or, if the default is empty, any list of numbers. number: type of
    each."""
    if isinstance(default, str):
        return str
    if not isinstance(default, list | tuple):
        return Annotated[number, Field(ge=0)] if default >= 0 else number
    if not default:
        return list[number]
    if isinstance(default[0], list | tuple):
        return _so_many(_so_many(number, len(default[0])), len(default))
    numbers = _so_many(number, len(default))
    return Annotated[numbers, AfterValidator(_rising)] if len(default) == 2 and default[0] < default[1] else numbers


def _so_many(item: Any, count: int) -> Any:
    return Annotated[list[item], Field(min_length=count, max_length=count)]


def _rising(ends: list[float]) -> list[float]:
    if not ends[0] < ends[1]:
        raise ValueError(f"{ends[0]:g} to {ends[1]:g} is not a range; expected from < to")
    return ends


def default_spec(kind: str) -> Spec:
    """Return the spec of a product, checked like any. Raises ProductError, SpecError."""
    return load_spec(str(product_named(kind).spec))


def default_specs() -> list[Spec]:
    """Return the spec of every installed product. One of another package that cannot be used is left out and said, as a
    plug-in is. Raises SpecError."""
    found = []
    for name in list(products()):
        try:
            found.append(default_spec(name))
        except SpecError as e:
            if name in BUILT_IN:
                raise
            words = f"product '{name}' is left out: {' '.join(str(e).split())}"
            plugins.PROBLEMS.extend([words] if words not in plugins.PROBLEMS else [])
    return found


def load_spec(name: str) -> Spec:
    """Return a spec by name or file, checked against the checks' declarations. Raises SpecError with all problems."""
    spec = load(name)
    check_spec(spec, name)
    return spec


def check_spec(spec: Spec, called: str) -> None:
    """Raise SpecError if the declarations of the checks do not allow a spec, or its name is not one."""
    problems = [p for check, section in spec.checks.items() for p in spec_problems(spec.kind, check, section)]
    if not NAME.fullmatch(spec.name):
        problems.append(f"name = {spec.name[:70]!r}: expected 1 to 64 letters, digits, '.', '_' or '-'")
    if problems:
        raise SpecError(called, problems)


def spec_problems(kind: str, name: str, section: CheckSpec) -> list[str]:
    """Return what a spec asks of a check that the check does not know: quantities, settings, uncertainties."""
    where = f"[checks.{name}"
    if name not in CHECKS:
        return [f"{where}] unknown check (known: {', '.join(CHECKS)})"]
    check = CHECKS[name]
    applies = kind in check.kinds or name in product_named(kind).checks
    why = product_named(kind).absent.get(name)
    not_of = f"not of {kind}{f' ({why})' if why else ''}"
    problems = [] if applies else [f"{where}] is a check of {' and '.join(check.kinds)}, {not_of}"]
    settings = [s.name for s in check.settings]
    for part, given, known in (
        ("limits", section.limits, check.quantities),
        ("uncertainty", section.uncertainty, check.stated),
        ("settings", section.settings, settings),
    ):
        words = f"(known: {', '.join(known) or 'none'})"
        problems += [f"{where}.{part}.{key}] unknown name {words}" for key in given if key not in known]
    return problems + settings_problems(check, section.settings)


def judge_unit(
    given: UnitFolder | LoadedUnit,
    spec: Spec,
    stated: Statement | None = None,
    models: Models | None = None,
    own: bool = True,
) -> UnitRecord:
    """Judge every section of a unit that the spec asks about. Raises UnitError if the spec is for another kind.

    stated : the calibration of the instruments behind it; None without a bench file, then the result states none.
    own : False for a result of an earlier program, which let results fail that a wrong payload made fail, and did not
    weigh what unit.toml alone states. models : opens the models that the spec names; None opens built-in ones and files
    by their paths.
    """
    held = loaded(given)
    unit = held.folder
    if unit.kind != spec.kind:
        judges = f"'{spec.kind}' ({product_named(spec.kind).title})"
        problem = f"kind = '{unit.kind}', but spec {spec.name} judges {judges}: correct the kind, or name another spec"
        raise UnitError(unit.path / units.UNIT_FILE, [problem])
    models = models or Models()
    temperature = unit.header.environment.get("temperature_C")
    outcomes = {
        name: _at_temperature(_outcome(held, CHECKS[name], asked, models), asked, temperature)
        for name, asked in spec.checks.items()
    }
    quantities = [(name, quantity) for name, outcome in outcomes.items() for quantity in outcome.quantities]
    findings = tuple(f for name, asked in spec.checks.items() for f in _judged(name, asked, outcomes[name]))
    notes = [f"{name}: {note}" for name, outcome in outcomes.items() for note in outcome.notes]
    record = UnitRecord(
        **vars(unit.header),
        verdict=unit_verdict(findings),
        findings=findings,
        information=tuple(
            Information.of(n, q) for n, q in quantities if q.name not in spec.checks[n].limits and isfinite(q.value)
        ),
        not_judged=tuple(_not_judged(unit, spec)),
        notes=(*notes, *_notes_of_unit(held, spec)),
        inputs=dict(sorted(held.hashes.items())),
        spec=spec.with_hash,
        panels={f"{name}/{key}": p for name, outcome in outcomes.items() for key, p in outcome.panels.items()},
        calibration=stated,
        models=models.hashes(spec),
        measured=_days(unit, spec),
        samples=samples_of(held, dict.fromkeys(CHECKS[name].reads for name in spec.checks)),
    )
    known = {q.name: q for _, q in quantities if q.reason is None and isfinite(q.value)}
    return judged(record, Case(held, spec, models, known), own)


judge_unit.__dict__["judge_unit"] = judge_unit  # scripts from before this room had a door call it by its module


def _notes_of_unit(held: LoadedUnit, spec: Spec) -> list[str]:
    """Return which checks do not apply to the product, how columns of the records were converted, by section, and what
    the operator noted of the checks."""
    absent = product_named(spec.kind).absent.items()
    reads = [(CHECKS[n].reads, n, why) for n, why in absent if n in CHECKS]
    found = [f"{step}: {name} does not apply: {why}" for step, name, why in reads if step in spec.checks]
    for section in dict.fromkeys(CHECKS[name].reads for name in spec.checks):
        with suppress(RecordError, KeyError):  # said with the findings
            read = held.values(section).values()
            found += [f"{section}: {words}" for value in read for words in getattr(value, "remarks", ())]
    typed = ((name, lines) for name, lines in held.folder.notes.items() if name in spec.checks)
    return found + [typed_note(name, line) for name, lines in typed for line in lines]


def spec_warnings(spec: Spec) -> list[str]:
    """Return what leaves verdicts open in a spec: uncertainties that its own decision rules do not allow."""
    found = []
    for name, section in spec.checks.items():
        for quantity, limit in section.limits.items():
            stated, most = section.uncertainty.get(quantity), largest_U(limit)
            lower, upper = limit.bounds
            if stated is None or not isfinite(most):
                continue
            U = stated.at((lower + upper) / 2.0)
            if U > most:
                words = f"U = {U:.3g} {limit.unit} is above the {most:.3g} that rule '{limit.rule}' allows"
                found.append(f"[checks.{name}.uncertainty.{quantity}] {words}: no unit is accepted")
            if limit.U_max is not None and limit.U_max > most:
                words = f"U_max = {limit.U_max:.3g} {limit.unit} is above the {most:.3g}"
                found.append(f"[checks.{name}.limits.{quantity}] {words} that any U may be")
    return found


def _days(unit: UnitFolder, spec: Spec) -> dict[str, str]:
    """Return the day, ISO, on which the section of each check was measured, as far as the unit states it."""
    days = {name: unit.measured.get(name) or unit.measured.get(CHECKS[name].reads) for name in spec.checks}
    return {name: day.isoformat() for name, day in days.items() if day is not None}


def _outcome(held: LoadedUnit, check: Check, asked: CheckSpec, models: Models) -> Outcome:
    """Return the outcome of a check: every quantity that the spec limits, without a value if it was not determined; no
    quantity if nothing was measured and nothing is required."""
    section = held.folder.sections.get(check.reads)
    if section is None or not section.entries:
        if not asked.required:
            return Outcome((), ("not measured (the spec does not require it)",))
        return _completed(Outcome(()), asked, because(Cause.NOT_MEASURED))
    try:
        return _completed(_measure(held, check, asked, models), asked, because(Cause.NOT_IN_DATA))
    except NoResult as e:
        return _completed(Outcome((), panels=e.panels), asked, e.reason)
    except RecordError as e:
        return _completed(Outcome(()), asked, e.reason)


def _at_temperature(outcome: Outcome, asked: CheckSpec, temperature: Measured | None) -> Outcome:
    stated = asked.uncertainty
    return replace(
        outcome,
        quantities=tuple(
            with_temperature(q, stated[q.name], temperature) if q.name in stated else q for q in outcome.quantities
        ),
    )


def _completed(outcome: Outcome, asked: CheckSpec, reason: Reason) -> Outcome:
    found = {q.name for q in outcome.quantities}
    missing = [Quantity.missing(name, reason) for name in asked.limits if name not in found]
    return replace(outcome, quantities=(*outcome.quantities, *missing))


def _measure(held: LoadedUnit, check: Check, asked: CheckSpec, models: Models) -> Outcome:
    values = {**held.values(check.reads), **_model_of(check, asked, models)}
    try:
        return check.measure(values, asked)
    except (NoResult, RecordError):
        raise
    except MemoryError as e:
        raise NoResult(Cause.MEMORY_LIMIT, most=memory_GB()) from e
    except Exception as e:
        log_fault(f"{held.folder.serial}: judging {check.name}", e)
        raise NoResult(Cause.INTERNAL_ERROR, detail=f"{type(e).__name__}: {e}; {PLEASE_REPORT}") from e


def _model_of(check: Check, asked: CheckSpec, models: Models) -> "dict[str, Model]":
    """Return the model that a spec's setting names, opened here: checks read no files. Raises NoResult."""
    name = model_of(check.name, asked)
    if name is None:
        return {}
    try:
        return {"model": models.open(name)}
    except (SpecError, ModelError, OSError) as e:
        raise NoResult(Cause.MODEL_UNUSABLE, model=name, detail=str(e)) from e


def _judged(name: str, asked: CheckSpec, outcome: Outcome) -> list[Finding]:
    found = {q.name: q for q in outcome.quantities}
    return [judge(name, found[key], limit, asked.required) for key, limit in asked.limits.items() if key in found]


def _not_judged(unit: UnitFolder, spec: Spec) -> list[str]:
    return [
        f"{name} ({', '.join(section.files or section.entries)})"
        for name, section in unit.sections.items()
        if name not in {CHECKS[check].reads for check in spec.checks}
    ]


def spec_for(unit: UnitFolder, specs: Mapping[str, Spec]) -> Spec:
    """Return the spec of a unit's kind. Raises UnitError if the run has no such spec, or the serial does not have the
    form that the spec requires."""
    if unit.kind not in specs:
        have = ", ".join(f"{s.name} for '{k}'" for k, s in specs.items())
        raise UnitError(unit.path / units.UNIT_FILE, [f"kind = '{unit.kind}' has no spec in this run ({have})"])
    serial_fits(unit, specs[unit.kind])
    return specs[unit.kind]


def serial_fits(unit: UnitFolder, spec: Spec) -> None:
    """Raise UnitError if the serial does not have the form that the spec requires."""
    if not re.fullmatch(spec.serial_pattern, unit.serial):
        problem = f"serial = '{unit.serial}' does not fit the pattern {spec.serial_pattern} of spec {spec.name}"
        raise UnitError(unit.path / units.UNIT_FILE, [problem])
