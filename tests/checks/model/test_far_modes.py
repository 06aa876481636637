"""Modes far above a band, summed at a few frequencies: the same as mode by mode at each frequency."""

import numpy as np
import pytest

from checks.model.dynamics.complex_modes import Sections
from checks.model.dynamics.far_modes import FAR, MANY, is_far

BAND = 2.0 * np.pi * np.geomspace(10.0, 2000.0, 400)
EXACT = 1e-11  # of the largest: 3e-13 of each far mode, which here all pull one way


def modes(ratio: float) -> tuple[Sections, np.ndarray]:
    """Some within the band, one just beyond where it counts as far, some far above, one real pole; their mu."""
    w = BAND[-1] * np.array([0.2, 0.9, 1.2, 1.001 * np.sqrt(FAR), 2.0, 5.0, 40.0])
    mu = np.append((-ratio - 1j * np.sqrt(1.0 - ratio**2)) / w, -1e-4)
    residues = np.random.default_rng(5).standard_normal((mu.size, 3)) * (1.0 + 0.2j)
    residues[-1] = residues[-1].real
    return Sections(mu, residues, mu.imag < 0.0), mu


@pytest.mark.parametrize("ratio", [1e-3, 0.05, 0.7, 0.95])
def test_a_sum_over_far_modes_is_that_of_every_mode_at_every_frequency(ratio: float) -> None:
    sections, mu = modes(ratio)
    s = 1j * BAND[:, None]
    each = sections.residues.T[:, None] / (s * mu - 1.0)
    other = np.where(sections.paired, np.conj(sections.residues.T)[:, None] / (s * np.conj(mu) - 1.0), 0.0)
    whole = (each + other).sum(axis=-1)
    np.testing.assert_allclose(sections.at(BAND), whole, atol=EXACT * np.abs(whole).max(), rtol=0.0)


def test_what_is_far() -> None:
    w2 = BAND[-1] ** 2 * np.array([0.5, 0.99 * FAR, 1.01 * FAR, 100.0])
    assert is_far(w2, np.zeros(4), BAND).tolist() == [False, False, True, True]
    assert not is_far(w2, 2.1 * np.sqrt(w2), BAND).any(), "overdamped: one of its two poles is slow"
    assert not is_far(w2, np.zeros(4), BAND[: MANY - 1]).any(), "too few frequencies to save anything"
    assert not is_far(w2, np.zeros(4), np.zeros(2 * MANY)).any(), "at rest alone"
