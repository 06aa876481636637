"""Requirements of a spec on the bench that a model learned: its age at the measurement, and how many units it is from.

A bench changes: an amplifier is exchanged, a screw of the guide works loose. What was learned before that makes a
misalignment out of it. All that is compared here is on the certificate, so that it can be judged again from it.
"""

from collections.abc import Mapping
from datetime import date

from accept.models.evidence import Models, model_of
from checks.cause import Cause, Reason, because
from checks.errors import ModelError
from specs.model_sections import LearnedBenchRecord
from specs.spec import LearnedBenchLimits, Spec
from specs.strict import SpecError


def learned_bench_doubts(spec: Spec, models: Models, measured: Mapping[str, str]) -> dict[str, Reason]:
    """Return check -> why the learned bench of its model does not meet the spec. measured: check -> day, ISO."""
    if spec.learned_bench is None:
        return {}
    found = {}
    for check, asked in spec.checks.items():
        name = model_of(check, asked)
        if name is None:
            continue
        try:
            record = models.learned_bench(name)
        except (SpecError, ModelError, OSError):
            continue  # the check has no result for that reason
        if problem := learned_bench_problem(spec.learned_bench, record, measured.get(check)):
            found[check] = because(Cause.LEARNED_BENCH, model=name, detail=problem)
    return found


def learned_bench_problem(
    asked: LearnedBenchLimits, record: LearnedBenchRecord | None, measured: str | None
) -> str | None:
    """Return why a learned bench does not meet the limits, None if it does. measured: the unit's day, ISO; without one
    the age is unknown, which never passes."""
    if record is None:
        return "it has no learned bench, and the spec asks for one"
    if asked.from_units is not None and len(record.units) < asked.from_units:
        return f"its bench was learned from {len(record.units)} units, the spec asks for {asked.from_units}"
    if asked.within_days is None:
        return None
    if measured is None:
        return "the age of its learned bench is unknown, because [measured] of unit.toml does not state the day"
    try:
        days = (date.fromisoformat(measured) - date.fromisoformat(record.learned_on or "")).days
    except ValueError:
        return f"learned_on = '{record.learned_on or ''}' is no day, so the age of its learned bench is unknown"
    if days > asked.within_days:
        return f"its bench was learned {days} days before the unit was measured, the spec allows {asked.within_days}"
    return None
