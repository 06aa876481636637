"""Each unit of a batch fitted for itself: with the file's priors and with its misalignment free, so that it does not
press a shift of the batch into the shape of another."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from accept.base.progress import steps
from accept.gap.responses import Responses
from accept.models.model_file import Opened, as_weighed
from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.calibrate import Calibration, calibrate, of_damping, refined
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Led, finish, free_of, lead
from checks.fitting.goodness import gaps
from checks.misalignment.estimate_types import DX, DY
from checks.model.model import Model

OFFSETS = {DX: 60.0, DY: 180.0}  # [um] 1 sd, of a strut that was not aligned with care
BANDS_HZ = (700.0, 1000.0, 1400.0, np.inf)  # tops of the growing band: a mode or two more each time
BLUR = 0.03  # tolerance of the first look at a wider band
G_MOST = 2.0  # on records that were not fitted; above, a unit has something that no value of the model gives

Say = Callable[[str], None]
Gs = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class UnitFit:
    """A unit fitted for itself: names (p,), theta (p,), cov (p, p) in the names' units; G: by channel on records that
    were not fitted, or on those that were where there are no others."""

    serial: str
    measured: Responses
    model: Model
    names: tuple[str, ...]
    theta: Array
    cov: Array
    G: Gs
    converged: bool

    @property
    def fits(self) -> bool:
        return self.converged and self.worst <= G_MOST

    @property
    def worst(self) -> float:
        return max(self.G.values(), default=np.inf)


def fit_all(measured: Sequence[Responses], given: Opened, say: Say) -> list[UnitFit]:
    """Return every unit for itself; those that lost their way once more from the middle of the others."""
    fits = [_said(fit_unit(given, m), say) for m in steps(measured, "units fitted")]
    good = [f for f in fits if f.fits]
    if not good or len(good) == len(fits):
        return fits
    centre = dict(zip(good[0].names, np.median([f.theta for f in good], axis=0), strict=True))
    say("again from the middle of the others: " + ", ".join(f.serial for f in fits if not f.fits))
    return [f if f.fits else _said(_better(f, fit_from(given, f.measured, centre)), say) for f in fits]


def _said(fit: UnitFit, say: Say) -> UnitFit:
    known = ", ".join(f"{c} {G:.3g}" for c, G in fit.G.items())
    say(f"{fit.serial}: G {known}" if known else f"{fit.serial}: no values of the model come near its responses")
    return fit


def _better(one: UnitFit, other: UnitFit) -> UnitFit:
    return other if other.worst < one.worst else one


def fit_unit(given: Opened, measured: Responses) -> UnitFit:
    """Fit one unit for itself, offsets free. If that search has lost its way, fit once more over a growing band: two
    modes that lie close can be taken for each other, and are not once those below stand where they belong."""
    model = as_weighed(given, measured.serial, measured.payload_kg).model
    found = _tried(model, measured, lambda: calibrate(model, measured.first, freed(model), unseen=measured.second))
    return (
        found if found.fits else _better(found, _tried(model, measured, lambda: _over_growing_bands(model, measured)))
    )


def _tried(model: Model, measured: Responses, search: Callable[[], Calibration]) -> UnitFit:
    """Return what a search found; a unit of which it can make nothing says nothing: its priors alone, and no G."""
    try:
        found = search()
        fit, G = found.fit, gaps_at(found.model, found.fit.at, measured.second or measured.first)
    except (ModelError, np.linalg.LinAlgError):
        free = freed(model)
        prior, sds = np.array([p.prior for p in free]), np.array([p.sd for p in free])
        return UnitFit(measured.serial, measured, model, tuple(p.name for p in free), prior, np.diag(sds**2), {}, False)
    return UnitFit(measured.serial, measured, found.model, fit.names, fit.values, fit.cov, G, fit.converged)


def _over_growing_bands(model: Model, measured: Responses) -> Calibration:
    first, data = of_damping(model, "modal") or model, measured.first
    low = data.band(data.f[0], BANDS_HZ[0])
    at = lead(first, low, freed(model))[0].at
    for to_Hz in BANDS_HZ:
        part = data.band(data.f[0], to_Hz)
        for tolerance in (BLUR, data.tolerance):
            free = tuple(replace(p, start=at[p.name]) for p in freed(model))
            fit = finish(first, replace(part, tolerance=max(tolerance, data.tolerance)), Led(free, np.inf))
            at = fit.at
    return refined(Calibration(first, first, fit), unseen=measured.second)


def fit_from(given: Opened, measured: Responses, start: Mapping[str, float]) -> UnitFit:
    """Fit one unit for itself from given values, offsets free."""
    model = as_weighed(given, measured.serial, measured.payload_kg).model
    free = tuple(replace(p, start=float(start.get(p.name, p.begin))) for p in freed(model))
    first = of_damping(model, "modal") or model

    def search() -> Calibration:
        fit = finish(first, measured.first, Led(free, np.inf))
        return refined(Calibration(first, first, fit), unseen=measured.second)

    return _tried(model, measured, search)


def freed(model: Model) -> list[Free]:
    """Return what is fitted of each unit: all that is uncertain, and where its APA sits."""
    strut = any(name.startswith("joint.") for name in model.values)
    offsets = [n for n in OFFSETS if strut and n in model.values and n not in model.sds]
    return [
        *free_of(model),
        *(replace(p, sd=OFFSETS[p.name], scale=OFFSETS[p.name] / 3) for p in free_of(model, offsets)),
    ]


def gaps_at(model: Model, values: Mapping[str, float], data: Dataset) -> Gs:
    """Return the G by channel of a model at these values."""
    H = model.frf(data.f, values, data.channels)
    return {c: g.G for c, g in gaps([data.around(H)], [data.H - H]).items()}
