"""The strut: the published figures and statements ([STB] 5, 6), and the laws that any strut must obey."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg

from accept.models.model_file import open_model
from checks.errors import ModelError
from checks.model.dynamics.complex_modes import direct_frf, modal
from checks.model.model import Model, frequency_and_damping
from checks.model.parameter_sweep import PUBLISHED_SWEEPS, Sweep, sweep_parameters
from checks.model.structure.apa import superelement_body
from checks.model.structure.frame import frame_apa
from checks.model.structure.matrix_builder import Builder, System
from specs.model import builtin_models
from tests.checks.model.units_model import needs_data, nominal_model

BAND = np.linspace(10.0, 1000.0, 500)
DRAWS = settings(max_examples=12, deadline=None, derandomize=True)


@pytest.fixture(scope="module")
def strut() -> Model:
    return open_model("strut")


def modes(model: Model) -> np.ndarray:
    return frequency_and_damping(model.poles())[0]


def drawn(model: Model, z: list[float]) -> dict[str, float]:
    """Uncertain parameters at z standard deviations; what may not be negative stays above zero."""
    c = model.calibrated
    values = c.values + np.array(z) * c.sds
    positive = np.where(c.values > 0, np.maximum(values, 0.05 * c.values), values)
    return dict(zip(c.names, positive.tolist(), strict=True))


def draws(model_name: str) -> st.SearchStrategy[list[float]]:
    n = len(open_model(model_name).calibrated.names)
    return st.lists(st.floats(-3, 3), min_size=n, max_size=n)


@needs_data
class TestFactsPage:
    """Figures computed elsewhere from the same matrices, printed to the last digit given."""

    def test_spurious_modes_clamped_at_both_ends(self) -> None:
        assert modes(nominal_model().clamped())[:3] == pytest.approx([191, 282, 398], abs=1.0)  # kz 90 here, 94 there

    def test_axial_mode(self) -> None:
        assert modes(nominal_model())[0] == pytest.approx(85.7, abs=0.05)

    @pytest.mark.parametrize(("payload_kg", "f_Hz"), [(5.7, 88.0), (5.0, 93.9)])
    def test_apa_alone(self, payload_kg: float, f_Hz: float) -> None:
        strut = nominal_model()
        alone = {n: v for n, v in strut.values.items() if not n.startswith(("joint.", "encoder."))}
        apa = Model("apa", strut.apa, {**alone, "bench.payload_kg": payload_kg})
        assert modes(apa)[0] == pytest.approx(f_Hz, abs=0.05)
        assert apa.channels == ("Vs", "de", "da")


class TestBuiltIn:
    def test_spurious_modes_of_the_seed(self, strut: Model) -> None:
        assert modes(strut.clamped())[:3] == pytest.approx([189, 285, 400], rel=0.03)  # issue: within 3 %

    def test_they_need_no_file(self) -> None:
        for name in builtin_models():
            assert np.isfinite(open_model(name).frf(BAND)).all()

    def test_without_encoder_Vs_and_da_hardly_change_and_de_is_gone(self, strut: Model) -> None:
        bare = strut.without_encoder()
        assert bare.channels == ("Vs", "da")
        with pytest.raises(ModelError, match="no channel 'de'"):
            bare.frf(BAND, channels=("de",))
        off = (BAND < 75) | ((BAND > 110) & (BAND < 300))  # around the resonance 0.1 kg of 5.7 kg shifts it by 1 %
        change = np.abs(bare.frf(BAND)[off] / strut.frf(BAND, channels=("Vs", "da"))[off] - 1)
        assert np.median(change) < 0.03
        assert modes(bare)[0] == pytest.approx(modes(strut)[0], rel=0.01)


class TestLaws:
    @DRAWS
    @given(z=draws("strut"), dx=st.floats(-500, 500), dy=st.floats(-1000, 1000))
    def test_no_mode_gains_energy(self, z: list[float], dx: float, dy: float) -> None:
        strut = open_model("strut")
        form = strut.modal({**drawn(strut, z), "misalignment.dx_um": dx, "misalignment.dy_um": dy})
        assert (form.poles().real < 0).all()

    @DRAWS
    @given(z=draws("strut"), dx=st.floats(-500, 500), dy=st.floats(-1000, 1000))
    def test_force_and_elongation_of_the_actuator_take_energy_only(self, z: list[float], dx: float, dy: float) -> None:
        """Passivity: at one port the displacement never leads its force."""
        strut = open_model("strut")
        s = strut.system({**drawn(strut, z), "misalignment.dx_um": dx, "misalignment.dy_um": dy})
        port = System(s.M, s.C, s.K, s.force, s.force[None], ("elongation",))
        assert (modal(port).frf(BAND).imag < 0).all()

    def test_reciprocity(self, strut: Model) -> None:
        """Force on the actuator to motion of the payload is force on the payload to elongation of the actuator."""
        s = strut.system({"misalignment.dx_um": 60.0, "misalignment.dy_um": -200.0})
        for channel in range(3):
            there = System(s.M, s.C, s.K, s.force, s.outputs[[channel]], ("there",))
            back = System(s.M, s.C, s.K, s.outputs[channel], s.force[None], ("back",))
            np.testing.assert_allclose(modal(there).frf(BAND), modal(back).frf(BAND), rtol=1e-8)  # round-off at zeros

    def test_a_rigid_motion_of_the_apa_needs_no_force_and_has_its_mass(self, strut: Model) -> None:
        """In the reduced coordinates too: rigid motion of both interfaces, found as the static answer to it."""
        body = strut.apa(strut.values)
        places = np.vstack([body.bottom, body.top])
        rigid = np.vstack([_about_origin(-0.015), _about_origin(0.015)])
        q = np.linalg.pinv(places) @ rigid
        inside = np.linalg.svd(places)[2][12:].T
        q -= inside @ np.linalg.solve(inside.T @ body.K @ inside, inside.T @ body.K @ q)
        left = np.abs(q.T @ body.K @ q).max()
        assert left < 1e-6 * np.abs(body.K).max()  # newtons per metre of what cancels
        m = q.T @ body.M @ q
        assert np.diag(m)[:3] == pytest.approx(np.full(3, 0.1153), rel=0.03)  # the frame's mass is within 3 %
        assert np.abs(q.T @ body.C_ratio @ q).max() < 1e-6 * np.abs(body.C_ratio).max()

    @pytest.mark.parametrize(("name", "lengths"), [("strut", 3), ("strut-as-built", 4)])
    def test_mirror(self, name: str, lengths: int) -> None:
        """The APA is its own mirror image in y: mirroring all that hangs on it changes nothing."""
        strut = open_model(name)
        lateral = ("misalignment.dy_um", "encoder.com_y_mm", "encoder.arm_y_mm", "encoder.ruler_arm_y_mm")
        names = [n for n in lateral if n in strut.values]
        assert len(names) == lengths  # as built, head and ruler have arms of their own
        here = {**{n: strut.values[n] for n in names}, "misalignment.dy_um": 150.0}
        there = {n: -v for n, v in here.items()}
        np.testing.assert_allclose(strut.frf(BAND, here), strut.frf(BAND, there), rtol=1e-7)  # round-off at zeros

    def test_dz_makes_one_joint_longer_and_the_other_shorter(self, strut: Model) -> None:
        """Moving the APA up between centres that stay is the same as a longer bottom joint and a shorter top one."""
        shared = {n.removeprefix("joint."): v for n, v in strut.values.items() if n.startswith("joint.")}
        rest = {n: v for n, v in strut.values.items() if not n.startswith("joint.")}
        both = {f"joint.{end}.{key}": v for end in ("bottom", "top") for key, v in shared.items()}
        for end, sign in (("bottom", 1.0), ("top", -1.0)):
            both[f"joint.{end}.length_mm"] += sign * 2 * 0.4
            both[f"joint.{end}.half_arm_mm"] += sign * 0.4
        tilted = {"misalignment.dx_um": 50.0, "misalignment.dy_um": 100.0}
        other = Model("two joints", strut.apa, rest | both)
        moved = strut.frf(BAND, tilted | {"misalignment.dz_um": 400.0})
        np.testing.assert_allclose(moved, other.frf(BAND, tilted), rtol=1e-8)  # round-off at zeros

    def test_every_elastic_mode_of_the_free_apa_has_the_damping_ratio(self) -> None:
        body = superelement_body(frame_apa())
        w2, shapes = linalg.eigh(body.K, body.M)
        C = shapes.T @ body.C_ratio @ shapes
        assert np.diag(C)[6:] / (2 * np.sqrt(w2[6:])) == pytest.approx(np.ones(len(w2) - 6), rel=1e-6)
        assert np.abs(np.diag(C)[:6]).max() < 1e-6 * np.diag(C).max()

    def test_a_joint_made_stiff_becomes_a_rigid_one(self, strut: Model) -> None:
        """Springs a million times stiffer and a rigid direction are the same strut."""
        stiff = {"joint.kx_N_per_um": 1e7, "joint.ky_N_per_um": 1e7}
        rigid = {n: v for n, v in strut.values.items() if n not in stiff}
        H = Model("rigid", strut.apa, rigid).frf(BAND)
        np.testing.assert_allclose(strut.frf(BAND, stiff), H, rtol=1e-4)  # 12.7 to 1e7 N/um leaves 1e-6, more at zeros


def _about_origin(z: float) -> np.ndarray:
    """(6, 6) the six rigid motions of a point on the axis."""
    T = np.eye(6)
    T[0, 4], T[1, 3] = z, -z
    return T


@pytest.fixture(scope="module", params=["strut", pytest.param("superelement", marks=pytest.mark.takes_data)])
def either(request: pytest.FixtureRequest) -> Model:
    return nominal_model() if request.param == "superelement" else open_model(request.param)


class TestSeedStatements:
    """Sections 6.2 and 6.3, from poles and zeros; the curves are for the eye."""

    def between(self, s: Sweep, first: float, second: float) -> dict[float, list[float]]:
        return {r.value: [z for z in r.zeros.f if first < z < second] for r in s.rows}

    def run(self, model: Model, name: str, channel: str = "de") -> Sweep:
        names, values = PUBLISHED_SWEEPS[name]
        return sweep_parameters(model, names, values, channel, BAND)

    def test_dy_decides_the_zero_between_the_first_two_resonances(self, either: Model) -> None:
        s = self.run(either, "dy")
        zeros = self.between(s, modes(either)[0], modes(either)[1])
        assert [len(zeros[dy]) for dy in (-500.0, -100.0, 100.0, 500.0)] == [0, 0, 1, 1]

    def test_dx_acts_on_the_285_Hz_mode(self, either: Model) -> None:
        """Residues beside the aligned strut's: that of the second spurious mode moves, that of the first does not."""
        size = self.residues(either, "misalignment.dx_um", (-100.0, 0.0, 100.0))
        change = np.ptp(size, axis=0) / size[1]
        assert change[2] > 1.0
        assert change[1] < 0.1

    def test_dy_acts_on_the_200_Hz_mode(self, either: Model) -> None:
        size = self.residues(either, "misalignment.dy_um", (-100.0, 0.0, 100.0))
        assert (np.ptp(size, axis=0) / size[1])[1] > 1.0

    def residues(self, model: Model, name: str, values: tuple[float, ...]) -> np.ndarray:
        """(values, 4) size of the first four modes' residues in de, by rising frequency."""
        rows = []
        for v in values:
            form = model.modal({name: v})
            rows.append(np.abs(form.residues[np.argsort(-np.abs(form.mu))[:4], 1]))
        return np.array(rows)

    def test_dz_shows_in_none(self, either: Model) -> None:
        s = self.run(either, "dz")
        first = np.array([r.zeros.f[:4] for r in s.rows])
        assert np.ptp(first, axis=0).max() < 1.0  # Hz, over one millimetre of dz

    def test_kz_moves_the_zero_near_500_Hz(self, either: Model) -> None:
        s = self.run(either, "kz")
        zero = [r.zeros.f[3] for r in s.rows[:3]]
        assert zero[0] < zero[1] < zero[2]
        assert zero[2] - zero[0] > 90.0
        assert np.ptp([r.poles.f[1] for r in s.rows]) < 0.1  # while the spurious modes stay

    def test_kR_hardly_matters(self, either: Model) -> None:
        s = self.run(either, "kR")
        roots = np.array([[*r.poles.f[:4], *r.zeros.f[:4]] for r in s.rows])
        assert (np.ptp(roots, axis=0) / roots[0]).max() < 0.015  # kR more than doubles

    def test_cR_damps_the_spurious_modes(self, either: Model) -> None:
        s = self.run(either, "cR")
        damping = np.array([r.poles.damping[:4] for r in s.rows])
        assert (np.diff(damping[:, 1:], axis=0) > 0).all()
        assert (damping[-1, 1:] > 0.3).all()
        assert np.ptp(damping[:, 0]) < 1e-3  # the axial mode does not bend the joints

    @pytest.mark.parametrize("channel", ["da", "Vs"])
    def test_da_and_Vs_hardly_depend_on_alignment(self, either: Model, channel: str) -> None:
        aligned = either.frf(BAND, channels=(channel,))
        moved = either.frf(BAND, {"misalignment.dx_um": 100.0, "misalignment.dy_um": 100.0}, channels=(channel,))
        de = either.frf(BAND, channels=("de",))
        moved_de = either.frf(BAND, {"misalignment.dx_um": 100.0, "misalignment.dy_um": 100.0}, channels=("de",))
        assert np.median(np.abs(moved / aligned - 1)) < 0.01
        assert np.median(np.abs(moved_de / de - 1)) > 0.1

    def test_table_and_panels_show_it(self, either: Model) -> None:
        s = self.run(either, "dy")
        rows = s.table
        assert [row["value"] for row in rows] == [-500.0, -100.0, 0.0, 100.0, 500.0]
        assert rows[2]["poles_Hz"][0] == pytest.approx(modes(either)[0])
        size, phase = s.panels
        assert len(size.items) == len(phase.items) == 5
        assert size.y_label == "|de / Va| [m/V]"


class TestRefused:
    @pytest.mark.parametrize(
        ("changes", "words"),
        [
            ({"joint.kw": 1.0}, r"no parameter 'joint\.kw'"),
            ({"joint.kz_N_per_um": 0.0}, r"joint\.kz_N_per_um is 0 N/um; expected a number above 0"),
            ({"bench.payload_kg": np.nan}, r"bench\.payload_kg is nan kg"),
            ({"bench.payload_kg": np.inf}, r"bench\.payload_kg is inf kg"),
            ({"apa.damping_ratio": -0.01}, r"apa\.damping_ratio is -0.01"),
            ({"misalignment.dy_um": 6000.0}, r"misalignment\.dy_um is 6000 um.*at most 5000"),
        ],
    )
    def test_value(self, strut: Model, changes: dict[str, float], words: str) -> None:
        with pytest.raises(ModelError, match=words):
            strut.frf(BAND, changes)

    @pytest.mark.parametrize(
        ("f", "words"),
        [([10.0, 5001.0], "5001 Hz is outside"), ([-1.0], "-1 Hz"), ([np.nan], "nan Hz"), ([], "at least one")],
    )
    def test_frequency(self, strut: Model, f: list[float], words: str) -> None:
        with pytest.raises(ModelError, match=words):
            strut.frf(f)

    def test_assembly_that_is_not_held(self) -> None:
        b = Builder(2)
        b.spring(np.array([[1.0, -1.0]]), np.array([1e6]), np.zeros(1))
        _, C, K, _ = b.matrices()
        with pytest.raises(ModelError, match="the assembly is not held: lowest eigenvalue of its stiffness"):
            modal(System(np.eye(2), C, K, np.ones(2), np.eye(2), ("a", "b")))

    def test_mass_that_is_negative(self) -> None:
        s = System(np.diag([1.0, -1.0]), np.zeros((2, 2)), np.eye(2), np.ones(2), np.eye(2), ("a", "b"))
        with pytest.raises(ModelError, match="mass is not positive"):
            modal(s)

    def test_damping_that_overflows(self) -> None:
        """A search that jumps far off reaches it: one run in some ended in a traceback."""
        s = System(np.eye(2), np.full((2, 2), np.nan), np.eye(2), np.ones(2), np.eye(2), ("a", "b"))
        with pytest.raises(ModelError, match="no modes can be found with such values"):
            modal(s)


def test_direct_solve_is_the_textbook_oscillator() -> None:
    """The reference that all else is compared with, itself against 1 / (k - m w^2 + i w c)."""
    s = System(np.eye(1) * 2.0, np.eye(1) * 3.0, np.eye(1) * 5e4, np.ones(1), np.eye(1), ("q",))
    w = 2 * np.pi * BAND
    np.testing.assert_allclose(direct_frf(s, BAND)[:, 0], 1 / (5e4 - 2.0 * w**2 + 3j * w), rtol=1e-13)
