"""Record files to records: every channel that a check declared, vetted, with the hash of the file."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from checks.arrays import Array
from checks.declare import Series
from checks.errors import RecordError
from checks.record import Record
from hw.records.damage import refused
from hw.records.limits import DEFAULT_LIMITS, ReadLimits
from hw.records.source import Source, load_bytes
from hw.records.variable import Variables, listing
from hw.records.vet import loaded, vet_channel, vet_step, vet_time

NO_RENAME: Mapping[str, str] = MappingProxyType({})
TIME = "t"


def read(
    path: Path, series: Series, rename: Mapping[str, str] = NO_RENAME, limits: ReadLimits = DEFAULT_LIMITS
) -> Record:
    """Record of a file: see `record_of`. Raises RecordError, also where it cannot be read."""
    return record_of(load_bytes(path, limits), series, rename, limits)


def record_of(
    source: Source, series: Series, rename: Mapping[str, str] = NO_RENAME, limits: ReadLimits = DEFAULT_LIMITS
) -> Record:
    """Record of the bytes of a .mat (MATLAB 5 to 7.3), .csv, .uff or .tdms file; the content tells which.

    series : the channels to read and their units; the time is the vector "t" [s], or starts at 0 and runs in steps of
    the scalar that `series.step` names [s] where the file has it. rename : name of a channel here -> in the file.
    The arrays of the record are read-only. Raises RecordError, naming the file, the channel, what was found and what
    was expected, for everything that could make a verdict wrong; nothing is repaired.
    """
    with refused(source.file):
        wanted = _wanted(source.file, source.variables(), series, rename)
        arrays = _arrays(source.file, wanted, limits)
        units = {**series.channels, **series.optional_channels}
        t = _time(source.file, arrays, series, limits)
        channels = {name: x for name, x in arrays.items() if name not in (TIME, series.step)}
        for name, x in channels.items():
            vet_channel(source.file, name, units[name], x, t)
    for x in (t, *channels.values()):
        x.flags.writeable = False
    return Record(t, channels, {name: units[name] for name in channels}, source.file, source.sha256)


def _wanted(file: str, found: Variables, series: Series, rename: Mapping[str, str]) -> Variables:
    """Channel -> variable for all that is declared and there, the time included; refuses what is missing."""

    def theirs(name: str) -> str:
        return rename.get(name, name)

    time = series.step if series.step is not None and theirs(series.step) in found else TIME
    required = [*(n for n in series.channels if n != TIME), time]
    missing = [n for n in required if theirs(n) not in found]
    if missing:
        words = ", ".join(f"'{n}'" if theirs(n) == n else f"'{n}' (here '{theirs(n)}')" for n in missing)
        raise RecordError(f"{file}: lacks {words}; it has {listing(found)}")
    present = [n for n in series.optional_channels if theirs(n) in found]
    wanted = {n: found[theirs(n)] for n in [*required, *present]}
    _refuse_twins(file, wanted)
    for name, unit in {TIME: "s", **series.channels, **series.optional_channels}.items():
        if name in wanted and wanted[name].unit not in ("", unit):
            raise RecordError(f"{file}: channel '{name}' is in {wanted[name].unit}, expected {unit}")
    return wanted


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


def _time(file: str, arrays: Mapping[str, Array], series: Series, limits: ReadLimits) -> Array:
    if series.step is None or series.step not in arrays:
        vet_time(file, arrays[TIME], limits.min_samples)
        return arrays[TIME]
    step = vet_step(file, series.step, arrays[series.step])
    samples = max(x.size for x in arrays.values())
    if samples < limits.min_samples:
        raise RecordError(f"{file}: has {samples} samples, at least {limits.min_samples} are needed")
    return step * np.arange(samples, dtype=np.float64)
