"""The encoder's scale is off: grating pitch, interpolation or cosine error of its mounting (Heidenhain, Encoders for
Linear Positioning, accuracy; [STB], section 5.1.4 compares encoder and interferometer)."""

from checks.gap.modelling.effect import Effect, Parameter

EFFECT = Effect(
    name="encoder_scale",
    title="Scale of the encoder",
    parameters=(Parameter("relative", -0.9, 5.0, 0.0, 0.0, 0.01),),
    channels=("de",),
    sign="de alone is larger or smaller by one factor at every frequency",
    sentence="The encoder's scale is off by {relative} (relative).",
)
