"""What must end in a refusal, a stated loss or 'cannot be told apart', never in a guess."""

from dataclasses import replace

import numpy as np
import pytest

from accept.gap.analyse_unit import run_gap
from accept.models.model_file import open_model
from checks.fitting import Dataset
from checks.gap.decision.result import Result
from checks.gap.workflow import GapRefused, Inputs, run
from checks.model import Model
from tests.checks.gap.shared.gap_cases import FS, TOLERANCE, drawn, fewer, inputs, recorded
from tests.checks.gap.shared.gap_units import make_strut


def quiet(words: str) -> None:
    del words


def apa(**sds: float) -> Model:
    """The 2-DoF APA with its uncertain values as given."""
    model = replace(open_model("apa-2dof"), tolerance=TOLERANCE)
    return replace(model, sds={**model.sds, **{name.replace("__", "."): sd for name, sd in sds.items()}})


def told(model: Model, effect: str, values: dict[str, float]) -> Result:
    A, B = (recorded(model, seed, {effect: values}) for seed in (1, 2))
    return run(Inputs(model, A, B, FS), quiet)


class TestAliases:
    """Exact aliases ([GAP] 6): the data cannot tell, so nothing is named, and the experiment is said."""

    def test_payload_is_a_scaling_of_force_stiffness_and_damping(self) -> None:
        sure = {"constants__ga_N_per_V": 0.3, "apa__k_N_per_um": 0.004, "apa__ke_N_per_um": 0.01}
        sure |= {"apa__ka_N_per_um": 0.3, "apa__c_N_s_per_m": 0.3, "apa__ce_N_s_per_m": 0.2, "apa__ca_N_s_per_m": 0.2}
        result = told(apa(**sure), "payload_mass", {"kg": 0.8})
        assert result.verdict == "ambiguous"
        assert not result.named
        assert result.ambiguous[0].effects[0] == "payload_mass"
        assert "apa.ke_N_per_um" in result.ambiguous[0].effects[1]
        assert "+0.5 kg" in result.ambiguous[0].experiment

    def test_crosstalk_is_another_sensor_constant(self) -> None:
        sure = {"constants__gs_V_per_N": 5e-4, "apa__ka_N_per_um": 0.3, "constants__ga_N_per_V": 0.3}
        result = told(apa(**sure), "crosstalk", {"V_per_V": 0.02})
        assert result.verdict == "ambiguous"
        assert not result.named
        assert result.ambiguous[0].effects[0] == "crosstalk"
        assert "unplug the sensor" in result.ambiguous[0].experiment

    def test_a_short_delay_is_an_amplifier_far_above_the_band(self) -> None:
        """Of first order or of second: far below its corner each is a delay."""
        result = run(inputs(5, {"loop_delay": {"tau_us": 12.0}}), quiet)
        assert result.verdict == "ambiguous"
        assert set(result.ambiguous[0].effects) == {"loop_delay", "amplifier_bandwidth", "amplifier_second_order"}
        assert "dummy" in result.ambiguous[0].experiment

    def test_and_what_data_tell_is_named(self) -> None:
        """The strut's own stiffness is known, so its payload is no alias of anything."""
        result = run(inputs(5, {"payload_mass": {"kg": 0.8}}), quiet)
        assert [n.effect for n in result.named] == ["payload_mass"]
        agreed = all(gap.G <= 1.0 for gap in result.gap_before.channels.values())
        why = [note for note in result.notes if note.startswith("without what is named the model agrees as well")]
        assert len(why) == agreed, "a name beside gaps that agree is given its reason, and no other"


def test_missing_channels() -> None:
    """Misalignment shows in de alone: without it nothing is named, a mode of the bench least of all."""
    case = fewer(inputs(6, {"misalignment": {"dx_um": 0.0, "dy_um": 200.0}}))
    blind = replace(case, A=case.A.select(("Vs", "da")), B=case.B.select(("Vs", "da")))
    assert not run(blind, quiet).named


def test_records_of_another_unit() -> None:
    case = inputs(7)
    other = recorded(drawn(8), 9, {"crosstalk": {"V_per_V": 0.3}})
    with pytest.raises(GapRefused, match="not records of one unit"):
        run(replace(case, B=other), quiet)


def noisier(data: Dataset, times: float, seed: int) -> Dataset:
    """The same with so many times the noise, and its covariance."""
    rng = np.random.default_rng(seed)
    e = (rng.standard_normal(data.H.shape) + 1j * rng.standard_normal(data.H.shape)) / np.sqrt(2.0)
    return replace(data, H=data.H + times * np.sqrt(data.noise) * e, cov=data.cov * (1.0 + times**2))


def test_little_coherence_names_nothing() -> None:
    """Noise three hundred times as large: an effect that was plain is gone, and no other comes out of the noise."""
    case = fewer(inputs(5, {"crosstalk": {"V_per_V": 0.02}}))
    poor = replace(case, A=noisier(case.A, 300.0, 1), B=noisier(case.B, 300.0, 2))
    result = run(poor, quiet)
    assert {n.effect for n in result.named} <= {"crosstalk"}
    assert result.verdict in ("no_missing_effect", "explained")


def test_a_single_realisation_says_what_is_lost(tmp_path) -> None:
    found = run_gap(make_strut(tmp_path / "single", "S-1", repeats=False), "strut")
    assert any("a single realisation" in note and "sensitivity is reduced" in note for note in found["notes"])
    assert not found["named"]
