"""`accept gap --empirical`: something for the simulation where there is no name, labelled, and never worse."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from accept.gap.improved_model import write_with_elements
from accept.gap.text import AT_EDGE, poles_of
from accept.gap.unit_responses import Responses
from accept.models.model_file import open_model, open_model_file
from checks.errors import ModelError
from checks.fitting import Dataset
from checks.gap import Inputs, fit_element, run
from checks.model import UnidentifiedElement
from checks.model.time.partial_fractions import paths
from tests.checks.gap.shared.gap_cases import CHANNELS, FS, TOLERANCE, F, recorded
from validation.rational import lowpass, resonance

GIVEN = {"channel": "Vs", "gain": 1.0, "poles": [[620.0, 0.02]], "zeros": [[630.0, 0.03]]}


def outside(data: Dataset, channel: str, factor: np.ndarray) -> Dataset:
    """A channel times what no library holds."""
    by = np.where(np.array(CHANNELS) == channel, factor[:, None], 1.0)
    return replace(data, H=data.H * by)


@pytest.mark.parametrize(
    ("channel", "shape"), [("Vs", resonance(620.0, 0.01, 0.04, 1.0)), ("de", lowpass(1500.0)), ("da", lowpass(2500.0))]
)
def test_effects_of_the_independent_simulation(channel: str, shape: object) -> None:
    """`validation.effects.OUTSIDE`: a resonance on one channel, a first-order lag. The rest is noise: G at most 1."""
    strut = open_model("strut")
    H, factor = strut.frf(F, channels=CHANNELS), shape.frf(F)[0]
    A, B = (outside(replace(recorded(strut, s), tolerance=0.003), channel, factor) for s in (1, 2))
    c = CHANNELS.index(channel)
    found = fit_element(channel, H[:, c], A, B, H[:, c])
    assert found is not None
    truth = H[:, c] * factor
    left = np.abs(H[:, c] * found.element.factor(F) - truth) ** 2 / B.variance[:, c]
    assert np.mean(left) < 0.3
    assert found.covariance.shape == (1 + 4 * len(found.element.poles),) * 2


def test_nothing_is_added_to_noise() -> None:
    """Each draw would have to gain 12.5 of log-likelihood on records that were not fitted."""
    strut = open_model("strut")
    H = strut.frf(F, channels=CHANNELS)[:, 0]
    for seed in range(4):
        A, B = (replace(recorded(strut, 2 * seed + k), tolerance=0.0) for k in (0, 1))
        assert fit_element("Vs", H, A, B, H) is None


def test_written_reopened_and_never_worse(tmp_path: Path) -> None:
    given = open_model_file("strut")
    given = replace(given, model=replace(given.model, tolerance=TOLERANCE))
    factor = resonance(620.0, 0.01, 0.05, 1.0).frf(F)[0]
    A, B = (outside(recorded(given.model, s), "Vs", factor) for s in (1, 2))
    inputs = Inputs(given.model, A, B, FS)
    result = run(inputs, lambda _: None)
    assert not result.named
    (left,) = (u for u in result.unnamed if u.channel == "Vs")
    (lo, hi) = left.ci95[0]
    assert lo - (hi - lo) < 620.0 < hi + (hi - lo)  # three times as wide it must hold the truth
    assert not left.at_edge
    added = write_with_elements(tmp_path / "model.toml", given, Responses("S", "strut", A, B, 350.0), result, inputs)
    assert [a.channel for a in added if a.fitted is not None] == ["Vs"]
    assert all(a.after <= a.before for a in added)
    model = open_model(tmp_path / "model.toml")
    error = np.abs(model.frf(F, channels=("Vs",))[:, 0] - given.model.frf(F, channels=("Vs",))[:, 0] * factor)
    assert np.median(error / np.abs(B.H[:, 0])) < TOLERANCE
    assert "unidentified" not in [n.effect for n in result.named]
    json.dumps([a.document for a in added], allow_nan=False)
    again = run(replace(inputs, model=replace(model, tolerance=TOLERANCE)), lambda _: None)
    assert again.verdict == "no_missing_effect"


def test_the_response_in_time_is_that_in_frequency() -> None:
    strut = open_model("strut")
    model = replace(strut, values=strut.values | UnidentifiedElement.of_entry(GIVEN, "file").values())
    f = np.array([50.0, 610.0, 620.0, 635.0, 900.0])
    expected = model.frf(f, channels=("Vs",))[:, 0]
    np.testing.assert_allclose(paths(model)["Vs"].at(2j * np.pi * f), expected, rtol=1e-9)
    assert np.max(np.abs(expected / strut.frf(f, channels=("Vs",))[:, 0] - 1.0)) > 0.1


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"channel": "Va"}, "channel is 'Va'; expected Vs, de or da"),
        ({"gain": 0.0}, "gain is 0.0; expected a number above 0"),
        ({"zeros": []}, "1 poles and 0 zeros; expected as many of each"),
        ({"poles": [[620.0, -0.1]]}, "would not be stable"),
        ({"poles": [[620.0]]}, "expected [frequency in Hz, damping ratio]"),
        ({"poles": 3}, "poles is 3; expected a list"),
        ({"mass": 3}, "unknown mass"),
    ],
)
def test_what_is_wrong_in_a_file_is_said(change: dict, said: str) -> None:
    with pytest.raises(ModelError) as e:
        UnidentifiedElement.of_entry(GIVEN | change, "file")
    assert said in str(e.value)


def test_values_and_back() -> None:
    one = UnidentifiedElement.of_entry(GIVEN, "file")
    assert isinstance(one, UnidentifiedElement)
    np.testing.assert_allclose(one.factor(np.array([0.0])), 1.0)


@pytest.mark.parametrize(("pole_Hz", "end"), [(1.02, -1), (0.98, 0)])
def test_a_pole_at_an_end_of_the_band_is_called_that(pole_Hz: float, end: int) -> None:
    """A resonance beyond an end of the band shows as a slope towards it: where its pole is cannot be said."""
    strut = open_model("strut")
    factor = resonance(pole_Hz * F[end], 0.01, 0.3, 1.0).frf(F)[0]
    given = [outside(replace(recorded(strut, s), tolerance=TOLERANCE), "Vs", factor) for s in (1, 2)]
    result = run(Inputs(strut, *given, FS), lambda _: None)
    (left,) = (u for u in result.unnamed if u.channel == "Vs")
    assert left.at_edge
    assert AT_EDGE in poles_of(left.poles_Hz, left.ci95, left.at_edge)
