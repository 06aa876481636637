"""What to do stands beside every failure and every missing result, in the lines of a batch and on the certificate's
page; what several findings share is said once, and whole."""

import io
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pypdf import PdfReader

from accept.base.documents.document import DocumentError
from accept.base.documents.results import UnitRecord
from accept.batch.table import reasons
from accept.certificate.page.document import render
from accept.judging.advice import ADVICE, stored_advice
from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, because, together
from tests.accept.certificate.certificate_help import certificate_contents, result

OFFSET = because(Cause.CHANNEL_OFFSET, record="low", channel="de", other="da", samples=3.02, most=0.8)
DEAD = because(Cause.CHANNEL_DEAD, record="low", channel="de", levels=2)


def finding(quantity: str, cause: Reason | None, verdict: str = "no_result", check: str = "frf") -> dict[str, Any]:
    told = {"reason": str(cause), "cause": cause.to_json()} if cause else {"reason": "above the upper limit"}
    numbers = {"value": None, "U": None, "lower": 80.0, "upper": 100.0, "p_false_accept": None}
    return {"check": check, "quantity": quantity, "unit": "Hz", "rule": "simple", "verdict": verdict} | numbers | told


def lines(*findings: Mapping[str, Any], action: str = "") -> list[str]:
    unit = {"serial": "S-1", "kind": "strut", "verdict": "incomplete", "findings": findings, "action": action or None}
    return reasons([UnitRecord.from_json(unit)])


def test_a_reason_with_a_semicolon_is_said_once_and_whole() -> None:
    said, advised = lines(finding("axial_resonance_Hz", OFFSET), finding("bending_x_Hz", OFFSET))
    assert said.endswith(str(OFFSET))
    assert {"axial_resonance_Hz", "bending_x_Hz"} <= set(re.findall(r"\w+_Hz", said))
    assert "acquisition settings" in advised


def test_a_reason_of_another_verdict_is_said_with_the_finding_that_has_it_too() -> None:
    *_, last = lines(finding("axial_resonance_Hz", OFFSET), finding("bending_x_Hz", OFFSET, "conditional"))
    assert str(OFFSET) in last
    assert "Axial resonance" in last


def test_of_several_causes_only_the_new_ones_are_said() -> None:
    *_, last = lines(finding("axial_resonance_Hz", OFFSET), finding("bending_x_Hz", together([OFFSET, DEAD])))
    assert "plug and supply" in last
    second = lines(finding("axial_resonance_Hz", OFFSET), finding("bending_x_Hz", together([OFFSET, DEAD])))[2]
    assert str(DEAD) in second
    assert "acquisition" not in second
    assert OFFSET.sentence() not in second


def test_the_action_of_the_unit_is_not_said_again() -> None:
    (advised,) = stored_advice(finding("axial_resonance_Hz", DEAD))
    assert len(lines(finding("axial_resonance_Hz", DEAD), action=advised)) == 1


def test_every_failure_of_our_checks_has_something_to_do() -> None:
    for check in CHECKS.values():
        for quantity in check.quantities:
            assert stored_advice(finding(quantity, None, "fail", check.name)), check.name


@pytest.mark.parametrize(
    "cause", [{"code": "channel_dead"}, {"code": "of_another_version"}, {"code": "record_short", "needed": "long"}]
)
def test_a_cause_that_is_not_known_here_gives_no_advice(cause: Any) -> None:
    strange = finding("axial_resonance_Hz", None) | {"cause": cause}
    assert stored_advice(strange) == []
    assert lines(strange) == ["S-1: Axial resonance (axial_resonance_Hz): no result, above the upper limit"]


def test_what_is_no_cause_gives_no_advice_and_no_record() -> None:
    strange = finding("axial_resonance_Hz", None) | {"cause": 7}
    assert stored_advice(strange) == []
    with pytest.raises(DocumentError, match="a cause is an object"):
        lines(strange)


def test_a_check_of_another_package_gives_no_advice() -> None:
    assert stored_advice(finding("axial_resonance_Hz", DEAD, check="of_theirs")) == []


def test_the_page_says_what_to_do_once(tmp_path: Path) -> None:
    made = certificate_contents(tmp_path, result(4.99, 181.7))
    assert "What to do: check that all three stacks are connected" in text(render(made))
    two = [finding("axial_resonance_Hz", DEAD), finding("gain_de_um_per_V", DEAD)]
    shared = text(render(replace(made, result=dict(made.result) | {"findings": two})))
    assert shared.count(str(DEAD)) == 1
    assert shared.count(ADVICE[Cause.CHANNEL_DEAD].format(channel="encoder de")) == 1
    assert "as Axial resonance" in shared


def text(pdf: bytes) -> str:
    return " ".join(" ".join(page.extract_text().split()) for page in PdfReader(io.BytesIO(pdf)).pages)


def test_what_was_not_measured_is_called_so_for_every_quantity() -> None:
    """It read as if flatness were the reason."""
    cause = Reason(Cause.NOT_MEASURED)
    (said,) = lines(finding("flatness_um", cause, check="flatness"), finding("stroke_um", cause, check="stroke"))
    assert {"flatness_um", "stroke_um"} <= set(re.findall(r"\w+_um", said))
    assert said.endswith(", not measured")
