"""Residuals of a calibrated model made independent, with all that its calibrated parameters can explain taken out.

Whitened residuals and the priors' rows form one vector r (n,); J (n, p) are its derivatives by the calibrated
parameters. What is left by J, r - Q Q' r with Q R = J, does not change with any small error of the calibration, so it
is standard normal if noise, tolerance and priors are those of the model: no refit is needed to know its null.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.dataset import Dataset
from checks.fitting.prior import prior_rows
from checks.gap.modelling.augmented import Augmented, Values

TOLD = 1.0 / (1.0 + 5.0**2)  # room of a parameter that the data alone tell to five standard deviations of its prior


@dataclass(frozen=True, eq=False)
class Projected:
    """The residual without the free parameters. r (n,): 2 F C rows of the data, then one for every parameter with a
    prior; Q (n, p) orthonormal."""

    data: Dataset
    response: Augmented
    at: Values
    r: Array
    Q: Array
    names: tuple[str, ...]
    pulled: tuple[str, ...]

    @cached_property
    def modelled(self) -> Complex:
        """Return the response (F, C) at the values."""
        return self.response.frf(self.data.f, self.at, self.data.channels)

    @cached_property
    def left(self) -> Array:
        """Return the part (n,) of the residual that the calibrated parameters cannot explain."""
        return self.off(self.r)

    def off(self, x: Array) -> Array:
        """Return the rows (..., n) without their part along the parameters."""
        return x - (x @ self.Q) @ self.Q.T

    def rows(self, dH: Complex) -> Array:
        """Return the whitened and projected rows (..., n) of changes of the response (..., F, C)."""
        white = self.data.whitener(dH)
        zeros = np.zeros((*white.shape[:-1], len(self.pulled)))
        return self.off(np.concatenate([white, zeros], axis=-1))

    def by_bin(self, x: Array) -> Complex:
        """Return the data's rows of x (n,) as complex numbers (F, C): each of unit variance per real and imaginary
        part."""
        return self.data.whitener.by_bin(x[: 2 * self.data.H.size])

    @property
    def pulls(self) -> dict[str, float]:
        """Return the pulls, standard normal under the null: how far a calibrated value is pulled off its prior by data
        that it can explain no other way. A parameter that the data alone hardly tell has none: they would place it many
        standard deviations away, where no derivative holds."""
        last = len(self.pulled)
        room = 1.0 - np.sum(self.Q[-last:] ** 2, axis=1) if last else np.zeros(0)
        rest = self.left[-last:] if last else np.zeros(0)
        return {n: float(v / np.sqrt(g)) for n, v, g in zip(self.pulled, rest, room, strict=True) if g > TOLD}

    @property
    def cost(self) -> float:
        """Return half the squared residuals, before projection."""
        return 0.5 * float(self.r @ self.r)


def project(response: Augmented, data: Dataset, at: Values) -> Projected:
    """Return the projected residual at values of all free parameters. A parameter on its bound counts as free."""
    free = response.free()
    names = tuple(p.name for p in free)
    priors = [p for p in free if np.isfinite(p.sd)]
    unit = np.array([p.unit for p in free])
    rows = prior_rows(free, response.model.joint)[[names.index(p.name) for p in priors]] * unit
    white = data.whitener(response.jacobian(data.f, names, at, data.channels)) * unit[:, None]
    known = at_known(response, data, at)
    return replace(known, Q=_basis(np.hstack([white, -rows.T])), names=names)


def _basis(rows: Array) -> Array:
    """Return an orthonormal basis (n, q) of rows (p, n), without directions that differ from the others by rounding
    only."""
    J = rows.T / np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
    Q, R = np.linalg.qr(J)
    U, s, _ = np.linalg.svd(R)
    told = s > 1e-9 * s.max(initial=0.0)
    return Q if told.all() else Q @ U[:, told]


def at_known(response: Augmented, data: Dataset, at: Values) -> Projected:
    """Return the residual at values that were fitted elsewhere, without projection. If a channel holds something that
    the response lacks, taking out what the parameters could explain of it would spread it over all channels."""
    priors = [p for p in response.free() if np.isfinite(p.sd)]
    known = prior_rows(priors, response.model.joint) @ np.array([at[p.name] - p.prior for p in priors])
    residual = data.H - response.frf(data.f, at, data.channels)
    r = np.concatenate([data.whitener(residual), known])
    return Projected(data, response, at, r, np.zeros((r.size, 0)), (), tuple(p.name for p in priors))
