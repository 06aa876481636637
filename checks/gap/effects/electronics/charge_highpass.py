"""A charge amplifier, or a filter that takes a drift out, makes the high-pass of Vs one of second order ([FL14] ch. 5
for charge amplifiers of piezoelectric sensors)."""

from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.usual_parameters import corner_of_highpass, damping_of_filter

EFFECT = Effect(
    name="charge_highpass",
    title="High-pass of second order on the sensor",
    does="s^2/(s^2 + 2 z w s + w^2) on Vs",
    parameters=(
        corner_of_highpass("sensor.charge_highpass_Hz"),
        damping_of_filter("sensor.charge_highpass_damping_ratio", 0.6),
    ),
    channels=("Vs",),
    sign="Vs alone leads by up to half a turn and loses magnitude with the square of frequency towards low frequency",
    sentence="Vs runs through a second-order high-pass of {f_Hz} Hz (damping ratio {damping_ratio}).",
    sources=("[FL14] ch. 5",),
    experiment=Experiment.RESISTOR,
)
