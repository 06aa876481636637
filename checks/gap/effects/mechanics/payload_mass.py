"""The payload is heavier or lighter than in the model ([STB] 3.2.1: 5.7 kg; the axial resonance goes with the root of
stiffness over mass)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="payload_mass",
    title="Mass of the payload",
    does="mass of the payload, from the model's",
    parameters=(Parameter("kg", label="mass", lo=-5.0, hi=50.0, scale=0.1, adds=("bench.payload_kg",)),),
    channels=("da", "de", "Vs"),
    sign="the axial mode moves and everything above it scales, the static gain stays",
    sentence="The payload is {kg} kg heavier than the model says.",
    below="The payload is {kg} kg lighter than the model says.",
    sources=("[STB] 3.2.1",),
    experiment=Experiment.MASS,
)
