"""`[[experiments]]` of `unit.toml`: the unit's responses once more, under another condition."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from accept.units.unit_entry import Entry, FileEntry, entry_of
from checks.acceptance import CHECKS
from checks.declare import Measured
from checks.gap.conditions.kinds import EXPERIMENT_KINDS, ExperimentKind

EXPERIMENTS = "experiments"
RECORDS = ("low", "high", "low_repeat", "high_repeat")
REQUIRED = ("low", "high")


@dataclass(frozen=True, eq=False)
class UnitExperiment:
    """One entry. name: its kind, with its place in the list where there is more than one of a kind; entries: records
    and value by key; problem: why its values cannot be used."""

    name: str
    kind: ExperimentKind
    entries: Mapping[str, Entry]
    problem: str | None = None

    @property
    def files(self) -> list[str]:
        return [e.name for e in self.entries.values() if isinstance(e, FileEntry)]

    @property
    def value(self) -> float | None:
        """In the unit of its key; None for a kind without one."""
        given = self.entries.get(self.kind.value.name) if self.kind.value else None
        return given.value if isinstance(given, Measured) else None


def experiments_of(data: Mapping[str, Any], problems: list[str]) -> tuple[UnitExperiment, ...]:
    """The list, in order; what is wrong with it goes into `problems`."""
    listed = data.get(EXPERIMENTS, [])
    if not isinstance(listed, list) or not all(isinstance(each, dict) for each in listed):
        problems.append(f"{EXPERIMENTS} = {listed!r}: expected sections [[{EXPERIMENTS}]]")
        return ()
    found: list[UnitExperiment] = []
    for number, content in enumerate(listed, 1):
        one = _experiment(f"[[{EXPERIMENTS}]] {number}:", content, [e.kind.name for e in found], problems)
        if one is not None:
            found.append(one)
    return tuple(found)


def _experiment(
    where: str, content: Mapping[str, Any], before: list[str], problems: list[str]
) -> UnitExperiment | None:
    given = content.get("kind")
    if not isinstance(given, str) or given not in EXPERIMENT_KINDS:
        said = "kind is missing" if given is None else f"kind = {given!r}"
        problems.append(f"{where} {said}: expected one of {', '.join(EXPERIMENT_KINDS)}")
        return None
    kind, records = EXPERIMENT_KINDS[given], CHECKS["frf"].inputs
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
    entries: dict[str, Entry] = {}
    unusable: list[str] = []
    for key, declared in known.items():
        entry = entry_of(where, declared, content[key], problems, unusable) if key in content else None
        if entry is not None:
            entries[key] = entry
    count = before.count(given) + 1
    return UnitExperiment(given if count == 1 else f"{given}_{count}", kind, entries, "; ".join(unusable) or None)
