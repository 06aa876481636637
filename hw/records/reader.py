"""Record files to records, by one way for every door: the channels that a check declared (unit folders), or those that
are as long as an input (`accept frf`, `--hammer`, the API). What a file states of time and unit is used or refused."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from checks.declare import Series
from checks.errors import RecordError
from checks.record import Record
from hw.records.damage import refused
from hw.records.foreign_record import variables_of
from hw.records.limits import DEFAULT_LIMITS, ReadLimits
from hw.records.source import Source, load_bytes
from hw.records.stated.assembly import GIVEN, Selection, assemble
from hw.records.stated.statements import is_time, plain, unit_of
from hw.records.stated.structures import expand
from hw.records.variable import CLOCK, NESTED, OWN_RECORD, Clock, Variable, Variables, listing
from hw.records.vet import loaded, vet_step
from specs.bench import NO_CHANNELS, TIME, Channels, ChannelSource, channel_source
from specs.units import parse_header

OBJECTS = "MATLAB objects (timeseries, Dataset) cannot be read: write the run with hw/records/matlab/accept_export.m"
FORCE = "N"  # unit by which the input of a hammer test is found, if one channel alone has it


def read(
    path: Path,
    series: Series,
    rename: Mapping[str, str | ChannelSource] = NO_CHANNELS,
    limits: ReadLimits = DEFAULT_LIMITS,
) -> Record:
    """Return the record of a file: see `record_of`. Raises RecordError, also if the file cannot be read."""
    return record_of(load_bytes(path, limits), series, rename, limits)


def record_of(
    source: Source,
    series: Series,
    rename: Mapping[str, str | ChannelSource] = NO_CHANNELS,
    limits: ReadLimits = DEFAULT_LIMITS,
) -> Record:
    """Return the record of the bytes of a .mat (MATLAB 5 to 7.3), .csv, .uff or .tdms file; the content tells which.

    series : the channels to read and their units; the time is the vector "t" [s], what the file states in other words,
    or starts at 0 and runs in steps of the scalar that `series.step` names [s]. rename : name of a channel here -> in
    the file, with its gain and unit. What is not a variable of the file itself is looked for in its structures, as
    Simulink, Speedgoat and dSPACE write them. The arrays of the record are read-only. Raises RecordError, naming the
    file, the channel, what was found and what was expected, for everything that could make a verdict wrong; nothing is
    repaired."""
    with refused(source.file):
        sources = {here: channel_source(there) if isinstance(there, str) else there for here, there in rename.items()}
        found = source.variables()
        if OWN_RECORD in found:
            sources = {}
        return assemble(source.file, source.sha256, _declared(source.file, found, series, sources), limits)


def record_by_input(
    source: Source,
    input: str,
    channels: Channels = NO_CHANNELS,
    step_s: float | None = None,
    units: Mapping[str, str] = NO_CHANNELS,  # type: ignore[assignment]
    mapped_only: bool = False,
    step_name: str | None = None,
    limits: ReadLimits = DEFAULT_LIMITS,
) -> Record:
    """Return the record of every vector that is sampled with an input; its remarks state the mapping.

    channels : name here -> source in the file; units : of known names, others are in SI; step_s : sampling time of a
    file without one; step_name : of the scalar that states it for all channels; mapped_only : leave out what `channels`
    does not name. Raises RecordError, which lists what the file holds."""
    if step_s is not None and not (math.isfinite(step_s) and step_s > 0):
        raise RecordError(f"--ts {step_s:g}: expected a sampling time above 0 s")
    with refused(source.file):
        found = variables_of(source)
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
        return assemble(source.file, source.sha256, replace(chosen, step=step), limits)


def _declared(file: str, found: Variables, series: Series, sources: Channels) -> Selection:
    """Return what is declared and in the file. Raises RecordError if a channel that is required is missing."""

    def theirs(name: str) -> str:
        there = (sources[name].name or name) if name in sources else name
        return there if there in found else parse_header(there)[0]

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
    return Selection(wanted, sources, {**series.channels, **series.optional_channels}, found, time, step)


def _by_input(
    file: str, found: Variables, input: str, channels: Channels, units: Mapping[str, str], mapped_only: bool
) -> Selection:
    """Return the input and what is sampled with it, by the names of `channels`, else by their own last part if that is
    one vector's. Raises RecordError."""
    found = expand(file, found)
    vectors = {n: v for n, v in found.items() if v.load is not None and v.size > 1}
    theirs = {here: _single(file, at.name or here, vectors) for here, at in channels.items() if not at.sampling_time_s}
    taken, lasts = set(theirs.values()), [plain(n) for n in vectors]
    own = {plain(n) if lasts.count(plain(n)) == 1 else n: n for n in vectors if n not in taken}
    named = theirs | {here: n for here, n in own.items() if here not in theirs}
    if input not in named and units.get(input) == FORCE:
        forces = [n for n in vectors if n not in taken and unit_of(vectors[n], found) == FORCE]
        if len(forces) == 1:
            named = {input: forces[0]} | {here: n for here, n in named.items() if n != forces[0]}
    if input not in named:
        raise RecordError(f"{file}: no channel '{input}'; use --map {input}=NAME. It holds {_listing(vectors)}")
    drive = vectors[named[input]]
    time = vectors[theirs[TIME]] if TIME in theirs else None
    outputs = {
        here: vectors[n]
        for here, n in named.items()
        if here not in (input, TIME) and n not in (named[input], *([time.name] if time else []))
        and not (here not in channels and is_time(n)) and (not mapped_only or here in channels)
    }  # fmt: skip
    apart = [here for here, v in outputs.items() if not _sampled_with(drive, v)]
    chosen = {input: drive, **{here: v for here, v in outputs.items() if here not in apart}}
    if len(chosen) < 2:
        raise RecordError(f"{file}: no output as long as '{input}' ({drive.size}); it holds {_listing(vectors)}")
    remarks = [f"{n} from '{v.name}'" for n, v in chosen.items() if n != parse_header(v.name)[0]]
    if apart:
        remarks.append(f"left out, of another length or time: {', '.join(apart[:5])}{', ...' if apart[5:] else ''}")
    return Selection(chosen, channels, units, found, time, remarks=tuple(remarks))


def _sampled_with(drive: Variable, v: Variable) -> bool:
    """Return whether a vector may belong to the record of the drive: of its length, or in another time of its own with
    the same step that overlaps."""
    if v.clock is None or drive.clock is None:
        return v.size == drive.size
    a, b = drive.clock(), v.clock()
    if a.axis is not None or b.axis is not None:
        return v.size == drive.size and (a.axis is None or b.axis is None or bool(a.axis[-1] >= b.axis[0]))
    same = abs(a.step / b.step - 1.0) * v.size < 1.0
    return same and a.start < b.start + b.step * v.size and b.start < a.start + a.step * drive.size


def _step_of(file: str, v: Variable) -> Clock:
    """Return the sampling time that a scalar states, or a column that repeats it."""
    return Clock(v.name, vet_step(file, v.name, loaded(file, v.name, v)))


def _refuse_twins(file: str, wanted: Variables) -> None:
    names = [v.name for v in wanted.values()]
    twins = [name for name, v in wanted.items() if names.count(v.name) > 1]
    if twins:
        raise RecordError(f"{file}: '{wanted[twins[0]].name}' cannot be all of {', '.join(twins)} (check the renaming)")


def _single(file: str, wanted: str, found: Variables) -> str:
    hits = _hits(wanted, found)
    if len(hits) != 1:
        raise RecordError(f"{file}: no single '{wanted}'; it holds {_listing(found)}")
    return hits[0]


def _hits(wanted: str, found: Variables) -> list[str]:
    """Return the vectors of that name: whole, else without its unit, else its last part."""
    hits: list[str] = []
    for same in (
        lambda n: n == wanted,
        lambda n: plain(n) == wanted,
        lambda n: n.endswith(("." + wanted, "/" + wanted)),
    ):
        hits = hits or [name for name in found if same(name)]
    return hits


def _listing(found: Variables) -> str:
    names = [f"{name}{f' [{v.unit}]' if v.unit else ''} ({v.size})" for name, v in found.items()]
    return ", ".join(names[:20]) + (f" and {len(names) - 20} more" if len(names) > 20 else "") or "no vectors"
