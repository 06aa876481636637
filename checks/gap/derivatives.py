"""Derivatives of a model's responses by the adjoint method: one solution per frequency serves all parameters.

y = c Z^-1 b with Z = K + s C + s^2 M symmetric, so  dy = dc x + y' db - y' dZ x,  x = Z^-1 b,  y = Z^-1 c'
(Haftka & Guerdal, Elements of Structural Optimization, 3rd ed., 7.2). The matrices' own derivatives are central
differences, which are exact but for rounding in what enters them linearly or as a square.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from checks.model.bench import suspension
from checks.model.builder import System
from checks.model.model import Model, _optics, frequencies
from checks.model.parameters import derivative_step, is_mechanical
from checks.model.parts import electrical_of

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Values = Mapping[str, float]

ROUNDING = 1e-15  # of the largest entry of the matrix: smaller differences are none
BATCH = 512  # frequencies solved at once: the work space stays in the cache
# What stiffness, damping and mass matrices, or what is read of the motion, are proportional to.
AFFINE = {
    *("kz_N_per_um", "kx_N_per_um", "ky_N_per_um", "kRx_Nm_per_rad", "kRy_Nm_per_rad", "kRz_Nm_per_rad"),
    *("c_N_s_per_m", "cR_Nm_s_per_rad", "guide_damping_N_s_per_m", "damping_ratio"),
    *("head_mass_kg", "ruler_mass_kg", "payload_kg", "arm_x_mm", "arm_y_mm"),
    *("sensor_stiffening", "actuator_stiffening"),
}
SPRINGS = ("kx_N_per_um", "ky_N_per_um", "kz_N_per_um", "kRx_Nm_per_rad", "kRy_Nm_per_rad", "kRz_Nm_per_rad")


def jacobian(model: Model, f: Array, names: Sequence[str], changes: Values, channels: tuple[str, ...]) -> Complex:
    """(P, F, C) derivatives of `model.frf` at f (F,) [Hz] per unit of each name, as `Model.jacobian` gives them."""
    f = frequencies(f)
    at = model.with_values(changes)
    mechanical = [n for n in names if is_mechanical(n)] if _own_coordinates(at) else []
    other = [n for n in names if n not in mechanical]
    found = dict(zip(other, at.jacobian(f, other, {}, channels), strict=True)) if other else {}
    if mechanical:
        found |= dict(zip(mechanical, _adjoint(model, at, f, mechanical, channels), strict=True))
    return np.array([found[n] for n in names]).reshape(len(names), f.size, len(channels))


def _own_coordinates(at: Model) -> bool:
    """Whether nothing is rigid (rigid directions are taken out, and the basis of what is left turns with a value) and
    damping is a matrix of its own: modal damping turns with the modes, and `Model.jacobian` is as quick there."""
    prefixes = [p for p in ("joint", "joint.bottom", "joint.top") if f"{p}.kRx_Nm_per_rad" in at.values]
    whole = bool(prefixes) and not at.held and at.damping == "full"
    return whole and all(f"{p}.{k}" in at.values for p in prefixes for k in SPRINGS)


def _adjoint(model: Model, at: Model, f: Array, names: Sequence[str], channels: tuple[str, ...]) -> list[Complex]:
    system = at.system()
    s = 2j * np.pi * np.concatenate([[0.0], f])  # at rest too: the bench's mode goes with the static gain
    x, y = _responses(system, s)
    out = []
    for name in names:
        d = _affine(model, name, _offset(at)) if name.rpartition(".")[2] in AFFINE else _derivative(at, name)
        out.append(_measured(at, f, _change(d, s, x, y), system.channels, channels))
    return out


def _offset(at: Model) -> tuple[float, ...]:
    return tuple(at.values[f"misalignment.d{axis}_um"] for axis in "xyz")


def _responses(system: System, s: Complex) -> tuple[Complex, Complex]:
    """x (S, n) = Z^-1 force and y (S, n, c) = Z^-1 outputs^T."""
    sources = np.column_stack([system.force, system.outputs.T]).astype(complex)
    parts = []
    for first in range(0, s.size, BATCH):
        p = s[first : first + BATCH, None, None]
        Z = system.K + p * system.C + p * p * system.M
        parts.append(np.linalg.solve(Z, np.broadcast_to(sources, (len(Z), *sources.shape))))
    found = np.concatenate(parts)
    return found[:, :, 0], found[:, :, 1:]


@dataclass(frozen=True, eq=False)
class _Derivative:
    """Of M, C, K (n, n), None where zero; of force (n,) and outputs (c, n)."""

    M: Array | None
    C: Array | None
    K: Array | None
    force: Array
    outputs: Array


@lru_cache(maxsize=256)
def _affine(model: Model, name: str, offset: tuple[float, ...]) -> _Derivative:
    """Of what enters the matrices in proportion: the same wherever the other values are."""
    moved = {f"misalignment.d{axis}_um": d for axis, d in zip("xyz", offset, strict=True)}
    return _derivative(model.with_values(moved), name)


def _derivative(at: Model, name: str) -> _Derivative:
    h = derivative_step(name, at.values[name])
    above, below = (replace(at, values={**at.values, name: at.values[name] + d}).system() for d in (h, -h))

    def of(key: str) -> Array:
        a, b = getattr(above, key), getattr(below, key)
        return np.where(np.abs(a - b) > ROUNDING * np.abs(a).max(), (a - b) / (2.0 * h), 0.0)

    M, C, K = (d if d.any() else None for d in map(of, ("M", "C", "K")))
    return _Derivative(M, C, K, of("force"), of("outputs"))


def _change(d: _Derivative, s: Complex, x: Complex, y: Complex) -> Complex:
    """(S, c) change of the responses to one newton per unit of the parameter."""
    out = x @ d.outputs.T
    if d.force.any():
        out = out + np.einsum("snc,n->sc", y, d.force)
    for power, D in ((0, d.K), (1, d.C), (2, d.M)):
        if D is not None:
            rows = np.flatnonzero(np.abs(D).sum(axis=0))
            load = (x[:, rows] @ D[np.ix_(rows, rows)]) * s[:, None] ** power
            out = out - (load[:, None, :] @ y[:, rows])[:, 0]
    return np.asarray(out)


def _measured(at: Model, f: Array, dH: Complex, have: tuple[str, ...], channels: tuple[str, ...]) -> Complex:
    """(F, C) what the converters see of a change dH (1 + F, c) of the mechanics, whose first row is at rest."""
    v, e = at.values, electrical_of(at.values)
    per_volt = e.gain * e.ga
    static = float(dH[0, have.index("da")].real) * per_volt
    added = suspension(f, static, v["bench.mode_ratio"], v["bench.mode_Hz"], v["bench.mode_damping_ratio"])
    out = np.empty((f.size, len(channels)), dtype=complex)
    for i, channel in enumerate(channels):
        h = dH[1:, have.index(channel)] * per_volt
        out[:, i] = h * e.gs * e.sensor(f) if channel == "Vs" else h + added
        if channel == "de":
            out[:, i] *= _optics(f, v)
    return out * e.drive(f)[:, None]
