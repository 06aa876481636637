"""The encoder's head sits on a bracket with a resonance of its own, which filters de alone (Ewins, Modal Testing, 2nd
ed., 3.4: a transducer on a flexible mount reads the mount's resonance; [STB], section 5.3 for the encoder's holder)."""

from checks.gap.modelling.effect import Effect, Parameter, spread

EFFECT = Effect(
    name="encoder_bracket_mode",
    title="Mode of the encoder's bracket",
    parameters=(
        Parameter("f_Hz", 30.0, 100_000.0, float("inf"), 2000.0, 20.0, spread(60.0, 12_000.0, 36)),
        Parameter("damping_ratio", 5e-4, 0.5, 0.01, 0.02, 0.005, (0.01, 0.05)),
    ),
    channels=("de",),
    sign="de alone is multiplied by a second-order resonance that goes to one at low frequency",
    sentence="The encoder's bracket resonates at {f_Hz} Hz (damping ratio {damping_ratio}).",
)
