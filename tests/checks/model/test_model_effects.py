"""Effects as parameters of the model, against the factors that the design writes down; constants, recovered."""

from collections.abc import Callable
from typing import ClassVar

import numpy as np
import pytest
from scipy import stats

from accept.models.model_file import open_model
from checks.errors import ModelError
from checks.fitting.constants import fit_constants, seed_constants
from checks.gap import EFFECTS, with_effects
from checks.model.electrical import highpass_corner
from checks.model.model import Model

F = np.linspace(10.0, 2000.0, 300)
S = 2j * np.pi * F
VS, DE, DA = 0, 1, 2


@pytest.fixture(scope="module")
def strut() -> Model:
    return open_model("strut")


def second_order(f_Hz: float, damping_ratio: float) -> np.ndarray:
    w = 2 * np.pi * f_Hz
    return w**2 / (S**2 + 2 * damping_ratio * w * S + w**2)


class TestFactors:
    """H with the effect over H without it, channel by channel ([DESIGN] 6)."""

    @pytest.mark.parametrize(
        ("name", "parameters", "on", "factor"),
        [
            ("loop_delay", {"tau_us": 100.0}, (VS, DE, DA), lambda: np.exp(-S * 100e-6)),
            ("amplifier_bandwidth", {"f_Hz": 3900.0}, (VS, DE, DA), lambda: 1 / (1 + S / (2 * np.pi * 3900.0))),
            ("sensor_highpass", {"f_Hz": 3.9}, (VS,), lambda: S / (S + 2 * np.pi * 3.9)),
            (
                "encoder_bracket_mode",
                {"f_Hz": 900.0, "damping_ratio": 0.02},
                (DE,),
                lambda: second_order(900.0, 0.02),
            ),
            ("encoder_scale", {"relative": 0.01}, (DE,), lambda: np.full(F.size, 1.01)),
            ("sensor_polarity", {}, (VS,), lambda: np.full(F.size, -1.0)),
        ],
    )
    def test_multiplies(
        self, strut: Model, name: str, parameters: dict, on: tuple[int, ...], factor: Callable[[], np.ndarray]
    ) -> None:
        ratio = with_effects(strut, [(name, parameters)]).frf(F) / strut.frf(F)
        for channel in range(3):
            expected = factor() if channel in on else np.ones(F.size)
            np.testing.assert_allclose(ratio[:, channel], expected, rtol=1e-9)

    def test_crosstalk_adds_to_Vs(self, strut: Model) -> None:
        added = with_effects(strut, [("crosstalk", {"V_per_V": 0.002})]).frf(F) - strut.frf(F)
        np.testing.assert_allclose(added[:, VS], 0.002 * 20.0, rtol=1e-9)
        assert np.abs(added[:, 1:]).max() == 0.0

    def test_crosstalk_runs_through_the_amplifier(self, strut: Model) -> None:
        slow = with_effects(strut, [("amplifier_bandwidth", {"f_Hz": 500.0})])
        added = with_effects(slow, [("crosstalk", {"V_per_V": 0.002})]).frf(F) - slow.frf(F)
        np.testing.assert_allclose(added[:, VS], 0.04 / (1 + S / (2 * np.pi * 500.0)), rtol=1e-9)

    def test_bench_mode_adds_to_both_displacements(self, strut: Model) -> None:
        parameters = {"f_Hz": 109.5, "ratio": 0.03, "damping_ratio": 0.014}
        added = with_effects(strut, [("bench_mode", parameters)]).frf(F) - strut.frf(F)
        g0 = strut.frf([0.0])[0, DA]
        expected = 0.03 * g0 * second_order(109.5, 0.014)
        np.testing.assert_allclose(added[:, DE], expected, rtol=1e-6)  # a difference of near equals at the resonance
        np.testing.assert_allclose(added[:, DA], expected, rtol=1e-6)
        assert np.abs(added[:, VS]).max() == 0.0


class TestMechanics:
    def test_misalignment(self, strut: Model) -> None:
        moved = with_effects(strut, [("misalignment", {"dx_um": 20.0, "dy_um": -170.0})])
        assert moved.values["misalignment.dx_um"] == 20.0
        assert moved.values["misalignment.dy_um"] == -170.0

    def test_masses_count_from_the_model(self, strut: Model) -> None:
        heavier = with_effects(strut, [("payload_mass", {"kg": 0.5}), ("encoder_mass", {"kg": 0.01})])
        assert heavier.values["bench.payload_kg"] == pytest.approx(6.2)
        assert heavier.values["encoder.head_mass_kg"] == pytest.approx(0.089)

    def test_open_circuit_makes_it_stiffer(self, strut: Model) -> None:
        stiff = with_effects(strut, [("open_circuit_stiffening", {"ratio": 0.3})])
        assert abs(stiff.poles()[0]) > 1.005 * abs(strut.poles()[0])

    def test_highpass_of_the_seed(self) -> None:
        assert highpass_corner(80.6e3, 5.1e-6) == pytest.approx(0.39, abs=0.005)

    def test_two_joints_get_one_kz(self, strut: Model) -> None:
        assert EFFECTS["joint_axial_compliance"].changes(strut, {"kz_N_per_um": 70.0}) == {"joint.kz_N_per_um": 70.0}

    @pytest.mark.parametrize(
        ("name", "parameters", "words"),
        [
            ("hysteresis", {"relative_width": 0.1}, "effect 'hysteresis': a model cannot hold it"),
            ("loop_delay", {"tau_ms": 1.0}, "'loop_delay' is given with tau_ms; expected tau_us"),
            ("misalignment", {"dx_um": 1.0}, "is given with dx_um; expected dx_um, dy_um"),
        ],
    )
    def test_refused(self, strut: Model, name: str, parameters: dict[str, float], words: str) -> None:
        with pytest.raises(ModelError, match=words):
            with_effects(strut, [(name, parameters)])

    def test_effect_on_a_part_that_is_not_there(self) -> None:
        with pytest.raises(ModelError, match=r"needs encoder\.scale, which model 'apa-frame' does not have"):
            with_effects(open_model("apa-frame"), [("encoder_scale", {"relative": 0.1})])


class TestConstants:
    GRID = np.arange(1.0, 600.0)
    TRUE: ClassVar = {"constants.ga_N_per_V": -30.0, "constants.gs_V_per_m": -5.0e6}

    def noisy(self, strut: Model, rng: np.random.Generator, level: float) -> tuple[dict, dict]:
        H = strut.frf(self.GRID, self.TRUE)
        size = np.abs(H) * level
        noise = rng.standard_normal((2, *H.shape))
        H = H + size * (noise[0] + 1j * noise[1]) / np.sqrt(2)
        return dict(zip(strut.channels, H.T, strict=True)), dict(zip(strut.channels, size.T**2, strict=True))

    def test_without_noise_exactly_with_their_signs(self, strut: Model) -> None:
        H = dict(zip(strut.channels, strut.frf(self.GRID, self.TRUE).T, strict=True))
        variance = {c: np.abs(h) ** 2 * 1e-6 for c, h in H.items()}
        fit = fit_constants(strut, self.GRID, H, variance)
        assert fit["ga_N_per_V"].value == pytest.approx(-30.0, rel=1e-9)
        assert fit["gs_V_per_m"].value == pytest.approx(-5.0e6, rel=1e-9)
        by_seed = seed_constants(strut, self.GRID, H["de"], H["Vs"])
        assert by_seed["ga_N_per_V"] == pytest.approx(-30.0, rel=0.05)  # static gain for that at 10..20 Hz
        assert by_seed["gs_V_per_m"] == pytest.approx(-5.0e6, rel=0.07)  # 1 kHz for 400..500 Hz, and ga's error

    def test_uncertainty_of_a_stated_variance(self, strut: Model) -> None:
        """One real factor from 2 n real numbers, each with half of the variance: u^2 = 1 / sum(2 |x|^2 / v)."""
        H = dict(zip(strut.channels, strut.frf(self.GRID, self.TRUE).T, strict=True))
        variance = {c: np.abs(h) ** 2 * 1e-4 for c, h in H.items()}
        ga = fit_constants(strut, self.GRID, H, variance)["ga_N_per_V"]
        n = 9  # 11..19 Hz
        assert ga.u == pytest.approx(30.0 * np.sqrt(1e-4 / (2 * n)), rel=1e-9)
        assert ga.hi - ga.value == pytest.approx(stats.t.ppf(0.975, 2 * n - 1) * ga.u)

    def test_intervals_cover(self, strut: Model) -> None:
        """95 % intervals over 200 draws: hits within the 99.9 % binomial band."""
        rng = np.random.default_rng(11)
        n, hits = 200, {"ga_N_per_V": 0, "gs_V_per_m": 0}
        for _ in range(n):
            for name, c in fit_constants(strut, self.GRID, *self.noisy(strut, rng, 0.02)).items():
                hits[name] += c.lo < self.TRUE[f"constants.{name}"] < c.hi
        lo, hi = stats.binom.interval(0.999, n, 0.95)
        for name, count in hits.items():
            # the Birge ratio never shrinks an interval, so it may cover more often than 95 %
            assert lo <= count <= max(hi, n), name

    def test_two_dof_constants(self) -> None:
        apa = open_model("apa-2dof")
        H = dict(zip(apa.channels, apa.frf(self.GRID).T, strict=True))
        fit = fit_constants(apa, self.GRID, H, {c: np.abs(h) ** 2 * 1e-6 for c, h in H.items()})
        assert fit["ga_N_per_V"].value == pytest.approx(-32.2, rel=1e-9)
        assert fit["gs_V_per_N"].value == pytest.approx(0.088, rel=1e-9)

    def test_refused(self, strut: Model) -> None:
        f = np.arange(100.0, 600.0)
        H = dict(zip(strut.channels, strut.frf(f).T, strict=True))
        variance = {c: np.abs(h) ** 2 for c, h in H.items()}
        with pytest.raises(ModelError, match=r"0 frequencies within 10\.\.20 Hz"):
            fit_constants(strut, f, H, variance)
        H["de"][3] = np.nan
        with pytest.raises(ModelError, match="not finite and positive"):
            fit_constants(strut, f, H, variance, bands={"ga": (100.0, 120.0)})
