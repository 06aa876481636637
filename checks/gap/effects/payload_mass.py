"""The payload is heavier or lighter than the model says ([STB] 3.2.1: 5.7 kg; the axial resonance goes with the
root of stiffness over mass)."""

from checks.gap.modelling.effect import Effect, Parameter

EFFECT = Effect(
    name="payload_mass",
    title="Mass of the payload",
    parameters=(Parameter("kg", -5.0, 50.0, 0.0, 0.0, 0.1),),
    channels=("da", "de", "Vs"),
    sign="the axial mode moves and everything above it scales, the static gain stays",
    sentence="The payload is {kg} kg heavier than the model says.",
    alias=("bench.payload_kg",),
)
