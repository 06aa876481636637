"""Records as other tools write them, for `accept frf`: units in headers, `;` and decimal commas, structures of
Speedgoat and dSPACE, channels of any name, a sampling time from the command line. What was taken for what is said.

Only responses are estimated from these; a unit is judged from records that need no interpretation (`hw.records`).
"""

import io
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from accept.workflow.entry.units import UnitMismatch, factor
from checks.arrays import Array
from checks.errors import RecordError
from checks.record import Record
from hw.records.limits import DEFAULT_LIMITS
from hw.records.source import SIGNATURE, Source, load_bytes
from hw.records.vet import vet_channel, vet_time

TIMES = ("t", "time", "time_s", "timestamp", "zeit")
_HEADER = re.compile(r"^(?P<name>.*?)\s*[\[(]\s*(?P<unit>[^\])]*)\s*[\])]$")
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")
_DEEPEST = 8  # structures within structures
_MOST = 400  # names of one file


@dataclass(frozen=True, eq=False)
class Column:
    """values (N,) float64; unit: as the file says, "" where it says none."""

    values: Array
    unit: str = ""


def foreign_record(
    path: Path, input: str, channels: Mapping[str, str], step_s: float | None, units: Mapping[str, str]
) -> tuple[Record, str]:
    """The record, and what was taken for what. channels: name here -> name in the file; units: of the names here.

    Raises RecordError, which lists what the file holds."""
    source = load_bytes(path, DEFAULT_LIMITS)
    found = columns_of(source)
    theirs = {here: _find(source.file, there, found) for here, there in channels.items()}
    taken = set(theirs.values())
    named = theirs | {_plain(name): name for name in found if name not in taken and _plain(name) not in theirs}
    if input not in named:
        raise RecordError(f"{source.file}: no channel '{input}'; use --map {input}=NAME. It holds {_listing(found)}")
    length = found[named[input]].values.size
    time = next((n for n in named if n.lower() in TIMES and found[named[n]].values.size == length), None)
    outputs = [n for n, there in named.items() if found[there].values.size == length and n not in (input, time)]
    if not outputs:
        raise RecordError(f"{source.file}: no output as long as '{input}' ({length}); it holds {_listing(found)}")
    data = {n: _in_unit(source.file, n, found[named[n]], units.get(n, "")) for n in (input, *outputs)}
    t = _times(source.file, None if time is None else found[named[time]], length, step_s)
    for name, x in data.items():
        vet_channel(source.file, name, units.get(name, ""), x, t)
        x.flags.writeable = False
    said = ", ".join(f"{n}{'' if n == named[n] else f' from {named[n]!r}'}{_unit(found[named[n]])}" for n in data)
    clock = f"--ts {step_s:g} s" if step_s else f"time from '{named[time]}'" if time else ""
    words = f"{source.file}: {said}; {length} samples, {clock}, {1 / (t[1] - t[0]):.6g} Hz"
    return Record(t, data, {n: units.get(n, "") for n in data}, source.file, source.sha256), words


def columns_of(source: Source) -> dict[str, Column]:
    """Every vector of numbers that a file holds, by name; of structures as `outer.inner`. Raises RecordError."""
    head = source.raw[:1024]
    try:
        if source.suffix in (".csv", ".txt", ".dat"):
            found = _text(source)
        elif head.startswith(SIGNATURE) or head.startswith(SIGNATURE, 512):
            found = _hdf5(source)
        elif b"IM" in head[124:128] or b"MI" in head[124:128]:
            found = _matlab(source)
        else:
            found = {n: Column(v.load(), v.unit) for n, v in source.variables().items() if v.load is not None}
    except RecordError:
        raise
    except Exception as e:
        raise RecordError(f"{source.file}: cannot be read: {type(e).__name__}: {e}") from e
    if len(found) > _MOST:
        raise RecordError(f"{source.file}: holds {len(found)} vectors; at most {_MOST} are taken")
    return found


def _text(source: Source) -> dict[str, Column]:
    """A table with one header line; fields apart by `;`, tab or comma; with `;` or tab also decimal commas."""
    lines = [line for line in source.raw.decode("utf-8-sig", "replace").splitlines() if line.strip()]
    if len(lines) < 2:
        raise RecordError(f"{source.file}: holds no rows below a header")
    apart = next((c for c in (";", "\t") if c in lines[0]), ",")
    rows = lines[1:] if apart == "," else [_DECIMAL_COMMA.sub(".", line) for line in lines[1:]]
    try:
        table = np.loadtxt(io.StringIO("\n".join(rows)), delimiter=apart, comments=None, ndmin=2)
    except ValueError as e:
        raise RecordError(f"{source.file}: {e}") from e
    heads = [h.strip().strip('"') for h in lines[0].split(apart)]
    if len(heads) != table.shape[1] or len(set(heads)) != len(heads):
        raise RecordError(f"{source.file}: {len(heads)} names for {table.shape[1]} columns, or a name twice")
    return {head: Column(np.ascontiguousarray(table[:, i]), _header_unit(head)) for i, head in enumerate(heads)}


def _matlab(source: Source) -> dict[str, Column]:
    from scipy.io import loadmat  # loads slowly: only when wanted

    return dict(_walk("", {k: v for k, v in loadmat(io.BytesIO(source.raw), simplify_cells=True).items()
                           if not k.startswith("__")}, 0))  # fmt: skip


def _hdf5(source: Source) -> dict[str, Column]:
    import h5py  # loads slowly: only when wanted

    with h5py.File(io.BytesIO(source.raw), "r") as file:
        found: dict[str, Any] = {}
        file.visititems(lambda name, node: found.update({name: node[()]}) if isinstance(node, h5py.Dataset) else None)
    return dict(_walk("", {name.replace("/", "."): value for name, value in found.items() if name[0] != "#"}, 0))


def _walk(name: str, value: Any, depth: int) -> Iterator[tuple[str, Column]]:
    """Vectors in structures. dSPACE: X.Data is the time of every entry of Y with its Name and Data. Speedgoat and
    Simulink: a signal with Time and Data, or fields side by side."""
    if depth > _DEEPEST:
        return
    if isinstance(value, Mapping):
        if {"X", "Y"} <= set(value):
            yield from _dspace(value)
            return
        for key, part in value.items():
            yield from _walk(f"{name}.{key}" if name else str(key), part, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and sum(n > 1 for n in value.shape) == 1:
        yield name, Column(np.asarray(value, dtype=np.float64).ravel())


def _dspace(value: Mapping[str, Any]) -> Iterator[tuple[str, Column]]:
    def entries(part: Any) -> list[Mapping[str, Any]]:
        several = part if isinstance(part, list | np.ndarray) else [part]
        return [entry for entry in several if isinstance(entry, Mapping) and "Data" in entry]

    for axis in entries(value["X"])[:1]:
        yield "t", Column(np.asarray(axis["Data"], dtype=np.float64).ravel(), "s")
    for entry in entries(value["Y"]):
        label = str(entry.get("Name", "")).strip('"')
        yield label, Column(np.asarray(entry["Data"], dtype=np.float64).ravel(), str(entry.get("Unit", "") or ""))


def _find(file: str, wanted: str, found: Mapping[str, Column]) -> str:
    """The one vector of that name: whole, without its unit, or its last part."""
    for same in (
        lambda n: n == wanted,
        lambda n: _plain(n) == wanted,
        lambda n: n.endswith(("." + wanted, "/" + wanted)),
    ):
        hits = [name for name in found if same(name)]
        if len(hits) == 1:
            return hits[0]
    raise RecordError(f"{file}: no single '{wanted}'; it holds {_listing(found)}")


def _plain(name: str) -> str:
    """Name without its unit and without the structures around it."""
    bare = _HEADER.match(name)
    return (bare["name"] if bare else name).strip().rsplit(".", 1)[-1].rsplit("/", 1)[-1].strip("\"'")


def _header_unit(name: str) -> str:
    found = _HEADER.match(name)
    return found["unit"].strip() if found else ""


def _in_unit(file: str, name: str, column: Column, wanted: str) -> Array:
    """(N,) in the unit that the name has here; a file that says none is taken to mean it."""
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
    names = [f"{name} ({column.values.size})" for name, column in found.items()]
    return ", ".join(names[:20]) + (f" and {len(names) - 20} more" if len(names) > 20 else "") or "no vectors"
