"""Vectors of numbers in the structures that Speedgoat, Simulink and dSPACE write."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from checks.arrays import Array

_DEEPEST = 8  # structures within structures
_WIDEST = 64  # columns of a matrix that are taken as signals


@dataclass(frozen=True, eq=False)
class Column:
    """values (N,) float64; unit: as in the file, "" without one."""

    values: Array
    unit: str = ""


def vectors(name: str, value: Any, labels: Sequence[str] = (), depth: int = 0) -> Iterator[tuple[str, Column]]:
    """Yield the vectors of structures as `outer.inner`, of a matrix by its labels, else as `name[1]`, `name[2]`. Single
    numbers too."""
    if depth > _DEEPEST:
        return
    if isinstance(value, Mapping):
        yield from _structure(name, value, depth)
    elif _are_structures(value):
        for part in value:
            yield from vectors(name, part, (), depth + 1)
    elif isinstance(value, int | float | np.number | np.ndarray):
        yield from _columns(name, np.asarray(value), labels)


def _structure(name: str, value: Mapping[str, Any], depth: int) -> Iterator[tuple[str, Column]]:
    """Yield the vectors of a structure. dSPACE: X and Y. timeseries: Time and Data. Simulink, structure with time:
    `signals` with `values` and `label`. Speedgoat, file scope: `data` with `signalNames`. Else fields side by side."""
    if {"X", "Y"} <= set(value):
        yield from _dspace(value)
        return
    if {"Time", "Data"} <= set(value):
        yield from _timeseries(name, value)
        return
    named = {"values": _words(value.get("label")), "data": _words(value.get("signalNames"))}
    for key, part in value.items():
        inner = f"{name}.{key}" if name else str(key)
        yield from vectors(inner, part, named.get(key, ()), depth + 1)


def _timeseries(name: str, value: Mapping[str, Any]) -> Iterator[tuple[str, Column]]:
    """Yield a timeseries as a structure, by `struct` or `get` of MATLAB: its data by its own name or that of the
    variable."""
    own = value.get("Name")
    label = own if isinstance(own, str) and own not in ("", "unnamed") else name
    yield f"{label}.Time", Column(_flat(value["Time"]), "s")
    yield from _columns(label, np.squeeze(np.asarray(value["Data"])), ())


def _dspace(value: Mapping[str, Any]) -> Iterator[tuple[str, Column]]:
    """Yield the first time axis and the signals sampled by it; signals of another axis have other instants."""
    axes = _with_data(value["X"])
    if axes:
        yield "t", Column(_flat(axes[0]["Data"]), "s")
    for entry in _with_data(value["Y"]):
        if int(entry.get("XIndex", 1) or 1) == 1:
            label = str(entry.get("Name", "")).strip('"')
            yield label, Column(_flat(entry["Data"]), str(entry.get("Unit", "") or ""))


def _columns(name: str, x: np.ndarray[Any, Any], labels: Sequence[str]) -> Iterator[tuple[str, Column]]:
    if x.dtype.kind not in "fiu" or x.size == 0:
        return
    if sum(n > 1 for n in x.shape) <= 1:
        yield (labels[0] if len(labels) == 1 else name), Column(_flat(x))
    elif x.ndim == 2 and min(x.shape) <= _WIDEST:
        rows = x if x.shape[0] < x.shape[1] else x.T
        own = [f"{name}[{i + 1}]" for i in range(len(rows))]
        for label, row in zip(labels if len(labels) == len(rows) else own, rows, strict=True):
            yield label, Column(_flat(row))


def _are_structures(value: Any) -> bool:
    return (
        isinstance(value, list | np.ndarray)
        and len(np.shape(value)) == 1
        and any(isinstance(part, Mapping) for part in value)
    )


def _with_data(part: Any) -> list[Mapping[str, Any]]:
    several = part if isinstance(part, list | np.ndarray) else [part]
    return [entry for entry in several if isinstance(entry, Mapping) and "Data" in entry]


def _words(value: Any) -> tuple[str, ...]:
    """Return one label or several; an empty tuple for any other value."""
    if isinstance(value, str):
        return (value,) if value else ()
    if isinstance(value, list | np.ndarray) and all(isinstance(v, str) and v for v in np.ravel(np.asarray(value))):
        return tuple(str(v).strip() for v in np.ravel(np.asarray(value)))
    return ()


def _flat(x: Any) -> Array:
    return np.array(x, dtype=np.float64).ravel()
