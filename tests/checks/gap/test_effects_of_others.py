"""Effects of other packages: values stay within the declared bounds; one that cannot be evaluated is listed."""

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest

from accept.gap.analyse_unit import to_json
from accept.gap.document import candidates
from checks.fitting import Dataset
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.effect import Effect, Parameter, Values, spread
from checks.gap.modelling.experiment import Experiment
from checks.gap.workflow import run
from tests.checks.gap.shared.gap_cases import inputs, strut


def second_order(values: Values, s: np.ndarray) -> np.ndarray:
    """s^2 / (s^2 + 2 z w s + w^2)."""
    w = 2.0 * np.pi * values["f_Hz"]
    return s**2 / (s**2 + 2.0 * values["damping_ratio"] * w * s + w**2)


def effect(factor, grid: tuple[float, ...] = ()) -> Effect:
    return Effect(
        name="their_highpass",
        title="Their high-pass",
        parameters=(
            Parameter("f_Hz", lo=0.5, hi=200.0, off=0.0, start=5.0, scale=1.0, grid=spread(1.0, 100.0, 12)),
            Parameter("damping_ratio", lo=0.1, hi=2.0, off=0.7, start=0.7, scale=0.1, grid=grid),
        ),
        channels=("Vs",),
        sign="Vs falls by 40 dB a decade",
        sentence="A second-order high-pass of {f_Hz} Hz, damping ratio {damping_ratio}.",
        sources=("their manual",),
        experiment=Experiment.POINT,
        factor=factor,
    )


def test_what_cannot_be_linear_about_zero_is_not_taken_for_it() -> None:
    f, damping = effect(second_order).parameters
    assert not f.linear
    assert not damping.linear  # zero is out of its bounds
    assert damping.places == (0.7,)
    every = [p for e in EFFECTS.values() for p in e.parameters if not p.grid]
    assert all(p.linear for p in every)  # of the library nothing changes
    assert damping.inside(0.0) == 0.1


def test_a_derivative_at_a_bound_stays_within_it() -> None:
    seen: list[float] = []

    def watched(values: Values, s: np.ndarray) -> np.ndarray:
        seen.append(values["damping_ratio"])
        return second_order(values, s)

    theirs = effect(watched)
    f = np.geomspace(10.0, 300.0, 40)
    at = {"their_highpass.f_Hz": 8.0, "their_highpass.damping_ratio": 0.1}
    response = Augmented(strut(), (theirs,))
    D = response.jacobian(f, ["their_highpass.damping_ratio"], at, ("Vs", "de", "da"))
    assert min(seen) >= 0.1
    H = [response.frf(f, {**at, "their_highpass.damping_ratio": z}, ("Vs", "de", "da")) for z in (0.1, 0.1001)]
    np.testing.assert_allclose(D[0][:, 0], (H[1] - H[0])[:, 0] / 1e-4, rtol=0.02)  # one-sided, with a step of its own


def with_highpass(d: Dataset) -> Dataset:
    factor = np.ones(d.H.shape, dtype=complex)
    factor[:, d.channels.index("Vs")] = second_order({"f_Hz": 12.0, "damping_ratio": 0.7}, 2j * np.pi * d.f)
    return replace(d, H=d.H * factor)


@pytest.mark.slow
@pytest.mark.parametrize("broken", [False, True])
def test_within_bounds_it_is_named_and_else_listed(broken: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a grid the damping ratio was tried at zero, below its bound, gave NaN, and the effect went without a
    word."""
    seen: list[float] = []

    def factor(values: Values, s: np.ndarray) -> np.ndarray:
        seen.append(values["damping_ratio"])
        return second_order(values, s) * np.sqrt(np.float64(-1.0 if broken else 1.0))

    theirs = effect(factor)
    monkeypatch.setitem(EFFECTS, theirs.name, theirs)
    # The library's own effect of the same shape stands aside, and what would come near it.
    case = inputs(5, without=("charge_highpass", "sensor_highpass", "latency", "channel_lowpass"))
    case = replace(case, A=with_highpass(case.A), B=with_highpass(case.B))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = run(case, lambda _: None)
    assert 0.1 <= min(seen) <= max(seen) <= 2.0
    if not broken:
        assert [n.effect for n in result.named] == ["their_highpass"]
        values = result.named[0].parameters
        assert values["f_Hz"].value == pytest.approx(12.0, rel=0.02)
        assert values["damping_ratio"].value == pytest.approx(0.7, rel=0.05)
        return
    listed = [(words, why) for words, *_, why in candidates(result)]
    assert any("their highpass" in words and "could not be evaluated" in why for words, why in listed), listed
    document = json.loads(json.dumps(to_json("S-1", result), allow_nan=False))
    (row,) = (c for c in document["candidates"] if "their_highpass" in c["effect"])
    assert row["p"] is None
    assert "not finite" in row["reason"]
