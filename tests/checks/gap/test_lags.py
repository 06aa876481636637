"""A lag whose corner lies far above the band is a delay with a droop, whatever makes it: then the others are named with
it."""

from dataclasses import replace

import numpy as np
import pytest

from checks.gap.workflow import run
from tests.checks.gap.shared.gap_cases import F, inputs
from tests.checks.gap.test_gap import quiet

IN_THE_DRIVE = {"amplifier_bandwidth", "amplifier_second_order", "loop_delay"}


def test_a_hold_of_another_rate_is_no_amplifier() -> None:
    """Zero-order hold at 2 kHz: half a period late, and a droop of sinc. Red before: an amplifier of second order."""
    T = 5e-4
    hold = np.sinc(F * T) * np.exp(-1j * np.pi * F * T)
    given = inputs(3)
    A, B = (
        replace(d, H=d.H * hold[:, None], cov=d.cov * (np.abs(hold) ** 2)[:, None, None]) for d in (given.A, given.B)
    )
    found = run(replace(given, A=A, B=B), quiet)
    assert not found.named
    assert found.verdict in ("ambiguous", "unexplained")
    assert all(set(a.effects) == IN_THE_DRIVE for a in found.ambiguous)


def test_a_lag_whose_form_the_band_does_not_show_is_ambiguous() -> None:
    """An amplifier of second order at 20 kHz is 8 us of delay up to 2 kHz. Red before: StopIteration, since no rival of
    another form had been fitted."""
    found = run(inputs(3, {"amplifier_second_order": {"f_Hz": 9000.0, "damping_ratio": 0.95}}), quiet)
    assert found.verdict == "ambiguous"
    assert {"loop_delay", "amplifier_second_order"} <= {name for a in found.ambiguous for name in a.effects}


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("amplifier_second_order", {"f_Hz": 2500.0, "damping_ratio": 0.4}),
        ("channel_lowpass_de", {"f_Hz": 2500.0, "order": 4.0}),
        ("loop_delay", {"tau_us": 60.0}),
    ],
)
def test_what_the_band_shows_is_named(effect: str, values: dict[str, float]) -> None:
    found = run(inputs(3, {effect: values}), quiet)
    assert [n.effect for n in found.named] == [effect]


def test_a_capacitive_pickup_is_no_latency() -> None:
    """Below the first zero of Vs its derivative looks like an earlier sample. Red before it was in the library: Vs is
    sampled 13 us earlier."""
    found = run(inputs(3, {"sensor_pickup": {"tau_us": -3.0}}), quiet)
    assert [n.effect for n in found.named] == ["sensor_pickup"]
