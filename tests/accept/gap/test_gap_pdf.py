"""gap.pdf and the summary on the terminal: the sentence, the numbers of gap.json, on one page, and never cut."""

import io
import re
from dataclasses import replace

import numpy as np
import pytest
from pypdf import PdfReader

from accept.gap import analyse_unit
from accept.gap.document import candidates, moved_parameters
from accept.gap.improved_model import AddedElement
from accept.gap.report import COLUMNS, LINES, RIVALS, summary
from accept.gap.report_pdf import render
from accept.gap.text import gap_number, one_line
from checks.gap import FittedElement, Result, Tried
from checks.gap.decision.result import Ambiguous, Nameless
from checks.model import UnidentifiedElement
from checks.rounding import rounded

AMBIGUOUS = Ambiguous(("amplifier_bandwidth", "loop_delay"), "drive a dummy capacitor and read it back")
NAMELESS = Nameless("Vs", (750.4,), (762.8,), False, "Vs times a mode would explain it")


@pytest.fixture(scope="module")
def crowded(result: Result) -> Result:
    """An answer with more to say than any unit so far."""
    return replace(
        result,
        verdict="partly_explained",
        named=result.named * 4,
        ambiguous=(AMBIGUOUS,) * 3,
        unnamed=(NAMELESS,) * 6,
        notes=("what somebody should know about these records " * 4,) * 5,
    )


def text_of(pdf: bytes) -> str:
    return " ".join(" ".join(page.extract_text() for page in PdfReader(io.BytesIO(pdf)).pages).split())


def test_the_first_page_has_sentence_numbers_and_reasons_the_second_the_bode_plots(result: Result) -> None:
    pdf = render("X-1", result)
    pages = [" ".join(page.extract_text().split()) for page in PdfReader(io.BytesIO(pdf)).pages]
    assert len(pages) == 2
    text = pages[0]
    assert "fits worse, by" in text  # why another explanation was not named
    assert "Fitted values against their priors" in text
    assert f"{moved_parameters(result)[0].shift:+.1f} sd" in text
    for words in ("measured", "model before", "model after", "95 % of the measurement", "95 % of the model after"):
        assert pages[1].count(words) >= 3  # of every channel
    assert pages[1].count("frequency [Hz]") == 3  # one axis for magnitude, phase and what is left
    assert "How well each named value is determined" in text
    assert "sensor highpass: f [Hz]" in text
    document = analyse_unit.to_json("X-1", result)
    assert document["named"][0]["sentence"] in text
    for key in ("gap_before", "gap_after"):
        for G in document[key]["channels"].values():
            assert gap_number(G) in text
    found = document["named"][0]["parameters"]["f_Hz"]
    half = (found["ci95"][1] - found["ci95"][0]) / 2.0
    at, low, high = (rounded(x, half) for x in (found["value"], *found["ci95"]))
    assert f"f {at} Hz ({low} to {high})" in text
    assert result.tried[0].names[0].replace("_", " ") in text  # the candidates, the best first
    assert "Cause found" in text


def test_an_element_without_a_name_stands_in_the_report(result: Result) -> None:
    element = UnidentifiedElement("Vs", 1.034, ((750.4, 0.01),), ((762.8, 0.0098),))
    added = (
        AddedElement("Vs", FittedElement(element, np.eye(5)), 329.0, 0.4),
        AddedElement("de", None, 0.17, 0.17, "agrees as it is"),
    )
    text = text_of(render("X-1", result, added))
    assert "Unidentified elements in the improved model" in text
    assert "750.4 Hz, 0.01" in text
    assert "762.8 Hz, 0.0098" in text
    assert "nothing added: agrees as it is" in text
    assert "with the unidentified element" in text  # a curve of its own
    assert "Unidentified elements" not in text_of(render("X-1", result))


def test_equal_answers_give_equal_bytes(result: Result) -> None:
    assert render("X-1", result) == render("X-1", result)


def test_what_is_not_told_apart_and_what_would_tell(crowded: Result) -> None:
    text = text_of(render("X-1", crowded))
    told = "Cannot be distinguished: amplifier bandwidth, loop delay."
    assert f"{told} Next experiment: drive a dummy capacitor and read it back." in text
    assert "Unidentified effect: Vs, poles 750.4 Hz, zeros 762.8 Hz" in text
    assert "Partly explained" in text


def test_terminal(result: Result, crowded: Result) -> None:
    for shown in (result, crowded):
        lines = summary("X-1", shown)
        assert len(lines) <= LINES
        assert max(map(len, lines)) <= COLUMNS
        for c, G in shown.gap_after.channels.items():
            assert any(re.search(rf"{c}: G before .*, G after {re.escape(gap_number(G.G))}$", line) for line in lines)
    assert any("for the rest see gap.json" in line for line in summary("X-1", crowded))


@pytest.mark.parametrize("verdict", ["unexplained", "ambiguous"])
def test_the_rivals_stand_wherever_nothing_was_named(result: Result, verdict: str) -> None:
    """On the terminal, in gap.json and in gap.pdf; red before on the terminal."""
    refused = Tried(("crosstalk",), 4321.0, 1e-5, "leaves its own channel unexplained " * 9)
    notes = ("what somebody should know about these records " * 4,) * 5
    shown = replace(result, verdict=verdict, named=(), tried=(refused, *result.tried), notes=notes, unnamed=(NAMELESS,))
    lines = summary("X-1", shown)
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= COLUMNS
    seen = " ".join(" ".join(lines).split())
    rows = list(candidates(shown))
    assert len(rows) > RIVALS
    for words, gain, _, _ in rows[:RIVALS]:
        assert f"{words}: gain in ln L {gain}, " in seen
    listed = analyse_unit.to_json("X-1", shown)["candidates"]
    assert listed[0]["effect"] == "crosstalk"
    assert listed[0]["delta_lnL"] == 4321.0
    assert len(listed) == len(rows)
    text = text_of(render("X-1", shown))
    assert "Why this cause, and why not another" in text
    assert all(f"{words} {gain}" in text for words, gain, _, _ in rows)


def test_agreement_has_no_rivals(result: Result) -> None:
    assert "gain in ln L" not in " ".join(summary("X-1", replace(result, verdict="no_missing_effect", named=())))


def test_what_was_named_stands_among_what_was_tried(result: Result) -> None:
    """Also where the search came to it from an explanation with more in it, which it then did not need."""
    named = {n.effect for n in result.named}
    without = replace(result, tried=tuple(t for t in result.tried if set(t.names) != named))
    for shown in (result, without):
        rows = [(words, why) for words, _, _, why in candidates(shown)]
        assert ("sensor highpass", "named") in rows
        assert all(why.startswith(("not named", "leaves the gap")) for words, why in rows if words != "sensor highpass")


def test_one_line_says_it_all(crowded: Result, result: Result) -> None:
    line = one_line(analyse_unit.to_json("X-1", crowded) | {"reason": None})
    for words in (
        "partly explained: sensor highpass (f ",
        "amplifier bandwidth or loop delay (cannot be distinguished)",
        "on Vs (750.4 Hz)",
    ):
        assert words in line
    assert "->" in line
    refused = {"verdict": "refused", "start": "strut", "reason": "coherence is too low"}
    assert one_line(refused) == "not compared with model strut: coherence is too low"
