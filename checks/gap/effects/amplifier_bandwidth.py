"""The amplifier drives a capacitive load and is of limited bandwidth: a first-order lag in every channel (Fleming &
Leang, Design, Modeling and Control of Nanopositioning Systems, 2014, ch. 14; [STB], section 2.1 for the amplifier's
load)."""

from checks.gap.modelling.effect import Effect, Parameter, spread

EFFECT = Effect(
    name="amplifier_bandwidth",
    title="Bandwidth of the amplifier",
    parameters=(Parameter("f_Hz", 50.0, 200_000.0, float("inf"), 5000.0, 300.0, spread(400.0, 60_000.0, 12)),),
    channels=("Vs", "de", "da"),
    sign="all channels lose magnitude and phase together, as behind one first-order lag",
    sentence="The amplifier is a first-order lag of {f_Hz} Hz.",
)
