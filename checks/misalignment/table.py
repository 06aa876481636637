"""Table of the ratio de / da over the misalignment, and the place of measured responses in it.

The ratio holds no actuator gain, no amplifier and no delay. Its rows differ by a few shapes only, so the table is held
as coefficients on a basis: the misfit at every grid point is then a quadratic form, and a query one small product."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.fitting.calibrate import quicker
from checks.fitting.dataset import Dataset
from checks.model.model import Model

DX_MAX_UM, DY_MAX_UM = 200.0, 600.0  # of an APA300ML, and in proportion to the height of another actuator
APA300ML_HEIGHT = 0.03  # [m] between its interfaces
F_LO, F_HI = 100.0, 700.0  # [Hz] the modes that a misalignment shows in (190, 280, 400 Hz) and their zeros
STEP = 1e-3  # of f: a mode's half-width is its damping ratio of f, so a geometric grid is as dense at every mode
BINS = 150  # of the data, spread over log f: a query wants the place, not the last digit
SHIFTS = (-0.02, -0.01, 0.0, 0.01, 0.02)  # of f: a strut's modes lie elsewhere than the nominal model's
TOLERANCE = 0.2  # of the ratio: other damping, other modes than the table's; wide, so that the misfit has few minima
FLOOR = 0.05  # of da: near a zero of de the table cannot be right to a part of de
RANK, SMALLEST = 12, 1e-4  # of the basis: shapes below this part of the first are left out


def table_frequencies() -> Array:
    """Return frequencies (F,) [Hz] that rise by a constant ratio."""
    f: Array = F_LO * np.exp(STEP * np.arange(int(np.log(F_HI / F_LO) / STEP) + 1))
    return f


def table_limits_um(model: Model) -> tuple[float, float]:
    """Return the largest |dx| and |dy| [um] of the search: those of the APA300ML in proportion to the actuator's
    height, the lever of a misalignment."""
    height = model.apa(model.values).height or APA300ML_HEIGHT  # two springs may be stated without one
    scale = height / APA300ML_HEIGHT
    return DX_MAX_UM * scale, DY_MAX_UM * scale


def grid(model: Model, nx: int = 41, ny: int = 41) -> tuple[Array, Array]:
    """Return dx (nx,) and dy (ny,) [um] up to the limits of the model. Raises ModelError if either has fewer than 3."""
    if nx < 3 or ny < 3:
        raise ModelError(f"a table of {nx} x {ny}; expected 3 x 3 or more")
    dx, dy = table_limits_um(model)
    return np.linspace(-dx, dx, nx), np.linspace(-dy, dy, ny)


def check_tabulated(model: Model) -> None:
    """Raise ModelError if de / da of the model does not depend on a misalignment: no encoder or no joints."""
    if "de" not in model.channels:
        raise ModelError(f"model {model.name} has no encoder, so no channel de and nothing to tabulate")
    if not any(name.startswith("joint") for name in model.values):
        raise ModelError(f"model {model.name} has no joints, so no misalignment; name the model of a strut")


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Misfit (X, Y) over dx (X,), dy (Y,) [um]: minus the logarithm of the likelihood, least over the shifts."""

    dx: Array
    dy: Array
    misfit: Array

    def minima(self, most: int = 3) -> list[tuple[float, float]]:
        """Return (dx, dy) of the local minima, the lowest first."""
        padded = np.pad(self.misfit, 1, constant_values=np.inf)
        shape = self.misfit.shape
        around = [
            padded[1 + i : 1 + i + shape[0], 1 + j : 1 + j + shape[1]]
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
            if (i, j) != (0, 0)
        ]
        x, y = np.nonzero(self.misfit <= np.min(around, axis=0))
        order = np.argsort(self.misfit[x, y])[:most]
        return [(float(self.dx[x[i]]), float(self.dy[y[i]])) for i in order]


@dataclass(frozen=True, eq=False)
class MisalignmentTable:
    """R (X, Y, F) complex: de / da over dx (X,), dy (Y,) [um] and f (F,) [Hz]; of which model."""

    dx: Array
    dy: Array
    f: Array
    R: NDArray[np.complex64]
    model: str = ""
    sha256: str = ""

    @staticmethod
    def axes(model: Model, nx: int = 41, ny: int = 41) -> tuple[Model, Array, Array, Array]:
        """Return what a table of the model is made from: the model, dx (nx,) and dy (ny,) [um], f (F,) [Hz].

        A model with uncertain modes has more modes, so it is tabulated with real modes, which is close enough. Raises
        ModelError for a grid that is too small or a model without encoder or joints."""
        check_tabulated(model)
        return quicker(model) if model.scatters else model, *grid(model, nx, ny), table_frequencies()

    @staticmethod
    def row(model: Model, dx_um: float, dy_um: Sequence[float] | Array, f: Array) -> NDArray[np.complex64]:
        """Return de / da (Y, F) of a row of the table. Raises ModelError if the model has no such ratio."""
        check_tabulated(model)
        out = np.empty((len(dy_um), f.size), dtype=np.complex64)
        for i, dy in enumerate(dy_um):
            H = model.frf(f, {"misalignment.dx_um": float(dx_um), "misalignment.dy_um": float(dy)}, ("de", "da"))
            out[i] = H[:, 0] / H[:, 1]
        return out

    def query(self, data: Dataset) -> Likelihood:
        """Return the likelihood of each place for responses with de and da. Raises ModelError without a common bin."""
        low, high = self.f[0] * (1 + max(SHIFTS)), self.f[-1] * (1 + min(SHIFTS))
        bins = data.select(("de", "da")).band(low, high).thinned(BINS)
        if not bins.f.size:
            raise ModelError(f"{data.name}: no bin of {low:.4g} to {high:.4g} Hz, where the table is")
        coefficients = np.array([self._coefficients(bins, s) for s in SHIFTS]).T
        misfit = (self._features @ coefficients).min(axis=1)
        return Likelihood(self.dx, self.dy, misfit.reshape(self.dx.size, self.dy.size))

    @cached_property
    def _basis(self) -> Complex:
        """Return orthonormal shapes (r, F) of the ratio over its size by frequency, from every fourth grid point."""
        some = self.R[::4, ::4].reshape(-1, self.f.size)
        _, size, shapes = np.linalg.svd(some / self._size, full_matrices=False)
        return np.asarray(shapes[:RANK][size[:RANK] > SMALLEST * size[0]], dtype=np.complex128)

    @cached_property
    def _size(self) -> NDArray[np.float32]:
        """Return the size (F,) of the ratio over the table; without it the peaks would take all shapes."""
        size: NDArray[np.float32] = np.sqrt(np.mean(np.abs(self.R[::4, ::4]) ** 2, axis=(0, 1)))
        return size

    @cached_property
    def _features(self) -> Array:
        """Return real features (X Y, r r + 2 r + 1) of the coefficients u on the basis: conj(u_j) u_k, u, 1."""
        B = (self._basis.conj() / self._size).T.astype(np.complex64)
        u = (self.R.reshape(-1, self.f.size) @ B).astype(complex)
        pairs = np.einsum("gj,gk->gjk", u.conj(), u).reshape(len(u), -1)
        j, k = np.divmod(np.arange(pairs.shape[1]), u.shape[1])
        return np.hstack([np.where(j <= k, pairs.real, pairs.imag), u.real, u.imag, np.ones((len(u), 1))])

    def _coefficients(self, bins: Dataset, shift: float) -> Array:
        """Return coefficients (r r + 2 r + 1,) that turn features into half the weighted squared misfit of the bins."""
        de, da = bins.H.T
        weight = 1.0 / _variance(bins)
        A = self._shapes(bins.f * (1.0 + shift)) * da
        Aw = A.conj() * weight
        Q, p = Aw @ A.T, Aw @ de
        r = np.arange(len(Q))
        upper = np.where(r[:, None] == r, Q.real, np.where(r[:, None] < r, 2.0 * Q.real, 2.0 * Q.imag.T))
        rest = float(np.sum(weight * np.abs(de) ** 2))
        return np.concatenate([upper.ravel(), -2.0 * p.real, -2.0 * p.imag, [rest]])

    @cached_property
    def _ratio_shapes(self) -> Complex:
        return self._basis * self._size

    def _shapes(self, f: Array) -> Complex:
        """Return (r, B) basis at f (B,) [Hz], linear between its points."""
        place = np.log(f / self.f[0]) / STEP
        i = np.clip(place.astype(int), 0, self.f.size - 2)
        part = place - i
        shapes = self._ratio_shapes
        between: Complex = shapes[:, i] * (1.0 - part) + shapes[:, i + 1] * part
        return between


def _variance(bins: Dataset) -> Array:
    """Return the variance (B,) of de - R da: noise of both, and the error of a table of the nominal model."""
    de, da = bins.H.T
    R, C = de / da, bins.cov
    noise = C[:, 0, 0].real + np.abs(R) ** 2 * C[:, 1, 1].real - 2.0 * (R.conj() * C[:, 0, 1]).real
    variance: Array = noise + TOLERANCE**2 * np.abs(de) ** 2 + FLOOR**2 * np.abs(da) ** 2
    return variance
