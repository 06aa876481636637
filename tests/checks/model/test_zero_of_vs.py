"""The zero of Vs of the APA as two springs and a force ([STB] 1.1, 4.2): what may turn it to the other side."""

import numpy as np
import pytest

from accept.models.model_file import open_model
from checks.model.time.partial_fractions import Fractions, paths

HZ = 2.0 * np.pi
GAIN = 20.0  # of the amplifier


def vs(**changes: float) -> Fractions:
    return paths(open_model("apa-2dof").with_values({f"sensor.{k}": v for k, v in changes.items()}))["Vs"]


STATIC = vs().static()  # [V/V] of Va; below zero by the sign of the file's force constant
SIGN = float(np.sign(STATIC))


def zero_of(Vs: Fractions) -> tuple[float, float]:
    """Return frequency [Hz] and damping ratio of the zero that comes from 41 Hz, by Newton steps on the sum over
    poles."""
    s, h = np.array([HZ * 41j]), 1e-3
    for _ in range(20):
        s = s - Vs.at(s) * 2.0 * h / (Vs.at(s + h) - Vs.at(s - h))
    assert abs(Vs.at(s)[0]) < 1e-9 * abs(STATIC)
    return float(abs(s[0]) / HZ), float(-s[0].real / abs(s[0]))


def test_the_zero_of_a_sound_apa_is_damped() -> None:
    f_Hz, damping_ratio = zero_of(vs())
    assert f_Hz == pytest.approx(41.09, abs=0.01)
    assert 100.0 * damping_ratio == pytest.approx(1.02, abs=0.01)


def test_a_constant_coupling_moves_the_zero_and_cannot_turn_it() -> None:
    """Cross-talk, as the capacitance between the cables makes it beside a sensor that is a capacitor too: as much as
    two thirds of what Vs itself has at rest."""
    for share, f_Hz in ((1e-3 * SIGN, 41.7), (-1e-3 * SIGN, 40.5)):
        moved = zero_of(vs(crosstalk_V_per_V=share))
        assert moved[0] == pytest.approx(f_Hz, abs=0.05)
        assert 100.0 * moved[1] == pytest.approx(1.02, abs=0.02)
    for part in np.linspace(-0.66, 0.66, 12):
        assert zero_of(vs(crosstalk_V_per_V=float(part * STATIC / GAIN)))[1] > 0.0


@pytest.mark.parametrize(("tau_us", "percent"), [(-1.0, 0.66), (-3.0, -0.06), (3.0, 2.1)])
def test_the_voltage_on_a_shared_return_turns_it(tau_us: float, percent: float) -> None:
    """tau = R C: 0.1 ohm beside actuator stacks of 10 uF are 1 us, 0.3 ohm are 3 us. tau as beside a sensor that is
    positive below its zero."""
    f_Hz, damping_ratio = zero_of(vs(pickup_us=SIGN * tau_us))
    assert f_Hz == pytest.approx(41.09, abs=0.1)
    assert 100.0 * damping_ratio == pytest.approx(percent, abs=0.02)
