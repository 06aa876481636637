"""The capacitance between the cables of drive and sensor lets the derivative of the drive into Vs ([OTT09] ch. 2:
capacitive coupling into a resistor grows in proportion to frequency)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="sensor_pickup",
    title="Capacitive pick-up of the sensor",
    does="adds tau times the derivative of the amplifier's output (20 Va) to Vs",
    parameters=(
        Parameter(
            "tau_us",
            label="coupling",
            lo=-1000.0,
            hi=1000.0,
            off=0.0,
            start=0.0,
            scale=0.1,
            sets=("sensor.pickup_us",),
        ),
    ),
    channels=("Vs",),
    sign="the zeros of Vs move, its poles stay; what is missing grows in proportion to frequency",
    sentence="The derivative of the amplifier's output, times {tau_us} us, adds to Vs.",
    sources=("[OTT09] ch. 2",),
    experiment=Experiment.UNPLUG,
)
