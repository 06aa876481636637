"""Elimination of all that is linear in a fit of poles, against least squares by singular values."""

import numpy as np
import pytest

from checks.signals.spectral.poles import PoleWindow, basis, eliminate

B, C, ORDER = 300, 3, 3
RNG = np.random.default_rng(11)


def window() -> PoleWindow:
    def noise(*shape: int) -> np.ndarray:
        return RNG.standard_normal(shape) + 1j * RNG.standard_normal(shape)

    sd = RNG.uniform(0.5, 2.0, (B, C))
    f = np.linspace(80.0, 110.0, B)
    return PoleWindow(f, np.linspace(-1.0, 1.0, B), noise(B), noise(B, C), np.ones(C), sd, ("a", "b", "c"))


@pytest.mark.parametrize("apart", [0.5, 1e-5, 1e-8], ids=["apart", "close", "one but for digits"])
def test_what_is_linear_is_least_squares_however_near_the_columns_are(apart: float) -> None:
    """Two poles that come together make columns dependent. 1e-6: normal equations lose the square of a condition of 1e4
    from sixteen digits; beyond, they are not used, and with 1e8 would leave none."""
    w = window()
    A = basis(w, np.array([0.1 + 0.02j, 0.1 + apart + 0.02j]), ORDER)
    columns, X, coefficients, residual = eliminate(w, A)
    Q = columns @ X
    for c in range(C):
        weighted, y = A / w.sd[:, c : c + 1], w.Y[:, c] / w.sd[:, c]
        expected = y - weighted @ np.linalg.lstsq(weighted, y, rcond=1e-13)[0]
        np.testing.assert_allclose(residual[c], expected, atol=1e-6)
        np.testing.assert_allclose(y - weighted @ coefficients[c], expected, atol=1e-6)
    unit = np.broadcast_to(np.eye(A.shape[1]), (C, A.shape[1], A.shape[1]))
    np.testing.assert_allclose(Q.conj().swapaxes(1, 2) @ Q, unit, atol=1e-6)
