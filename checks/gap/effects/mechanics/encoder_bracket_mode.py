"""The encoder's head sits on a bracket with a resonance of its own, which filters de alone ([EWINS00] 3.4: a transducer
on a flexible mount reads the mount's resonance; [STB] 5.1.2 for the encoder fixed to the strut)."""

from checks.gap.modelling.effect import Effect, Parameter, spread
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="encoder_bracket_mode",
    title="Mode of the encoder's bracket",
    does="multiplies de by w^2/(s^2 + 2 z w s + w^2)",
    parameters=(
        Parameter(
            "f_Hz",
            lo=30.0,
            hi=100_000.0,
            off=float("inf"),
            start=2000.0,
            scale=20.0,
            sets=("encoder.bracket_Hz",),
            grid=spread(60.0, 12_000.0, 36),
        ),
        Parameter(
            "damping_ratio",
            lo=5e-4,
            hi=0.5,
            off=0.01,
            start=0.02,
            scale=0.005,
            sets=("encoder.bracket_damping_ratio",),
            grid=(0.01, 0.05),
        ),
    ),
    channels=("de",),
    sign="de alone is multiplied by a second-order resonance that goes to one at low frequency",
    sentence="The encoder's bracket resonates at {f_Hz} Hz (damping ratio {damping_ratio}).",
    sources=("[EWINS00] 3.4", "[STB] 5.1.2"),
    experiment=Experiment.POINT,
)
