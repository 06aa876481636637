"""Responses of others: files of an analyser or of another program, read and compared. `accept.read_response`."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from accept.analysis.record_responses import UNITS, MeasuredResponse
from accept.base.console import say
from checks.errors import RecordError
from checks.signals import Frf, conjugate_resonances
from hw.records import ResponseFile, read_response_file
from specs.units import UnitMismatch, factor

DIGITS = 1e-6  # relative: universal files state frequencies with seven digits


@dataclass(frozen=True, eq=False)
class ImportedResponse(MeasuredResponse):
    """Response of a file without record. Variance and coherence are NaN if the file states none; there are no second
    realisation and no resonances."""

    file: str
    sha256: str

    @property
    def inputs(self) -> dict[str, str]:
        return {self.file: self.sha256}

    def __repr__(self) -> str:
        f, of = self.frf.f, f"{', '.join(self.frf.channels)} over {self.frf.input}"
        noise = "noise not stated" if np.isnan(self.frf.var).all() else "with its noise"
        return f"ImportedResponse({self.file}: {of}; {f.size} bins from {f[0]:.4g} to {f[-1]:.4g} Hz, {noise})"


def import_response(
    path: Path,
    input: str = "",
    names: Mapping[str, str] | None = None,
    averages: float | None = None,
    noise: float | None = None,
) -> ImportedResponse:
    """Return the response of a file, in the units of this program.

    input: name of the input; if empty that of the file, else by its unit (force for N), else Va; names: channel here ->
    in the file; averages: segments behind the coherence that the file states; noise: relative standard deviation of H,
    if the file states none. Raises RecordError, also for the complex conjugate of a response."""
    if averages is not None and not averages >= 2.0:
        raise RecordError(f"averages = {averages:g}: a variance needs two or more")
    if noise is not None and not 0.0 < noise < 1.0:
        raise RecordError(f"noise = {noise:g}: expected a relative standard deviation between 0 and 1")
    found = read_response_file(path, input, names)
    called = found.input or "Va"
    H, units, conversions = _in_our_units(found, called)
    if rising := conjugate_resonances(found.f, H):
        where = ", ".join(f"{pole.f_Hz:.4g}" for pole in rising[:3])
        raise RecordError(
            f"{found.file}: at {where} Hz the phase rises through a resonance, where that of a stable structure falls: "
            "the file holds the complex conjugate (phase of e^-jwt); export it with the other sign, or change that of "
            "its phase or imaginary part"
        )
    scale = np.abs(H) / np.where(found.H == 0.0, 1.0, np.abs(found.H))
    var, nu, notes = _noise(found, H, found.var * scale**2, averages, noise)
    frf = Frf(
        f=found.f,
        H=H,
        channels=found.channels,
        input=called,
        coherence=found.coherence,
        cov=var[:, :, None] * np.eye(H.shape[1]),
        nu=np.full(found.f.size, nu),
        correlation=(),
        estimator="imported",
        notes=notes,
    )
    say(f"{found.file}: {'; '.join([found.said, *conversions])}")
    return ImportedResponse((), frf, units, {}, found.file, found.sha256)


def _in_our_units(found: ResponseFile, input: str) -> tuple[Any, dict[str, str], list[str]]:
    """Return H (F, C), the units, of the channels that have one here in that (others stay as they are), and the words
    on conversions. Raises RecordError for a unit that does not fit a channel."""
    given = {input: found.units.get(found.input, ""), **{c: found.units.get(c, "") for c in found.channels}}
    units, scales, words = dict(given), dict.fromkeys(given, 1.0), []
    for name, unit in given.items():
        wanted = UNITS.get(name, "")
        if not wanted:
            continue
        units[name] = wanted
        if unit:
            try:
                scales[name] = factor(unit, wanted)
            except UnitMismatch as e:
                other = "give it another name (--map NAME=THERE)" if name != input else "name the input with --input"
                raise RecordError(
                    f"{found.file}: '{name}' has the unit {unit}, which does not fit: {name} is in {wanted} here; "
                    f"{other}, or convert it"
                ) from e
            words += [f"{name} in {unit} converted to {wanted}"] if scales[name] != 1.0 else []
    H = found.H * np.array([scales[c] / scales[input] for c in found.channels])
    return H, units, words


def _noise(
    found: ResponseFile, H: Any, var: Any, averages: float | None, noise: float | None
) -> tuple[Any, float, tuple[str, ...]]:
    """Return the variance (F, C), its degrees of freedom, and a note on missing noise. The variance that follows from
    coherence and n averages is |H|^2 (1 - coherence) / (coherence (n - 1)) ([PS12] 2.5)."""
    n = averages or found.averages
    if np.isfinite(var).all():
        return var, (n or 2.0) - 1.0, ()
    if np.isfinite(found.coherence).all() and n is not None:
        coherence = np.clip(found.coherence, 1e-12, 1.0)
        return np.abs(H) ** 2 * (1.0 - coherence) / coherence / (n - 1.0), n - 1.0, ()
    if noise is not None:
        return (noise * np.abs(H)) ** 2, np.inf, (f"noise of {100 * noise:g} % of |H|, as stated by the user",)
    known = np.isfinite(found.coherence)
    has = "states its coherence without averages" if known.any() else "states no coherence"
    if known.any() and n is not None:
        has = f"states no coherence at {int((~known).any(axis=1).sum())} of {found.f.size} frequencies"
    return np.full(H.shape, np.nan), np.inf, (f"the file {has}: its noise is not known",)


@dataclass(frozen=True)
class ResponseDifference:
    """Difference of two responses of a channel, relative to the second [1]: median and largest |H1/H2 - 1|, the
    frequency [Hz] of the largest, and in how many of the bins both agree within their 95 % regions (None: noise not
    known)."""

    channel: str
    bins: int
    median: float
    largest: float
    at_Hz: float
    agreeing: float | None


def differences(one: MeasuredResponse, other: MeasuredResponse) -> list[ResponseDifference]:
    """Compare the channels that two responses have in common, over their common band, on the grid of the coarser one.

    Raises RecordError if they share no channel, no band, or differ in units."""
    a, b = one.frf, other.frf
    shared = [c for c in a.channels if c in b.channels]
    if not shared and len(a.channels) == len(b.channels) == 1:
        shared = [a.channels[0]]
    if not shared:
        raise RecordError(f"{one.title} has {', '.join(a.channels)}, {other.title} {', '.join(b.channels)}")
    lo, hi = max(a.f[0], b.f[0]) * (1.0 - DIGITS), min(a.f[-1], b.f[-1]) * (1.0 + DIGITS)
    coarse = a if np.sum((a.f >= lo) & (a.f <= hi)) <= np.sum((b.f >= lo) & (b.f <= hi)) else b
    f = coarse.f[(coarse.f >= lo) & (coarse.f <= hi)]
    if f.size < 2:
        raise RecordError(f"{one.title} and {other.title} have no two frequencies in common")
    return [_difference(one, other, c, f) for c in shared]


def _difference(one: MeasuredResponse, other: MeasuredResponse, channel: str, f: Any) -> ResponseDifference:
    units = [r.ratios.get(channel, "") for r in (one, other)]
    if all(units) and units[0] != units[1]:
        raise RecordError(f"{channel}: {one.title} is in {units[0]}, {other.title} in {units[1]}")
    values, radii = [], []
    for r in (one, other):
        c = r.frf.channels.index(channel) if channel in r.frf.channels else 0
        values.append(np.interp(f, r.frf.f, r.frf.H[:, c]))
        radii.append(np.interp(f, r.frf.f, r.frf.radius()[:, c]))
    usable = np.isfinite(values[0]) & np.isfinite(values[1]) & (np.abs(values[1]) > 0.0)
    if not usable.any():
        raise RecordError(f"{channel}: {one.title} and {other.title} have no usable bin in common")
    apart = np.abs(values[0][usable] - values[1][usable])
    relative = apart / np.abs(values[1][usable])
    region = np.hypot(radii[0], radii[1])[usable]
    agreeing = None if np.isnan(region).any() else float(np.mean(apart <= region))
    worst = int(np.argmax(relative))
    return ResponseDifference(
        channel, f.size, float(np.median(relative)), float(relative[worst]), float(f[usable][worst]), agreeing
    )
