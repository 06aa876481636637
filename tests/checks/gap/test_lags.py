"""A lag whose corner lies far above the band is a delay with a droop, whatever makes it: then the others are named with
it."""

from dataclasses import replace

import numpy as np
import pytest

from checks.gap.effects import EFFECTS
from checks.gap.workflow import run
from checks.model import LATENCIES
from tests.checks.gap.shared.gap_cases import F, inputs
from tests.checks.gap.test_bench_paths import NOTHING_LEARNED
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


def test_a_common_return_is_no_latency() -> None:
    """Below the first zero of Vs its derivative looks like an earlier sample. Red before it was in the library: Vs is
    sampled 13 us earlier."""
    found = run(inputs(3, {"sensor_pickup": {"tau_us": -3.0}}), quiet)
    assert [n.effect for n in found.named] == ["sensor_pickup"]
    assert "return wire" in found.named[0].sentence
    assert "return wire of its own" in EFFECTS["sensor_pickup"].experiment.value


@pytest.mark.parametrize("learned", [True, False])
def test_a_learned_latency_imitates_no_delay(learned: bool) -> None:
    """A delay of 60 us where the latencies of all channels are known to 0.5 us: from a batch, it is the unit's. A file
    may state what it likes, so there the latencies are named beside it. Red before where it was learned."""
    given = inputs(3, {"loop_delay": {"tau_us": 60.0}})
    sds = {**given.model.sds, **dict.fromkeys(LATENCIES.values(), 0.5)}
    model = replace(given.model, sds=sds, learned=NOTHING_LEARNED if learned else None)
    found = run(replace(given, model=model), quiet)
    if learned:
        assert [n.effect for n in found.named] == ["loop_delay"]
        assert found.named[0].parameters["tau_us"].value == pytest.approx(60.0, abs=1.5)  # 3 sd of three latencies
    else:
        assert not found.named
        assert any("loop_delay" in a.effects for a in found.ambiguous)
