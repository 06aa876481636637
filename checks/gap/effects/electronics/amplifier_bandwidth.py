"""The amplifier drives a capacitive load and is of limited bandwidth: a first-order lag in every channel ([FL14] ch.
14; [STB] 2.2 for the amplifier's load)."""

from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.usual_parameters import corner_of_lag

EFFECT = Effect(
    name="amplifier_bandwidth",
    title="Bandwidth of the amplifier",
    does="1/(1 + s/w) on every output",
    parameters=(corner_of_lag("amplifier.f_Hz", 60_000.0, 12),),
    channels=("Vs", "de", "da"),
    sign="all channels lose magnitude and phase together, as behind one first-order lag",
    sentence="The amplifier is a first-order lag of {f_Hz} Hz.",
    sources=("[FL14] ch. 14", "[STB] 2.2"),
    experiment=Experiment.DUMMY,
    lags=True,
)
