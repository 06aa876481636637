"""Model against data: where they disagree, which effect is missing, and how sure that is.

    inputs = Inputs(model=model, A=first, B=second, fs=10_000.0, merge_Hz=350.0)  # one to fit, one to judge with
    result = run(inputs, say=print)
    result.verdict == GapVerdict.NO_MISSING  # model and data agree
    [(n.effect, n.parameters) for n in result.named]
    [(t.names, t.delta_lnL, t.p) for t in result.tried]
    bode_panels(result)  # to draw

    EFFECTS["crosstalk"].sign  # where an effect shows
    with_effects(model, [("crosstalk", {"V_per_V": 0.01})])  # the model with an effect built in

Records that cannot be compared with a model raise `GapRefused`."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from checks.gap.conditions.kinds import EXPERIMENT_KINDS, ExperimentKind
    from checks.gap.conditions.trial import ConditionTrial, GapRefused, under_experiment
    from checks.gap.decision.bode_panels import bode_panels
    from checks.gap.decision.made_again import contradictions, picture_again
    from checks.gap.decision.next_experiment import every_experiment
    from checks.gap.decision.panels import channel_errors, gap_panels
    from checks.gap.decision.result import GapVerdict, Result, Tested, Tried
    from checks.gap.effects import EFFECTS, effect_named, with_effects
    from checks.gap.empirical import FittedElement, fit_element
    from checks.gap.modelling.effect import Parameter
    from checks.gap.preparation.inputs import Inputs
    from checks.gap.workflow import run
else:
    __getattr__ = door(__name__)
