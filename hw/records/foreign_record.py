"""Records of other tools, for `accept frf`: units in headers, `;` and decimal commas, structures of Speedgoat, Simulink
and dSPACE, channels of any name, a sampling time from the command line. The mapping of columns is stated.

`accept frf` takes all of these. A unit is judged from named channels: those of structures are read, too, if the name
stands for one vector, and units only as the unit's [channels] states them (`hw.records.reader`)."""

import io
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from checks.record import Record
from hw.records.foreign_structures import Column, vectors
from hw.records.limits import DEFAULT_LIMITS
from hw.records.source import SIGNATURE, Source, load_bytes
from hw.records.textfile import SUFFIXES, open_columns
from hw.records.textlayout import TIMES as TIMES
from hw.records.variable import Remarked, Variable, remarks_of
from hw.records.vet import vet_channel, vet_time
from specs.bench import TIME, Channels, ChannelSource
from specs.units import UnitMismatch, factor, parse_header

STEPS = ("ts", "dt", "sampletime", "sample_time")  # a single number of that name is the sampling time [s]
_MOST = 400  # names of one file
OBJECTS = "MATLAB objects (timeseries, Dataset) cannot be read: write the run with hw/records/matlab/accept_export.m"


class Unreadable(RecordError):
    """A file of which nothing could be read."""


def foreign_record(
    path: Path,
    input: str,
    channels: Channels,
    step_s: float | None,
    units: Mapping[str, str],
    mapped_only: bool = False,
) -> tuple[Record, str]:
    """Return the record, and a sentence on how its columns were mapped. channels: name here -> source in the file;
    units: of the names here; mapped_only: leave out what `channels` does not name.

    Raises RecordError, which lists what the file holds."""
    source = load_bytes(path, DEFAULT_LIMITS)
    found = columns_of(source)
    theirs = {
        here: _find(source.file, at.name or here, found) for here, at in channels.items() if not at.sampling_time_s
    }
    if step_s is None and TIME in channels:
        step_s = channels[TIME].sampling_time_s
    found |= {there: _convert(source.file, found[there], channels[here]) for here, there in theirs.items()}
    taken = set(theirs.values())
    named = theirs | {_plain(name): name for name in found if name not in taken and _plain(name) not in theirs}
    if input not in named:
        raise RecordError(f"{source.file}: no channel '{input}'; use --map {input}=NAME. It holds {_listing(found)}")
    length = found[named[input]].values.size
    time = next((n for n in named if n.lower() in TIMES and found[named[n]].values.size == length), None)
    if step_s is None and time is None:
        step = next((n for n in named if n.lower() in STEPS and found[named[n]].values.size == 1), None)
        step_s = None if step is None else float(_in_unit(source.file, step, found[named[step]], "s")[0])
        clock = f"sampling time {step_s:g} s from '{named[step]}'" if step else ""
    else:
        clock = f"--ts {step_s:g} s" if step_s is not None else f"time from '{named[time]}'" if time else ""
    outputs = [
        n
        for n, there in named.items()
        if found[there].values.size == length and n not in (input, time) and (not mapped_only or n in channels)
    ]
    if not outputs:
        raise RecordError(f"{source.file}: no output as long as '{input}' ({length}); it holds {_listing(found)}")
    data = {n: _in_unit(source.file, n, found[named[n]], units.get(n, "")) for n in (input, *outputs)}
    t = _times(source.file, None if time is None else found[named[time]], length, step_s)
    for name, x in data.items():
        vet_channel(source.file, name, units.get(name, ""), x, t)
        x.flags.writeable = False
    mapping = ", ".join(f"{n}{'' if n == named[n] else f' from {named[n]!r}'}{_unit(found[named[n]])}" for n in data)
    words = f"{source.file}: {mapping}; {length} samples, {clock}, {1 / (t[1] - t[0]):.6g} Hz" + "".join(
        f"; {remark}" for remark in remarks_of(found)
    )
    return Record(t, data, {n: units.get(n, "") for n in data}, source.file, source.sha256), words


def _convert(file: str, column: Column, source: ChannelSource) -> Column:
    """Return a column times its gain, in the unit stated for it. Raises RecordError if the file states another."""
    if column.unit and source.unit and column.unit != source.unit:
        raise RecordError(f"{file}: '{source.name}' is in {column.unit}, [channels] has {source.unit}")
    return Column(column.values * source.gain, source.unit or column.unit)


def nested_variables(source: Source, names: Iterable[str], time: str) -> dict[str, Variable]:
    """Return the vectors in the structures of a file that have these names, whole or as their last part; for `time` a
    structure's own time axis too. Raises RecordError if a name stands for several vectors, or if there are two time
    axes."""
    columns = columns_of(source)
    found: dict[str, Column] = {}
    for name in dict.fromkeys(names):
        hits = _hits(name, columns)
        if len(hits) > 1:
            raise RecordError(f"{source.file}: '{name}' may be {', '.join(hits)}; name one of them in full")
        if hits:
            found[name] = columns[hits[0]]
    length = next((column.values.size for column in found.values()), 0)
    if time not in found:
        axes = [c for n, c in columns.items() if _plain(n).lower() in TIMES and c.values.size == length]
        if any(not np.array_equal(axis.values, axes[0].values) for axis in axes[1:]):
            raise RecordError(f"{source.file}: holds several time axes; name one of them as 't'")
        if axes:
            found[time] = axes[0]
    return {name: _variable(name, column) for name, column in found.items()}


def _variable(name: str, column: Column) -> Variable:
    return Variable(name, (column.values.size,), "double", lambda: column.values, column.unit)


def columns_of(source: Source) -> dict[str, Column]:
    """Return every vector of numbers that a file holds, by name; of structures as `outer.inner`. Raises RecordError."""
    head = source.raw[:1024]
    try:
        if source.suffix in SUFFIXES:
            read = open_columns(source.file, source.raw)
            columns = {n: Column(v.load(), v.unit) for n, v in read.items() if v.load is not None}
            found: dict[str, Column] = Remarked(columns, read.remarks)
        elif head.startswith(SIGNATURE) or head.startswith(SIGNATURE, 512):
            found = _hdf5(source)
        elif b"IM" in head[124:128] or b"MI" in head[124:128]:
            found = _matlab(source)
        else:
            found = {n: Column(v.load(), v.unit) for n, v in source.variables().items() if v.load is not None}
    except RecordError:
        raise
    except Exception as e:
        raise Unreadable(f"{source.file}: cannot be read: {type(e).__name__}: {e}") from e
    if len(found) > _MOST:
        raise RecordError(f"{source.file}: holds {len(found)} vectors; at most {_MOST} are taken")
    return found


def _matlab(source: Source) -> dict[str, Column]:
    from scipy.io import loadmat  # loads slowly: only when wanted

    from hw.records.mat5 import vet_unpacked

    vet_unpacked(source.file, source.raw, 8 * DEFAULT_LIMITS.max_samples)
    found = loadmat(io.BytesIO(source.raw), simplify_cells=True)
    return _by_name(source.file, vectors("", {k: v for k, v in found.items() if not k.startswith("__")}))


def _hdf5(source: Source) -> dict[str, Column]:
    import h5py  # loads slowly: only when wanted

    from hw.records.mat73 import vet_stored

    found: dict[str, Any] = {}
    sizes: list[int] = []

    def take(name: str, node: h5py.Group | h5py.Dataset) -> None:
        if isinstance(node, h5py.Dataset) and node.size:
            sizes.append(node.size)
            vet_stored(source.file, node, len(source.raw))
            if sum(sizes) > DEFAULT_LIMITS.max_samples:
                raise RecordError(f"{source.file}: holds more than {DEFAULT_LIMITS.max_samples} numbers")
            found[name] = node[()]

    with h5py.File(io.BytesIO(source.raw), "r") as file:
        file.visititems(take)
    named = {name.replace("/", "."): value for name, value in found.items() if name[0] != "#"}
    return _by_name(source.file, vectors("", named))


def _by_name(file: str, found: Iterable[tuple[str, Column]]) -> dict[str, Column]:
    """Return vectors by name. Raises RecordError if two have one name, because the meaning is then ambiguous."""
    out: dict[str, Column] = {}
    for name, column in found:
        if name in out and column.values.size > 1:
            raise RecordError(f"{file}: holds two signals named '{name}'")
        out.setdefault(name, column)
    return out


def _find(file: str, wanted: str, found: Mapping[str, Column]) -> str:
    hits = _hits(wanted, found)
    if len(hits) != 1:
        raise RecordError(f"{file}: no single '{wanted}'; it holds {_listing(found)}")
    return hits[0]


def _hits(wanted: str, found: Mapping[str, Column]) -> list[str]:
    """Return the vectors of that name: whole, else without its unit, else its last part."""
    hits: list[str] = []
    for same in (
        lambda n: n == wanted,
        lambda n: _plain(n) == wanted,
        lambda n: n.endswith(("." + wanted, "/" + wanted)),
    ):
        hits = hits or [name for name in found if same(name)]
    return hits


def _plain(name: str) -> str:
    """Return the name without its unit and without the structures around it."""
    return parse_header(name)[0].rsplit(".", 1)[-1].rsplit("/", 1)[-1].strip("\"'")


def _in_unit(file: str, name: str, column: Column, wanted: str) -> Array:
    """Return (N,) in the unit that the name has here; a file without a unit is taken to have it."""
    if not column.unit or not wanted:
        return column.values.copy()
    try:
        return column.values * factor(column.unit, wanted)
    except UnitMismatch as e:
        raise RecordError(f"{file}: channel '{name}': {e}") from e


def _times(file: str, column: Column | None, length: int, step_s: float | None) -> Array:
    if step_s is not None:
        if not (math.isfinite(step_s) and step_s > 0):
            raise RecordError(f"--ts {step_s:g}: expected a sampling time above 0 s")
        return step_s * np.arange(length, dtype=np.float64)
    if column is None:
        raise RecordError(f"{file}: no time vector ({', '.join(TIMES[:2])}); give the sampling time with --ts SECONDS")
    t = _in_unit(file, "time", column, "s")
    vet_time(file, t, DEFAULT_LIMITS.min_samples)
    return t


def _unit(column: Column) -> str:
    return f" [{column.unit}]" if column.unit else ""


def _listing(found: Mapping[str, Column]) -> str:
    names = [f"{name} ({column.values.size})" for name, column in found.items() if column.values.size > 1]
    return ", ".join(names[:20]) + (f" and {len(names) - 20} more" if len(names) > 20 else "") or "no vectors"
