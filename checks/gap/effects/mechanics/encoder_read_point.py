"""Head and ruler are not read at one point: the scale is glued, or the strip mounted, beside where the drawing says
([HEIDENHAIN-LIN] mounting; [STB] 6.2: what de reads of the strut's bending is the bending times this arm)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="encoder_read_point",
    title="Point where the ruler is read",
    does="where the ruler is read, from the model's place; for models with `ruler_arm_x_mm`, `ruler_arm_y_mm`",
    parameters=(
        Parameter("x_mm", lo=-60.0, hi=60.0, scale=0.5, adds=("encoder.ruler_arm_x_mm",)),
        Parameter("y_mm", lo=-60.0, hi=60.0, scale=0.5, adds=("encoder.ruler_arm_y_mm",)),
    ),
    channels=("de",),
    sign="de alone reads more or less of the strut's bending, at the modes' own frequencies",
    sentence="The ruler is read {x_mm} mm (x) and {y_mm} mm (y) off the place that the model states.",
    sources=("[HEIDENHAIN-LIN]", "[STB] 6.2"),
    experiment=Experiment.BARE,
)
