"""A channel is sampled later than Va: its converter, its interpolator or its filter takes some microseconds more
([FPW98] 4.3 for delays of converters; [HEIDENHAIN-LIN] for the time that an interpolation takes). One effect for each
channel, because channels have converters of their own."""

from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.usual_parameters import delay
from checks.model.channel_paths import CHANNELS


def _of_channel(channel: str) -> Effect:
    return Effect(
        name=f"channel_latency_{channel}",
        title=f"Latency of {channel}",
        does=f"exp(-s tau) on {channel}",
        parameters=(delay(f"bench.latency_{channel}_us"),),
        channels=(channel,),
        sign=f"the phase of {channel} alone falls in proportion to frequency, its magnitude stays",
        sentence=f"{channel} is sampled {{tau_us}} us later than the model says.",
        below=f"{channel} is sampled {{tau_us}} us earlier than the model says.",
        sources=("[FPW98] 4.3", "[HEIDENHAIN-LIN]"),
        experiment=Experiment.LOOP_BACK,
        lags=True,
    )


EFFECTS = tuple(_of_channel(c) for c in CHANNELS)
