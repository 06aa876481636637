"""The sensor stack's capacitance discharges through the resistor across it: a first-order high-pass on Vs alone ([STB]
3.1.9: 80.6 kOhm with 5.1 uF, 0.39 Hz)."""

from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.usual_parameters import corner_of_highpass

EFFECT = Effect(
    name="sensor_highpass",
    title="High-pass of the sensor",
    does="s/(s + w) on Vs",
    parameters=(corner_of_highpass("sensor.highpass_Hz"),),
    channels=("Vs",),
    sign="Vs alone leads in phase and loses magnitude towards low frequency",
    sentence="Vs runs through a high-pass of {f_Hz} Hz (sensor stack and its resistor).",
    sources=("[STB] 3.1.9",),
    experiment=Experiment.RESISTOR,
)
