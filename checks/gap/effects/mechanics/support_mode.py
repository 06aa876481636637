"""The payload's guide or the support of the strut gives way: a resonance that each channel sees in its own part
([EWINS00] 3.2: a support that is not rigid adds its own resonance; [STB] 3.2.3). The mode of the bench that de
and da see alike, and Vs does not, is `bench_mode`.

With a residue of its own in each channel it is what any small oscillator beside the strut does: a mass on a spring that
hangs on the head, a cable, a payload that tilts. Blind units with such a mass were called a support, and what was left
a misalignment. So it is not searched for: what it explains is shown as a pole without a name."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.usual_parameters import damping_of_mode, frequency_of_mode
from checks.model.channel_paths import CHANNELS

EFFECT = Effect(
    name="support_mode",
    title="Mode of the support",
    does="adds ratio g0 w^2/(s^2 + 2 z w s + w^2) to each channel, g0 its own static gain",
    parameters=(
        frequency_of_mode("bench.support_mode_Hz", 400.0),
        *(
            Parameter(f"ratio_{channel}", lo=-5.0, hi=5.0, scale=0.01, sets=(f"bench.support_mode_ratio_{channel}",))
            for channel in CHANNELS
        ),
        damping_of_mode("bench.support_mode_damping_ratio"),
    ),
    channels=CHANNELS,
    sign="one resonance adds to every channel, with a residue of its own in each",
    sentence="A support gives way at {f_Hz} Hz (damping ratio {damping_ratio}). It adds {ratio_Vs} to Vs, {ratio_de} "
    "to de and {ratio_da} to da, in parts of each one's static response.",
    sources=("[EWINS00] 3.2", "[STB] 3.2.3"),
    experiment=Experiment.TURN,
    resembles="any small oscillator on the strut: a mass on a spring, a cable, a payload that tilts",
)
