"""All channels come late by the same time ([STB] 6.1.2: a delay of one sample is added to the model; [FPW98] 4.3: a
hold delays by half a sample)."""

from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.usual_parameters import delay

EFFECT = Effect(
    name="loop_delay",
    title="Delay between the converters",
    does="exp(-s tau) on every output",
    parameters=(delay("delay.tau_us", 200.0, 400.0),),
    channels=("Vs", "de", "da"),
    sign="the phase of all channels falls in proportion to frequency, the magnitude stays",
    sentence="Every channel comes {tau_us} us later than the model says.",
    below="Every channel comes {tau_us} us earlier than the model says.",
    sources=("[STB] 6.1.2", "[FPW98] 4.3"),
    experiment=Experiment.DUMMY,
    lags=True,
)
