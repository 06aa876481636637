"""The modal form of a system whose real modes keep to themselves: four times faster than that of any damping."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy import linalg

from checks.arrays import Array, between_zeros
from checks.errors import ModelError, NotHeld
from checks.model.dynamics.complex_modes import Modal, modal
from checks.model.structure.matrix_builder import System

MASSLESS = 1e-12  # of the largest 1 / w^2: round-off of a coordinate without mass


@lru_cache(maxsize=8)
def real_modes(system: System) -> tuple[Array, Array]:
    """Return w^2 (n,) [rad2/s2], rising, and shapes P (n, n) of unit mass of the undamped system.

    Solved for 1 / w^2, which keeps all digits of the slow modes: the band holds the slowest seven of thirty. Raises
    ModelError for a coordinate without mass or an assembly that is not held."""
    try:
        inverse, shapes = linalg.eigh(system.M, system.K, check_finite=False)
    except linalg.LinAlgError as e:
        lowest = float(np.linalg.eigvalsh(system.K)[0])
        raise NotHeld(lowest) from e
    if inverse[0] <= MASSLESS * inverse[-1]:
        raise ModelError("damping 'modal' needs a mass on every coordinate, which a 2-DoF APA has not")
    return 1.0 / inverse[::-1], (shapes / np.sqrt(inverse))[:, ::-1]


def real_modal(system: System) -> Modal:
    """Return `modal(with_modal_damping(system))`, from the real modes alone (Geradin & Rixen, 3.1.2).

    With modes P of unit mass, P^T C P taken as diag(2 z w), each mode is one pair of poles w (-z +- i sqrt(1 - z^2))
    and its response a b / (w^2 + 2 z w s + s^2). Raises ModelError as `real_modes` does."""
    w2, P = real_modes(system)
    w = np.sqrt(w2)
    z = 0.5 * np.einsum("ni,ni->i", P, system.C @ P) / w
    if not np.abs(z).max() < 1.0:  # an overdamped mode is no pair; rare enough to go the long way
        return modal(with_modal_damping(system))
    T = P / w  # as in `modal`: unit energy of stiffness
    force, outputs = T.T @ system.force, system.outputs @ T
    mu = (-z - 1j * np.sqrt(1.0 - z * z)) / w
    residues = (-mu / (2j * mu.imag))[:, None] * (force[:, None] * outputs.T)
    n = w.size
    W = np.zeros((2 * n, 2 * n))
    i = np.arange(n)
    W[i, i], W[i, n + i], W[n + i, i] = -2.0 * z / w, -1.0 / w, 1.0 / w
    g = np.concatenate([-force, np.zeros(n)])
    return Modal(mu, residues, np.ones(n, dtype=bool), system.channels, W, g, between_zeros(outputs, 0, n))


def with_modal_damping(system: System) -> System:
    """Return the system with C such that the real modes P of K and M have P^T C P diagonal (Geradin & Rixen, 3.1.2).

    Right if modes lie far apart against their widths; two close modes then ring and move a little otherwise (in a strut
    those near 834 and 843 Hz shift by 2e-4). Raises ModelError for a coordinate without mass."""
    try:
        _, P = linalg.eigh(system.K, system.M)
    except linalg.LinAlgError as e:
        raise ModelError(f"damping 'modal' needs a mass on every coordinate, which a 2-DoF APA has not: {e}") from e
    momenta = system.M @ P
    ratios = np.einsum("ni,nm,mi->i", P, system.C, P)
    return replace(system, C=(momenta * ratios) @ momenta.T)
