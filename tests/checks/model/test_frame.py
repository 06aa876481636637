"""The frame APA: a sound body, the published figures, and the matrices that it was calibrated on."""

import time
from dataclasses import replace

import numpy as np
import pytest

from accept.models.model_file import open_model
from checks.arrays import Array
from checks.errors import ModelError
from checks.model.model import frequency_and_damping
from checks.model.structure.apa import superelement_body
from checks.model.structure.frame import craig_bampton, frame_apa, frame_matrices
from checks.model.structure.frame_geometry import FrameGeometry, SolidBlock
from checks.model.structure.rigid_motion import rigid_motions
from checks.model.structure.superelement import Superelement
from checks.model.structure.superelement_check import check_superelement
from hw.superelement import read_superelement
from tests.checks.model.units_model import APA300ML, NOMINAL, needs_data
from validation.frame.figures import figures
from validation.frame.identify import effective, identify, with_effective

# Facts page, from the published matrices: (value, accepted relative difference). 3 % on what is a frequency, a
# stiffness of the whole or a mass, 5 % on amplifications and stacks, as asked for; lateral stiffness as a bonus.
FACTS = {
    "mass": (0.1153, 0.03),
    "clamped_0": (294.6, 0.03),
    "clamped_1": (525.2, 0.03),
    "clamped_2": (709.4, 0.03),
    "compliance_uz": (1 / 1.753e6, 0.03),
    "compliance_ux": (1 / 0.360e6, 0.03),
    "compliance_uy": (1 / 0.266e6, 0.03),
    "stroke_sensor": (-4.71, 0.05),
    "stroke_actuator": (-4.895, 0.05),
    "stiffness_actuator": (121.9e6, 0.05),  # the "one stack's stiffness" of the page: felt across nodes 5 and 7
}
ABOVE_2500_HZ = {"clamped_5", "clamped_6", "free_1", "free_2", "free_3", "free_4"}
BELOW_2500_HZ = set(figures(frame_apa())) - ABOVE_2500_HZ


@pytest.fixture(scope="module")
def frame() -> Superelement:
    return frame_apa()


@pytest.fixture(scope="module")
def published() -> Superelement:
    return read_superelement(APA300ML)


class TestBody:
    def test_is_a_sound_superelement(self, frame: Superelement) -> None:
        assert check_superelement(frame) is frame

    def test_interface_stands_where_the_published_one_does(self, frame: Superelement) -> None:
        x = [0, 0, -32.5e-3, -12.5e-3, -7.5e-3, 12.5e-3, 32.5e-3]
        z = [-15e-3, 15e-3, 0, 0, 0, 0, 0]
        assert frame.xyz == pytest.approx(np.column_stack([x, np.zeros(7), z]))

    def test_elongating_stacks_pull_the_top_down(self, frame: Superelement) -> None:
        got = figures(frame)
        assert got["stroke_sensor"] < 0
        assert got["stroke_actuator"] < 0

    def test_shell_is_symmetric_though_the_row_is_not(self, frame: Superelement) -> None:
        """Mirrored in x the static stiffness of the top is the same; the mass centre is off, towards the spacer."""
        R = rigid_motions(frame.xyz, frame.size)
        mass = R.T @ frame.M @ R
        assert -mass[2, 4] / mass[0, 0] == pytest.approx(-0.34e-3, rel=0.1)  # published: -0.339 mm

    def test_finer_arms_change_little(self, frame: Superelement) -> None:
        K, M, _ = frame_matrices(FrameGeometry(), arm_elements=24)
        finer = replace(frame, **dict(zip(("K", "M"), craig_bampton(K, M, 42, 40), strict=True)))
        coarse, fine = figures(frame), figures(finer)
        assert max(abs(coarse[k] / fine[k] - 1) for k in coarse) < 0.01  # stepwise taper, lumped torsional inertia

    def test_more_internal_modes_change_nothing_below_2500_Hz(self, frame: Superelement) -> None:
        few, many = figures(frame), figures(frame_apa(modes=150))
        assert {k: v for k, v in few.items() if k in BELOW_2500_HZ} == pytest.approx(
            {k: v for k, v in many.items() if k in BELOW_2500_HZ}, rel=3e-4
        )

    def test_is_built_fast(self) -> None:
        frame_apa()
        best = min(_seconds() for _ in range(5))
        assert best < 0.05  # 5 ms on the bench's computer


def _seconds() -> float:
    start = time.perf_counter()
    frame_apa()
    return time.perf_counter() - start


class TestFacts:
    @pytest.mark.parametrize("name", FACTS)
    def test_figure(self, frame: Superelement, name: str) -> None:
        value, tolerance = FACTS[name]
        assert figures(frame)[name] == pytest.approx(value, rel=tolerance)

    def test_strut_clamped_at_both_ends(self) -> None:
        f, _ = frequency_and_damping(open_model("strut").clamped().poles())
        assert f[:3] == pytest.approx([189.0, 285.0, 400.0], rel=0.03)  # the finite-element strut of [STB] 5.1.2

    def test_strut_under_its_payload(self) -> None:
        f, _ = frequency_and_damping(open_model("strut").poles())
        assert f[0] == pytest.approx(85.7, rel=0.01)  # published description; a compliance within 1 % makes 0.5 %

    def test_a_wrong_shell_is_seen(self) -> None:
        """Arms a tenth thicker leave the accepted band: the figures above do test the shell."""
        g = FrameGeometry()
        thick = figures(frame_apa(replace(g, arm_thickness=(1.1 * g.arm_thickness[0], 1.1 * g.arm_thickness[1]))))
        assert abs(thick["compliance_uz"] / FACTS["compliance_uz"][0] - 1) > 0.03


@needs_data
class TestAgainstThePublishedMatrices:
    def test_every_figure(self, frame: Superelement, published: Superelement) -> None:
        """Static ones and the band below 2.5 kHz within 2 %; what lies above 2.5 kHz within 4 %."""
        got, truth = figures(frame), figures(published)
        error = {k: abs(got[k] / truth[k] - 1) for k in truth}
        assert max(v for k, v in error.items() if k in BELOW_2500_HZ) < 0.02, error
        assert max(error[k] for k in ABOVE_2500_HZ) < 0.04, error

    def test_responses_to_the_actuators_force_pair(self, frame: Superelement, published: Superelement) -> None:
        """Accepted median and 90 % quantile of the relative difference of the responses, 10 Hz to 2 kHz. The quantile
        holds the flanks of resonances and zeros: they sit within 1.6 % of the published ones."""
        accepted = {"top z": (0.01, 0.08), "top ry": (0.12, 0.4), "sensor": (0.015, 0.12), "actuator": (0.01, 0.08)}
        found = {}
        for output in accepted:
            # Below 200 Hz the published mesh leaks rotation of 1e-3 rad/m that no symmetric shell has.
            f = np.geomspace(200.0 if output == "top ry" else 10.0, 2000.0, 200)
            got, truth = (_response(s, output, f) for s in (frame, published))
            error = np.abs(got - truth) / np.abs(truth)
            found[output] = np.median(error), np.quantile(error, 0.9)
        assert all(np.less(found[output], accepted[output]).all() for output in accepted), found

    def test_misaligned_strut(self) -> None:
        """The built-in strut against the one made of the published matrices: what a misalignment is read from."""
        got, truth = open_model("strut"), open_model(str(NOMINAL))
        off = {}
        for dx, dy in ((0.0, 0.0), (0.0, 200.0), (0.0, -200.0), (60.0, -170.0)):
            at = {"misalignment.dx_um": dx, "misalignment.dy_um": dy}
            both = {"poles": (got.poles(at), truth.poles(at)), "zeros": (got.zeros("de", at), truth.zeros("de", at))}
            for name, roots in both.items():
                f, f_true = (frequency_and_damping(each)[0] for each in roots)
                low, low_true = f[f < 705], f_true[f_true < 700]
                if low != pytest.approx(low_true, rel=0.006):  # half the stiffnesses' 1 %
                    off[dx, dy, name] = low, low_true
            f = np.geomspace(10.0, 1000.0, 300)
            error = np.median(np.abs(got.frf(f, at) / truth.frf(f, at) - 1), axis=0)
            if not (error < 0.015).all():  # Vs, de, da: the static figures' errors
                off[dx, dy, "responses"] = error, 0.015
        assert off == {}

    def test_identification_finds_the_constants_again(self, published: Superelement) -> None:
        """From dimensions off by 10 %, all figures come as close as with the constants in FrameGeometry.

        The boxes' sides are left at their start: the figures hardly tell them apart."""
        g = FrameGeometry()
        off = 1 + np.array([0.05, -0.1, -0.02, 0.1, -0.1, 0.1, 0.1, 0, 0, 0, 0.1, -0.1, 0, 0.1])
        found, left = identify(published, with_effective(g, effective(g) * off))
        assert max(abs(v) for v in left.values()) < 0.05
        shell = slice(0, 7)
        assert effective(found)[shell] == pytest.approx(effective(g)[shell], rel=0.1)

    def test_identification_refuses_another_body(self, published: Superelement) -> None:
        swapped = replace(published, nodes=replace(published.nodes, bottom=1, top=0))
        with pytest.raises(ModelError, match="not the same APA"):
            identify(swapped, FrameGeometry())


def _response(s: Superelement, output: str, f: Array) -> Array:
    """(F,) response per newton on the actuator stacks, bottom clamped, 1 % damping."""
    body = superelement_body(s)
    free = np.arange(6, body.size)
    row = {"top z": body.top[2], "top ry": body.top[4], "sensor": body.sensor, "actuator": body.actuator}[output]
    K, M, C = (A[np.ix_(free, free)] for A in (body.K, body.M, 0.01 * body.C_ratio))
    w = 2 * np.pi * f
    return np.array([row[free] @ np.linalg.solve(K + 1j * x * C - x * x * M, body.actuator[free]) for x in w])


class TestRefused:
    @pytest.mark.parametrize("value", [0.0, -1e-3, np.nan, np.inf])
    def test_impossible_dimension(self, value: float) -> None:
        with pytest.raises(ModelError, match="arm_width"):
            FrameGeometry(arm_width=value)

    def test_impossible_part_of_a_block(self) -> None:
        with pytest.raises(ModelError, match="end"):
            FrameGeometry(end=SolidBlock(box=(1e-3, 0.0, 1e-3), center=0.0, neck=(1e-3, 1e-3)))

    def test_center_that_is_no_number(self) -> None:
        with pytest.raises(ModelError, match=r"top\.center is nan"):
            FrameGeometry(top=SolidBlock(box=(1e-3, 1e-3, 1e-3), center=np.nan, neck=(1e-3, 1e-3)))

    def test_stations_out_of_order(self) -> None:
        with pytest.raises(ModelError, match="do not rise"):
            FrameGeometry(stations=(-0.03, -0.01, -0.02, 0.01, 0.03))

    def test_foot_outside_the_height(self) -> None:
        with pytest.raises(ModelError, match="arm_foot_z"):
            FrameGeometry(arm_foot_z=0.016)

    def test_more_modes_than_there_are(self) -> None:
        with pytest.raises(ModelError, match="10000 interior modes"):
            frame_apa(modes=10000)

    def test_interior_that_is_not_held(self) -> None:
        with pytest.raises(ModelError, match="not held"):
            craig_bampton(np.diag([1.0, 0.0]), np.eye(2), 1, 1)
