"""The calibration: a model's uncertain parameters estimated from the data of a unit. Fit, misalignment and gap share
it.

A model whose APA may differ mode by mode need not be wrong for any strut, so the tolerance of its file, an error too
small to matter, is larger than needed: it is reduced as long as the data agree, and the intervals with it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.agreement import contradiction
from checks.fitting.dataset import Dataset
from checks.fitting.fit import BEYOND_DOUBT, Fit, fit, free_of, resume
from checks.fitting.prior import prior_rows
from checks.fitting.response import Response
from checks.model.model import Model

FINER = (3e-3, 1e-3, 3e-4, 1e-4)  # tolerances; the reduction of an APA leaves 1e-4
STEPS = 5  # towards the other form of damping
ROUNDING = 1e-12  # relative: keeps a matrix invertible that a double leaves just short of it
OTHER = {"full": "modal", "modal": "full"}

Wrap = Callable[[Model], Response]


@dataclass(frozen=True, eq=False)
class Calibration:
    """A model calibrated to a unit's responses. model: with the form of damping that the data require; response: the
    fitted part of the model; fit: of its free parameters, at the finest tolerance that the data bear."""

    model: Model
    response: Response
    fit: Fit

    def __repr__(self) -> str:
        return f"Calibration({self.model.name}: {self.fit!r})"


def itself(model: Model) -> Response:
    """Return the model itself, with nothing in series."""
    return model


def calibrate(
    model: Model, datasets: Dataset | Sequence[Dataset], *, unseen: Dataset | None = None, starts: int = 1
) -> Calibration:
    """Return the fit of the model's uncertain parameters. unseen: another realisation, to judge a tolerance by. Raises
    as `fit`."""
    first = quicker(model) if model.scatters else model  # `refine` asks the data for the form
    found = Calibration(first, first, fit(first, datasets, free_of(model), joint=model.joint, starts=starts))
    return refine(found, unseen=unseen)


def refine(found: Calibration, wrap: Wrap = itself, unseen: Dataset | None = None) -> Calibration:
    """Return a calibration with the form of damping that is more likely beyond doubt and, for a model that scatters,
    with the finest tolerance that the data bear."""
    best = with_likelier_damping(found, wrap)
    own = best.fit.datasets[0].tolerance
    for tolerance in (t for t in FINER if found.model.scatters and found.model.least <= t < own):
        sets = [replace(s, tolerance=tolerance) for s in best.fit.datasets]
        finer = replace(best, fit=resume(best.response, best.fit, sets))
        if contradiction(finer.response, finer.fit, unseen) is not None:
            finer = with_likelier_damping(finer, wrap)
            if contradiction(finer.response, finer.fit, unseen) is not None:
                break
        best = finer
    return with_likelier_damping(best, wrap)


def with_likelier_damping(found: Calibration, wrap: Wrap = itself) -> Calibration:
    """Return the calibration with the other form of damping if that is more likely beyond doubt."""
    other = with_damping(found.model, OTHER[found.model.damping])
    if other is None:
        return found
    response, now = wrap(other), found.fit
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            x, cost = _steps_for_damping(found, response)
    except ModelError:  # a step reached values at which the strut is not held
        return found
    if not cost < now.cost:
        return found
    changed = resume(response, replace(now, values=x), now.datasets)
    # One whitener for both: the tolerance's part of it depends on the model's response.
    white = [s.whitener(r) for s, r in zip(now.datasets, changed.residuals, strict=True)]
    cost = changed.prior_cost + 0.5 * sum(float(w @ w) for w in white)
    return Calibration(other, response, changed) if now.cost - cost > BEYOND_DOUBT else found


def _steps_for_damping(found: Calibration, other: Response) -> tuple[Array, float]:
    """Return values (p,) and cost of the best of some Gauss-Newton steps for the other form of damping, with the
    derivatives of this form, which are nearly the same: a cheap test whether the other form is worth a fit."""
    now, x = found.fit, found.fit.values
    unit, W = np.array([p.unit for p in now.free]), prior_rows(now.free, now.joint)
    lo, hi, prior = (np.array([getattr(p, k) for p in now.free]) for k in ("lo", "hi", "prior"))
    J = np.hstack([s.whitener(found.response.jacobian(s.f, now.names, now.at, s.channels)) for s in now.datasets])
    J = np.vstack([J.T, -W]) * unit
    A = linalg.cho_factor(J.T @ J + ROUNDING * np.diag(np.sum(J * J, axis=0)))
    best = x, np.inf
    for _ in range(STEPS):
        at = dict(zip(now.names, (float(v) for v in x), strict=True))
        white = [s.whitener(s.H - other.frf(s.f, at, s.channels)) for s in now.datasets]
        r = np.concatenate([*white, W @ (x - prior)])
        cost = 0.5 * float(r @ r)
        if not cost < best[1]:
            break
        best = x, cost
        x = np.clip(x + unit * linalg.cho_solve(A, J.T @ r), lo, hi)
    return best


@lru_cache(maxsize=8)
def with_damping(model: Model, damping: str) -> Model | None:
    """Return the model with another form of damping, None if it has only one. Cached with its solutions."""
    other = model if model.damping == damping else replace(model, damping=damping)
    try:
        other.modal()
    except ModelError:
        return None
    return other


def quicker(model: Model) -> Model:
    """Return the model with modal damping if it can have it: derivatives take half the time, and a start is as good."""
    return with_damping(model, "modal") or model
