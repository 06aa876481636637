"""The bench itself has a mode that both displacement sensors see ([STB] 3.2.3: the double resonance at 95 and 105 Hz
was not explained; [EWINS00] 3.10: a support that is not rigid adds its own resonance)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.usual_parameters import damping_of_mode, frequency_of_mode

EFFECT = Effect(
    name="bench_mode",
    title="Mode of the bench",
    does="adds ratio g0 w^2/(s^2 + 2 z w s + w^2) to de and da, g0 the static gain of da",
    parameters=(
        frequency_of_mode("bench.mode_Hz", 100.0),
        Parameter("ratio", lo=-5.0, hi=5.0, scale=0.01, sets=("bench.mode_ratio",)),
        damping_of_mode("bench.mode_damping_ratio"),
    ),
    channels=("de", "da"),
    sign="the same resonance adds to de and da, with the same residue; Vs does not show it",
    sentence="The bench has a mode at {f_Hz} Hz (damping ratio {damping_ratio}). "
    "It adds {ratio} times the static motion.",
    sources=("[STB] 3.2.3", "[EWINS00] 3.10"),
    experiment=Experiment.POINT,
)
