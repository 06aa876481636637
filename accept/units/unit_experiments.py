"""`[[experiments]]` of `unit.toml`: the unit's responses once more, under another condition."""

from collections.abc import Mapping
from typing import Any

from accept.units.unit_entry import UnitSection, section_of
from checks.acceptance import CHECKS
from checks.gap import EXPERIMENT_KINDS, ExperimentKind

EXPERIMENTS = "experiments"
RECORDS = ("low", "high", "low_repeat", "high_repeat")
REQUIRED = ("low", "high")
Experiments = Mapping[str, UnitSection[ExperimentKind]]  # by kind, the second and later of one with its number


def experiments_of(data: Mapping[str, Any], product: str, problems: list[str]) -> Experiments:
    """Return the experiments in order; faults are added to `problems`."""
    listed = data.get(EXPERIMENTS, [])
    if not isinstance(listed, list) or not all(isinstance(each, dict) for each in listed):
        problems.append(f"{EXPERIMENTS} = {listed!r}: expected sections [[{EXPERIMENTS}]]")
        return {}
    found: dict[str, UnitSection[ExperimentKind]] = {}
    for number, content in enumerate(listed, 1):
        one = _experiment(f"[[{EXPERIMENTS}]] {number}:", content, product, problems)
        if one is not None:
            name, count = one.declared.name, 1 + sum(other.declared is one.declared for other in found.values())
            found[name if count == 1 else f"{name}_{count}"] = one
    return found


def _experiment(
    where: str, content: Mapping[str, Any], product: str, problems: list[str]
) -> UnitSection[ExperimentKind] | None:
    given = content.get("kind")
    if not isinstance(given, str) or given not in EXPERIMENT_KINDS:
        said = "kind is missing" if given is None else f"kind = {given!r}"
        problems.append(f"{where} {said}: expected one of {', '.join(EXPERIMENT_KINDS)}")
        return None
    kind, records = EXPERIMENT_KINDS[given], CHECKS.of_kind("frf", product).inputs
    known = {key: records[key] for key in RECORDS} | ({kind.value.name: kind.value} if kind.value else {})
    problems += [
        f"{where} {key}: unknown key (known of {given}: kind, {', '.join(known)})"
        for key in content
        if key != "kind" and key not in known
    ]
    needed = (*REQUIRED, *([kind.value.name] if kind.value else []))
    problems += [f"{where} {key} is missing: {given} needs {', '.join(needed)}" for key in needed if key not in content]
    if "high_repeat" in content and "low_repeat" not in content:
        problems.append(f"{where} high_repeat without low_repeat: a second realisation begins with the low record")
    return section_of(kind, where, known, {key: content[key] for key in known if key in content}, problems)
