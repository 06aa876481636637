"""Responses of a strut with damping of any form, from the receptances of its free APA.

The free APA is known by its modes, and all the rest is fastened to it at a few motions. So at each frequency only the
forces at those motions are unknown (dynamic substructuring [KLERK08]): with G, the free APA's receptances between its
motions, z, the dynamic stiffness of what is fastened, and L, loads on the motions,

    u = G (L - z u) at the APA's motions,      z u = L at the payload,

some thirteen equations a frequency instead of the eigenvalues of 150 states. The rigid modes of the free APA answer by
1 / w^2, and where they nearly cancel digits are lost: 1e-8 of a response at 1 Hz, so below that the complex modes are
taken."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from checks.arrays import Array, Complex
from checks.errors import NotHeld
from checks.model.dynamics.complex_modes import Sections, eigen
from checks.model.dynamics.far_modes import is_far, product, sum_sections
from checks.model.dynamics.real_modes import real_modes
from checks.model.structure.matrix_builder import Parts, System

LOWEST = 2.0 * np.pi  # [rad/s]


@dataclass(frozen=True, eq=False)
class Receptances:
    """The responses of a system that is given by its parts."""

    system: System
    parts: Parts

    @property
    def channels(self) -> tuple[str, ...]:
        return self.system.channels

    def frf(self, f: Array) -> Complex:
        """Return the response (F, c) at f (F,) [Hz]; in memory each channel lies in one piece."""
        u, _ = _motions_under_loads(self.parts, (2.0 * np.pi * f).tobytes())
        return np.asarray(product(self.parts.outputs, np.ascontiguousarray(u[:, 0])).T)

    def static(self) -> Array:
        """Return the response (c,) at rest."""
        at_rest: Array = self.system.outputs @ _at_rest(self.system)[:, 0]
        return at_rest

    def reached(self, w: Array) -> Complex:
        """Return motions, then coordinates (1 + c, r, F), at w (F,) [rad/s], the first of them zero, under one newton
        of drive and under a force along each output."""
        system, parts = self.system, self.parts
        x = _at_rest(system)
        still = np.concatenate([parts.motions @ x, x]).T[:, :, None].astype(complex)
        u, forces = _motions_under_loads(parts, w[1:].tobytes())
        pushed = product(parts.motions[:, : parts.w2.size].T, forces.reshape(len(forces), -1)).reshape(
            -1, *forces.shape[1:]
        )
        q = pushed * _each(parts, w[1:])[:, None]
        moving = np.concatenate([u, q, u[parts.own]]).swapaxes(0, 1)
        return np.concatenate([still, moving], axis=2)


def receptances(system: System, w: Array) -> Receptances | None:
    """Return the receptances at w (F,) [rad/s]; None if the system is not given by its parts or w is too low."""
    return None if system.parts is None or w.min() < LOWEST else Receptances(system, system.parts)


@lru_cache(maxsize=8)
def _motions_under_loads(parts: Parts, band: bytes) -> tuple[Complex, Complex]:
    """Return every motion (m, 1 + c, F), and the forces on the APA's motions, under one newton of drive and under a
    force along each output. Cached, because derivatives are asked for at values where a response was computed."""
    w = np.frombuffer(band)
    load = np.column_stack([parts.drive, parts.outputs.T])
    on_apa = load.copy()
    on_apa[parts.own] = 0.0
    fastened = np.flatnonzero((np.abs(parts.K) + np.abs(parts.C) + np.abs(parts.M)).any(axis=0))
    last = np.searchsorted(fastened, parts.own)
    s = 1j * w[:, None, None]
    z = (parts.K + s * parts.C + s * s * parts.M)[:, :, fastened]
    G = _receptance(parts, w)
    A, b = G[:, fastened] @ z, G[:, fastened] @ on_apa
    A[:, np.arange(fastened.size), np.arange(fastened.size)] += 1.0
    A[:, last], b[:, last] = z[:, parts.own], load[parts.own]
    u = np.linalg.solve(A, b)
    forces = on_apa - z @ u
    forces[:, parts.own] = 0.0
    every = G @ forces
    every[:, parts.own] = u[:, last]
    return _frequencies_last(every), _frequencies_last(forces)


def _frequencies_last(a: Complex) -> Complex:
    return np.ascontiguousarray(np.moveaxis(a, 0, -1))


def _receptance(parts: Parts, w: Array) -> Complex:
    """Return the receptances (F, m, m) of the free APA between its motions; zero for the other motions."""
    rows = parts.motions[:, : parts.w2.size]
    i, j = np.triu_indices(len(rows))

    def basis(which: NDArray[np.bool_], w: Array) -> Complex:
        return _each(parts, w, which)[None]

    pairs = sum_sections((rows[i] * rows[j])[:, None], basis, is_far(parts.w2, parts.rate, w), w)
    G = np.empty((w.size, len(rows), len(rows)), dtype=complex)
    G[:, i, j] = G[:, j, i] = pairs.T
    return G


def _each(parts: Parts, w: Array, which: NDArray[np.bool_] | slice = slice(None)) -> Complex:
    """Return the response (k, F) of each free mode to a force of one newton along it."""
    stiffness: Complex = parts.w2[which][:, None] + np.multiply.outer(parts.rate[which], 1j * w) - w * w
    return 1.0 / stiffness


@lru_cache(maxsize=8)
def _at_rest(system: System) -> Array:
    """Return the static coordinates (n, 1 + c) under such forces. Raises NotHeld."""
    try:
        factor = linalg.cho_factor(system.K, check_finite=False)
    except linalg.LinAlgError as e:
        raise NotHeld(float(np.linalg.eigvalsh(system.K)[0])) from e
    still: Array = linalg.cho_solve(factor, np.column_stack([system.force, system.outputs.T]), check_finite=False)
    return still


def receptances_between(system: System, rows: Array, w: Array, damping: str) -> Complex:
    """Return the receptances (r, r, F) between directions, rows (r, n) in the system's coordinates, at w (F,) [rad/s]:
    the motion along one under a unit force along another. damping: "modal", or "full" for dampers of any form. Of any
    system, by its modes."""
    if damping == "modal":
        w2, P = real_modes(system)
        motions = rows @ P
        each = 1.0 / (w2[:, None] + np.multiply.outer(np.einsum("ni,ni->i", P, system.C @ P), 1j * w) - w * w)
        pairs = (motions[:, None] * motions[None]).reshape(-1, w2.size)
        return product(pairs, each).reshape(len(rows), len(rows), w.size)
    form = eigen(system)
    kept = form.mu.imag <= 0.0
    loads = np.zeros((len(form.W), len(rows)), dtype=complex)
    loads[: len(form.T)] = -(rows @ form.T).T
    shapes, weights = (rows @ form.T) @ form.V[: len(form.T)], np.linalg.solve(form.V, loads)
    residues = (shapes.T[:, :, None] * weights[:, None])[kept].reshape(int(kept.sum()), -1)
    mu = form.mu[kept]
    return Sections(mu, residues, mu.imag < 0.0).at(w).reshape(len(rows), len(rows), w.size)
