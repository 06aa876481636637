"""The record of what was selected in a file: in its units, on one time base, vetted."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from checks.record import Record
from hw.records.limits import ReadLimits
from hw.records.stated.clocks import agreed, common_part, date_doubt
from hw.records.stated.statements import axis_of, clocks_of, is_time, spelled, time_unit, unit_of
from hw.records.variable import OWN_RECORD, Clock, Variable, Variables, listing
from hw.records.vet import loaded, vet_channel, vet_time
from specs.bench import TIME, Channels, ChannelSource
from specs.units import UnitMismatch, factor, to_si

GIVEN = "[channels]"  # a sampling time for files without one of their own
SILENT = (TIME, "wf_increment")  # sources of time that need no remark


@dataclass(frozen=True, eq=False)
class Selection:
    """What a record is made of: name here -> variable, its source as mapped, its unit here ("": SI of the file's own).

    found : all that the file holds; time : a vector of times that was named; step : a sampling time of all channels;
    remarks : on the selection.
    """

    channels: Mapping[str, Variable]
    sources: Channels
    units: Mapping[str, str]
    found: Variables
    time: Variable | None = None
    step: Clock | None = None
    remarks: tuple[str, ...] = ()


def assemble(file: str, sha256: str, chosen: Selection, limits: ReadLimits) -> Record:
    """Return the record of what was selected, in its units and on one time base. Raises RecordError."""
    own = OWN_RECORD in chosen.found
    counted = {**chosen.channels, **({TIME: chosen.time} if chosen.time else {})}
    total = sum(v.size for v in counted.values())
    if total > limits.max_samples:
        most = max(counted, key=lambda name: counted[name].size)
        raise RecordError(
            f"{file}: declares {total} samples, {counted[most].size} of them in channel '{most}'; "
            f"at most {limits.max_samples} are read"
        )
    read = {name: loaded(file, name, v) for name, v in counted.items()}
    remarks, units, arrays = list(chosen.remarks), {}, {}
    for name, x in read.items():
        v, given = counted[name], chosen.sources.get(name, ChannelSource())
        stated = time_unit(v.name, v.unit) if name == TIME else unit_of(v, chosen.found)
        wanted = "s" if name == TIME else chosen.units.get(name, "")
        scale, units[name], remark = _scale(file, name, given, stated, wanted)
        arrays[name] = x if scale == 1.0 else x * scale
        remarks += [remark] if remark else []
    axis = None
    if chosen.time is not None:
        given = chosen.sources.get(TIME, ChannelSource())
        in_seconds = own or bool(time_unit(chosen.time.name, chosen.time.unit) or given.unit)
        times = arrays.pop(TIME)
        vet_time(file, times, limits.min_samples)
        even = float((times[-1] - times[0]) / (times.size - 1))
        axis = Clock(chosen.time.name, even, float(times[0]), times, in_seconds=in_seconds)
        units.pop(TIME)
    t, firsts, said = _times(file, chosen, axis, {n: x.size for n, x in arrays.items()}, limits)
    if firsts is not None:
        arrays = {n: x[firsts[n] : firsts[n] + t.size] for n, x in arrays.items()}
    for name, x in arrays.items():
        vet_channel(file, name, units[name], x, t)
    for x in (t, *arrays.values()):
        x.flags.writeable = False
    remarks = [*said, *remarks]
    return Record(t, arrays, units, file, sha256, (f"{file}: {', '.join(remarks)}",) if remarks else ())


def _times(
    file: str, chosen: Selection, axis: Clock | None, sizes: Mapping[str, int], limits: ReadLimits
) -> tuple[Array, dict[str, int] | None, list[str]]:
    """Return the times (N,) [s] of a record, the first sample of each channel if they do not start together, and
    remarks. axis: a time vector that was named. Raises RecordError if the file states none, or several that contradict
    each other."""
    axes: dict[str, Clock] = {}
    known: dict[tuple[int, ...], Clock] = {}
    clocks: dict[str, Clock] = {}
    for name, v in chosen.channels.items():
        stated = clocks_of(v, chosen.found, axes)
        fallback = chosen.step is not None and chosen.step.source == GIVEN
        if axis is None and not _tells(stated):
            stated = [*_only_axis(file, v, chosen.found, axes), *stated]
        if chosen.step is not None and not (fallback and _tells(stated)):
            stated = [*stated, chosen.step] if _tells(stated) else [chosen.step, *stated]
        if axis is not None:  # its channels may state their step and start once more
            stated = [axis, *(c for c in stated if c.axis is None)] if v.clock is None else [*stated, axis]
        if _tells(stated):
            key = tuple(id(c) for c in stated)
            clocks[name] = known.get(key) or agreed(file, name, stated, limits.min_samples)
            known[key] = clocks[name]
    silent = [n for n in chosen.channels if n not in clocks]
    if silent and clocks:
        other = next(iter(clocks))
        raise RecordError(
            f"{file}: '{silent[0]}' states no time and no sampling time, '{other}' does ('{clocks[other].source}'); "
            "they cannot be taken together"
        )
    if silent:
        raise RecordError(
            f"{file}: lacks 't': it states no time (t, time) and no sampling time; give the sampling time with --ts "
            "SECONDS, of a unit in [channels] as t = { sampling_time_s = SECONDS }; it has " + listing(chosen.found)
        )
    return _time_base(file, clocks, axis, sizes, limits)


def _time_base(
    file: str, clocks: Mapping[str, Clock], axis: Clock | None, sizes: Mapping[str, int], limits: ReadLimits
) -> tuple[Array, dict[str, int] | None, list[str]]:
    first = next(iter(clocks.values()))
    remarks = [doubt for doubt in [date_doubt(first)] if doubt]
    source = first.source if axis is None else axis.source
    whole = first.axis if axis is None else axis.axis
    if whole is not None and source != TIME:
        remarks.append(f"time from '{source}'")
    elif whole is None and source not in SILENT and not source.endswith("X_Resolution"):
        remarks.append(f"sampling time {first.step:g} s from '{source}'")
    if whole is not None and all(c.axis is first.axis and c.origin == first.origin for c in clocks.values()):
        return whole, None, remarks
    firsts, count, cut = common_part(file, clocks, sizes)
    if cut and axis is not None:
        raise RecordError(f"{file}: '{axis.source}' is one time for all channels, but {cut.partition(':')[0]}")
    if count < limits.min_samples:
        raise RecordError(f"{file}: has {count} samples, at least {limits.min_samples} are needed")
    if whole is not None and not cut and whole.size == count:
        return whole, None, remarks
    latest = max(clocks.values(), key=lambda c: c.start)
    t = latest.start + latest.step * np.arange(count, dtype=np.float64)
    return t, firsts if cut else None, [*remarks, *([cut] if cut else [])]


def _tells(stated: Iterable[Clock]) -> bool:
    return any(c.axis is not None or c.step > 0 for c in stated)


def _only_axis(file: str, v: Variable, found: Variables, axes: dict[str, Clock]) -> list[Clock]:
    """Return the time vector of another structure that has the length of a channel. Raises RecordError if there are
    several that differ."""
    times = [at for at in found.values() if at.load and at.size == v.size > 1 and at is not v and is_time(at.name)]
    clocks = [axes.setdefault(at.name, axis_of(at)) for at in times]
    if any(not np.array_equal(np.asarray(c.axis), np.asarray(clocks[0].axis)) for c in clocks[1:]):
        named = ", ".join(c.source for c in clocks)
        raise RecordError(f"{file}: holds several time axes ({named}); name one of them as 't'")
    return clocks[:1]


def _scale(file: str, name: str, given: ChannelSource, stated: str, wanted: str) -> tuple[float, str, str]:
    """Return the factor of a channel, its unit, and a remark on a conversion. given: as mapped; stated: unit in the
    file; wanted: its unit here, "" for SI. Raises RecordError if they do not fit."""
    try:
        if given.unit and stated and factor(given.unit, stated) != 1.0:
            raise RecordError(f"{file}: channel '{name}' is in {stated}, [channels] has {given.unit}")
        unit = spelled(given.unit or stated)
        scale, here = (factor(unit, wanted) if unit else 1.0, wanted) if wanted else to_si(unit) or (1.0, unit)
    except UnitMismatch as e:
        raise RecordError(f"{file}: channel '{name}': {e}") from e
    if unit and not wanted and to_si(unit) is None:
        return given.gain, unit, f"{name} stays in {unit}"
    words = "" if scale == 1.0 or given.unit else f"{name} is in {unit}, converted to {here}"
    return given.gain * scale, here, words
