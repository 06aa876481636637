"""TDMS files, as National Instruments' recorders write them: channels in groups, and their time as increments.

The time is the channel "t" if the file has it, else that of the properties `wf_increment` and `wf_start_offset` of the
channels, if they agree. A file whose last segment was cut off is refused: nothing is repaired.
"""

import io
import logging
import math
from typing import Any

import numpy as np
from nptdms import TdmsFile
from nptdms.log import log_manager

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.variable import Variable, unique

TIME = "t"
log_manager.set_level(logging.ERROR)  # what it warns of is refused here, in one line
UNITS = {"volts": "V", "meters": "m", "newtons": "N", "seconds": "s"}  # as the maker's drivers write them


def open_tdms(file: str, raw: bytes) -> dict[str, Variable]:
    """Return the variables of the bytes of a TDMS file, named by channel alone if only one group has it. Raises
    RecordError and the errors that `damage.refused` converts."""
    found = TdmsFile.read_metadata(io.BytesIO(raw))
    if found.file_status.incomplete_final_segment:
        raise RecordError(f"{file}: its last segment is cut off; was it copied before the recorder had finished?")
    channels = [channel for group in found.groups() for channel in group.channels()]
    names = [channel.name for channel in channels]
    variables = []
    for channel in channels:
        if len(channel) > len(raw):
            raise RecordError(f"{file}: channel '{channel.name}' declares {len(channel)} values in {len(raw)} bytes")
        name = channel.name if names.count(channel.name) == 1 else f"{channel.group_name}/{channel.name}"
        variables.append(_variable(raw, channel, name))
    if TIME not in names and (time := _time(file, channels)):
        variables.append(time)
    return unique(file, variables)


def _variable(raw: bytes, channel: Any, name: str) -> Variable:
    kind, unit = channel.dtype, str(channel.properties.get("unit_string", "")).strip()
    if kind.kind not in "iuf":
        return Variable(name, (len(channel),), f"TDMS {kind}")
    group, own = channel.group_name, channel.name
    return Variable(name, (len(channel),), "double", lambda: _numbers(raw, group, own), UNITS.get(unit.lower(), unit))


def _numbers(raw: bytes, group: str, name: str) -> Array:
    with TdmsFile.open(io.BytesIO(raw)) as found:
        return np.asarray(found[group][name][:], np.float64).ravel()


def _time(file: str, channels: list[Any]) -> Variable | None:
    """Return the time that the channels with an increment have in common; None if no channel has an increment."""
    timed = [c for c in channels if "wf_increment" in c.properties and len(c)]
    ways = {(c.properties["wf_increment"], c.properties.get("wf_start_offset", 0.0), len(c)) for c in timed}
    if not ways:
        return None
    if len(ways) > 1:
        raise RecordError(f"{file}: its channels have {len(ways)} different times; one record has one")
    ((step, start, count),) = ways
    if not (isinstance(step, float) and isinstance(start, float) and math.isfinite(start) and step > 0):
        raise RecordError(f"{file}: wf_increment = {step!r}, wf_start_offset = {start!r}: no time")
    return Variable(TIME, (count,), "double", lambda: start + step * np.arange(count, dtype=np.float64), "s")
