"""The encoder's scale is off: grating pitch, interpolation or cosine error of its mounting ([HEIDENHAIN-LIN] accuracy;
[STB] 5.1.2 compares encoder and interferometer)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="encoder_scale",
    title="Scale of the encoder",
    does="multiplies de by 1 + relative",
    parameters=(Parameter("relative", lo=-0.9, hi=5.0, scale=0.01, sets=("encoder.scale",)),),
    channels=("de",),
    sign="de alone is larger or smaller by one factor at every frequency",
    sentence="The encoder's scale is off by {relative} (relative).",
    sources=("[HEIDENHAIN-LIN]", "[STB] 5.1.2"),
    experiment=Experiment.POINT,
)
