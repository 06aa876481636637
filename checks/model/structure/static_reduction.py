"""Reduction of an APA to a few coordinates that still answer exactly to static loads on every face.

Craig-Bampton [CB68] on the two interfaces, enriched: the coordinates are the twelve motions of the two interfaces, the
static answers to the stacks' force pairs with both interfaces held, the answers to the inertia of all of these (so that
the residual is right to the second power of frequency, not only at rest), and the modes with both interfaces held up to
`KEEP_HZ`."""

from dataclasses import replace

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.errors import ModelError
from checks.model.structure.apa import ApaBody

KEEP_HZ = 4000.0  # twice the band's end: 32 coordinates, responses within 1e-4 to 2 kHz, zeros included
KEEP_ALL_HZ = 30e3  # where modes are uncertain: with 68 of 156, dx is as well known as with all of them
INDEPENDENT = 1e-3  # shapes that hold less than this of anything new repeat others


def reduce_apa(body: ApaBody, keep_Hz: float = KEEP_HZ) -> ApaBody:
    """Return the same APA in the coordinates of `basis`; the first twelve are the motions of bottom and top."""
    T = basis(body, keep_Hz)
    return replace(
        body,
        K=_congruent(T, body.K),
        M=_congruent(T, body.M),
        C_ratio=_congruent(T, body.C_ratio),
        C=_congruent(T, body.C),
        bottom=body.bottom @ T,
        top=body.top @ T,
        sensor=body.sensor @ T,
        actuator=body.actuator @ T,
    )


def basis(body: ApaBody, keep_Hz: float = KEEP_HZ) -> Array:
    """Return the shapes (n, r) of the reduction. Raises ModelError if the body is not held by its two interfaces."""
    held = np.vstack([body.bottom, body.top])
    edge = np.flatnonzero(np.abs(held).sum(axis=0))
    inside = np.setdiff1d(np.arange(body.size), edge)
    Kii, Mii = body.K[np.ix_(inside, inside)], body.M[np.ix_(inside, inside)]
    try:
        factor = linalg.cho_factor(Kii)
    except linalg.LinAlgError as e:
        raise ModelError(f"{body.name}: is not held by its two interfaces: {e}") from e
    T_edge = np.zeros((body.size, edge.size))
    T_edge[edge] = np.eye(edge.size)
    T_edge[inside] = -linalg.cho_solve(factor, body.K[np.ix_(inside, edge)])
    stacks = linalg.cho_solve(factor, np.column_stack([body.sensor[inside], body.actuator[inside]]))
    inertia = linalg.cho_solve(factor, np.column_stack([(body.M @ T_edge)[inside], Mii @ stacks]))
    w2, modes = linalg.eigh(Kii, Mii)
    low = modes[:, w2 < (2 * np.pi * keep_Hz) ** 2]
    shapes = _orthonormal(np.column_stack([stacks, inertia]), Kii, low)
    T_inside = np.zeros((body.size, shapes.shape[1]))
    T_inside[inside] = shapes
    return np.column_stack([T_edge, T_inside])


def _orthonormal(shapes: Array, K: Array, first: Array) -> Array:
    """Return `first` extended by `shapes`, orthonormal in energy; additions too small to matter are dropped.

    A shape without motion inside is dropped too: a stack between the two interfaces pushes on these alone."""
    energy = np.einsum("ni,nm,mi->i", shapes, K, shapes)
    moving = energy > 0.0
    U = linalg.cholesky(K)
    start, _ = np.linalg.qr(U @ first)
    rest = U @ (shapes[:, moving] / np.sqrt(energy[moving]))
    rest -= start @ (start.T @ rest)
    left, size, _ = np.linalg.svd(rest, full_matrices=False)
    added = left[:, size > INDEPENDENT]
    basis: Array = linalg.solve_triangular(U, np.column_stack([start, added]))
    return basis


def _congruent(T: Array, A: Array) -> Array:
    B = T.T @ A @ T
    return (B + B.T) / 2
