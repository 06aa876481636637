"""Sentences of effects: a value below zero is said by the other word and its size."""

from checks.gap.effects import EFFECTS


def test_a_lighter_payload_is_no_payload_that_is_heavier_by_less_than_nothing() -> None:
    payload = EFFECTS["payload_mass"]
    assert payload.say({"kg": -0.7}, {"kg": 0.02}) == "The payload is 0.7 kg lighter than the model says."
    assert payload.say({"kg": 0.7}, {"kg": 0.02}) == "The payload is 0.7 kg heavier than the model says."


def test_an_effect_without_another_word_keeps_its_sign() -> None:
    assert EFFECTS["misalignment"].below == ""
    words = EFFECTS["misalignment"].say({"dx_um": -30.0, "dy_um": -5.0}, {"dx_um": 1.0, "dy_um": 1.0})
    assert "-30" in words
    assert "-5" in words
