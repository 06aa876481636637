"""Part of the amplifier's output couples into the sensor's wire and adds to Vs at every frequency ([PREUMONT18] 3.9:
feedthrough moves the zeros of a collocated pair; [STB] 3.2.4 for Vs). The capacitance between the cables does so: with
the sensor stack, a capacitor above 0.4 Hz, it divides the drive."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="crosstalk",
    title="Cross-talk into the sensor",
    does="adds this share of the amplifier's output (20 Va) to Vs",
    parameters=(
        Parameter("V_per_V", label="coupling", lo=-1.0, hi=1.0, scale=1e-3, sets=("sensor.crosstalk_V_per_V",)),
    ),
    channels=("Vs",),
    sign="the zeros of Vs move, its poles stay; the same constant is missing at every frequency",
    sentence="{V_per_V} of the amplifier's output adds to Vs.",
    sources=("[PREUMONT18] 3.9", "[STB] 3.2.4"),
    experiment=Experiment.UNPLUG,
)
