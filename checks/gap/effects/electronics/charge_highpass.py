"""A charge amplifier, or a filter that takes a drift out, makes the high-pass of Vs one of second order ([FL14] ch. 5
for charge amplifiers of piezoelectric sensors)."""

from checks.gap.modelling.effect import Effect, Parameter, spread
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="charge_highpass",
    title="High-pass of second order on the sensor",
    does="s^2/(s^2 + 2 z w s + w^2) on Vs",
    parameters=(
        Parameter(
            "f_Hz",
            lo=0.0,
            hi=500.0,
            start=2.0,
            scale=0.2,
            sets=("sensor.charge_highpass_Hz",),
            grid=spread(0.1, 100.0, 13),
        ),
        Parameter(
            "damping_ratio",
            lo=5e-3,
            hi=0.99,
            off=0.7,
            start=0.6,
            scale=0.05,
            sets=("sensor.charge_highpass_damping_ratio",),
            grid=(0.3, 0.8),
            limit_at=0.7,
        ),
    ),
    channels=("Vs",),
    sign="Vs alone leads by up to half a turn and loses magnitude with the square of frequency towards low frequency",
    sentence="Vs runs through a second-order high-pass of {f_Hz} Hz (damping ratio {damping_ratio}).",
    sources=("[FL14] ch. 5",),
    experiment=Experiment.RESISTOR,
)
