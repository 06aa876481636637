"""The encoder's head and ruler weigh more or less than in the model ([STB] 5.1.1 and 5.1.2: the encoder's mass moves
the strut's modes from 227, 337, 398 to 197, 290, 376 Hz)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="encoder_mass",
    title="Mass of the encoder",
    does="mass of the encoder, from the model's",
    parameters=(
        Parameter(
            "kg",
            label="mass",
            lo=-0.07,
            hi=0.5,
            scale=0.005,
            adds=("encoder.head_mass_kg", "encoder.ruler_mass_kg"),
        ),
    ),
    channels=("de",),
    sign="the strut's bending modes move together, the axial mode stays",
    sentence="Head and ruler each weigh {kg} kg more than the model says.",
    below="Head and ruler each weigh {kg} kg less than the model says.",
    sources=("[STB] 5.1.1", "[STB] 5.1.2"),
    experiment=Experiment.BARE,
)
