"""Inputs of findings: what scales, maps or selects a measurement, beside the samples themselves.

An editor can choose what stands in a unit's own file alone, so it supports no acceptance by itself: spec or bench file
state the same, or the finding is conditional.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from accept.judging.calibration import Statement
from accept.pictures.labels import CHANNELS, input_words, source_words
from accept.units import UNIT_FILE, FileEntry, LoadedUnit, UnitSection
from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, because, together
from checks.declare import Check, Measured, Scalar, Series
from checks.verdict import UsedInput
from specs.bench import ChannelSource, channel_source
from specs.spec import Spec
from specs.units import unit_of

Inputs = Mapping[str, tuple[UsedInput, ...]]  # by check
SPEC, DEFAULT = "spec", "default"
TEMPERATURE = "temperature_C"


def inputs_of(held: LoadedUnit, spec: Spec, stated: Statement | None) -> Inputs:
    """Return the inputs of the findings of each check that the unit has data for: what its section holds, numbers
    beside records that it leaves to the spec, mapped channels, the temperature if the uncertainty depends on it, and
    settings of the spec other than the defaults. stated: by the bench file, None without one."""
    found, stated = {}, stated or {}
    for name, asked in spec.checks.items():
        check = CHECKS[name]
        section = held.folder.sections.get(check.reads)
        if section is None or not section.entries:
            continue
        used = [*_entries(check, section, spec, stated), *_channels(held, section, stated)]
        temperature = held.folder.header.environment.get(TEMPERATURE)
        if temperature is not None and any(u.percent_per_C for u in asked.uncertainty.values()):
            used.append(UsedInput(TEMPERATURE, temperature.value, "°C", UNIT_FILE, temperature.U))
        for setting in check.settings:
            value = _plain(asked.settings.get(setting.name, setting.default))
            if setting.name not in check.inputs and value != _plain(setting.default):
                used.append(UsedInput(setting.name, value, unit_of(setting.name), SPEC))
        known = (each if math.isfinite(each.U or 0.0) else replace(each, U=None) for each in used)
        found[name] = tuple(replace(each, value=_finite(each.value)) for each in known)
    return found


def _finite(value: Any) -> Any:
    """Return a value with each number that JSON does not have as text: what is entered may be NaN."""
    if isinstance(value, list):
        return [_finite(each) for each in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def input_doubts(inputs: Inputs) -> dict[str, Reason]:
    """Return check -> which of its inputs neither spec nor bench file state as they were used."""
    doubted = {check: [_reason(check, one) for one in used if one.against] for check, used in inputs.items()}
    return {check: together(reasons) for check, reasons in doubted.items() if reasons}


def _reason(check: str, used: UsedInput) -> Reason:
    if used.name.startswith(CHANNELS):
        how = source_words(channel_source(used.value))
        return because(Cause.CHANNEL_SCALED, channel=used.name.removeprefix(CHANNELS), how=how)
    return because(Cause.INPUT_NOT_STATED, input=input_words(check, used), source=used.source, against=used.against)


def _entries(check: Check, section: UnitSection[Check], spec: Spec, stated: Statement) -> Iterator[UsedInput]:
    """Yield what the section holds, and the numbers beside its records that it leaves to spec or default."""
    for name, declared in check.inputs.items():
        given = section.entries.get(name)
        if isinstance(given, FileEntry):
            yield UsedInput(name, given.name, "", UNIT_FILE)
        elif isinstance(given, Measured):
            others = _others(check, name, given.value, spec, stated) if section.files else (None, None)
            yield UsedInput(name, given.value, unit_of(name), UNIT_FILE, given.U, *others)
        elif given is not None:
            yield UsedInput(name, given.tolist(), unit_of(name), UNIT_FILE)
        elif isinstance(declared, Scalar) and section.files and (told := _told([check], name, spec)):
            yield UsedInput(name, told[0], unit_of(name), told[1], None, *_others(check, name, told[0], spec, stated))


def _told(checks: list[Check], name: str, spec: Spec) -> tuple[float, str] | None:
    """Return a number as the spec states it for one of these checks, or by default, and which of the two; or None."""
    given = (spec.checks[c.name].settings for c in checks if c.name in spec.checks)
    set_by_spec = next((settings[name] for settings in given if name in settings), None)
    if set_by_spec is not None:
        return float(set_by_spec), SPEC
    defaults = [s.default for c in checks for s in c.settings if s.name == name]
    defaults += [i.default for i in [checks[0].inputs[name]] if isinstance(i, Scalar) and i.default is not None]
    return (float(defaults[0]), DEFAULT) if defaults else None


def _others(check: Check, name: str, value: float, spec: Spec, stated: Statement) -> tuple[str | None, str | None]:
    """Return what the bench file, or if it does not mention it the spec, states of a number instead, and what the spec
    does if the bench file supports the number; None where they state the same within the U that the spec states."""
    checks = [check, CHECKS[check.reads]]
    told = _told(checks, name, spec)
    allowed = (spec.checks[c.name].uncertainty.get(name) for c in checks if c.name in spec.checks)
    uncertainty = next((u for u in allowed if u is not None), None)

    def other(source: str, number: float) -> str | None:
        U = uncertainty.at(number) if uncertainty else 0.0
        if math.isclose(value, number, rel_tol=1e-9, abs_tol=U):
            return None
        return f"the {source} {'is' if source == DEFAULT else 'says'} {number:.10g} {unit_of(name)}"

    by_spec = other(told[1], told[0]) if told else None
    at_bench = stated.get("values", {}).get(check.reads, {}).get(name)
    if at_bench is None:
        return (by_spec if told else "neither spec nor bench file state it"), None
    against = other("bench file", at_bench)
    return against, None if against or by_spec is None else f"as the bench file says; {by_spec}"


def _channels(held: LoadedUnit, section: UnitSection[Check], stated: Statement) -> Iterator[UsedInput]:
    """Yield the channels of the section's records that `[channels]` of unit.toml maps or scales."""
    files = [e.declared for e in section.entries.values() if isinstance(e, FileEntry)]
    series = [declared for declared in files if isinstance(declared, Series)]
    read = {n for s in series for n in (*s.channels, *s.optional_channels, *([s.step] if s.step else []))}
    known = stated.get("channels", {})
    for name in sorted(read & held.folder.channels.keys()):
        source = held.folder.channels[name]
        at_bench = known.get(name) == source.model_dump(exclude_defaults=True)
        against = None if at_bench or not _decides(name, source, held, section) else "no bench file states it"
        yield UsedInput(f"{CHANNELS}{name}", source.to_toml(), "", UNIT_FILE, None, against)


def _decides(name: str, source: ChannelSource, held: LoadedUnit, section: UnitSection[Check]) -> bool:
    """Return whether a source differs from the file: by its scale, or as the file has this name too, or another's."""
    if source.gain != 1.0 or source.unit or source.sampling_time_s is not None:
        return True
    return held.renames(name, source.name, section)


def _plain(value: Any) -> Any:
    return [_plain(v) for v in value] if isinstance(value, list | tuple) else value
