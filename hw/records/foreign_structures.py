"""Vectors in the structures that Speedgoat, Simulink, dSPACE and analysers write, each with its unit and times."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.clocks import UNIT_NAMES, key_of, seconds
from hw.records.contents.variable import NESTED, Clock, Variable, Variables
from hw.records.limits import DEFAULT_LIMITS
from hw.records.mat5 import DEEPEST, NUMBERS
from specs.units import spelled

_WIDEST = 64  # columns of a matrix that are taken as signals
_MOST = 400  # vectors of one file
# Variables of an analyser's file are pairs [axis, value]: X time records; W the same under a window, Z impulse
# responses, S and G spectra, H responses and C coherences are made of them.
_TIME_RECORD = re.compile(r"X_?(\d+)")


def expand(file: str, found: Variables) -> dict[str, Variable]:
    """Return every vector, number and text that a file holds: of structures as `outer.inner`, of matrices as `name[1]`,
    of an analyser its time records. Raises RecordError if two vectors have one name, because it is then ambiguous."""
    pairs = {n: v for n, v in found.items() if v.kind in NUMBERS and v.shape[1:] == (2,) and v.shape[0] > 2}
    records = {name: v for name, v in pairs.items() if _TIME_RECORD.fullmatch(name)}
    out: dict[str, Variable] = {}
    vectors = samples = 0
    for v in _of_analyser(found, records) if records else _all_vectors(found):
        if v.load is not None and v.size > 1:
            vectors, samples = vectors + 1, samples + v.size
            if v.name in out:
                raise RecordError(f"{file}: holds two signals named '{v.name}'")
            if vectors > _MOST or (v.home and samples > DEFAULT_LIMITS.max_samples):
                raise RecordError(f"{file}: holds more than {_MOST} vectors or {DEFAULT_LIMITS.max_samples} numbers")
        out.setdefault(v.name, v)
    return out


def _all_vectors(found: Variables) -> Iterator[Variable]:
    for name, v in found.items():
        if v.inner is not None and (v.kind in NESTED or not v.is_vector):
            yield from _vectors(name, v.inner(), "")
        else:
            yield v


def _of_analyser(found: Variables, records: Variables) -> Iterator[Variable]:
    """Yield the time records with their times and units."""
    words = {name: v.inner() for name, v in found.items() if name in ("Unit", "ChanNum") and v.inner is not None}
    listed = words.get("Unit")
    units = listed.split("\n") if isinstance(listed, str) else list(listed or ())
    numbers = words.get("ChanNum")
    channels = np.ravel(numbers).tolist() if isinstance(numbers, np.ndarray) else range(1, len(units) + 1)
    unit_of = {f"{float(c):g}": str(u).strip() for c, u in zip(channels, units, strict=False)}
    for name, v in records.items():
        pair = partial(_pair, v)
        unit = unit_of.get(name.removeprefix("X").strip("_"), "")
        clock = partial(_axis_clock, f"first column of {name}", lambda pair=pair: pair()[0], "s")
        yield Variable(name, (v.shape[0],), v.kind, lambda pair=pair: pair()[1], unit, clock=clock)  # type: ignore[misc]


def _pair(v: Variable) -> tuple[Array, Array]:
    axis, values = v.values.reshape(2, -1) if v.inner is None else np.asarray(v.inner()).T
    return _flat(axis), _flat(values)


def _axis_clock(source: str, axis: Any, unit: str, origin: str = "", step: float = math.nan) -> Clock:
    """Return the clock of times in a unit, "" for seconds that the file does not call so."""
    scale = seconds(unit or "s")
    times = scale * _flat(axis() if callable(axis) else axis)
    return Clock(source, scale * step, axis=times, origin=origin, in_seconds=bool(unit))


def _vectors(name: str, value: Any, home: str, labels: Sequence[str] = (), depth: int = 0) -> Iterator[Variable]:
    """Yield the vectors of structures as `outer.inner`, of a matrix by its labels, else as `name[1]`, `name[2]`; single
    numbers and texts too. home: the structure that holds the value."""
    if depth > DEEPEST:
        return
    if isinstance(value, Mapping):
        yield from _structure(name, value, depth)
    elif isinstance(value, str):
        yield Variable(name, (1, len(value)), "char", text=lambda: value, home=home)
    elif isinstance(value, list) and any(isinstance(part, Mapping) for part in value):
        for part in value:
            yield from _vectors(name, part, home, (), depth + 1)
    elif isinstance(value, int | float | np.number | np.ndarray):
        yield from _columns(name, np.asarray(value), home, labels)


def _structure(name: str, value: Mapping[str, Any], depth: int) -> Iterator[Variable]:
    """Yield the vectors of a structure. dSPACE: X and Y. timeseries: Time and Data. Simulink, structure with time:
    `signals` with `values` and `label`. Speedgoat, file scope: `data` with `signalNames`. Else fields side by side."""
    if {"X", "Y"} <= set(value) and _with_data(value["Y"]):
        yield from _dspace(name, value)
        return
    if {"Time", "Data"} <= set(value):
        yield from _timeseries(name, value)
        return
    own = next(
        (spelled(text) for key, text in value.items() if key_of(key) in UNIT_NAMES and isinstance(text, str)), ""
    )
    named = {"values": _words(value.get("label")), "data": _words(value.get("signalNames"))}
    for key, part in value.items():
        whole = (
            key == "Data" and isinstance(part, np.ndarray) and len(value) > 1
        )  # next to it are statements on the same vector
        inner = f"{name}.{key}" if name and not whole else name or str(key)
        for v in _vectors(inner, part, name, named.get(key, ()), depth + 1):
            single = own and not v.unit and v.load is not None and key.lower() in ("data", "values", "value")
            yield replace(v, unit=own) if single else v


def _timeseries(name: str, value: Mapping[str, Any]) -> Iterator[Variable]:
    """Yield a timeseries as a structure, by `struct` or `get` of MATLAB: its data by its own name or that of the
    variable. TimeInfo and DataInfo state units, start and increment."""
    own = value.get("Name")
    label = own if isinstance(own, str) and own not in ("", "unnamed") else name
    info, data_info = (part if isinstance(part := value.get(n), Mapping) else {} for n in ("TimeInfo", "DataInfo"))
    unit, origin = spelled(_word(info, "Units")), _word(info, "StartDate")
    start, step = (float(np.ravel(part)[0]) if np.size(part := info.get(n, ())) == 1 else math.nan
                   for n in ("Start", "Increment"))  # fmt: skip
    times = value["Time"] if isinstance(value["Time"], np.ndarray) else np.empty(0)
    if times.size:
        clock = partial(_axis_clock, f"{label}.Time", times, unit, origin, step)
        yield Variable(f"{label}.Time", (times.size,), "double", partial(_flat, times), unit, home=name)
    else:  # even times are stored as start and increment
        scale = seconds(unit or "s")
        even = Clock(f"{label}.TimeInfo", scale * step, scale * start, origin=origin, in_seconds=bool(unit))
        if not (step > 0 and math.isfinite(start)):
            raise RecordError(f"{label}.TimeInfo: Start = {start:g}, Increment = {step:g}: no times")
        clock = partial(replace, even)
    data = np.squeeze(np.asarray(value["Data"])) if isinstance(value["Data"], np.ndarray) else np.empty(0)
    for v in _columns(label, data, name, ()):
        yield replace(v, unit=spelled(_word(data_info, "Units")), clock=clock)


def _dspace(name: str, value: Mapping[str, Any]) -> Iterator[Variable]:
    """Yield the signals of dSPACE's recorder, each with the axis that it names."""
    axes = _with_data(value["X"])
    for k, axis in enumerate(axes):
        yield Variable("t" if k == 0 else f"t[{k + 1}]", np.shape(_flat(axis["Data"])), "double",
                       partial(_flat, axis["Data"]), spelled(_word(axis, "Unit")) or "s", home=name)  # fmt: skip
    for entry in _with_data(value["Y"]):
        k = int(np.ravel(entry.get("XIndex", 1) or 1)[0]) - 1
        clock = None
        if 0 <= k < len(axes):
            called = _word(axes[k], "Name").strip('"') or f"X({k + 1})"
            clock = partial(_axis_clock, called, axes[k]["Data"], spelled(_word(axes[k], "Unit")) or "s")
        label = _word(entry, "Name").strip('"')
        data = _flat(entry["Data"])
        yield Variable(label, data.shape, "double", data.copy, spelled(_word(entry, "Unit")), clock=clock, home=name)


def _columns(name: str, x: np.ndarray[Any, Any], home: str, labels: Sequence[str]) -> Iterator[Variable]:
    if x.dtype.kind not in "fiu" or x.size == 0:
        return
    if sum(n > 1 for n in x.shape) <= 1:
        rows, called = [x], [labels[0] if len(labels) == 1 else name]
    elif x.ndim == 2 and min(x.shape) <= _WIDEST:
        rows = list(x if x.shape[0] < x.shape[1] else x.T)
        called = list(labels) if len(labels) == len(rows) else [f"{name}[{i + 1}]" for i in range(len(rows))]
    else:
        return
    for label, row in zip(called, rows, strict=True):
        yield Variable(label, (row.size,), str(x.dtype), partial(_flat, row), home=home)


def _with_data(part: Any) -> list[Mapping[str, Any]]:
    several = part if isinstance(part, list) else [part]
    return [entry for entry in several if isinstance(entry, Mapping) and isinstance(entry.get("Data"), np.ndarray)]


def _word(value: Mapping[str, Any], name: str) -> str:
    text = value.get(name)
    return text.strip() if isinstance(text, str) else ""


def _words(value: Any) -> tuple[str, ...]:
    """Return one label or several; an empty tuple for any other value."""
    several: Iterable[Any] = value.split("\n") if isinstance(value, str) else value if isinstance(value, list) else ()
    words = tuple(v.strip() for v in several if isinstance(v, str) and v.strip())
    return words if isinstance(value, str) or len(words) == len(list(several)) else ()


def _flat(x: Any) -> Array:
    return np.array(x, dtype=np.float64).ravel()
