"""The sensor stack's wires are exchanged, so Vs has the wrong sign ([STB] 4.1: the model shows the opposite sign in Vs,
corrected by the sign of gs)."""

from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="sensor_polarity",
    title="Polarity of the sensor",
    does="turns the sign of Vs",
    turns=("constants.gs_V_per_m", "constants.gs_V_per_N"),
    channels=("Vs",),
    sign="only Vs is reversed (180 degrees at every frequency)",
    sentence="The sensor stack is connected with reversed polarity.",
    sources=("[STB] 4.1",),
    experiment=Experiment.UNPLUG,
)
