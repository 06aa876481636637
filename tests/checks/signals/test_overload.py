"""Clipping, told from what only looks like it: crests of sines, noise, coarse steps."""

import numpy as np
import pytest

from checks.cause import Cause
from checks.signals.record_checks import overload

T = np.arange(200_000) * 1e-4
RNG = np.random.default_rng(4)
FINE, COARSE = 1e-3, 0.05


def signals() -> dict[str, np.ndarray]:
    sweep = np.sin(2 * np.pi * (2 * T + 4 * T**2))
    return {
        "sine": np.sin(2 * np.pi * 3 * T),
        "sweep": sweep,
        "noise": RNG.standard_normal(T.size) / 4,
        "resonance passed": sweep * np.exp(-(((T - 9) / 1.5) ** 2)),
        "sine and noise": np.sin(2 * np.pi * 3 * T) + 0.01 * RNG.standard_normal(T.size),
    }


@pytest.mark.parametrize("step", [FINE, COARSE])
@pytest.mark.parametrize("name", signals())
def test_whole_signals_are_let_through(name: str, step: float) -> None:
    assert overload("Vs", step * np.round(signals()[name] / step)) == ()


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("name", signals())
def test_clipped_ones_are_named(name: str, side: float) -> None:
    x = side * FINE * np.round(signals()[name] / FINE)
    for end, clipped in (("largest", np.minimum(x, 0.5 * x.max())), ("smallest", np.maximum(x, 0.5 * x.min()))):
        (reason,) = overload("Vs", clipped)
        assert reason.cause is Cause.CHANNEL_CLIPPED
        assert (reason.parameters["channel"], reason.parameters["end"]) == ("Vs", end)
        assert reason.parameters["value"] == pytest.approx(clipped.max() if end == "largest" else clipped.min())
