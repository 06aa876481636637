"""The gap workflow on units: what their responses show beyond a model, as a document, in words and in reports.

    done = analyse(unit, "strut", say=print)  # a unit's folder, or the unit as it was read
    done.document["verdict"], done.document["named"]  # the content of gap.json
    one_line(StartModel.at("strut").answer(done.document))  # as the key `gap` of a result, in a line
    [sentence.words for sentence in findings(done.document)]

    found = responses(unit)  # what it compares: `found.first`, and another realisation `found.second` or None

A `GapJob` writes gap.json, gap.pdf and the improved model; `explain_result` attaches the answer to a judgement. Words,
verdicts and pictures of stored documents are read without what searches."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from accept.gap.analyse_unit import GapAnalysis, GapJob, analyse
    from accept.gap.attach_to_result import explain_folder, explain_result, with_explanation
    from accept.gap.fleet import are_settled, common, lines
    from accept.gap.sketch import place_panel
    from accept.gap.start_model import StartModel, applies, stands
    from accept.gap.text import (
        G_NOTE,
        beside_truth,
        data_words,
        findings,
        gap_by_channel,
        gap_number,
        headline_of_document,
        one_line,
    )
    from accept.gap.unit_responses import Responses, responses
else:
    __getattr__ = door(__name__)
