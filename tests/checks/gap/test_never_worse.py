"""Nothing that is named leaves a channel worse explained, and faults of the records are told for what they are."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from accept.gap.analyse_unit import run_gap
from accept.simulate import simulate, write
from accept.workflow.training import training_request
from checks.fitting import Dataset
from checks.gap import workflow
from checks.gap.decision.gates import Claim
from checks.gap.decision.never_worse import gaps_of, withdraw_harmful
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.thresholds import THRESHOLDS
from checks.gap.preparation import record_faults
from checks.gap.preparation.inputs import possible_faults, with_fault
from checks.gap.search.explanation import Explanation
from checks.gap.workflow import GapRefused, run
from tests.checks.gap.shared.gap_cases import fewer, inputs, recorded, strut

DE = 1


def silent(data: Dataset) -> Dataset:
    """de as a loose cable gives it: noise alone."""
    rng = np.random.default_rng(int(data.name.split()[-1]))
    H, scale = data.H.copy(), np.sqrt(data.noise[:, DE] / 2)
    H[:, DE] = scale * (rng.standard_normal(scale.size) + 1j * rng.standard_normal(scale.size))
    return replace(data, H=H)


def resonance(data: Dataset) -> Dataset:
    """On Vs alone, at 300 Hz: no effect of the library."""
    w2, H = 300.0**2, data.H.copy()
    H[:, 0] *= 1.0 + 0.3 * w2 / (w2 - data.f**2 + 2j * 0.02 * 300.0 * data.f)
    return replace(data, H=H)


FAULTS: dict[str, tuple[Callable[[Dataset], Dataset], list[str]]] = {
    "Vs turned": (lambda d: record_faults.with_signs(d, ("Vs",)), ["sensor_polarity"]),
    "da turned": (lambda d: record_faults.with_signs(d, ("da",)), ["polarity_da"]),
    "de and da exchanged": (lambda d: record_faults.with_names(d, ("de", "da")), ["swapped_channels"]),
    # a motion in metres under the name of a voltage is no dead channel
    "de and Vs exchanged": (lambda d: record_faults.with_names(d, ("de", "Vs")), ["swapped_channels"]),
    "de dead": (silent, ["dead_channel"]),
    "a resonance on Vs": (resonance, []),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_told_and_no_channel_gets_worse(fault: str) -> None:
    spoil, names = FAULTS[fault]
    case = fewer(inputs(4))
    result = run(replace(case, A=spoil(case.A), B=spoil(case.B)), lambda words: None)
    assert [n.effect for n in result.named] == names
    assert result.verdict == ("explained" if names else "unexplained")
    before, after = result.gap_before.channels, result.gap_after.channels
    assert all(after[c].G <= before[c].G for c in after)


def test_no_channel_at_all() -> None:
    case = inputs(4)
    A, B = (replace(d, H=1e-4 * d.H) for d in (case.A, case.B))
    with pytest.raises(GapRefused, match="no channel answers"):
        run(replace(case, A=A, B=B), lambda words: None)


def test_a_reversed_sensor_of_an_APA_that_is_not_quite_the_models(tmp_path: Path) -> None:
    """The training unit of seed 5: zeros of Vs elsewhere than the model's hid its sign, gs was calibrated through zero,
    and the loops of the slow record alone were named."""
    order = training_request("apa", "T-5", 5)
    assert order.fault == "polarity"
    found = run_gap(write(simulate(order), tmp_path / "T-5"), "apa-frame")
    assert "sensor_polarity" in [n["effect"] for n in found["named"]]
    before, after = found["gap_before"]["channels"], found["gap_after"]["channels"]
    assert all(after[c] <= before[c] for c in after)
    assert after["Vs"] < 1.0


def test_a_claim_that_widens_a_gap_is_taken_back() -> None:
    data = recorded(strut(), 3, {"crosstalk": {"V_per_V": 0.02}})
    prior = strut().calibrated
    values = dict(zip(prior.names, prior.values.tolist(), strict=True))
    helps, harms = EFFECTS["crosstalk"], EFFECTS["encoder_scale"]
    full = Explanation(
        Augmented(strut(), (helps, harms)),
        values | {"crosstalk.V_per_V": 0.02, "encoder_scale.relative": 0.2},
        0.0,
        data,
        THRESHOLDS,
    )
    bare = Explanation(Augmented(strut()), values, 0.0, data, THRESHOLDS)
    made = (Claim(helps, 900.0, 0.0, ()), Claim(harms, 100.0, 0.0, ()))
    claims, before, after = withdraw_harmful([bare], full, made)
    assert [c.effect.name for c in claims if not c.reasons] == ["crosstalk"]
    assert "de worse explained" in claims[1].reasons[0]
    assert gaps_of(after).channels["de"].G <= gaps_of(before).channels["de"].G
    _, before, after = withdraw_harmful([bare], full, made[1:])
    assert before is after is bare


def test_records_turned_without_need_are_taken_as_they_came(monkeypatch: pytest.MonkeyPatch) -> None:
    """A calibration that went astray made a reversed Vs look better: a name may not widen the gap of any channel."""
    monkeypatch.setattr(workflow, "correct_records", lambda search, base, p: with_fault(p, possible_faults(p)[0]))
    case = inputs(4)
    result = run(replace(case, A=resonance(case.A), B=resonance(case.B)), lambda words: None)
    assert (result.named, result.early) == ((), ())
    assert result.verdict == "unexplained"


def test_a_constant_keeps_its_sign() -> None:
    """A negative gs that may turn undoes a polarity that was turned, and the same records count as another fault."""
    free = {p.name: p for p in Augmented(strut()).free()}
    assert free["constants.gs_V_per_m"].hi < 0.0 < free["joint.kz_N_per_um"].lo
