"""A low-pass against aliasing before the converter of one channel ([OPPENHEIM10] 4.8 and 7.2: a Butterworth filter; far
below its corner it is a delay and nothing else). One effect for each channel."""

from checks.gap.modelling.effect import Effect, Parameter, spread
from checks.gap.modelling.experiment import Experiment
from checks.model.channel_paths import CHANNELS


def _of_channel(channel: str) -> Effect:
    return Effect(
        name=f"channel_lowpass_{channel}",
        title=f"Low-pass of {channel}",
        does=f"Butterworth low-pass on {channel}; `order` is a real number, near a whole one if the band shows it",
        parameters=(
            Parameter(
                "f_Hz",
                lo=50.0,
                hi=200_000.0,
                off=float("inf"),
                start=5000.0,
                scale=300.0,
                sets=(f"bench.lowpass_{channel}_Hz",),
                grid=spread(400.0, 30_000.0, 10),
            ),
            Parameter(
                "order",
                lo=1.0,
                hi=8.0,
                off=2.0,
                start=2.4,
                scale=0.5,
                sets=(f"bench.lowpass_{channel}_order",),
                grid=(1.4, 3.6),
                limit_at=2.0,
            ),
        ),
        channels=(channel,),
        sign=f"{channel} alone loses phase, and close to the corner magnitude, as behind a Butterworth filter",
        sentence=f"{channel} runs through a low-pass of {{f_Hz}} Hz, order {{order}}.",
        sources=("[OPPENHEIM10] 7.2",),
        experiment=Experiment.LOOP_BACK,
        lags=True,
    )


EFFECTS = tuple(_of_channel(c) for c in CHANNELS)
