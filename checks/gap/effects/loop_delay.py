"""All channels come late by the same time ([STB], section 3.2.2: a delay of one sample is added to the model; Franklin,
Powell, Workman, Digital Control of Dynamic Systems, 3rd ed., 4.3: a hold delays by half a sample)."""

from checks.gap.modelling.effect import Effect, Parameter

EFFECT = Effect(
    name="loop_delay",
    title="Delay between the converters",
    parameters=(Parameter("tau_us", -500.0, 5000.0, 0.0, 0.0, 5.0, (-100.0, 0.0, 30.0, 100.0, 200.0, 400.0)),),
    channels=("Vs", "de", "da"),
    sign="the phase of all channels falls in proportion to frequency, the magnitude stays",
    sentence="Every channel comes {tau_us} us later than the model says.",
)
