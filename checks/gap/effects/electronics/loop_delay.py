"""All channels come late by the same time ([STB] 6.1.2: a delay of one sample is added to the model; [FPW98] 4.3: a
hold delays by half a sample)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="loop_delay",
    title="Delay between the converters",
    does="exp(-s tau) on every output",
    parameters=(
        Parameter(
            "tau_us",
            lo=-500.0,
            hi=5000.0,
            scale=5.0,
            sets=("delay.tau_us",),
            grid=(-100.0, 0.0, 30.0, 100.0, 200.0, 400.0),
        ),
    ),
    channels=("Vs", "de", "da"),
    sign="the phase of all channels falls in proportion to frequency, the magnitude stays",
    sentence="Every channel comes {tau_us} us later than the model says.",
    below="Every channel comes {tau_us} us earlier than the model says.",
    sources=("[STB] 6.1.2", "[FPW98] 4.3"),
    experiment=Experiment.DUMMY,
    lags=True,
)
