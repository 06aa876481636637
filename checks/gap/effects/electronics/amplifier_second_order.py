"""The amplifier and its capacitive load are of second order: the output filter's inductance resonates with the stacks
([FL14] ch. 14: voltage amplifiers with an output filter)."""

from checks.gap.modelling.effect import Effect, Parameter, spread
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="amplifier_second_order",
    title="Amplifier of second order",
    does="w^2/(s^2 + 2 z w s + w^2) on every output",
    parameters=(
        Parameter(
            "f_Hz",
            lo=50.0,
            hi=200_000.0,
            off=float("inf"),
            start=5000.0,
            scale=300.0,
            sets=("amplifier.second_order_Hz",),
            grid=spread(400.0, 60_000.0, 12),
        ),
        Parameter(
            "damping_ratio",
            lo=5e-3,
            hi=0.99,
            off=0.7,
            start=0.5,
            scale=0.05,
            sets=("amplifier.second_order_damping_ratio",),
            grid=(0.3, 0.8),
            limit_at=0.7,
        ),
    ),
    channels=("Vs", "de", "da"),
    sign="all channels rise and fall together, as behind one second-order lag",
    sentence="The amplifier is a second-order lag of {f_Hz} Hz (damping ratio {damping_ratio}).",
    sources=("[FL14] ch. 14",),
    experiment=Experiment.DUMMY,
    lags=True,
)
