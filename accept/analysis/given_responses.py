"""Responses that a script has already, as a fit and a misalignment take them: a dataset, an estimate, or arrays."""

from collections.abc import Sequence
from dataclasses import replace
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from accept.analysis.arguments import check_argument
from accept.analysis.record_responses import UNITS, MeasuredResponse
from accept.gap import Responses
from checks.cause import together
from checks.errors import RecordError
from checks.fitting import Dataset

Given = Responses | Dataset | MeasuredResponse
CHANNELS = ("Vs", "de", "da")


def dataset(
    f: ArrayLike, H: ArrayLike, channels: Sequence[str], var: ArrayLike, averages: float = 10.0, name: str = "arrays"
) -> Dataset:
    """Return responses (F, C) over Va at the DAC as a fit takes them, from arrays.

    f (F,) [Hz], rising; H (F, C) complex, Vs in V/V, de and da in m/V; channels: names of the columns of H; var (F, C)
    total complex variance of H, or (F, C, C) its covariance across channels; averages: how many estimates, records or
    segments, var was found from. Errors of different bins are taken to be independent. Raises RecordError."""
    check_argument("dataset", "channels", channels, Sequence[str])
    check_argument("dataset", "name", name, str)
    if not isinstance(averages, Real) or not averages >= 2.0:
        raise RecordError(f"{name}: averages = {averages!r}; a variance needs two or more")
    try:
        frequencies, response, noise = np.asarray(f, float), np.asarray(H, complex), np.asarray(var, complex)
    except (TypeError, ValueError) as e:
        raise RecordError(f"{name}: f, H and var must be arrays of numbers ({e})") from e
    C = len(channels)
    if unknown := [c for c in channels if c not in CHANNELS]:
        raise RecordError(f"{name}: channels has {unknown[0]!r}; expected some of {', '.join(CHANNELS)}")
    if len(set(channels)) < C:
        raise RecordError(f"{name}: channels names one of {', '.join(channels)} twice")
    if frequencies.ndim != 1 or response.shape != (frequencies.size, C):
        shapes = f"f has the shape {frequencies.shape}, H {response.shape}"
        raise RecordError(f"{name}: {shapes}; expected (F,) and (F, {C}) for {C} channels")
    if noise.shape == response.shape:
        noise = noise[:, :, None] * np.eye(C)
    if noise.shape != (frequencies.size, C, C):
        raise RecordError(f"{name}: var has the shape {noise.shape}; expected (F, {C}) or (F, {C}, {C})")
    if frequencies.size < 2 or not np.isfinite(frequencies).all() or not (np.diff(frequencies, prepend=0.0) > 0).all():
        raise RecordError(f"{name}: f must hold two or more rising frequencies above 0 Hz")
    if not (np.isfinite(response).all() and np.isfinite(noise).all()):
        raise RecordError(f"{name}: H and var must be finite numbers")
    if not (np.linalg.eigvalsh(noise)[:, 0] > 0).all():
        raise RecordError(f"{name}: var must be above zero, a covariance positive definite")
    nu = np.full(frequencies.size, float(averages) - 1.0)
    return Dataset(frequencies, response, tuple(channels), noise, nu, name=name)


def responses_given(
    given: Given, tolerance: float, f_lo: float, f_hi: float, channels: Sequence[str] = CHANNELS
) -> Responses:
    """Return responses as of a unit, over f_lo..f_hi [Hz]. tolerance, channels: of the model. Raises RecordError."""
    if isinstance(given, Responses):
        second = None if given.second is None else _part(given.second, tolerance, f_lo, f_hi, channels)
        return replace(given, first=_part(given.first, tolerance, f_lo, f_hi, channels), second=second)
    if isinstance(given, MeasuredResponse):
        if given.faults:
            raise RecordError(together(given.faults))
        wrong = [c for c, unit in given.units.items() if c in UNITS and unit not in ("", UNITS[c])]
        if given.frf.input != "Va" or wrong:
            what = f"{wrong[0]} is in {given.units[wrong[0]]}" if wrong else f"the input is {given.frf.input}"
            raise RecordError(f"{given.title}: {what}; a model answers to Va [V] with Vs [V], de and da [m]")
        if np.isnan(given.frf.var).all():
            raise RecordError(
                f"{given.title}: states no noise, and a fit needs it: name the averages beside the coherence "
                "(averages=20, --averages 20), or a relative noise (noise=0.005, --noise 0.005)"
            )
        band = given.frf.band(f_lo, f_hi)
        if not (band.var > 0.0).all():
            raise RecordError(
                f"{given.title}: its variance is 0 at {int((band.var <= 0.0).any(axis=1).sum())} of {band.f.size} "
                "frequencies, as where a coherence is rounded to 1 or of a single average; state a relative noise "
                "instead of the averages (noise=0.005, --noise 0.005)"
            )
        first = _part(Dataset.of(given.frf, name=given.title), tolerance, f_lo, f_hi, channels)
        return Responses(given.title, "strut", first, None, 0.0, inputs=given.inputs)
    return Responses(given.name, "strut", _part(given, tolerance, f_lo, f_hi, channels), None, 0.0)


def _part(data: Dataset, tolerance: float, f_lo: float, f_hi: float, channels: Sequence[str]) -> Dataset:
    there = [c for c in channels if c in data.channels]
    if not there:
        raise RecordError(f"{data.name}: has {', '.join(data.channels)}; the model needs some of {', '.join(channels)}")
    part = data.band(f_lo, f_hi).select(there)
    if part.f.size < 2:
        raise RecordError(f"{data.name}: no two frequencies lie in {f_lo:g}..{f_hi:g} Hz")
    return replace(part, tolerance=tolerance)
