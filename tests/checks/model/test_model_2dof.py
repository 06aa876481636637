"""The APA of two springs, against its closed form ([STB] 1.1 and 7.3)."""

import numpy as np
import pytest

from accept.models.model_file import open_model
from checks.model.model import frequency_and_damping

K, KE, KA, C, CE, CA, PAYLOAD = 0.38e6, 1.75e6, 30e6, 30.0, 20.0, 20.0, 5.7
UNDAMPED = {"apa.c_N_s_per_m": 0.0, "apa.ce_N_s_per_m": 0.0, "apa.ca_N_s_per_m": 0.0}


def test_pole_and_zero_without_damping() -> None:
    """Without damping the node between ka and ke has neither mass nor damping: a coordinate that follows at once."""
    apa = open_model("apa-2dof").with_values(UNDAMPED)
    pole = np.sqrt((K + KA * KE / (KA + KE)) / PAYLOAD) / (2 * np.pi)
    zero = np.sqrt(K / PAYLOAD) / (2 * np.pi)
    assert pole == pytest.approx(95.06, abs=0.005)
    assert frequency_and_damping(apa.poles())[0] == pytest.approx([pole], rel=1e-12)
    assert frequency_and_damping(apa.zeros("Vs"))[0] == pytest.approx([zero], rel=1e-12)


def test_zero_with_damping_is_that_of_payload_and_shell() -> None:
    f, damping = frequency_and_damping(open_model("apa-2dof").zeros("Vs"))
    assert f == pytest.approx([np.sqrt(K / PAYLOAD) / (2 * np.pi)], rel=1e-12)
    assert damping == pytest.approx([C / (2 * np.sqrt(K * PAYLOAD))], rel=1e-9)


def test_responses_in_closed_form() -> None:
    """Dynamic stiffness of three branches, written by hand; signs: ga < 0 lifts the payload, Vs starts below zero."""
    apa = open_model("apa-2dof")
    f = np.linspace(1.0, 2000.0, 400)
    s = 2j * np.pi * f
    shell, sensor, stacks = K + C * s, KE + CE * s, KA + CA * s
    force = 20.0 * -32.2
    in_series = sensor * stacks / (sensor + stacks)
    payload = -force * in_series / stacks / (PAYLOAD * s * s + shell + in_series)
    elongation_of_ka = (sensor * payload - force) / (stacks + sensor)
    H = apa.frf(f)
    # 1e-11: round-off; the response spans four decades
    np.testing.assert_allclose(H[:, 1], payload, rtol=1e-11)
    np.testing.assert_allclose(H[:, 2], payload, rtol=1e-11)
    np.testing.assert_allclose(H[:, 0], 0.088 * KE * (payload - elongation_of_ka), rtol=1e-11)
    assert H[0, 1].real > 0
    assert H[0, 0].real < 0


def test_static_gain_by_hand() -> None:
    H = open_model("apa-2dof").frf([0.0])[0]
    assert H[1] == pytest.approx(20 * 32.2 * KE / (KE + KA) / (K + KA * KE / (KA + KE)), rel=1e-12)


@pytest.mark.parametrize(("sensor", "actuator"), [(0.4, 0.0), (0.0, 0.4), (0.2, 0.7)])
def test_open_circuits_stiffen_their_own_stack(sensor: float, actuator: float) -> None:
    open_stacks = {"apa.sensor_stiffening": sensor, "apa.actuator_stiffening": actuator}
    ke, ka = KE * (1 + sensor), KA * (1 + actuator)
    pole = np.sqrt((K + ka * ke / (ka + ke)) / PAYLOAD) / (2 * np.pi)
    f = frequency_and_damping(open_model("apa-2dof").poles(UNDAMPED | open_stacks))[0]
    assert f == pytest.approx([pole], rel=1e-12)


def test_strut_of_two_springs_has_the_axial_mode_of_joints_in_series() -> None:
    """Two joints in series with the APA, the encoder's masses beside the payload's being small."""
    k = 1 / (1 / (K + KA * KE / (KA + KE)) + 2 / 90e6)
    f = frequency_and_damping(open_model("strut-2dof").poles())[0][0]
    assert f == pytest.approx(np.sqrt(k / 5.7) / (2 * np.pi), rel=0.01)  # 0.1 kg of 5.7 kg moves along: 0.9 %
