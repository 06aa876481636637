"""Beam elements: closed forms of a cantilever, rigid motions, turned frames, offsets, mass."""

import numpy as np
import pytest
from scipy import linalg

from checks.arrays import Array
from checks.errors import ModelError
from checks.model.structure.beam import SHEAR_FACTOR, Beams, Material, add_beams, add_body, torsion_constant
from checks.model.structure.rigid_motion import lever, rigid_motions

STEEL = Material(E=200e9, nu=0.3, rho=7850.0)
WIDTH, HEIGHT, LENGTH = 4e-3, 2e-3, 0.1
AREA = WIDTH * HEIGHT
I_Y, I_Z = WIDTH * HEIGHT**3 / 12, HEIGHT * WIDTH**3 / 12


def chain(n: int, length: float = LENGTH, turn: float = 0.0, shift: float = 0.0) -> tuple[Array, Array, Array]:
    """K, M, points of n elements in a row, turned about y by `turn` [rad]; nodes beside the beam by `shift` along z."""
    direction = np.array([np.cos(turn), 0.0, -np.sin(turn)])
    line = np.linspace(0, length, n + 1)[:, None] * direction
    offset = np.array([0.0, 0.0, shift])
    ends = np.stack([np.arange(n), np.arange(1, n + 1)], 1)
    beams = Beams(
        STEEL, ends, np.diff(line, axis=0), np.full(n, WIDTH), np.full(n, HEIGHT), np.broadcast_to(offset, (n, 2, 3))
    )
    K, M = np.zeros((6 * n + 6,) * 2), np.zeros((6 * n + 6,) * 2)
    add_beams(K, M, beams)
    return K, M, line - offset


def tip_compliance(K: Array) -> Array:
    """(6, 6) motion of the last node per load on it, the first node clamped."""
    return np.linalg.inv(K[6:, 6:])[-6:, -6:]


class TestCantilever:
    C = tip_compliance(chain(3)[0])

    @pytest.mark.parametrize(("axis", "inertia"), [(1, I_Z), (2, I_Y)])
    def test_deflection_under_a_tip_force_is_bending_plus_shear(self, axis: int, inertia: float) -> None:
        truth = LENGTH**3 / (3 * STEEL.E * inertia) + LENGTH / (SHEAR_FACTOR * STEEL.G * AREA)
        assert self.C[axis, axis] == pytest.approx(truth, rel=1e-9)  # exact shapes: only round-off

    def test_rotation_under_a_tip_force_has_the_sign_of_its_axis(self) -> None:
        assert self.C[5, 1] == pytest.approx(LENGTH**2 / (2 * STEEL.E * I_Z), rel=1e-9)
        assert self.C[4, 2] == pytest.approx(-(LENGTH**2) / (2 * STEEL.E * I_Y), rel=1e-9)

    def test_stretch_and_twist(self) -> None:
        J = torsion_constant(np.array([WIDTH]), np.array([HEIGHT]))[0]
        assert self.C[0, 0] == pytest.approx(LENGTH / (STEEL.E * AREA), rel=1e-9)
        assert self.C[3, 3] == pytest.approx(LENGTH / (STEEL.G * J), rel=1e-9)

    def test_first_bending_frequencies_are_those_of_a_slender_beam(self) -> None:
        K, M, _ = chain(12, length=0.4)
        got = np.sqrt(linalg.eigh(K[6:, 6:], M[6:, 6:], eigvals_only=True)[:4])
        root = np.array([1.875104, 4.694091])  # cos x cosh x = -1
        thin, thick = (root**2 * np.sqrt(STEEL.E * i / (STEEL.rho * AREA * 0.4**4)) for i in (I_Y, I_Z))
        # Shear and rotary inertia lower the second bending by about (4.7 h / L)^2 / 12 * 4.1 = 0.08 % at h/L = 1/100.
        assert got == pytest.approx(np.sort(np.concatenate([thin, thick])), rel=2e-3)

    def test_stocky_beam_between_hinges_has_timoshenkos_frequency(self) -> None:
        """Simply supported: omega solves a quadratic in omega^2 ([WTY90] 5.12)."""
        n, length = 24, 12e-3  # six times as long as high
        K, M, _ = chain(n, length=length)
        free = [6 * i + d for i in range(n + 1) for d in (2, 4) if not (d == 2 and i in (0, n))]  # bending along z only
        got = np.sqrt(linalg.eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)[0])
        k, r2, GA = np.pi / length, I_Y / AREA, SHEAR_FACTOR * STEEL.G * AREA
        m, EI = STEEL.rho * AREA, STEEL.E * I_Y
        a, b, c = m * m * r2 / GA, -(m + m * r2 * k**2 + m * EI * k**2 / GA), EI * k**4
        truth = np.sqrt((-b - np.sqrt(b * b - 4 * a * c)) / (2 * a))
        assert got == pytest.approx(truth, rel=1e-4)  # 24 elements
        assert truth < 0.97 * k**2 * np.sqrt(EI / m)  # the test would not see shear otherwise

    @pytest.mark.parametrize(("ratio", "alpha"), [(1.0, 0.1406), (2.0, 0.229), (10.0, 0.312)])
    def test_torsion_constant_of_rectangles(self, ratio: float, alpha: float) -> None:
        """[TG70] table 1 of art. 109 (three digits)."""
        J = torsion_constant(np.array([1.0]), np.array([ratio]))[0]
        assert J == pytest.approx(alpha * ratio, rel=5e-3)


class TestBody:
    @pytest.mark.parametrize("turn", [0.0, 0.7, -2.2])
    def test_rigid_motions_cost_no_energy(self, turn: float) -> None:
        K, _, points = chain(4, turn=turn, shift=3e-3)
        R = rigid_motions(points, len(K))
        assert np.abs(K @ R).max() < 1e-12 * (np.abs(K) @ np.abs(R)).max()

    @pytest.mark.parametrize("turn", [0.0, 0.7, -2.2])
    def test_mass_and_inertia_are_those_of_the_bar(self, turn: float) -> None:
        _, M, points = chain(4, turn=turn, shift=3e-3)
        R = rigid_motions(points, len(M))
        body = R.T @ M @ R
        m = STEEL.rho * AREA * LENGTH
        assert np.diag(body)[:3] == pytest.approx(np.full(3, m), rel=1e-12)
        about_end = m * (LENGTH**2 / 3 + HEIGHT**2 / 12)
        assert body[4, 4] == pytest.approx(about_end, rel=1e-9)

    def test_turning_the_beam_turns_its_compliance(self) -> None:
        turn = 0.7
        c, s = np.cos(turn), np.sin(turn)
        R = np.kron(np.eye(2), [[c, 0, s], [0, 1, 0], [-s, 0, c]])
        straight, turned = tip_compliance(chain(3)[0]), tip_compliance(chain(3, turn=turn)[0])
        scale = np.sqrt(np.diag(turned))
        assert np.abs((turned - R @ straight @ R.T) / np.outer(scale, scale)).max() < 1e-9

    def test_an_offset_is_a_rigid_lever(self) -> None:
        beside = tip_compliance(chain(3, shift=5e-3)[0])
        T = lever([0.0, 0.0, -5e-3])
        truth = T @ tip_compliance(chain(3)[0]) @ T.T
        scale = np.sqrt(np.diag(truth))
        assert np.abs((beside - truth) / np.outer(scale, scale)).max() < 1e-9

    def test_cutting_an_element_changes_no_tip_compliance(self) -> None:
        assert tip_compliance(chain(7)[0]) == pytest.approx(tip_compliance(chain(1)[0]), rel=1e-8, abs=1e-16)

    def test_a_body_brings_its_mass_and_steiners_term(self) -> None:
        M = np.zeros((6, 6))
        add_body(M, 0, 2.0, np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.0, 0.0]))
        assert np.diag(M) == pytest.approx([2.0, 2.0, 2.0, 0.1, 0.2 + 0.5, 0.3 + 0.5])


class TestRefused:
    def test_no_length(self) -> None:
        with pytest.raises(ModelError, match="positive length"):
            chain(2, length=0.0)

    def test_out_of_the_plane(self) -> None:
        beams = Beams(
            STEEL, np.array([[0, 1]]), np.array([[0.1, 0.1, 0.0]]), np.ones(1), np.ones(1), np.zeros((1, 2, 3))
        )
        with pytest.raises(ModelError, match="x-z plane"):
            add_beams(np.zeros((12, 12)), np.zeros((12, 12)), beams)
