"""Any structure given by M, C, K: the place, the kind and the values of what its model lacks.

    frame = LinearModel("frame", M, C, K, drive=tip, sensors={"tip": tip}, points={"tip": {"x": tip}}, tolerance=0.01)
    f, H = first.f, frame.frf(first.f)  # (F,) [Hz], (F, C); `shares` of M, C, K are known to an sd, the rest exactly
    answer = explain_linear(frame, first, second)  # two sets of responses: one to fit, one to judge with
    answer.verdict, [e.sentence for e in answer.elements]
    answer.only_in  # channels in whose path it lies, if nothing explains the records

The search is that of struts (`checks.gap`); no name of its library takes part."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from checks.gap.structures.explain import LinearAnswer, explain_linear
    from checks.gap.structures.linear_model import LinearModel, Share, modal_dampers
else:
    __getattr__ = door(__name__)
