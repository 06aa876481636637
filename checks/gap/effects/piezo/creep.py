"""The piezo creeps: after a step the displacement goes on with the logarithm of time ([JG00]; [STB] 3.1.7: creep is
visible in the mass steps). per_decade: of what follows at once, taken at 10 us.

In the responses that is a slope in log frequency with the lag that belongs to it: relaxations 1/(1 + s tau), equally
strong in every decade from 10 us to 1000 s, add up to log10(tau2 / tau1) - log10((1 + s tau2) / (1 + s tau1)).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from checks.gap.modelling.effect import Effect, Parameter, SlowRecord
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.slow_sines import Slow
from checks.model.time.hysteresis_creep import creep

FASTEST_S, SLOWEST_S = 1e-5, 1e3
WITHIN = 0.3  # of the opening: creep from minutes to milliseconds is not quite one number per decade


def factor(values: Mapping[str, float], s: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the factor (F,) on every channel."""
    decades = np.log10(SLOWEST_S / FASTEST_S) - np.log10((1.0 + s * SLOWEST_S) / (1.0 + s * FASTEST_S))
    return np.asarray(1.0 + values["per_decade"] * decades)


def _contradicts(slow: Slow, values: Mapping[str, float]) -> str:
    """Return why slow loops contradict values of creep, or "": their opening must be the sine of creep's lag, equal at
    every amplitude."""
    lag = -float(np.angle(factor(values, np.array([2j * np.pi * slow.f_Hz]))[0]))
    unsure = WITHIN * abs(np.sin(lag)) + 6.0 * slow.constant.u + 0.1 * abs(slow.grows.value)
    agrees = abs(slow.constant.value - np.sin(lag)) < unsure
    return "" if agrees else "would open the loops of the slow sines otherwise than they are"


EFFECT = Effect(
    name="creep",
    title="Creep",
    does="displacement that goes on with the logarithm of time",
    parameters=(Parameter("per_decade", lo=-0.2, hi=0.2, off=0.0, start=0.0, scale=0.01),),
    channels=("Vs", "de", "da"),
    sign="every channel falls with log frequency and lags by the same angle; slow loops are as wide at every amplitude",
    sentence="The displacement creeps by {per_decade} per decade of time.",
    sources=("[JG00]", "[STB] 3.1.7"),
    experiment=Experiment.LEVEL,
    factor=factor,
    slow=SlowRecord(contradicts=_contradicts),
    path=lambda values: creep(values["per_decade"]),
)
