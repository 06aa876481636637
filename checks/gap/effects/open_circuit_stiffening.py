"""A stack without a path for its charge is stiffer (IEEE Std 176-1987, section 2; [STB], section 3.1.8: 2.3 N/um open
and 1.7 connected)."""

from checks.gap.modelling.effect import Effect, Parameter

EFFECT = Effect(
    name="open_circuit_stiffening",
    title="Stiffening by the open circuit",
    parameters=(Parameter("ratio", -0.5, 5.0, 0.0, 0.0, 0.02),),
    channels=("Vs", "da"),
    sign="the axial mode and the zero of Vs move up together, with less motion per volt",
    sentence="The sensor stack, open, is stiffer by {ratio} (relative).",
)
