"""What lies between the strut and the converters: latencies, filters, amplifiers of second order, a support that gives
way."""

from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from accept.models.model_file import open_model, open_model_file, write_model
from checks.errors import ModelError
from checks.model.channel_paths import lowpass
from checks.model.time.partial_fractions import paths
from checks.model.time.time_response import time_simulation
from specs.strict import SpecError

F = np.geomspace(1.0, 2000.0, 200)
CHANNELS = ("Vs", "de", "da")
CASES = {
    "second order": {"amplifier.second_order_Hz": 1800.0, "amplifier.second_order_damping_ratio": 0.4},
    "charge": {"sensor.charge_highpass_Hz": 15.0, "sensor.charge_highpass_damping_ratio": 0.5},
    "pickup": {"sensor.pickup_us": 4.0},
    "lowpass": {"bench.lowpass_de_Hz": 900.0, "bench.lowpass_de_order": 5.0},
    "support": {
        "bench.support_mode_Hz": 400.0,
        "bench.support_mode_ratio_Vs": -0.01,
        "bench.support_mode_ratio_de": 0.03,
        "bench.support_mode_ratio_da": 0.05,
    },
}


@pytest.mark.parametrize("order", [1, 2, 4, 8])
def test_a_lowpass_is_that_of_scipy(order: int) -> None:
    b, a = signal.butter(order, 2 * np.pi * 700.0, analog=True)
    _, expected = signal.freqs(b, a, 2 * np.pi * F)
    np.testing.assert_allclose(lowpass(F, 700.0, order), expected, rtol=1e-9)  # scipy's polynomial of order 8


def test_an_order_between_two_lies_between_them() -> None:
    phase = [np.unwrap(np.angle(lowpass(F, 700.0, n))) for n in (3.0, 3.4, 4.0)]
    assert (phase[0] > phase[1]).all()
    assert (phase[1] > phase[2]).all()
    near = lowpass(F, 700.0, 4.0 + 1e-9)
    np.testing.assert_allclose(near, lowpass(F, 700.0, 4.0), rtol=1e-7)


def test_a_latency_is_a_delay_of_its_channel_alone() -> None:
    model = open_model("strut")
    late = model.frf(F, {"bench.latency_de_us": 30.0}) / model.frf(F)
    np.testing.assert_allclose(late[:, model.channels.index("de")], np.exp(-2j * np.pi * F * 30e-6), rtol=1e-12)
    others = [i for i, c in enumerate(model.channels) if c != "de"]
    np.testing.assert_allclose(late[:, others], 1.0, rtol=1e-12)


def test_a_pickup_adds_the_derivative_of_the_amplifiers_output_to_vs() -> None:
    model = open_model("strut")
    gain = model.values["constants.amplifier_gain"]
    more = model.frf(F, {"sensor.pickup_us": 4.0}) - model.frf(F)
    expected = gain * 4e-6 * 2j * np.pi * F
    i = model.channels.index("Vs")
    np.testing.assert_allclose(more[:, i], expected, rtol=0.03)  # its end at 100 kHz turns 2 kHz by 0.02
    np.testing.assert_allclose(np.delete(more, i, axis=1), 0.0, atol=1e-15)


def test_an_amplifier_of_second_order_acts_on_every_channel() -> None:
    model = open_model("strut")
    ratio = model.frf(F, CASES["second order"]) / model.frf(F)
    s = 1j * F / 1800.0
    np.testing.assert_allclose(ratio, np.tile(1 / (1 + 0.8 * s + s * s), (3, 1)).T, rtol=1e-12)


@pytest.mark.parametrize("values", CASES.values(), ids=CASES)
def test_the_same_in_time_as_over_frequency(values: dict[str, float]) -> None:
    model = open_model("strut").with_values(values)
    H = model.frf(F)
    for i, channel in enumerate(model.channels):
        # fractions leave out modes beyond 100 kHz, as they do without these parts
        np.testing.assert_allclose(paths(model)[channel].at(2j * np.pi * F), H[:, i], rtol=1e-6)


def test_a_held_drive_comes_late_in_its_channel_alone() -> None:
    fs, Va = 10_000.0, np.r_[np.zeros(10), np.ones(300)]
    late = open_model("strut").with_values({"bench.latency_da_us": 200.0})  # two samples
    own, other = (time_simulation(m, Va.size, fs, hold=True)(Va) for m in (late, open_model("strut")))
    np.testing.assert_allclose(own["da"][2:], other["da"][:-2], rtol=1e-9, atol=1e-18)
    np.testing.assert_array_equal(own["de"], other["de"])


def test_half_an_order_does_not_run_in_time() -> None:
    model = open_model("strut").with_values({"bench.lowpass_Vs_Hz": 900.0, "bench.lowpass_Vs_order": 2.5})
    with pytest.raises(ModelError, match=r"lowpass_Vs_order is 2\.5"):
        paths(model)


def test_a_file_names_them_by_channel(tmp_path: Path) -> None:
    text = open_model_file("strut").spec.text + (
        "\n[bench.latency_us]\nVs = { value = 3.0, sd = 10 }\n[bench.lowpass_Hz]\nde = 8000\n"
    )
    path = tmp_path / "model.toml"
    path.write_text(text)
    given = open_model_file(path)
    assert given.model.values["bench.latency_Vs_us"] == 3.0
    assert given.model.sds["bench.latency_Vs_us"] == 10.0
    assert given.model.values["bench.lowpass_de_Hz"] == 8000.0
    assert given.model.values["bench.lowpass_da_Hz"] == np.inf
    new = tmp_path / "new.toml"
    write_model(new, given.spec, {"bench.latency_Vs_us": 4.0, "bench.latency_da_us": 5.0}, {"bench.latency_da_us": 1.0})
    again = open_model(new)
    assert (again.values["bench.latency_Vs_us"], again.sds["bench.latency_Vs_us"]) == (4.0, 10.0)
    assert (again.values["bench.latency_da_us"], again.sds["bench.latency_da_us"]) == (5.0, 1.0)


def test_a_channel_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(open_model_file("strut").spec.text + "\n[bench.latency_us]\nVd = 3.0\n")
    with pytest.raises(SpecError, match=r"latency_us\.Vd"):
        open_model_file(path)
