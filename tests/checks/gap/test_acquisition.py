"""Effects of data acquisition on the responses of a recorded strut: each is named for what it is, alone or with
what the band does not tell from it, or is honestly unidentified. None gets another cause's name.

The effects are put on by formulas of their own. Red before: the filter of fourth order was "Vs comes 2 samples late".
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from accept.gap.unit_responses import SEARCH_LO, realisations, responses
from accept.models.model_file import open_model
from checks.arrays import Array, Complex
from checks.gap.workflow import Inputs, run
from tests.checks.model.units_model import NOMINAL
from tests.shared.recorded_units import RecordedUnits

Factor = Callable[[Array], Complex]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def recorded(recorded_units: RecordedUnits) -> Inputs:
    """S-01, in which nothing is hidden, at half of its bins."""
    model = open_model(NOMINAL)
    measured = responses(recorded_units.folder("S-01"), model.tolerance, f_lo=SEARCH_LO)
    A, B, _ = realisations(measured, model.tolerance)
    return Inputs(model, A.thinned(500), B.thinned(500), measured.records["low"].fs, measured.merge_Hz)


def delay(seconds: float) -> Factor:
    return lambda f: np.asarray(np.exp(-2j * np.pi * f * seconds))


def butterworth(order: int, corner_Hz: float) -> Factor:
    b, a = signal.butter(order, 2.0 * np.pi * corner_Hz, analog=True)
    return lambda f: np.asarray(signal.freqs(b, a, 2.0 * np.pi * f)[1])


def second_order(corner_Hz: float, ratio: float = 0.7) -> Factor:
    return lambda f: np.asarray(1.0 / (1.0 + 2j * ratio * f / corner_Hz - (f / corner_Hz) ** 2))


def highpass(corner_Hz: float, ratio: float = 0.7) -> Factor:
    return lambda f: second_order(corner_Hz, ratio)(f) * -((f / corner_Hz) ** 2)


EVERY = ("Vs", "de", "da")
CASES: dict[str, tuple[tuple[str, ...], Factor, set[str]]] = {
    "skew of 20 us on Vs": (("Vs",), delay(20e-6), {"channel_latency_Vs"}),
    "skew of 20 us on de": (("de",), delay(20e-6), {"channel_latency_de"}),
    "filter of fourth order, 2.5 kHz, on Vs": (("Vs",), butterworth(4, 2500.0), {"channel_lowpass_Vs"}),
    "filter of second order, 3 kHz, on da": (("da",), second_order(3000.0, 0.707), {"channel_lowpass_da"}),
    "high-pass of second order, 8 Hz": (("Vs",), highpass(8.0), {"charge_highpass"}),
    "amplifier of second order, 1.8 kHz": (EVERY, second_order(1800.0), {"amplifier_second_order"}),
    "two whole samples on de": (("de",), delay(2e-4), {"sample_offset"}),
}


def put(given: Inputs, channels: tuple[str, ...], factor: Factor) -> Inputs:
    by = np.ones((given.A.f.size, len(given.A.channels)), dtype=complex)
    for c in channels:
        by[:, given.A.channels.index(c)] = factor(given.A.f)
    A, B = (replace(d, H=d.H * by, cov=d.cov * by[:, :, None] * by[:, None, :].conj()) for d in (given.A, given.B))
    return replace(given, A=A, B=B)


@pytest.mark.parametrize("case", CASES)
def test_is_named_for_what_it_is(case: str, recorded: Inputs) -> None:
    channels, factor, right = CASES[case]
    found = run(put(recorded, channels, factor), lambda _: None)
    names = {n.effect for n in found.named}
    assert names <= right
    assert right <= names or any(right & set(a.effects) for a in found.ambiguous)


def test_a_drift_between_records_is_no_effect(recorded: Inputs) -> None:
    """One per cent from one realisation to the other, within the tolerance of the model."""
    found = run(replace(recorded, B=replace(recorded.B, H=1.01 * recorded.B.H)), lambda _: None)
    assert not found.named
    assert not found.ambiguous


@pytest.mark.soak
def test_two_close_modes_of_the_bench(recorded: Inputs) -> None:
    """No single mode is two: nothing but a mode may be said, and none while its own band stays unexplained."""
    given, f = recorded, recorded.A.f
    static = given.model.frf(np.array([5.0]), channels=("da",))[0, 0].real
    two = sum(part * static * second_order(at, 0.01)(f) for part, at in ((0.01, 178.0), (0.008, 182.0)))
    more = np.column_stack([two if c != "Vs" else np.zeros_like(f) for c in given.A.channels])
    A, B = (replace(d, H=d.H + more) for d in (given.A, given.B))
    found = run(replace(given, A=A, B=B), lambda _: None)
    assert {n.effect for n in found.named} <= {"bench_mode"}
    if found.named:
        assert max(found.gap_after.channels[c].G for c in ("de", "da")) < 1.5
