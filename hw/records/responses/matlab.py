"""Responses of MATLAB files: an frd struct, vectors beside frequencies, pairs of axis and values of an analyser.

An analyser's file has records, spectra and coherences too. The name of a variable shows its kind; a complex vector
without a telling name or --map is not taken for a response."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.responses.arrays import arrays_of
from hw.records.responses.file import SPECTRUM, Curve, ResponseFile, response_file
from hw.records.responses.frd import read_frd
from hw.records.responses.units import ANGULAR, axis_unit, converted, hertz
from hw.records.source import Source
from specs.units import RESPONSE_UNITS, split_ratio

COHERENT = re.compile(r"coh|^gamma|^g(?:am)?2|^c_?\d|^c(?:xy|yx|uy)", re.I)
RESPONDS = re.compile(r"^(?:h|frf|tf|transfer|response|receptance|compliance|mobility|accelerance|inertance)", re.I)
RESPONDS_EXACTLY = ("g", "txy", "tyx", "tuy")
COHERENCE_WORDS = ("coh", "coherence", "coher", "gamma", "gamma2", "cxy", "c")
RESPONSE_WORDS = ("h", "hf", "frf", "tf", "h1", "h2", "hv", "txy", "g", "response")
INDEXED = re.compile(r"^[a-z]+_?(\d+)_(\d+)$", re.I)  # H1_2: channel 2 over channel 1
ALONE = re.compile(r"^H[12v]?_(\d+)$")
SAME_AXIS = 1e-6


@dataclass(frozen=True)
class _Candidate:
    """Values (F,) of a variable over its frequencies; axis: name of their vector, "" for its own first column."""

    values: NDArray[Any]
    f: Array
    axis: str


def read_matlab(source: Source, input: str, there: Mapping[str, str]) -> ResponseFile:
    """Return the responses of a MATLAB file. Raises RecordError with the file's contents."""
    arrays = arrays_of(source)
    for prefix in dict.fromkeys(name.rpartition(".")[0] for name in arrays):
        dot = f"{prefix}." if prefix else ""
        own = {n.removeprefix(dot): x for n, x in arrays.items() if n.startswith(dot)}
        if {"ResponseData", "Frequency"} <= set(own):
            return read_frd(source, own, input)
    if not any(x.dtype.kind == "c" for x in arrays.values()):
        raise RecordError(
            f"{source.file}: holds no complex values: a magnitude has no phase; save the complex response. It has "
            f"{', '.join(arrays)}"
        )
    axis = _axis(source.file, arrays, there)
    found = dict(_candidates(arrays, axis))
    responses, left = _choose(source.file, arrays, found, there, axis)
    channel = {hit[1] for n in responses if (hit := INDEXED.match(_last(n)))}
    if len(channel) > 1:
        if input not in channel:
            listed = ", ".join(sorted(channel))
            raise RecordError(f"{source.file}: has responses to the channels {listed}; name one of them with --input")
        responses = {n: each for n, each in responses.items() if (hit := INDEXED.match(_last(n))) and hit[1] == input}
        channel, input = {input}, ""
    first = next(iter(responses.values()))
    for name, each in responses.items():
        if each.f.size != first.f.size or not np.allclose(each.f, first.f, rtol=SAME_AXIS, atol=0.0):
            raise RecordError(f"{source.file}: '{name}' has other frequencies than '{next(iter(responses))}'")
    stated = _stated_units(source.file, arrays)
    curves, used = [], set[str]()
    for name, each in responses.items():
        beside = _coherence_of(source.file, name, each, found, len(responses))
        used |= {beside} if beside else set()
        unit, per = split_ratio(stated.get(_last(name), ""))
        quality = None if not beside else (np.asarray(found[beside].values.real, float), "")
        curves.append(Curve(_last(name), np.asarray(each.values, complex), unit, per, quality))
    over = first.axis or "the first column of each"
    said = [f"{', '.join(responses)} over {over}"]
    scale = 1.0
    if axis:
        unit = axis_unit(_last(axis)) or ""
        scale, said = hertz(source.file, axis, unit or "Hz"), said + converted(axis, unit)
        said += [] if unit else ["frequencies without a unit taken in Hz"]
    said += [f"with their coherence {', '.join(sorted(used))}"] if used else []
    rest = [n for n in left if n not in used]
    said += [f"left out, no responses: {', '.join(rest)}"] if rest else []
    said += [f"per {curves[0].per} of channel {channel.pop()}"] if channel and curves[0].per else []
    return response_file(source, first.f * scale, curves, input, said)


def _axis(file: str, arrays: Mapping[str, NDArray[Any]], there: Mapping[str, str]) -> str:
    """Return the name of the vector of frequencies, "" without one. Raises RecordError if two contradict each other,
    and for angular frequencies, which may be per second or per sample."""
    mapped = next((n for n in arrays if "f" in (there.get(n), there.get(_last(n)))), "")
    if mapped:
        return mapped
    axes = {n: x for n, a in arrays.items() if axis_unit(_last(n)) is not None and (x := _vector(a)) is not None}
    angular = [n for n in axes if _last(n).lower() in ANGULAR]
    plain = [n for n in axes if n not in angular]
    if not plain and angular:
        raise RecordError(
            f"{file}: '{angular[0]}' may be in rad/s or per sample; save frequencies in Hz as 'f', or in rad/s as "
            f"'{_last(angular[0])}_rad_s'"
        )
    for name in plain[1:]:
        one, other = (axes[n].real * hertz(file, n, axis_unit(_last(n)) or "Hz") for n in (plain[0], name))
        if one.size == other.size and not np.allclose(one, other, rtol=1e-3, atol=0.0):
            raise RecordError(
                f"{file}: the frequencies '{plain[0]}' and '{name}' contradict each other; name one with --map f=NAME"
            )
    for name in angular:
        if axes[name].size == axes[plain[0]].size:
            f = axes[plain[0]].real * hertz(file, plain[0], axis_unit(_last(plain[0])) or "Hz")
            if not np.allclose(2.0 * np.pi * f, axes[name].real, rtol=1e-3, atol=0.0):
                raise RecordError(
                    f"{file}: the frequencies '{plain[0]}' in Hz and '{name}' in rad/s contradict each other; name one "
                    "with --map f=NAME"
                )
    return plain[0] if plain else ""


def _candidates(arrays: Mapping[str, NDArray[Any]], axis: str) -> Iterator[tuple[str, _Candidate]]:
    """Yield possible responses: pairs of axis and values, and columns as long as the frequencies."""
    vector = _vector(arrays[axis]) if axis else None
    f = None if vector is None else np.asarray(vector.real, float)
    for name, x in arrays.items():
        if x.dtype.kind not in "fiuc" or name == axis:
            continue
        pair = x if x.ndim == 2 and x.shape[1] == 2 else x.T if x.ndim == 2 and x.shape[0] == 2 else None
        at = np.zeros(0) if pair is None else pair[:, 0]
        rises = at.size > 1 and not np.any(at.imag) and bool((np.diff(at.real) > 0).all())
        if pair is not None and rises and (f is None or np.array_equal(at.real, f)):
            yield name, _Candidate(pair[:, 1], np.asarray(at.real, float), "")
        elif f is not None and f.size in x.shape:
            columns = x.reshape(f.size, -1) if x.shape[0] == f.size else x.T.reshape(f.size, -1)
            many = columns.shape[1] > 1
            for i in range(columns.shape[1]):
                yield f"{name}[{i + 1}]" if many else name, _Candidate(columns[:, i], f, axis)


def _choose(
    file: str, arrays: Mapping[str, Any], found: Mapping[str, _Candidate], there: Mapping[str, str], axis: str
) -> tuple[dict[str, _Candidate], list[str]]:
    """Return the responses, by --map or name, and the other vectors. Raises RecordError without a response."""
    wanted = {n for n in found if "f" not in (there.get(n), there.get(_last(n))) and (n in there or _last(n) in there)}
    if set(there.values()) - {"f"} and not wanted:
        raise RecordError(f"{file}: no response {', '.join(there)}; it has {', '.join(found) or ', '.join(arrays)}")
    named = {n for n in found if _is_response(_last(n))}
    exact = {n for n in named if INDEXED.match(_last(n)) or ALONE.match(_last(n))}
    chosen = wanted or {n for n in exact if found[n].values.dtype.kind == "c"} or named
    complex_ = [n for n, each in found.items() if each.values.dtype.kind == "c"]
    if not chosen:
        if complex_:
            hint = f"; if one is a response, name it: --map de={complex_[0]}"
            raise RecordError(f"{file}: {', '.join(complex_)}: no response by name (H, FRF, H1_2, de){hint}")
        what = f"no complex vector over {axis}" if axis else "no frequencies beside a response"
        raise RecordError(f"{file}: holds {what}; it has {', '.join(arrays)}")
    if real := next((n for n in found if n in chosen and found[n].values.dtype.kind != "c"), None):
        if not complex_ or real in wanted:
            raise RecordError(f"{file}: '{real}' has real values, so it has no phase; save the complex response")
        chosen = {n for n in chosen if n in complex_}
    if not chosen:
        raise RecordError(f"{file}: no complex response; it has {', '.join(arrays)}")
    left = [n for n in found if n not in chosen and (n in complex_ or COHERENT.search(_last(n)))]
    return {n: each for n, each in found.items() if n in chosen}, left


def _is_response(name: str) -> bool:
    plain = name.partition("[")[0]
    if plain in RESPONSE_UNITS:
        return True
    if SPECTRUM.search(plain) or COHERENT.search(plain):
        return False
    return plain.lower() in RESPONDS_EXACTLY or RESPONDS.match(plain) is not None


def _coherence_of(file: str, name: str, of: _Candidate, found: Mapping[str, _Candidate], responses: int) -> str:
    """Return the name of a response's coherence, "" without one: H1_2 has C1_2, Hf_chan_2 has Hf_coh_chan_2.

    Raises RecordError if it has other frequencies."""
    real = [n for n, each in found.items() if COHERENT.search(_last(n)) and each.values.dtype.kind != "c"]
    alone = ALONE.match(_last(name))
    keys = [_key(name, RESPONSE_WORDS), *([("1", alone[1])] if alone else [])]
    hits = [n for key in keys for n in real if _key(n, COHERENCE_WORDS + RESPONSE_WORDS) == key]
    if not hits and responses == 1 and len(real) == 1:
        hits = real
    if not hits:
        return ""
    beside = found[hits[0]]
    if beside.f.size != of.f.size or not np.allclose(beside.f, of.f, rtol=SAME_AXIS, atol=0.0):
        raise RecordError(f"{file}: the coherence '{hits[0]}' has other frequencies than '{name}'; save both alike")
    return hits[0]


def _key(name: str, words: Sequence[str]) -> tuple[str, ...]:
    """Return the parts of a name without those of its kind: `Hf_coh_chan_2` is ("chan", "2")."""
    last = _last(name)
    indexed = INDEXED.match(last)
    if indexed:
        return indexed[1], indexed[2]
    parts = [part.lower() for part in re.split(r"[_.\s]+", re.sub(r"\[(\d+)\]$", r"_\1", last)) if part]
    return tuple(part for part in parts if part not in words)


def _stated_units(file: str, arrays: Mapping[str, NDArray[Any]]) -> dict[str, str]:
    """Return the unit of each variable that an analyser's list of signals states (`Signal H1_2`, `Real/Imag g / N`), or
    that follows from its units by channel. Raises RecordError if a response is stated without phase."""
    units: dict[str, str] = {}
    info = [str(v).strip() for v in np.ravel(arrays["DP_Info"])] if "DP_Info" in arrays else []
    for signal, form, scaling in zip(info, info[1:], info[2:], strict=False):
        name = signal.removeprefix("Signal ").strip()
        if not signal.startswith("Signal ") or not RESPONDS.match(name):
            continue
        kind, _, unit = form.partition(" ")
        upper, colon, lower = scaling.partition(":")
        if kind.lower() != "real/imag" or (colon and upper != lower):
            raise RecordError(
                f"{file}: '{name}' is stated as '{form}', '{scaling}'; export real and imaginary parts, both sides "
                "scaled alike (0-Z:0-Z)"
            )
        units[name] = unit.strip().removeprefix("EU").strip()
    channels = [str(v).strip() for v in np.ravel(arrays["Unit"])] if "Unit" in arrays else []
    numbers = [str(v) for v in np.ravel(arrays.get("ChanNum", np.arange(1, len(channels) + 1)))]
    of = dict(zip(numbers, channels, strict=False))
    for name in arrays:
        hit = INDEXED.match(name)
        if hit and name not in units and hit[1] in of and hit[2] in of:
            units[name] = f"{of[hit[2]]}/{of[hit[1]]}"
    return units


def _last(name: str) -> str:
    return name.rpartition(".")[2]


def _vector(x: NDArray[Any]) -> NDArray[Any] | None:
    return x.ravel() if x.dtype.kind in "fiuc" and x.size == max(x.shape, default=0) > 1 else None
