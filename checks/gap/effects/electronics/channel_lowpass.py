"""A low-pass against aliasing before the converter of one channel ([OPPENHEIM10] 4.8 and 7.2: a Butterworth filter; far
below its corner it is a delay and nothing else). One effect for each channel."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.usual_parameters import corner_of_lag
from checks.model.channel_paths import CHANNELS


def _of_channel(channel: str) -> Effect:
    return Effect(
        name=f"channel_lowpass_{channel}",
        title=f"Low-pass of {channel}",
        does=f"Butterworth low-pass on {channel}; `order` is a real number, near a whole one if the band shows it",
        parameters=(
            corner_of_lag(f"bench.lowpass_{channel}_Hz", 30_000.0, 10),
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
