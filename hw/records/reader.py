"""Record files to records: every channel that a check declared, vetted, with the hash of the file."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from checks.arrays import Array
from checks.declare import Series
from checks.errors import RecordError
from checks.record import Record
from hw.records.damage import refused
from hw.records.foreign_record import OBJECTS, TIMES, nested_variables
from hw.records.limits import DEFAULT_LIMITS, ReadLimits
from hw.records.source import Source, load_bytes
from hw.records.textfile import ROWS
from hw.records.variable import OWN_RECORD, Variables, listing, remarks_of
from hw.records.vet import loaded, vet_channel, vet_step, vet_time
from specs.bench import NO_CHANNELS, TIME, Channels, ChannelSource, channel_source
from specs.units import UnitMismatch, factor, parse_header

NESTED = ("struct", "cell")  # kinds of variables that may hold the channels


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

    series : the channels to read and their units; the time is the vector "t" [s], or starts at 0 and runs in steps of
    the scalar that `series.step` names [s] if the file has it. rename : name of a channel here -> in the file, with its
    gain and unit. What is not a variable of the file itself is looked for in its structures, as Simulink, Speedgoat and
    dSPACE write them. The arrays of the record are read-only. Raises RecordError, naming the file, the channel, what
    was found and what was expected, for everything that could make a verdict wrong; nothing is repaired."""
    with refused(source.file):
        sources = {here: channel_source(there) if isinstance(there, str) else there for here, there in rename.items()}
        found = source.variables()
        if OWN_RECORD in found:
            sources = {}
        wanted = _wanted_variables(source, found, series, sources)
        units = {TIME: "s", **series.channels, **series.optional_channels}
        arrays = _arrays(source.file, wanted, limits)
        remarks = list(remarks_of(found))
        if TIME in wanted and TIME not in sources and wanted[TIME].name != TIME:  # as other tools call it
            remarks.append(f"time from '{wanted[TIME].name}'")
        for name, x in arrays.items():
            given = sources.get(name, ChannelSource())
            theirs, ours = wanted[name].unit, units.get(name, "")
            if given.unit is None and wanted[name].kind == ROWS and theirs and ours:
                given = given.model_copy(update={"unit": theirs})
                if theirs != ours:
                    remarks.append(f"{name} is in {theirs}, converted to {ours}")
            arrays[name] = _scale(source.file, name, x, given, units.get(name, ""))
        t = _time(source.file, arrays, series, sources, limits)
        channels = {name: x for name, x in arrays.items() if name not in (TIME, series.step)}
        for name, x in channels.items():
            vet_channel(source.file, name, units[name], x, t)
    for x in (t, *channels.values()):
        x.flags.writeable = False
    notes = (f"{source.file}: {', '.join(remarks)}",) if remarks else ()
    return Record(t, channels, {name: units[name] for name in channels}, source.file, source.sha256, notes)


def _wanted_variables(source: Source, found: Variables, series: Series, sources: Channels) -> Variables:
    """Return channel -> variable for all that is declared and in the file, the time included. Raises RecordError if one
    that is required is missing."""
    file = source.file
    clock = sources.get(TIME)

    def theirs(name: str) -> str:
        if name in sources and sources[name].name:
            there = sources[name].name or name
            return there if there in found else parse_header(there)[0]
        if name == TIME and TIME not in found:  # as other tools call it
            return next((n for n, v in found.items() if v.kind == ROWS and n.lower() in TIMES), TIME)
        return name

    channels = [n for n in series.channels if n != TIME]
    plain = {name: v for name, v in found.items() if v.kind not in NESTED}
    if len(plain) < len(found) and any(theirs(n) not in plain for n in channels):
        names = [*channels, *series.optional_channels]
        found = {**found, **nested_variables(source, [theirs(n) for n in names], theirs(TIME)), **plain}
    time = series.step if series.step is not None and theirs(series.step) in found else TIME
    # A sampling time that [channels] states is for files without one of their own.
    stated = clock is not None and clock.sampling_time_s is not None and theirs(time) not in found
    required = channels if stated else [*channels, time]
    missing = [n for n in required if theirs(n) not in found]
    if missing:
        words = ", ".join(f"'{n}'" if theirs(n) == n else f"'{n}' (here '{theirs(n)}')" for n in missing)
        objects = any(v.kind in ("opaque", "object") for v in found.values())
        hint = f"; {OBJECTS}" if objects else ""
        raise RecordError(f"{file}: lacks {words}; it has {listing(found)}{hint}")
    present = [n for n in series.optional_channels if theirs(n) in found]
    wanted = {n: found[theirs(n)] for n in [*required, *present]}
    _refuse_twins(file, wanted)
    for name, unit in {TIME: "s", **series.channels, **series.optional_channels}.items():
        expected = (sources[name].unit if name in sources else None) or unit
        if name in wanted and wanted[name].kind != ROWS and wanted[name].unit not in ("", expected):
            raise RecordError(f"{file}: channel '{name}' is in {wanted[name].unit}, expected {expected}")
    return wanted


def _scale(file: str, name: str, x: Array, source: ChannelSource, unit: str) -> Array:
    """Return x (N,) times gain in the declared unit; unchanged if neither gain nor unit is given."""
    try:
        scale = source.gain * (1.0 if source.unit is None else factor(source.unit, unit))
    except UnitMismatch as e:
        raise RecordError(f"{file}: channel '{name}': {e}") from e
    return x if scale == 1.0 else x * scale


def _refuse_twins(file: str, wanted: Variables) -> None:
    names = [v.name for v in wanted.values()]
    twins = [name for name, v in wanted.items() if names.count(v.name) > 1]
    if twins:
        raise RecordError(f"{file}: '{wanted[twins[0]].name}' cannot be all of {', '.join(twins)} (check the renaming)")


def _arrays(file: str, wanted: Variables, limits: ReadLimits) -> dict[str, Array]:
    total = sum(v.size for v in wanted.values())
    if total > limits.max_samples:
        most = max(wanted, key=lambda name: wanted[name].size)
        raise RecordError(
            f"{file}: declares {total} samples, {wanted[most].size} of them in channel '{most}'; "
            f"at most {limits.max_samples} are read"
        )
    return {name: loaded(file, name, v) for name, v in wanted.items()}


def _time(file: str, arrays: Mapping[str, Array], series: Series, sources: Channels, limits: ReadLimits) -> Array:
    """Return the times (N,) [s]: those of the file, else by the step that it states, else by the sampling time of the
    channel map. Raises RecordError if there are too few samples."""
    if TIME in arrays:
        vet_time(file, arrays[TIME], limits.min_samples)
        return arrays[TIME]
    if series.step is not None and series.step in arrays:
        step = vet_step(file, series.step, arrays[series.step])
    else:
        step = sources[TIME].sampling_time_s or 0.0  # `_wanted_variables` has a time vector otherwise
    samples = max(x.size for x in arrays.values())
    if samples < limits.min_samples:
        raise RecordError(f"{file}: has {samples} samples, at least {limits.min_samples} are needed")
    return step * np.arange(samples, dtype=np.float64)
