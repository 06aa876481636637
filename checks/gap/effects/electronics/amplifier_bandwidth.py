"""The amplifier drives a capacitive load and is of limited bandwidth: a first-order lag in every channel ([FL14] ch.
14; [STB] 2.2 for the amplifier's load)."""

from checks.gap.modelling.effect import Effect, Parameter, spread
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="amplifier_bandwidth",
    title="Bandwidth of the amplifier",
    does="1/(1 + s/w) on every output",
    parameters=(
        Parameter(
            "f_Hz",
            lo=50.0,
            hi=200_000.0,
            off=float("inf"),
            start=5000.0,
            scale=300.0,
            sets=("amplifier.f_Hz",),
            grid=spread(400.0, 60_000.0, 12),
        ),
    ),
    channels=("Vs", "de", "da"),
    sign="all channels lose magnitude and phase together, as behind one first-order lag",
    sentence="The amplifier is a first-order lag of {f_Hz} Hz.",
    sources=("[FL14] ch. 14", "[STB] 2.2"),
    experiment=Experiment.DUMMY,
    lags=True,
)
