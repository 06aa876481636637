"""A model's uncertain parameters fitted to the responses of a unit: `accept model fit` and `accept.fit_model`."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from accept.analysis.given_responses import Given, responses_given
from accept.analysis.imported_response import import_response
from accept.base.console import say
from accept.gap.responses import Responses, responses
from accept.models.model_file import OpenedModel, default_model, open_model_file, write_model
from accept.units.loaded_unit import LoadedUnit, loaded
from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.agreement import all_priors, outside_priors
from checks.fitting.calibrate import Calibration, calibrate
from checks.fitting.constants import Constant, fit_constants, seed_constants
from checks.fitting.dataset import F_HI, F_LO, Dataset
from checks.fitting.fit import Fit, free_of, own_cost, start_as_fit
from checks.fitting.fit_panels import fit_panels
from checks.fitting.goodness import Gap, gaps
from checks.model.model import Model, frequencies
from specs.model_sections import FitRecord
from specs.units import unit_of

SEARCH = "the gap analysis (analyse_gap, accept gap) looks for the cause"
WITHIN_DECADES = 0.5  # of a power of 1000: what else differs between a strut and its model is less
OPPOSITE = 0.9  # median of the cosine between response and model
AGREES = 1.1  # of G: 1 within the scatter of some hundred bins
MAX_POINTS = 1_000_000  # a response at each takes a few hundred bytes


@dataclass(frozen=True, eq=False)
class FittedModel:
    """A fit and its start. before, after: G of the model at its file's tolerance, about the model itself; held_out: G
    of the fitted model on the second realisation, empty without one. outside: which values the model's file does not
    allow, or None."""

    base: OpenedModel
    start: Model
    model: Model
    fit: Fit
    measured: Responses
    before: Mapping[str, Gap]
    after: Mapping[str, Gap]
    held_out: Mapping[str, Gap]
    seed_constants: Mapping[str, float]
    constants: Mapping[str, Constant]
    outside: str | None = None

    @property
    def worst(self) -> tuple[str, float]:
        """Return the channel with the largest G, on data that were not fitted if there are any, and that G."""
        by_channel = self.held_out or self.after
        channel = max(by_channel, key=lambda c: by_channel[c].G)
        return channel, by_channel[channel].G

    @property
    def explains(self) -> bool:
        """Return whether the fitted model is one that its file allows and agrees with the unit."""
        return self.doubt is None

    @property
    def doubt(self) -> str | None:
        """Return why the fitted values must not be used, None if they explain the unit."""
        channel, G = self.worst
        if self.fit.converged and self.outside is None and G <= AGREES:
            return None
        if scale := _scale_of(self.start, self.measured.first):
            return scale
        if not self.fit.converged:
            return f"the fit did not converge ({self.fit.message}); {SEARCH}"
        return self.outside or f"G of {channel} is {G:.3g}, agreement is 1 or less; {SEARCH}"

    def __repr__(self) -> str:
        G = ", ".join(f"{c} {self.before[c].G:.2g} -> {gap.G:.2g}" for c, gap in self.after.items())
        end = f"; do not use the values: {self.doubt}" if self.doubt else ""
        return f"FittedModel({self.base.spec.name} to {self.measured.serial}; G, before -> after: {G}{end})"


def fit_unit(
    given: Path | LoadedUnit | Given,
    model: str | None = None,
    f_lo: float = F_LO,
    f_hi: float = F_HI,
    starts: int = 3,
) -> FittedModel:
    """Fit a model to the first realisation of a unit, or to responses, and compare it with the second if there are two.

    given: a unit's folder, a file of responses (`import_response`), or responses in memory.

    model: the built-in one of the unit's kind (of a strut for responses) if None, for a strut with uncertain modes, as
    for its misalignment, so that the two agree. f_lo, f_hi: band that is fitted [Hz]. starts: of the search. Raises
    UnitError, RecordError, SpecError, ModelError."""
    grid(f_lo, f_hi, 2)  # a range that no model has is refused before anything is read
    frequencies([f_lo, f_hi])
    if starts < 1:
        raise ModelError(f"starts = {starts}: expected one or more")
    if isinstance(given, Path) and given.is_file():
        given = import_response(given)
    unit = given if isinstance(given, Given) else loaded(given)
    kind = unit.folder.kind if isinstance(unit, LoadedUnit) else unit.kind if isinstance(unit, Responses) else "strut"
    base = open_model_file(model or default_model(kind))
    if base.model.up_to_Hz < f_hi:
        f_hi = base.model.up_to_Hz
        say(f"fitted to {f_hi:.0f} Hz only: {base.spec.name} is valid up to there")
    if isinstance(unit, LoadedUnit):
        measured = responses(unit, base.model.tolerance, base.model.channels, f_lo, f_hi)
    else:
        measured = responses_given(unit, base.model.tolerance, f_lo, f_hi, base.model.channels)
    measured = measured.on_bench(base.model.learned)
    for words in measured.remarks:
        say(words)
    start = base.model
    if measured.payload_kg is not None:
        start = start.with_values({"bench.payload_kg": measured.payload_kg})
    if not start.sds:
        raise ModelError(f"{base.spec.name}: no value has an sd, so nothing is uncertain and nothing is fitted")
    say(f"{measured.serial}: fitting {len(start.sds)} parameters of {start.name} at {measured.first.f.size} bins")
    found = calibrate(start, measured.first, free_of(start), unseen=measured.second, starts=starts)
    # the state before it, if the search ended farther from the data than it began
    before = start_as_fit(start, measured.first, found.fit, "the search ended farther from the data than it began")
    own = replace(found.fit, datasets=tuple(replace(s, tolerance=measured.first.tolerance) for s in found.fit.datasets))
    found = found if own_cost(own) <= own_cost(before) else Calibration(start, start, before)
    at = found.model.with_values(found.fit.at)
    return FittedModel(
        base=base,
        start=start,
        model=at,
        fit=found.fit,
        measured=measured,
        before=_gaps(start, measured.first),
        after=_gaps(at, measured.first, found.fit.effective_parameters if found.fit.converged else 0.0),
        held_out={} if measured.second is None else _gaps(at, measured.second),
        outside=_outside(found.fit),
        **_constants(at, measured.first),
    )


def _outside(found: Fit) -> str | None:
    """Return the values outside the model file's bounds, with the reason."""
    reason = next(chain(outside_priors(found), all_priors(found)), None)
    return None if reason is None else str(reason)


def _scale_of(model: Model, data: Dataset) -> str | None:
    """Return the channel that is a power of 1000 larger than the model's, or of opposite sign, over most of the band.
    No value of a strut explains that; another unit or a plug does."""
    ratios = data.H / model.frf(data.f, channels=data.channels)
    for channel, size, turned in zip(
        data.channels, np.median(np.abs(ratios), axis=0), np.median(ratios.real / np.abs(ratios), axis=0), strict=True
    ):
        power = 3 * round(np.log10(size) / 3) if size > 0 else 0
        if power and abs(np.log10(size) - power) < WITHIN_DECADES:
            return f"{channel} is 1e{power} times what the model has: is it in another unit?"
        if turned < -OPPOSITE:
            return f"{channel} has the opposite sign of what the model has: check its polarity"
    return None


def _gaps(model: Model, data: Dataset, fitted: float = 0.0) -> dict[str, Gap]:
    """Return G of a model. fitted: how many of its parameters these data determined, 0 if they were not fitted."""
    H = model.frf(data.f, channels=data.channels)
    return gaps([data.around(H)], [data.H - H], fitted)


def _constants(model: Model, data: Dataset) -> dict[str, Any]:
    """Estimate ga and gs by the formulas of [STB] 4.2.1 and by least squares; empty without the bands they need."""
    H = {c: data.H[:, i] for i, c in enumerate(data.channels)}
    variance = {c: data.noise[:, i] for i, c in enumerate(data.channels)}
    if "Vs" not in H or not H.keys() & {"de", "da"}:
        return {"seed_constants": {}, "constants": {}}
    de = H["de"] if "de" in H else H["da"]
    try:
        by_seed = seed_constants(model, data.f, de, H["Vs"])
        return {"seed_constants": by_seed, "constants": fit_constants(model, data.f, H, variance)}
    except ModelError as e:
        say(f"no constants by the published formulas: {e}")
        return {"seed_constants": {}, "constants": {}}


def write_fitted(path: Path, fitted: FittedModel) -> None:
    """Write the fitted model as a file, with its covariance and where it came from."""
    fit, base = fitted.fit, fitted.base
    record = FitRecord(
        names=list(fit.names),
        covariance=[[float(v) for v in row] for row in fit.cov],
        model=base.spec.name,
        model_sha256=base.model.sha256,
        serial=fitted.measured.serial,
        inputs=fitted.measured.inputs,
        G={c: g.G for c, g in fitted.after.items()},
        G_not_fitted={c: g.G for c, g in fitted.held_out.items()},
        doubt=fitted.doubt,
    )
    moved = {n: v for n, v in fitted.start.values.items() if v != base.model.values[n]}
    write_model(path, base.spec, moved | fit.at, fit.sds, damping=fitted.model.damping, record=record)


def pictures(fitted: FittedModel) -> dict[str, Any]:
    """Return panels of every channel: magnitude, phase, residual."""
    data = fitted.fit.datasets[0]
    before, after = (m.frf(data.f, channels=data.channels) for m in (fitted.start, fitted.model))
    return dict(fit_panels(data.around(after), before, after))


def document(fitted: FittedModel) -> dict[str, Any]:
    """Return the fit as a document for scripts."""
    fit = fitted.fit
    return {
        "serial": fitted.measured.serial,
        "model": fitted.base.spec.name,
        "damping": fitted.model.damping,
        "converged": fit.converged,
        "at_bound": list(fit.at_bound),
        "explains": fitted.explains,
        "doubt": fitted.doubt,
        "parameters": {
            n: {"value": v, "U": 2.0 * fit.sds[n], "unit": unit_of(n), "prior": p.prior, "prior_sd": p.sd}
            for (n, v), p in zip(fit.at.items(), fit.free, strict=True)
        },
        "gap_before": _plain(fitted.before),
        "gap_after": _plain(fitted.after),
        "gap_held_out": _plain(fitted.held_out),
        "constants_by_the_seed": dict(fitted.seed_constants),
        "constants": {n: {"value": c.value, "ci95": [c.lo, c.hi]} for n, c in fitted.constants.items()},
        "inputs": fitted.measured.inputs,
    }


def _plain(found: Mapping[str, Gap]) -> dict[str, float]:
    return {channel: gap.G for channel, gap in found.items()}


def grid(f_lo: float, f_hi: float, points: int) -> Array:
    """Return (points,) frequencies [Hz] spread evenly over log f. Raises ModelError if there is no such grid."""
    if not 0.0 < f_lo < f_hi < np.inf or not 2 <= points <= MAX_POINTS:
        raise ModelError(
            f"{points} points from {f_lo:g} to {f_hi:g} Hz: expected 2 to {MAX_POINTS} of them over a rising range"
        )
    return np.geomspace(f_lo, f_hi, points)
