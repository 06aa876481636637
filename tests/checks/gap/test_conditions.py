"""Experiments: what a condition changes in a model, explanations told apart by it, and what it contradicts."""

import os
from dataclasses import replace

import numpy as np
import pytest

from accept.models.model_file import open_model
from checks.errors import ModelError
from checks.gap.conditions.kinds import EXPERIMENT_KINDS
from checks.gap.conditions.trial import ConditionTrial, together, under_experiment
from checks.gap.decision.experiments import changed_channels
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented
from tests.checks.gap.shared.experiment_cases import DAMPERS, SPRINGS, Case, known, random_case, scaled, with_effect
from tests.checks.gap.shared.gap_cases import F, recorded

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
PAYLOAD = "bench.payload_kg"


def trial(kind: str, value: float | None, own_ohm: float | None = None) -> ConditionTrial:
    data = recorded(open_model("strut"), 1)
    return ConditionTrial(kind, EXPERIMENT_KINDS[kind], value, data, data, own_ohm)


class TestCondition:
    def test_a_mass_is_added_to_what_is_calibrated_and_to_what_is_named(self) -> None:
        strut = open_model("strut")
        every = together(Augmented(strut, (EFFECTS["payload_mass"],)), [trial("added_mass", 0.5)])
        at = {p.name: p.begin for p in every.free()} | {PAYLOAD: 5.6, "payload_mass.kg": 0.3}
        H = every.frf(F[:20], at, ("de@added_mass",))
        np.testing.assert_allclose(H, strut.frf(F[:20], {PAYLOAD: 6.4}, ("de",)), rtol=1e-12)
        np.testing.assert_allclose(
            every.frf(F[:20], at, ("de",)), strut.frf(F[:20], {PAYLOAD: 5.9}, ("de",)), rtol=1e-12
        )

    @pytest.mark.parametrize("own_ohm", [None, 80_600.0])
    def test_derivatives_are_those_of_the_response(self, own_ohm: float | None) -> None:
        """Central differences; 1e-4 of the largest: their own truncation and rounding."""
        response = Augmented(open_model("strut"), (EFFECTS["sensor_highpass"],))
        every = together(response, [trial("other_resistor", 20_000.0, own_ohm)])
        at = {p.name: p.begin for p in every.free()} | {"sensor_highpass.f_Hz": 3.0}
        names = [n for n in at if "highpass" in n or n == PAYLOAD]
        assert ("other_resistor.highpass_Hz" in at) == (own_ohm is None)
        channels, f = ("Vs@other_resistor", "da@other_resistor"), F[:40]
        D = every.jacobian(f, names, at, channels)
        for d, n in zip(D, names, strict=True):
            h = 1e-4 * max(abs(at[n]), 1.0)
            ends = [every.frf(f, at | {n: at[n] + s * h}, channels) for s in (1.0, -1.0)]
            slope = (ends[0] - ends[1]) / (2.0 * h)
            np.testing.assert_allclose(d, slope, atol=1e-4 * max(np.abs(slope).max(), 1e-12))

    def test_a_corner_goes_with_one_over_the_resistor(self) -> None:
        response = Augmented(open_model("strut"), (EFFECTS["sensor_highpass"],))
        every = together(response, [trial("other_resistor", 20_150.0, 80_600.0)])
        at = {p.name: p.begin for p in every.free()} | {"sensor_highpass.f_Hz": 2.0}
        expected = open_model("strut").frf(F[:20], {"sensor.highpass_Hz": 8.0}, ("Vs",))
        np.testing.assert_allclose(every.frf(F[:20], at, ("Vs@other_resistor",)), expected, rtol=1e-12)

    def test_a_stack_neither_open_nor_closed_is_refused_in_words(self) -> None:
        response = Augmented(open_model("strut"), (EFFECTS["open_circuit_stiffening"],))
        together(response, [trial("other_resistor", 1.0)])
        with pytest.raises(ModelError, match="neither open nor closed"):
            together(response, [trial("other_resistor", 500.0)])


class TestSettled:
    def test_the_mass_that_was_asked_for_names_the_payload(self) -> None:
        case = with_effect(known(*SPRINGS, *DAMPERS), 1, "payload_mass", {"kg": 0.8})
        alone = case.told()
        assert (alone.verdict, alone.named) == ("ambiguous", ())
        asked = case.asked(alone)
        assert asked is not None
        result = case.told(asked)
        (named,) = result.named
        value = named.parameters["kg"]
        assert (result.verdict, named.effect) == ("explained", "payload_mass")
        assert value.lo <= case.truth.values[PAYLOAD] - case.model.values[PAYLOAD] <= value.hi
        assert [(t.kind, t.holds) for t in result.experiments] == [("added_mass", True)]

    def test_values_that_explain_all_leave_no_effect(self) -> None:
        result = scaled(known(*SPRINGS, *DAMPERS), 3, 0.86)
        told = result.told(result.trial("added_mass", 2.0))
        assert (told.verdict, told.named, told.ambiguous) == ("no_missing_effect", (), ())
        assert any("payload_mass is not needed" in n for n in told.notes)
        assert all(g.G < 1.0 for g in told.gap_after.channels.values())

    @pytest.mark.skipif(not SOAK, reason="slow: runs in make soak")
    def test_an_experiment_that_says_nothing_settles_nothing(self) -> None:
        case = with_effect(known(*SPRINGS, *DAMPERS), 1, "payload_mass", {"kg": 0.8})
        assert case.told(case.trial("turned", None)).verdict == "ambiguous"

    @pytest.mark.skipif(not SOAK, reason="some minutes: the full property runs in make soak")
    def test_pairs_come_apart_by_the_experiment_that_was_asked_for(self) -> None:
        """At least 9 of 10 of those that are not told apart ([GAP] 11); a false name counts twice."""
        told = [outcome(random_case(seed)) for seed in range(60)]
        asked = [o for o in told if o != "not ambiguous"]
        assert len(asked) >= 30
        assert sum(o == "right" for o in asked) >= 0.9 * len(asked)
        assert sum(o == "wrong" for o in asked) <= 0.03 * len(asked)


def outcome(case: Case) -> str:
    """Of one drawn unit: right, open, wrong, not asked, or not ambiguous to begin with."""
    alone = case.told()
    if alone.verdict != "ambiguous":
        return "not ambiguous"
    asked = case.asked(alone)
    if asked is None:
        return "not asked"
    result = case.told(asked)
    names = [n.effect for n in result.named]
    if names == ([case.effect] if case.effect else []) and not result.ambiguous:
        return "right"
    return "wrong" if set(names) - {case.effect} else "open"


class TestHeld:
    def test_a_contradiction_is_said_and_nothing_is_explained(self) -> None:
        """The mass that was stated as 0.5 kg was 1 kg."""
        model = known(*SPRINGS)
        case = with_effect(model, 2, "sensor_highpass", {"f_Hz": 4.0})
        assert case.told(case.trial("added_mass", 0.5)).verdict == "explained"
        wrong = replace(case.trial("added_mass", 1.0), value=0.5)
        result = case.told(wrong)
        assert (result.verdict, result.named) == ("unexplained", ())
        assert not result.experiments[0].holds
        assert any(t.reason.startswith("refuted: with 0.5 kg") for t in result.tried)
        assert any("does not hold" in u.words for u in result.unnamed)

    def test_another_answer_at_another_level_is_said_without_a_linear_name(self) -> None:
        case = with_effect(known(*SPRINGS), 2, "sensor_highpass", {"f_Hz": 4.0})
        assert not case.told(case.trial("drive_level", 0.5)).experiments[0].level
        bent = case.truth.with_values({"constants.ga_N_per_V": 1.05 * case.truth.values["constants.ga_N_per_V"]})
        result = case.told(case.trial("drive_level", 0.5, truth=bent))
        assert set(result.experiments[0].level) == {"Vs", "de", "da"}
        assert result.verdict == "partly_explained"
        assert all(u.level_dependent for u in result.unnamed)

    def test_false_alarms_of_the_level(self) -> None:
        """40 pairs of three channels, a threshold of 1e-4 each: one alarm has a chance of 1 %."""
        strut = open_model("strut")
        alarms = [changed_channels(recorded(strut, 2 * s), recorded(strut, 2 * s + 1)) for s in range(40)]
        assert sum(len(a) for a in alarms) == 0
        heavier = under_experiment(strut, EXPERIMENT_KINDS["added_mass"], 0.05)
        assert changed_channels(recorded(strut, 1), recorded(heavier, 2))
