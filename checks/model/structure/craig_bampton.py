"""Reduction of a free body to its interface and its lowest modes with the interface held."""

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.errors import ModelError


def craig_bampton(K: Array, M: Array, interface: int, modes: int) -> tuple[Array, Array]:
    """Return K, M reduced to the first `interface` dofs, kept as they are, and `modes` modal dofs with unit modal mass.

    K, M (n, n) with the interface first; returns two (interface + modes, interface + modes). Exact at rest for loads on
    the interface ([CB68]). Raises ModelError if the interior is not held by it.
    """
    inside = K.shape[0] - interface
    if not 0 <= modes <= inside:
        raise ModelError(f"{modes} interior modes were asked for, expected 0..{inside}")
    Kii, Mii = K[interface:, interface:], M[interface:, interface:]
    try:
        static = -linalg.cho_solve(linalg.cho_factor(Kii), K[interface:, :interface])
    except linalg.LinAlgError as e:
        raise ModelError(f"the interior is not held by the {interface} interface dofs: {e}") from e
    shapes = linalg.eigh(Kii, Mii, subset_by_index=[0, modes - 1])[1] if modes else np.zeros((inside, 0))
    T = np.block([[np.eye(interface), np.zeros((interface, modes))], [static, shapes]])
    reduced = [T.T @ A @ T for A in (K, M)]
    return (reduced[0] + reduced[0].T) / 2, (reduced[1] + reduced[1].T) / 2
