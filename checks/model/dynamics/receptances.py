"""Responses of a strut with damping of any form, from the receptances of its free APA.

The free APA is known by its modes, and all the rest is fastened to it at a few motions. So at each frequency only the
forces at those motions are unknown (dynamic substructuring [KLERK08]): with G, the free APA's receptances between its
motions, z, the dynamic stiffness of what is fastened, and L, loads on the motions,

    u = G (L - z u) at the APA's motions,      z u = L at the payload,

thirteen equations a frequency instead of the eigenvalues of 150 states. The rigid modes of the free APA answer by
1 / w^2, and where they nearly cancel digits are lost: 1e-8 of a response at 1 Hz, so below that the complex modes are
taken.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from checks.arrays import Array, Complex
from checks.errors import NotHeld
from checks.model.dynamics.far_modes import is_far, product, sum_sections
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
        pushed = product(parts.motions[:, :-1].T, forces.reshape(len(forces), -1)).reshape(-1, *forces.shape[1:])
        q = pushed * _each(parts, w[1:])[:, None]
        moving = np.concatenate([u, q, u[parts.payload][None]]).swapaxes(0, 1)
        return np.concatenate([still, moving], axis=2)


def receptances(system: System, w: Array) -> Receptances | None:
    """Return the receptances for responses at w (F,) [rad/s]; None if the system is not given by its parts or w is too
    low."""
    return None if system.parts is None or w.min() < LOWEST else Receptances(system, system.parts)


@lru_cache(maxsize=8)
def _motions_under_loads(parts: Parts, band: bytes) -> tuple[Complex, Complex]:
    """Return every motion (m, 1 + c, F), and the forces on the APA's motions, under one newton of drive and under a
    force along each output. Cached, because derivatives are asked for at values where a response was computed."""
    w = np.frombuffer(band)
    load = np.column_stack([parts.drive, parts.outputs.T])
    on_apa = load.copy()
    on_apa[parts.payload] = 0.0
    fastened = np.flatnonzero((np.abs(parts.K) + np.abs(parts.C) + np.abs(parts.M)).any(axis=0))
    last = int(np.flatnonzero(fastened == parts.payload)[0])
    s = 1j * w[:, None, None]
    z = (parts.K + s * parts.C + s * s * parts.M)[:, :, fastened]
    G = _receptance(parts, w)
    A, b = G[:, fastened] @ z, G[:, fastened] @ on_apa
    A[:, np.arange(fastened.size), np.arange(fastened.size)] += 1.0
    A[:, last], b[:, last] = z[:, parts.payload], load[parts.payload]
    u = np.linalg.solve(A, b)
    forces = on_apa - z @ u
    forces[:, parts.payload] = 0.0
    every = G @ forces
    every[:, parts.payload] = u[:, last]
    return _frequencies_last(every), _frequencies_last(forces)


def _frequencies_last(a: Complex) -> Complex:
    return np.ascontiguousarray(np.moveaxis(a, 0, -1))


def _receptance(parts: Parts, w: Array) -> Complex:
    """Return the receptances (F, m, m) of the free APA between its motions; zero for the payload's motion."""
    rows = parts.motions[:, :-1]
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
