"""The bench itself has a mode that both displacement sensors see ([STB] 3.2: the double resonance at 95 and 105
Hz was not explained; Ewins, Modal Testing, 2nd ed., 3.10: a support that is not rigid adds its own resonance)."""

from checks.gap.modelling.effect import Effect, Parameter, spread

EFFECT = Effect(
    name="bench_mode",
    title="Mode of the bench",
    parameters=(
        Parameter("f_Hz", 10.0, 1800.0, 100.0, 100.0, 1.0, spread(15.0, 1500.0, 40)),
        Parameter("ratio", -5.0, 5.0, 0.0, 0.0, 0.01),
        Parameter("damping_ratio", 5e-4, 0.3, 0.01, 0.015, 0.005, (0.006, 0.02)),
    ),
    channels=("de", "da"),
    sign="the same resonance adds to de and da, with the same residue; Vs does not show it",
    sentence="The bench has a mode at {f_Hz} Hz (damping ratio {damping_ratio}) adding {ratio} of the static motion.",
)
