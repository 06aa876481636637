"""Record files to records: the channels that a check declares (unit folders), or those sampled with an input (`accept
frf`, `--hammer`, the API). Stated times and units are used, or the file is refused."""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path, PurePath

import numpy as np

from checks.arrays import Array
from checks.declare import Series
from checks.errors import RecordError
from checks.record import Record
from hw.records.clocks import (
    agreed,
    clocks_of,
    common_part,
    date_doubt,
    is_time,
    only_axis,
    plain,
    tells,
    time_unit,
    unit_of,
)
from hw.records.contents.variable import CLOCK, NESTED, OWN_RECORD, Clock, Variable, Variables, listing, remarks_of
from hw.records.damage import refused
from hw.records.foreign_structures import expand
from hw.records.limits import DEFAULT_LIMITS, ReadLimits
from hw.records.source import Source, load_bytes
from hw.records.text.file import open_csv
from hw.records.vet import loaded, vet_channel, vet_step, vet_time
from specs.bench import NO_CHANNELS, TIME, Channels, ChannelSource, channel_source
from specs.units import UnitMismatch, factor, parse_column, spelled, to_si

OBJECTS = "MATLAB objects (timeseries, Dataset) cannot be read: write the run with hw/records/matlab/accept_export.m"
GIVEN = "[channels]"  # a sampling time for files without one of their own
SILENT = (TIME, "wf_increment")  # sources of time that need no remark
FORCE = "N"  # unit by which the input of a hammer test is found, if one channel alone has it


@dataclass(frozen=True, eq=False)
class Selection:
    """The parts of a record: name here -> variable, its source as mapped, its unit here ("": SI of the file's own).

    found : the file's content; time : a named time vector; step : sampling time of all; remarks : on the selection."""

    channels: Mapping[str, Variable]
    sources: Channels
    units: Mapping[str, str]
    found: Variables
    time: Variable | None = None
    step: Clock | None = None
    remarks: tuple[str, ...] = ()


def read(
    path: Path,
    series: Series,
    rename: Mapping[str, str | ChannelSource] = NO_CHANNELS,
    limits: ReadLimits = DEFAULT_LIMITS,
) -> Record:
    """Return the record of a file: see `record_of`. Raises RecordError, also if the file cannot be read."""
    return record_of(load_bytes(path, limits.max_bytes), series, rename, limits)


def record_of(
    source: Source,
    series: Series,
    rename: Mapping[str, str | ChannelSource] = NO_CHANNELS,
    limits: ReadLimits = DEFAULT_LIMITS,
) -> Record:
    """Return the record of the bytes of a .mat (MATLAB 5 to 7.3), .csv, .uff or .tdms file; the content shows which.

    series : the channels to read and their units; the time is the vector "t" [s], another statement of the file, or
    starts at 0 in steps of the scalar `series.step` [s]. rename : channel here -> name in the file, with gain and unit.
    Channels that are not variables of the file are searched in its structures, as of Simulink, Speedgoat and dSPACE.
    The arrays are read-only. Raises RecordError with file, channel, found and expected value for anything that could
    make a verdict wrong; nothing is repaired."""
    with refused(source.file):
        sources = {here: channel_source(there) if isinstance(there, str) else there for here, there in rename.items()}
        found = source.variables()
        if OWN_RECORD in found:
            sources = {}
        return assemble(source.file, source.sha256, _declared(source.file, found, series, sources), limits)


def declared_samples(name: str, raw: bytes, most: int) -> int:
    """Return how many numbers a file declares, 0 if it cannot be read; no structure beyond `most` is unpacked."""
    source = Source(name, PurePath(name).suffix.lower(), raw)
    with suppress(RecordError), refused(name):
        if source.is_text:
            return sum(map(raw.count, (b"\n", b"\r", b",", b";", b"\t", b" ")))
        found = source.variables()
        unpacked = sum(v.unpacked for v in found.values()) // np.dtype(float).itemsize
        every = () if unpacked > most else expand(name, found).values()
        return max(unpacked, sum(v.size for v in every if v.load is not None))
    return 0


def record_by_input(
    source: Source,
    input: str,
    channels: Channels = NO_CHANNELS,
    step_s: float | None = None,
    units: Mapping[str, str] = NO_CHANNELS,  # type: ignore[assignment]
    mapped_only: bool = False,
    step_name: str | None = None,
) -> Record:
    """Return the record of every vector sampled with an input; its remarks state the mapping.

    channels : name here -> source in the file; units : of known names, others are in SI; step_s : sampling time of a
    file without one; step_name : scalar with the sampling time of all channels; mapped_only : read the channels of
    `channels` only. Raises RecordError with the file's contents."""
    if step_s is not None and not (math.isfinite(step_s) and step_s > 0):
        raise RecordError(f"--ts {step_s:g}: expected a sampling time above 0 s")
    with refused(source.file):
        found = open_csv(source.file, source.raw) if source.is_text else source.variables()
        remarks = remarks_of(found)
        channels = NO_CHANNELS if OWN_RECORD in found else channels
        own = {n: v for n, v in found.items() if n == step_name}
        found = {n: v for n, v in found.items() if n != step_name}
        chosen = _by_input(source.file, found, input, channels, units, mapped_only)
        given = channels[TIME].sampling_time_s if TIME in channels else None
        step = (
            Clock(f"--ts {step_s:g}", step_s)
            if step_s is not None
            else _step_of(source.file, own[step_name])
            if step_name in own
            else Clock(GIVEN, given)
            if given is not None
            else None
        )
        return assemble(
            source.file, source.sha256, replace(chosen, step=step, remarks=(*chosen.remarks, *remarks)), DEFAULT_LIMITS
        )


def _declared(file: str, found: Variables, series: Series, sources: Channels) -> Selection:
    """Return the declared channels in the file. Raises RecordError if a required one is missing."""

    def theirs(name: str) -> str:
        there = (sources[name].name or name) if name in sources else name
        return there if there in found else parse_column(there)[0]

    remarks = remarks_of(found)
    names = [n for n in series.channels if n != TIME]
    plainly = {n: v for n, v in found.items() if v.kind not in NESTED}
    if any(theirs(n) not in plainly for n in names):
        found = {**found, **expand(file, found), **plainly}
    wanted: dict[str, Variable] = {}
    missing = []
    for name in [*names, *series.optional_channels]:
        hits = _hits(theirs(name), found)
        if len(hits) > 1:
            raise RecordError(f"{file}: '{theirs(name)}' may be {', '.join(hits)}; name one of them in full")
        if hits:
            wanted[name] = found[hits[0]]
        elif name in names:
            missing.append(f"'{name}'" if theirs(name) == name else f"'{name}' (here '{theirs(name)}')")
    if missing:
        objects = any(v.kind in ("opaque", "object") for v in found.values())
        raise RecordError(
            f"{file}: lacks {', '.join(missing)}; it has {listing(found)}{f'; {OBJECTS}' if objects else ''}"
        )
    _refuse_twins(file, wanted)
    time, step = None, None
    named = theirs(TIME) if TIME in sources and sources[TIME].name else TIME
    if hits := [n for n in _hits(named, found) if found[n].kind != CLOCK and not (named == TIME and found[n].home)]:
        time = found[hits[0]]
    if series.step is not None and theirs(series.step) in found:
        step, time = _step_of(file, found[theirs(series.step)]), None
    elif TIME in sources and (given := sources[TIME].sampling_time_s) is not None:
        step = Clock(GIVEN, given)
    units = {**series.channels, **series.optional_channels}
    return Selection(wanted, sources, units, found, time, step, remarks)


def _by_input(
    file: str, found: Variables, input: str, channels: Channels, units: Mapping[str, str], mapped_only: bool
) -> Selection:
    """Return the input and the channels sampled with it, by the names of `channels`, else by the last part of their own
    name if no other vector has it. Raises RecordError."""
    found = expand(file, found)
    vectors = {n: v for n, v in found.items() if v.load is not None and v.size > 1}
    theirs = {here: _single(file, at.name or here, vectors) for here, at in channels.items() if not at.sampling_time_s}
    taken, lasts = set(theirs.values()), [plain(n) for n in vectors]
    own = {plain(n) if lasts.count(plain(n)) == 1 else n: n for n in vectors if n not in taken}
    named = theirs | {here: n for here, n in own.items() if here not in theirs}
    for n, v in vectors.items():
        bare = n.removesuffix(f"_{v.unit}")  # `de_nm`
        if v.unit and bare in units and n in named and bare not in named:
            named[bare] = named.pop(n)
    if input not in named and units.get(input) == FORCE:
        forces = [n for n in vectors if n not in taken and unit_of(vectors[n], found) == FORCE]
        if len(forces) == 1:
            named = {input: forces[0]} | {here: n for here, n in named.items() if n != forces[0]}
    if input not in named:
        raise RecordError(_no_channel(file, input, found, vectors))
    drive = vectors[named[input]]
    time = vectors[theirs[TIME]] if TIME in theirs else None
    outputs = {
        here: vectors[n]
        for here, n in named.items()
        if here not in (input, TIME) and n not in (named[input], *([time.name] if time else []))
        and not (here not in channels and is_time(n)) and (not mapped_only or here in channels)
    }  # fmt: skip
    apart = {here: why for here, v in outputs.items() if (why := _sampled_apart(drive, v))}
    chosen = {input: drive, **{here: v for here, v in outputs.items() if here not in apart}}
    if len(chosen) < 2:
        why = "".join(f"; '{here}' {words}" for here, words in list(apart.items())[:3])
        raise RecordError(f"{file}: no output is sampled with '{input}'{why}. It holds {_listing(vectors)}")
    remarks = [f"{n} from '{v.name}'" for n, v in chosen.items() if n != parse_column(v.name)[0]]
    if apart:
        remarks.append(
            f"left out, of another length or time: {', '.join(list(apart)[:5])}{', ...' if len(apart) > 5 else ''}"
        )
    return Selection(chosen, channels, units, found, time, remarks=tuple(remarks))


def _no_channel(file: str, input: str, found: Variables, vectors: Variables) -> str:
    """Return in words why the input is missing."""
    same = [n for n in vectors if plain(n) == input]
    if len(same) > 1:
        return (
            f"{file}: '{input}' is there {len(same)} times, in several groups or structures ({', '.join(same[:4])}): "
            f"name one of them with --map {input}={same[0]}, and its outputs too"
        )
    other = next((v for n, v in found.items() if plain(n) == input and v.load is None), None)
    if other is not None:
        return f"{file}: channel '{input}' is of kind {other.kind}, expected real numbers over time"
    return f"{file}: no channel '{input}'; use --map {input}=NAME. It holds {_listing(vectors)}"


def _sampled_apart(drive: Variable, v: Variable) -> str:
    """Return why a vector cannot belong to the drive's record; "" if it has the drive's length, or an own time of the
    same step that overlaps."""
    a, b = (None, None) if v.clock is None or drive.clock is None else (drive.clock(), v.clock())
    if a is None or b is None or a.axis is not None or b.axis is not None:
        if v.size != drive.size:
            return f"has {v.size} samples, not {drive.size}"
        begins_after = a and b and a.axis is not None and b.axis is not None and a.axis[-1] < b.axis[0]
        return "starts after its end" if begins_after else ""
    if abs(a.step / b.step - 1.0) * v.size >= 1.0:
        return f"has a sampling time of {b.step:.6g} s ({b.source}), not {a.step:.6g} s"
    if a.start < b.start + b.step * v.size and b.start < a.start + a.step * drive.size:
        return ""
    return f"starts {b.start - a.start:.9g} s after it ({b.shown or b.source}): no sample in common"


def _step_of(file: str, v: Variable) -> Clock:
    """Return the sampling time that a scalar states, or a column that repeats it."""
    return Clock(v.name, vet_step(file, v.name, loaded(file, v.name, v)))


def assemble(file: str, sha256: str, chosen: Selection, limits: ReadLimits) -> Record:
    """Return the record of a selection, in its units and on one time base. Raises RecordError."""
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
    remarks. axis: a named time vector. Raises RecordError without stated times, or with contradicting ones."""
    axes: dict[str, Clock] = {}
    known: dict[tuple[int, ...], Clock] = {}
    clocks: dict[str, Clock] = {}
    for name, v in chosen.channels.items():
        stated = clocks_of(file, v, chosen.found, axes, chosen.time if TIME in chosen.sources else None)
        fallback = chosen.step is not None and chosen.step.source == GIVEN
        if axis is None and not tells(stated):
            stated = [*only_axis(file, v, chosen.found, axes), *stated]
        if chosen.step is not None and not (fallback and tells(stated)):
            stated = [*stated, chosen.step] if tells(stated) else [chosen.step, *stated]
        if axis is not None:  # its channels may state their step and start once more
            stated = [axis, *(c for c in stated if c.axis is None)] if v.clock is None else [*stated, axis]
        if tells(stated):
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
    words = [] if scale == 1.0 and not given.unit else [f"{name} is in {unit}, converted to {here}"]
    words += [f"{name} is multiplied by {given.gain:g}"] if given.gain != 1.0 else []
    return given.gain * scale, here, ", ".join(words)


def _refuse_twins(file: str, wanted: Variables) -> None:
    names = [v.name for v in wanted.values()]
    twins = [name for name, v in wanted.items() if names.count(v.name) > 1]
    if twins:
        raise RecordError(f"{file}: '{wanted[twins[0]].name}' cannot be all of {', '.join(twins)} (check the renaming)")


def _single(file: str, wanted: str, found: Variables) -> str:
    hits = _hits(wanted, found) or _hits(parse_column(wanted)[0], found)
    if len(hits) != 1:
        raise RecordError(f"{file}: no single '{wanted}'; it holds {_listing(found)}")
    return hits[0]


def _hits(wanted: str, found: Variables) -> list[str]:
    """Return the vectors of that name: as a whole, else without unit, else by the last part."""
    hits: list[str] = []
    for same in (
        lambda n: n == wanted,
        lambda n: plain(n) == wanted,
        lambda n: n.endswith(("." + wanted, "/" + wanted)),
        lambda n: n == f"{wanted}_{found[n].unit}",
    ):
        hits = hits or [name for name in found if same(name)]
    return hits


def _listing(found: Variables) -> str:
    names = [f"{name}{f' [{v.unit}]' if v.unit else ''} ({v.size})" for name, v in found.items()]
    return ", ".join(names[:20]) + (f" and {len(names) - 20} more" if len(names) > 20 else "") or "no vectors"
