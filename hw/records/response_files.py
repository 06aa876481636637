"""Frequency responses in files of this program and of others: universal files (data set 58 of type 4), MATLAB, CSV with
real and imaginary columns, the JSON of `accept frf`.

What a file does not state - noise, coherence, units - is NaN or empty and never filled in.
"""

import io
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.errors import RecordError
from hw.records import uff58
from hw.records.limits import DEFAULT_LIMITS
from hw.records.mat5 import vet_unpacked
from hw.records.source import SIGNATURE, Source, load_bytes
from hw.records.textfile import open_columns
from hw.records.uff58 import DELIMITER, FRF, UNNAMED
from specs.units import UnitMismatch, factor, parse_header

COHERENCE = 6  # function type of data set 58
FREQUENCIES = ("f", "f_hz", "freq", "freqs", "frequency", "frequencies", "freq_domain", "hz")
PART = re.compile(r"^(?P<name>.+?)[ _.\-]*(?P<part>real|imag|re|im|coherence|coh|var)$", re.IGNORECASE)
AROUND = re.compile(r"^(?P<part>re|im|real|imag)\((?P<name>.+)\)$", re.IGNORECASE)
PARTS = {"real": "re", "imag": "im", "coh": "coherence"}
ANALYSER_H, ANALYSER_COHERENCE = re.compile(r"^H[12v]?_(\d+)$"), "C1_{0}"  # of an analyser's .mat, by channel


@dataclass(frozen=True, eq=False)
class ResponseFile:
    """Responses of a file over one input. f (F,) [Hz], rising; H (F, C) in the units of the file; coherence, var (F,
    C), NaN if not stated; units: of channels and input, "" if not stated; averages: None if not stated; said: a
    sentence on how the content was mapped."""

    file: str
    sha256: str
    f: Array
    H: Complex
    channels: tuple[str, ...]
    input: str
    units: Mapping[str, str]
    coherence: Array
    var: Array
    averages: float | None = None
    said: str = ""


def read_response_file(path: Path, input: str = "", names: Mapping[str, str] | None = None) -> ResponseFile:
    """Return the responses of a file. input: name of the input if the file states none; names: channel here -> name in
    the file, "f" for the frequencies. Raises RecordError with what the file holds."""
    source = load_bytes(path, DEFAULT_LIMITS)
    there = {theirs: here for here, theirs in (names or {}).items()}
    raw = source.raw
    try:
        if DELIMITER.match(raw):
            found = _universal(source, input)
        elif source.suffix == ".json":
            found = _own_json(source)
        elif source.suffix in (".csv", ".txt", ".dat"):
            found = _table(source, input, there)
        else:
            found = _matlab(source, input, there)
    except (RecordError, MemoryError):
        raise
    except Exception as e:
        raise RecordError(f"{source.file}: holds no response that can be read: {type(e).__name__}: {e}") from e
    renamed = tuple(there.get(c, c) for c in found.channels)
    units = {there.get(c, c): unit for c, unit in found.units.items()}
    return _vet_bins(replace(found, channels=renamed, units=units))


def _vet_bins(r: ResponseFile) -> ResponseFile:
    """Return responses in rising order. Raises RecordError for bins that are not finite or come twice."""
    order = np.argsort(r.f, kind="stable")
    f, H = r.f[order], r.H[order]
    if f.size < 2 or not np.isfinite(f).all() or f[0] < 0.0 or not (np.diff(f) > 0).all():
        raise RecordError(f"{r.file}: its frequencies must be two or more, from 0 Hz, none of them twice")
    if not np.isfinite(H).all():
        bad = f[~np.isfinite(H).all(axis=1)][0]
        raise RecordError(f"{r.file}: the response at {bad:.6g} Hz is NaN or infinite")
    if len(set(r.channels)) < len(r.channels):
        raise RecordError(f"{r.file}: two responses have one name: {', '.join(r.channels)}; use --map HERE=THERE")
    return replace(r, f=f, H=H, coherence=r.coherence[order], var=r.var[order])


def _universal(source: Source, input: str) -> ResponseFile:
    functions = uff58.functions(source.file, source.raw)
    found = [f for f in functions if f.kind == FRF]
    if not found:
        kinds = sorted({f.kind for f in functions})
        raise RecordError(f"{source.file}: holds no response (data set 58 of function type {FRF}); it has {kinds}")
    references = {f.reference if f.reference not in UNNAMED else f.reference_dof for f in found}
    if len(references) > 1:
        raise RecordError(f"{source.file}: has responses to {', '.join(sorted(references))}; one input is expected")
    f = uff58.abscissa(source.file, found[0])
    for other in found[1:]:
        if not np.array_equal(f, uff58.abscissa(source.file, other)):
            raise RecordError(f"{source.file}: '{_named(other)}' has other frequencies than '{_named(found[0])}'")
    names = [_named(each) for each in found]
    coherence = np.full((f.size, len(found)), np.nan)
    for each in functions:
        if each.kind == COHERENCE and _named(each) in names and each.count == f.size:
            coherence[:, names.index(_named(each))] = uff58.ordinate(source.file, each).real
    reference = references.pop()
    called = input or reference
    return ResponseFile(
        file=source.file,
        sha256=source.sha256,
        f=f,
        H=np.stack([np.asarray(uff58.ordinate(source.file, each), complex) for each in found], axis=1),
        channels=tuple(names),
        input=called,
        units={called: found[0].per, **{name: each.unit for name, each in zip(names, found, strict=True)}},
        coherence=coherence,
        var=np.full(coherence.shape, np.nan),
        said=f"{len(found)} responses to {reference}",
    )


def _named(f: uff58.UffFunction) -> str:
    return f.response if f.response not in UNNAMED else f.response_dof


def _own_json(source: Source) -> ResponseFile:
    """Return the response that this program wrote, with its coherence and variance unchanged. `nu` are degrees of
    freedom, one fewer than averages. Raises RecordError if the file holds several."""
    found = json.loads(source.raw)["responses"]
    if len(found) != 1:
        raise RecordError(f"{source.file}: holds {len(found)} responses; write one at a time")
    (one,) = found
    names = tuple(one["H"])

    def table(part: str) -> Array:
        columns = [[np.nan if v is None else v for v in one[part][c]] for c in names]
        return np.array(columns, float).T

    H = np.stack([np.array(one["H"][c]["re"]) + 1j * np.array(one["H"][c]["im"]) for c in names], axis=1)
    averages = float(np.min(one["nu"])) + 1.0
    return ResponseFile(
        file=source.file,
        sha256=source.sha256,
        f=np.array(one["f_Hz"], float),
        H=H,
        channels=names,
        input=one["input"],
        units=one["units"],
        coherence=table("coherence"),
        var=table("var"),
        averages=averages,
        said=f"{', '.join(one['files'])}, {one['estimator']}",
    )


def _table(source: Source, input: str, there: Mapping[str, str]) -> ResponseFile:
    """Return the responses of a table with columns NAME_re and NAME_im, maybe NAME_coherence and NAME_var, units in the
    header: `de_re [m/V]`."""
    columns = open_columns(source.file, source.raw)
    plain = {head: parse_header(head)[0] for head in columns}
    axes = [h for h, name in plain.items() if there.get(name) == "f"] or [
        h for h, name in plain.items() if name.lower() in FREQUENCIES
    ]
    parts: dict[str, dict[str, str]] = {}
    for head, name in plain.items():
        hit = AROUND.match(name) or PART.match(name)
        if head not in axes[:1] and hit is not None:
            part = hit["part"].lower()
            parts.setdefault(hit["name"], {})[PARTS.get(part, part)] = head
    names = [name for name, has in parts.items() if {"re", "im"} <= set(has)]
    if not axes or not names:
        what = "no column of frequencies (f, freq)" if not axes else "no pair of columns NAME_re and NAME_im"
        raise RecordError(f"{source.file}: {what}; it has {', '.join(plain.values())}")
    f = columns[axes[0]].values * _scale(source.file, "f", columns[axes[0]].unit or "Hz", "Hz")

    def column(part: str) -> Array:
        empty = np.full(f.size, np.nan)
        return np.stack([columns[parts[n][part]].values if part in parts[n] else empty for n in names], axis=1)

    ratios = {n: columns[parts[n]["re"]].unit for n in names}
    for n in names:
        if ratios[n] != columns[parts[n]["im"]].unit:
            raise RecordError(f"{source.file}: the columns of {n} state two units")
    units, per = _halves(source.file, ratios)
    return ResponseFile(
        file=source.file,
        sha256=source.sha256,
        f=f,
        H=column("re") + 1j * column("im"),
        channels=tuple(names),
        input=input,
        units={input: per, **units},
        coherence=column("coherence"),
        var=column("var"),
        said=f"{', '.join(names)} from columns of real and imaginary parts",
    )


def _halves(file: str, ratios: Mapping[str, str]) -> tuple[dict[str, str], str]:
    """Return the unit of each channel and that of the input: `m/V` is m over V. Raises RecordError for two inputs."""
    found = {n: unit.rpartition("/") if "/" in unit else (unit, "", "") for n, unit in ratios.items()}
    per = {each[2] for each in found.values() if each[2]}
    if len(per) > 1:
        raise RecordError(f"{file}: responses per {', '.join(sorted(per))}; one input is expected")
    return {n: each[0] for n, each in found.items()}, per.pop() if per else ""


def _scale(file: str, name: str, unit: str, wanted: str) -> float:
    if unit.replace(" ", "") == "rad/s":
        return 1.0 / (2.0 * np.pi)
    try:
        return factor(unit, wanted)
    except UnitMismatch as e:
        raise RecordError(f"{file}: {name}: {e}") from e


def _matlab(source: Source, input: str, there: Mapping[str, str]) -> ResponseFile:
    """Return the responses of a MATLAB file: a struct with the fields of an frd object, or complex vectors beside one
    of frequencies. An analyser's H1_2 has its coherence in C1_2."""
    arrays = dict(_arrays(source))
    for prefix in dict.fromkeys(name.rpartition(".")[0] for name in arrays):
        own = {name.removeprefix(f"{prefix}."): value for name, value in arrays.items() if name.startswith(prefix)}
        if {"ResponseData", "Frequency"} <= set(own):
            return _frd(source, own, input)
    axis = next((n for n in arrays if there.get(n) == "f"), None) or next(
        (n for n in arrays if _last(n).lower() in FREQUENCIES and _vector(arrays[n]) is not None), None
    )
    pairs = {n: x for n, x in arrays.items() if x.ndim == 2 and 2 == x.shape[1] and _is_axis(x[:, 0])}
    if axis is None and not pairs:
        raise RecordError(f"{source.file}: holds no frequencies beside a response; it has {', '.join(arrays)}")
    f = np.asarray(_vector(arrays[axis]).real if axis else next(iter(pairs.values()))[:, 0].real, float)  # type: ignore[union-attr]
    named: dict[str, Complex] = {}
    for name, x in arrays.items():
        if axis is None and name in pairs and np.array_equal(x[:, 0].real, f):
            named[name] = x[:, 1]
        elif x.dtype.kind == "c" and f.size in x.shape:
            columns = x.reshape(f.size, -1) if x.shape[0] == f.size else x.T.reshape(f.size, -1)
            many = columns.shape[1] > 1
            named |= {f"{name}[{i + 1}]" if many else name: columns[:, i] for i in range(columns.shape[1])}
    wanted = {n: H for n, H in named.items() if n in there or _last(n) in there}
    if there and not wanted and set(there.values()) - {"f"}:
        raise RecordError(f"{source.file}: no response {', '.join(there)}; it has {', '.join(named)}")
    if not wanted and any(ANALYSER_H.match(_last(n)) for n in named):
        wanted = {n: H for n, H in named.items() if ANALYSER_H.match(_last(n))}
    wanted = wanted or named
    if not wanted:
        raise RecordError(f"{source.file}: no complex vector has the {f.size} values of {axis}")
    coherence = np.full((f.size, len(wanted)), np.nan)
    for i, name in enumerate(wanted):
        hit = ANALYSER_H.match(_last(name))
        beside = _vector(arrays.get(ANALYSER_COHERENCE.format(hit[1]))) if hit else None
        if beside is not None and beside.size == f.size:
            coherence[:, i] = beside.real
    names = tuple(_last(n) for n in wanted)
    return ResponseFile(
        file=source.file,
        sha256=source.sha256,
        f=f,
        H=np.stack([np.asarray(H, complex) for H in wanted.values()], axis=1),
        channels=names,
        input=input,
        units=dict.fromkeys((input, *names), ""),
        coherence=coherence,
        var=np.full(coherence.shape, np.nan),
        said=f"{', '.join(wanted)} over {axis or 'the first column'}",
    )


def _frd(source: Source, own: Mapping[str, NDArray[Any]], input: str) -> ResponseFile:
    """Return the responses of a struct with the fields of an frd object: ResponseData (C, 1, F) or, of one output,
    (F,)."""
    unit = _text(own.get("FrequencyUnit"))[0] or "rad/s"
    f = np.asarray(own["Frequency"], float).ravel() * _scale(source.file, "Frequency", unit, "Hz")
    H = np.asarray(own["ResponseData"], complex).reshape(-1, f.size)
    outputs = [n for n in _text(own.get("OutputName")) if n] or [f"y{i + 1}" for i in range(len(H))]
    inputs = [n for n in _text(own.get("InputName")) if n] or [input]
    if len(inputs) > 1 or len(outputs) != len(H):
        raise RecordError(f"{source.file}: has {len(inputs)} inputs and {len(outputs)} names for {len(H)} responses")
    called = input or inputs[0]
    units = dict(zip(outputs, [*_text(own.get("OutputUnit")), *[""] * len(outputs)], strict=False))

    def table(name: str) -> Array:
        given = own.get(name)
        return np.full(H.T.shape, np.nan) if given is None else np.asarray(given, float).reshape(-1, f.size).T

    averages = own.get("Averages")
    return ResponseFile(
        file=source.file,
        sha256=source.sha256,
        f=f,
        H=H.T,
        channels=tuple(outputs),
        input=called,
        units={called: _text(own.get("InputUnit"))[0], **units},
        coherence=table("Coherence"),
        var=table("Variance"),
        averages=None if averages is None else float(np.ravel(averages)[0]),
        said="the fields of an frd object",
    )


def _text(value: Any) -> list[str]:
    return [str(v).strip() for v in np.ravel(value)] if value is not None and np.size(value) else [""]


def _last(name: str) -> str:
    return name.rpartition(".")[2]


def _vector(x: NDArray[Any] | None) -> NDArray[Any] | None:
    return x.ravel() if x is not None and x.dtype.kind in "fiuc" and x.size == max(x.shape, default=0) > 1 else None


def _is_axis(x: NDArray[Any]) -> bool:
    return x.dtype.kind in "fiuc" and x.size > 1 and not np.any(x.imag) and bool((np.diff(x.real) > 0).all())


def _arrays(source: Source) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield the arrays of a MATLAB file as `outer.inner`, complex ones too."""
    if source.raw.startswith(SIGNATURE) or source.raw.startswith(SIGNATURE, 512):
        yield from _hdf5(source)
        return
    from scipy.io import loadmat  # loads slowly: only when wanted

    vet_unpacked(source.file, source.raw, 16 * DEFAULT_LIMITS.max_samples)
    found = loadmat(io.BytesIO(source.raw), simplify_cells=True)
    yield from _flatten("", {k: v for k, v in found.items() if not k.startswith("__")})


def _flatten(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, NDArray[Any]]]:
    if isinstance(value, Mapping) and depth < 8:
        for key, part in value.items():
            yield from _flatten(f"{name}.{key}" if name else str(key), part, depth + 1)
    elif isinstance(value, str | int | float | complex | np.generic | np.ndarray | list):
        yield name, np.asarray(value)


def _hdf5(source: Source) -> Iterator[tuple[str, NDArray[Any]]]:
    import h5py  # loads slowly: only when wanted

    from hw.records.mat73 import vet_stored

    found: list[tuple[str, NDArray[Any]]] = []

    def take(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset) or not node.size or name[0] == "#":
            return
        vet_stored(source.file, node, len(source.raw))
        if node.size > DEFAULT_LIMITS.max_samples:
            raise RecordError(f"{source.file}: {name} holds {node.size} numbers")
        x = node[()].T  # MATLAB counts columns first
        if node.attrs.get("MATLAB_class", b"") == b"char":
            x = np.array("".join(map(chr, np.ravel(node[()]))))
        elif {"real", "imag"} <= set(x.dtype.names or ()):
            x = x["real"] + 1j * x["imag"]
        if x.dtype.kind in "fiucU":
            found.append((name.replace("/", "."), x))

    with h5py.File(io.BytesIO(source.raw), "r") as file:
        file.visititems(take)
    yield from found
