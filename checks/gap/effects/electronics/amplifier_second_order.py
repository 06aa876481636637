"""The amplifier and its capacitive load are of second order: the output filter's inductance resonates with the stacks
([FL14] ch. 14: voltage amplifiers with an output filter)."""

from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.usual_parameters import corner_of_lag, damping_of_filter

EFFECT = Effect(
    name="amplifier_second_order",
    title="Amplifier of second order",
    does="w^2/(s^2 + 2 z w s + w^2) on every output",
    parameters=(
        corner_of_lag("amplifier.second_order_Hz", 60_000.0, 12),
        damping_of_filter("amplifier.second_order_damping_ratio", 0.5),
    ),
    channels=("Vs", "de", "da"),
    sign="all channels rise and fall together, as behind one second-order lag",
    sentence="The amplifier is a second-order lag of {f_Hz} Hz (damping ratio {damping_ratio}).",
    sources=("[FL14] ch. 14",),
    experiment=Experiment.DUMMY,
    lags=True,
)
