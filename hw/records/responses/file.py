"""Responses of a file in common form, and their making from the statements of each format."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import RecordError
from hw.records.responses.units import fraction, variance
from hw.records.source import Source
from hw.records.uff.units import kind_of

# Names of functions of two channels, or of one, that are no response.
SPECTRUM = re.compile(
    r"cross|spec|psd|asd|csd|auto|power|fft|^(?:pxx|pxy|pyy|pyx|sxx|sxy|syx|syy|sff|sxf|sfx|gxx|gxy|gyy)", re.I
)
INPUTS = {"voltage": "", "force": "force"}  # an input by its kind, if neither file nor user names it


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


@dataclass(frozen=True, eq=False)
class Curve:
    """One response of a file. H (F,); unit: of the channel, per: of the input, "" if not stated; coherence, var: values
    (F,) and their stated unit, None without."""

    name: str
    H: Complex
    unit: str = ""
    per: str = ""
    coherence: tuple[Array, str] | None = None
    var: tuple[Array, str] | None = None


def response_file(
    source: Source,
    f: Array,
    curves: Sequence[Curve],
    input: str,
    said: Iterable[str],
    averages: float | None = None,
) -> ResponseFile:
    """Return the responses of a file, vetted and in rising order. input: its name, "" if neither file nor user states
    one; said: how the content was mapped. Raises RecordError."""
    file, words = source.file, list(said)
    per = {c.per for c in curves if c.per}
    if len(per) > 1:
        raise RecordError(f"{file}: has responses per {' and per '.join(sorted(per))}; one input is expected")
    unit = per.pop() if per else ""
    called = input or (INPUTS.get(kind_of(unit), "input") if unit else "")
    empty = np.full(f.size, np.nan)
    coherence, var = [], []
    for c in curves:
        quality, more = fraction(file, f"the coherence of {c.name}", *c.coherence) if c.coherence else (empty, [])
        noise, less = variance(file, f"the variance of {c.name}", *c.var, (c.unit, c.per)) if c.var else (empty, [])
        coherence.append(quality)
        var.append(noise)
        words += more + less
    found = ResponseFile(
        file=file,
        sha256=source.sha256,
        f=f,
        H=np.stack([np.asarray(c.H, complex) for c in curves], axis=1),
        channels=tuple(c.name for c in curves),
        input=called,
        units={**{c.name: c.unit for c in curves}, called: unit},
        coherence=np.stack(coherence, axis=1),
        var=np.stack(var, axis=1),
        averages=averages,
        said="; ".join(dict.fromkeys(words)),
    )
    return _vet_bins(found)


def _vet_bins(r: ResponseFile) -> ResponseFile:
    """Return responses in rising order. Raises RecordError for bins that are not finite, negative, or come twice."""
    if r.f.size < 2 or not np.isfinite(r.f).all():
        raise RecordError(f"{r.file}: has {r.f.size} frequencies; two or more finite ones are expected")
    order = np.argsort(r.f, kind="stable")
    f, H = r.f[order], r.H[order]
    if f[0] < 0.0:
        raise RecordError(
            f"{r.file}: its frequencies run from {f[0]:.6g} to {f[-1]:.6g} Hz: it is two-sided; save the half from "
            "0 Hz on"
        )
    if not (np.diff(f) > 0).all():
        twice = f[:-1][np.diff(f) <= 0][0]
        raise RecordError(
            f"{r.file}: the frequency {twice:.6g} Hz comes twice; frequencies must rise, none of them twice"
        )
    if not np.isfinite(H).all():
        bad = f[~np.isfinite(H).all(axis=1)][0]
        raise RecordError(f"{r.file}: the response at {bad:.6g} Hz is NaN or infinite; leave that row out")
    if len(set(r.channels)) < len(r.channels):
        raise RecordError(f"{r.file}: two responses have one name: {', '.join(r.channels)}; use --map HERE=THERE")
    if not (np.diff(r.f) > 0).all():
        r = replace(r, said=f"{r.said}; sorted by frequency")
    return replace(r, f=f, H=H, coherence=r.coherence[order], var=r.var[order])
