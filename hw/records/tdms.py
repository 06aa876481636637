"""TDMS files, as National Instruments' recorders write them: channels in groups, and their time as increments.

Times are stated by the properties `wf_increment`, `wf_start_time` and `wf_start_offset` of each channel. A scale that
cannot be applied is refused by its name, and so is a file whose last segment was cut off: nothing is repaired."""

import io
import logging
import math
import re
from collections import Counter
from functools import partial
from typing import Any

import numpy as np
from nptdms import TdmsFile
from nptdms.log import log_manager

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.clocks import seconds
from hw.records.contents.variable import CLOCK, Clock, Variable, unique
from specs.units import UnitMismatch, factor, is_unit, parse_header, spelled

TIME = "t"
MOST_SCALES = 100  # of one channel
log_manager.set_level(logging.ERROR)  # a warning of it is refused here, in one line
# Scales that npTDMS applies (`nptdms.scaling`); raw counts stay as they are if a file states another one.
SCALES = {
    "Linear",
    "Polynomial",
    "RTD",
    "Strain",
    "Table",
    "Thermistor",
    "Thermocouple",
    "Add",
    "Subtract",
    "AdvancedAPI",
}
_SCALE = re.compile(r"NI_Scale\[(\d+)\]_Scale_Type")
_EXPORT = "export the file with scaled values"
_UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription")


def open_tdms(file: str, raw: bytes) -> dict[str, Variable]:
    """Return the variables of a TDMS file's bytes, by channel alone if one group has it. Raises as `damage.refused`."""
    found = TdmsFile.read_metadata(io.BytesIO(raw), raw_timestamps=True)
    if found.file_status.incomplete_final_segment:
        raise RecordError(f"{file}: its last segment is cut off; was it copied before the recorder had finished?")
    channels = [channel for group in found.groups() for channel in group.channels()]
    names = Counter(channel.name for channel in channels)
    first = min((s for c in channels if (s := _start_of(c)) is not None), default=(0, 0))
    variables = []
    for channel in channels:
        if len(channel) > len(raw):
            raise RecordError(f"{file}: channel '{channel.name}' declares {len(channel)} values in {len(raw)} bytes")
        name = channel.name if names[channel.name] == 1 else f"{channel.group_name}/{channel.name}"
        variables.append(_variable(file, raw, found, channel, name, first))
    timed = [v for v in variables if v.clock is not None]
    if TIME not in names and timed:
        variables.append(Variable(TIME, timed[0].shape, CLOCK))
    return unique(file, variables)


def _variable(file: str, raw: bytes, found: Any, channel: Any, name: str, first: tuple[int, int]) -> Variable:
    p, shape = channel.properties, (len(channel),)
    units = [text for n in _UNIT_PROPERTIES if (text := str(p.get(n, "")).strip())]
    if is_unit(spelled(of_name := parse_header(channel.name)[1])) and of_name:
        units.append(of_name)  # `de (nm)`
    x_name, x_unit = (str(p.get(n, "")).strip() for n in ("wf_xname", "wf_xunit_string"))
    if "freq" in x_name.lower() or x_unit.endswith("Hz"):
        return Variable(name, shape, f"spectrum over {x_name or x_unit}")
    group, own = channel.group_name, channel.name
    clock = partial(_clock, file, channel, first, x_unit) if "wf_increment" in p else None
    problem = _unit_problem(units) or _scale_problem(channel, (p, found[group].properties, found.properties))

    def load() -> Array:
        if problem:
            raise RecordError(f"{file}: channel '{name}' {problem}")
        with TdmsFile.open(io.BytesIO(raw)) as again:
            return np.asarray(again[group][own][:], np.float64).ravel()

    if getattr(channel.data_type, "__name__", "") == "TimeStamp":  # a column of dates is a time vector
        return Variable(name, shape, "double", lambda: _dates(raw, group, own), "s")
    if not problem and channel.dtype.kind not in "iuf":
        return Variable(name, shape, f"TDMS {channel.dtype}")
    return Variable(name, shape, "double", load, spelled(units[0] if units else ""), clock=clock)


def _unit_problem(units: list[str]) -> str:
    """Return the contradiction if a channel states two units, of which one at least is known; "" otherwise."""
    for other in units[1:]:
        known = [is_unit(spelled(unit)) for unit in (units[0], other)]
        if spelled(units[0]) != spelled(other) and any(known) and not (all(known) and _is_same(units[0], other)):
            return f"states two units, {units[0]} and {other}: correct one of them"
    return ""


def _is_same(unit: str, other: str) -> bool:
    try:
        return factor(spelled(unit), spelled(other)) == 1.0
    except UnitMismatch:
        return False


def _scale_problem(channel: Any, levels: tuple[Any, ...]) -> str:
    """Return why the numbers would stay raw although the channel, its group or its file states a scale; "" if not."""
    for p in levels:
        scales = {int(named[1]): str(value) for key, value in p.items() if (named := _SCALE.fullmatch(key))}
        stated = set(scales.values())
        if max(p.get("NI_Number_Of_Scales", 0), *scales, 0) > MOST_SCALES:  # npTDMS makes a list of so many
            return f"states more than {MOST_SCALES} scales; {_EXPORT}"
        status = p.get("NI_Scaling_Status", "")
        if status == "scaled":
            continue
        if unknown := sorted(stated - SCALES):
            return f"states the scale {', '.join(unknown)}, which cannot be applied here: its values are raw; {_EXPORT}"
        count = int(p.get("NI_Number_Of_Scales", len(stated)))
        if stated and count == 0:
            words = f"states the scale {', '.join(sorted(stated))} and NI_Number_Of_Scales = 0"
            return f"{words}: its values are raw; {_EXPORT}"
        if status == "unscaled" and count == 0:
            return f"holds raw values and states no scale; {_EXPORT}"
        if count:
            break  # the nearest scale counts
    try:
        _ = channel.dtype  # looks every scale up
    except (LookupError, ValueError) as e:
        return f"states a scale that cannot be read ({e}); {_EXPORT}"
    return ""


def _dates(raw: bytes, group: str, name: str) -> Array:
    """Return dates as seconds from the first one: whole seconds apart from their fractions of 2^-64 s."""
    with TdmsFile.open(io.BytesIO(raw), raw_timestamps=True) as found:
        read = found[group][name][:]
    whole, parts = read.seconds, read.second_fractions
    return np.asarray((whole - whole[0]).astype(np.float64) + (parts.astype(np.float64) - float(parts[0])) * 2.0**-64)


def _start_of(channel: Any) -> tuple[int, int] | None:
    """Return the date of the first sample (seconds since 1904 and fractions of 2^-64 s), None if not stated."""
    stamps = [channel.properties.get(n) for n in ("wf_start_time", "NI_ExpStartTimeStamp")]
    known = [s for s in stamps if s is not None and s.seconds > 0]
    return (int(known[0].seconds), int(known[0].second_fractions)) if known else None


def _clock(file: str, channel: Any, first: tuple[int, int], x_unit: str) -> Clock:
    """Return the times of a channel from the earliest start in the file. Raises RecordError for other content."""
    p, date = channel.properties, _start_of(channel)
    step, offset = p["wf_increment"], p.get("wf_start_offset", 0.0)
    if not (isinstance(step, float) and isinstance(offset, float) and math.isfinite(offset) and 0 < step < math.inf):
        raise RecordError(f"{file}: wf_increment = {step!r}, wf_start_offset = {offset!r}: no time")
    scale = seconds(x_unit or "s")
    if date is None:
        return Clock("wf_increment", scale * step, scale * offset, origin="no date")
    since = date[0] - first[0] + (date[1] - first[1]) * 2.0**-64
    shown = str(
        np.datetime64("1904-01-01", "us") + np.timedelta64(date[0] * 10**6 + ((date[1] * 10**6 + 2**63) >> 64), "us")
    )
    return Clock("wf_increment", scale * step, since + scale * offset, shown=shown)
