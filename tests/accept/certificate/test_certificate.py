"""Certificates before signing: same content, same bytes; all that was found is on the page; nothing is cut off."""

import hashlib
import io
import json
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pypdf import PdfReader
from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics

from accept.base.documents.results import SIMULATED
from accept.certificate import CertificateContent, ContentError, content_of
from accept.certificate.contents import content as certificate_content
from accept.certificate.page.document import _later_frame, _row_heights, render
from accept.certificate.page.fixed_parts import code_text, field_rectangles, open_fields, summary
from accept.judging import judge_unit, load_spec
from accept.judging.reservations.reservations import Reservations
from accept.pictures.labels import label_of
from accept.pictures.pdf import page_style
from accept.pictures.pdf.fonts import BOLD
from accept.pictures.pdf.limit_bar import _view
from accept.pictures.pdf.numbers import limits, risk, value_and_U
from accept.units import unit_folder
from checks.acceptance import CHECKS
from checks.quantity import Quantity
from checks.verdict import judge
from specs.spec import Limit
from tests.accept.certificate.certificate_help import (
    RECORD,
    SPEC_TEXT,
    UNIT_TOML,
    certificate_contents,
    folder,
    panels,
    result,
    spec,
)
from tests.accept.units.units import GOOD, make_unit


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> CertificateContent:
    return certificate_contents(tmp_path_factory.mktemp("unit"))


@pytest.fixture(scope="module")
def pdf(made: CertificateContent) -> bytes:
    return render(made)


def words(pdf: bytes) -> list[str]:
    """Text of each page, blanks normalised."""
    return [" ".join(page.extract_text().split()) for page in PdfReader(io.BytesIO(pdf)).pages]


def test_equal_contents_give_equal_bytes(made: CertificateContent, pdf: bytes, tmp_path: Path) -> None:
    assert render(certificate_contents(tmp_path)) == pdf
    assert render(replace(made, operator="Somebody else")) != pdf


def test_equal_bytes_in_another_process(made: CertificateContent, tmp_path: Path) -> None:
    """Another hash seed, time zone and folder; the clock has moved on too."""
    program = (
        "import sys, hashlib; sys.path.insert(0, sys.argv[1])\n"
        "from pathlib import Path\n"
        "from dataclasses import replace\n"
        "from tests.accept.certificate.certificate_help import certificate_contents\n"
        "from accept.certificate.page.document import render\n"
        "made = certificate_contents(Path(sys.argv[2]))\n"
        "print(hashlib.sha256(render(replace(made, code_sha256='c' * 64))).hexdigest())"
    )
    command = [sys.executable, "-c", program, str(Path(__file__).parents[3]), str(tmp_path)]
    environment = os.environ | {"PYTHONHASHSEED": "4711", "TZ": "Pacific/Auckland"}
    there = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert there.stdout.strip() == hashlib.sha256(render(replace(made, code_sha256="c" * 64))).hexdigest()


def test_one_page_that_says_all(made: CertificateContent, pdf: bytes) -> None:
    (text,) = words(pdf)
    for expected in (
        *("APA-03", "APA300ML, basic measurements", "REJECTED", "page 1 of 1", "M. Keller"),
        *("1.7200 ± 0.0086 µF", "4.4 … 5.5 µF", "181.7 ± 1.8 µm", "≥ 304 µm", "guarded", "simple", "FAIL"),
        "1.7200 µF is below the lower limit 4.4 µF",
        *("231 ± 44 µrad", "Responses (low.mat, high.mat)", "two stacks 121.6 µm", "LCR-819, 1 kHz"),
        *(made.spec_sha256, made.record_sha256[:32], made.record_sha256[32:]),
    ):
        assert expected in text, expected
    assert "Outside the limits: Sensor stack; Stroke, three stacks." in text


def test_the_pdf_names_no_time_and_has_two_empty_fields(pdf: bytes) -> None:
    reader = PdfReader(io.BytesIO(pdf))
    assert reader.metadata is not None
    assert not {"/CreationDate", "/ModDate"} & set(reader.metadata)
    fields = reader.get_fields() or {}
    assert {name: field.get("/V") for name, field in fields.items()} == {"technician": None, "qa": None}
    (left, bottom, right, top) = field_rectangles()["qa"]
    page = reader.pages[0].mediabox
    assert 0 < left < right < page.width
    assert 0 < bottom < top < page.height


def test_the_open_fields_say_that_they_are_open(pdf: bytes) -> None:
    """Not the page, where the words would stay below a signature."""
    shown = PdfReader(io.BytesIO(open_fields())).pages
    assert [page.extract_text().strip() for page in shown] == ["not signed", "not authorised: countersignature open"]
    (page,) = PdfReader(io.BytesIO(pdf)).pages
    forms = [each.get_object()["/AP"]["/N"] for each in page["/Annots"]]
    assert [form.get_data() for form in forms] == [each.get_contents().get_data() for each in shown]
    assert "open" not in page.extract_text()


def test_every_letter_is_embedded(pdf: bytes) -> None:
    """A font that the reader's computer must have would change or lose µ, ≤ and Ω."""
    fonts = PdfReader(io.BytesIO(pdf)).pages[0]["/Resources"]["/Font"]  # type: ignore[index]
    for font in fonts.values():
        descriptor = font.get_object().get("/FontDescriptor")
        name = str(font.get_object().get("/BaseFont"))
        assert (descriptor is not None and "/FontFile2" in descriptor) or name == "/Helvetica", (
            name
        )  # reportlab's unused


def test_attachments_give_the_dossier_back(made: CertificateContent, pdf: bytes) -> None:
    inside = {name: content[0] for name, content in PdfReader(io.BytesIO(pdf)).attachments.items()}
    assert inside["unit.toml"] == UNIT_TOML
    assert inside["raw/stroke.mat"] == RECORD
    assert inside["spec.toml"] == SPEC_TEXT.encode()
    assert json.loads(inside["results.json"]) == result().to_json()
    assert hashlib.sha256(inside["results.json"]).hexdigest() == made.record_sha256
    assert made.record_sha256 in code_text(made)
    manifest = json.loads(inside["manifest.json"])
    stated = {"sha256": hashlib.sha256(RECORD).hexdigest(), "attached": True, "bytes": len(RECORD)}
    assert manifest["inputs"]["raw/stroke.mat"] == stated
    assert render(certificate_content.read(inside)) == pdf


def test_records_above_the_limit_stay_outside_but_are_named(tmp_path: Path) -> None:
    small = certificate_contents(tmp_path, size_limit=1000)
    assert set(small.files) == {"unit.toml"}
    assert small.manifest()["inputs"]["raw/stroke.mat"]["attached"] is False
    assert render(certificate_content.read(small.attachments())) == render(small)


def test_an_input_that_changed_since_or_is_gone_is_refused(tmp_path: Path) -> None:
    home = folder(tmp_path)
    (home / "raw/stroke.mat").write_bytes(RECORD + b"x")
    with pytest.raises(ContentError, match=r"stroke\.mat: changed since it was judged"):
        content_of(result(), spec(), home, "M. Keller")
    (home / "raw/stroke.mat").unlink()
    with pytest.raises(ContentError, match=r"stroke\.mat: cannot be attached"):
        content_of(result(), spec(), home, "M. Keller")


def test_an_input_named_like_our_own_file_does_not_replace_it(tmp_path: Path) -> None:
    unit = replace(result(), inputs={"unit.toml": hashlib.sha256(UNIT_TOML).hexdigest(), "results.json": "0" * 64})
    made = content_of(unit, spec(), folder(tmp_path), "M. Keller")
    assert json.loads(made.attachments()["results.json"])["serial"] == "APA-03"
    assert made.manifest()["inputs"]["results.json"]["attached"] is False


@pytest.mark.parametrize("damage", ["format", "missing", "not json", "no spec"])
def test_attachments_of_something_else_are_refused(made: CertificateContent, damage: str) -> None:
    inside = made.attachments()
    if damage == "format":
        inside["manifest.json"] = certificate_content.canonical(made.manifest() | {"format": 99})
    elif damage == "missing":
        del inside["panels.json"]
    elif damage == "not json":
        inside["results.json"] = b"{"
    else:
        inside["manifest.json"] = certificate_content.canonical(
            {k: v for k, v in made.manifest().items() if k != "spec"}
        )
    with pytest.raises(ContentError):
        certificate_content.read(inside)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "\udce4.mat"])
def test_what_json_cannot_hold_is_refused(made: CertificateContent, value: object) -> None:
    with pytest.raises(ContentError, match="JSON does not have"):
        render(replace(made, result=dict(made.result) | {"notes": [value]}))


def crowded(made: CertificateContent, count: int) -> CertificateContent:
    """As many findings as no spec has, each with a longer reason than the one before, in hostile letters."""
    entry = made.result["findings"][0]
    found = [
        entry | {"quantity": f"number_{n:02d}_um", "reason": f"because <b>{n:02d}</b> & {'of this and that ' * n}"}
        for n in range(count)
    ]
    more: dict[str, Any] = {"findings": found, "serial": "S" * 64, "notes": ["a note\n\x00 " * 40] * 10}
    return replace(
        made,
        result=dict(made.result) | more,
        panels={f"{nth}/{name}": panel for nth in range(5) for name, panel in panels().items()},
        instruments={f"check {n}": "x" * 300 for n in range(5)},
        operator="<para>Ω & co",
    )


def test_a_long_table_flows_over_pages_with_its_head(made: CertificateContent) -> None:
    pages = words(render(crowded(made, 60)))
    assert len(pages) > 3
    text = " ".join(pages)
    for n in range(60):
        assert f"number {n:02d}" in text.lower()
        assert f"because <b>{n:02d}</b> &" in text
    for nth, page in enumerate(pages, 1):
        assert f"page {nth} of {len(pages)}" in page
        assert ("Value ± U (k = 2)" in page) or "because <b>" not in page  # a row of the table never without its head
    assert "<para>Ω & co" in text
    assert "whole text in results.json" in text  # 60 x 17 characters are more than a row shows


@pytest.mark.parametrize("rows", range(1, 16))
def test_rows_of_pictures_fill_their_pages(rows: int) -> None:
    """Rows that the first page has no room for stand in equal parts on the fewest pages that hold them: none of 4 such
    rows stands alone on a page of its own."""
    later = _later_frame()[1] / mm
    first, *others = _row_heights(380.0, 300.0, rows)
    assert 42.0 <= first <= 64.0
    assert all(42.0 <= height <= 64.0 for height in others)  # the least that can be read, the most that is of use
    space = 5.0 / mm  # above each
    pages = [math.ceil(len(others) / int(later / (height + space) + 1e-9)) for height in others]
    assert all(n == math.ceil(len(others) / int(later / (42.0 + space))) for n in pages)


def test_no_glyph_leaves_the_page(made: CertificateContent) -> None:
    """Every piece of text starts inside the margins of its A4 page (figures have coordinates of their own)."""
    places: list[tuple[float, float]] = []

    def see(text: str, cm: list[float], tm: list[float], font: Any, size: float) -> None:
        if text.strip():
            places.append((tm[4] * cm[0] + cm[4], tm[5] * cm[3] + cm[5]))

    for page in PdfReader(io.BytesIO(render(replace(crowded(made, 12), panels={})))).pages:
        page.extract_text(visitor_text=see)
    assert len(places) > 150
    assert all(20 < x < 575 and 20 < y < 822 for x, y in places)  # margins of 39 pt less a line's height


def held(tmp_path: Path) -> CertificateContent:
    """An APA of many findings, which one crack holds, each with its reason; by the spec of all checks."""
    text = GOOD + '[notes]\nflatness = ["NONCONFORMANCE: flexure cracked near the foot, seen under the lens (Ben)"]\n'
    unit, by = unit_folder.read(make_unit(tmp_path / "A-2", "A-2", text)), load_spec("apa")
    judged = Reservations().with_notes(unit.notes).apply(judge_unit(unit, by))
    return content_of(judged, by, unit.path, "Ann")


def test_findings_begin_on_the_first_page_of_a_held_unit(tmp_path: Path) -> None:
    """Its table is longer than what is left of that page; it must not leave the page empty."""
    made = held(tmp_path)
    assert made.result["nonconformances"]
    pages = words(render(made))
    assert len(pages) > 1
    label = label_of(made.result["findings"][0]["quantity"])
    assert label in pages[0].partition("Value ± U (k = 2)")[2]


def test_the_words_in_the_box_of_the_verdict_are_inside_it(made: CertificateContent) -> None:
    """Of a unit that is held and simulated too."""
    more = {"simulated": True, "verdict": "conditional", "nonconformances": ["stroke: cracked (Ben)"]}
    right = page_style.WIDTH - page_style.MARGIN
    ends: dict[str, tuple[float, float]] = {}

    def see(text: str, cm: list[float], tm: list[float], font: Any, size: float) -> None:
        line, left = text.strip(), tm[4] * cm[0] + cm[4]
        if (
            line in (SIMULATED, "CONDITIONAL: QUALITY ASSURANCE DECIDES IN ITS BOX BELOW")
            and left > page_style.WIDTH / 2
        ):
            ends[line] = left, left + pdfmetrics.stringWidth(line, BOLD, size)

    PdfReader(io.BytesIO(render(replace(made, result=dict(made.result) | more)))).pages[0].extract_text(
        visitor_text=see
    )
    assert len(ends) == 2
    assert all(right - 70 * mm < start and end < right - 2 * mm for start, end in ends.values()), ends


def test_no_internal_name_of_a_check_stands_on_a_page(tmp_path: Path) -> None:
    text = " ".join(words(render(held(tmp_path))))
    assert not [name for name in CHECKS if "_" in name and name in text]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7, 13])
def test_every_picture_is_on_a_page(made: CertificateContent, count: int) -> None:
    """Several rows of figures share a page with its text; each figure is drawn once."""
    (one, *_) = panels().values()
    pages = words(render(replace(made, panels={str(n): replace(one, title=f"Panel{n:02d}.") for n in range(count)})))
    text = " ".join(pages)
    assert [text.count(f"Panel{n:02d}.") for n in range(count)] == [1] * count
    assert "REJECTED" in pages[0]
    assert "Panel00." in pages[0]
    assert len(pages) == 1 or count > 3


@pytest.mark.parametrize(
    ("sensor", "stroke", "verdict", "sentence"),
    [
        (4.99, 365.5, "ACCEPTED", "All 2 required findings pass."),
        (4.405, 365.5, "CONDITIONAL", "Not decided within U: Sensor stack."),
        (float("nan"), 365.5, "INCOMPLETE", "No result for: Sensor stack."),
        (4.99, 181.7, "REJECTED", "Outside the limits: Stroke, three stacks."),
    ],
)
def test_each_verdict_has_its_word(tmp_path: Path, sensor: float, stroke: float, verdict: str, sentence: str) -> None:
    unit = result(sensor, stroke)
    assert summary(unit.to_json()) == sentence
    (text,) = words(render(certificate_contents(tmp_path, unit)))
    assert verdict in text
    assert sentence in text


def test_a_unit_without_pictures_and_information(made: CertificateContent) -> None:
    bare = replace(made, panels={}, result=dict(made.result) | {"information": [], "notes": [], "not_judged": []})
    (text,) = words(render(bare))
    assert "Measured, without limits" not in text


@pytest.mark.parametrize(
    ("value", "U", "shown"),
    [
        (1.72, 0.0086, ("1.7200", "0.0086")),
        (181.7, 1.817, ("181.7", "1.8")),
        (9.96, 0.0996, ("9.96", "0.10")),
        (12345.6, 234.0, ("12350", "230")),
        (-0.00001, 0.1, ("0.00", "0.10")),
        (-57.123, 4.1, ("−57.1", "4.1")),
        (1.234567891, None, ("1.23457", "?")),
        (5.0, 0.0, ("5", "0")),
        (0.4351564, 0.0000012, ("0.4352", "less than 0.0001")),
        (None, None, ("–", "")),
    ],
)
def test_digits_follow_the_uncertainty(value: float | None, U: float | None, shown: tuple[str, str]) -> None:
    assert value_and_U(value, U) == shown


@pytest.mark.parametrize(
    ("other", "sentence"),
    [
        (-130.0, "The two estimates agree."),
        (-160.0, "They differ by more than their uncertainties in Misalignment dy."),
    ],
)
def test_two_estimates_of_one_quantity_are_not_left_without_a_word(tmp_path: Path, other: float, sentence: str) -> None:
    limit = Limit(lower=-100.0, upper=100.0, unit="um", rule="guarded", source="test")
    dy = judge("misalignment", Quantity("dy_um", -128.5, 7.2), limit)
    parameters = {"dy_um": {"value": other, "ci95": [other - 6.0, other + 6.0]}}
    evidence = {"delta_lnL": 60.0, "p": 1e-12}
    sentence_named = "The APA sits beside the axis."
    named = [{"effect": "misalignment", "parameters": parameters, "sentence": sentence_named, "evidence": evidence}]
    gap = {"channels": {"de": 5.0}}
    found = {"verdict": "explained", "model": "strut", "start": "strut", "named": named, "ambiguous": [], "unnamed": []}
    unit = replace(result(), findings=(*result().findings, dy), gap=found | {"gap_before": gap, "gap_after": gap})
    text = " ".join(" ".join(words(render(certificate_contents(tmp_path, unit)))).split())
    assert "Judged are the findings above: Misalignment dy −128.5 ± 7.2 µm" in text
    assert sentence in text


@given(st.floats(-1e9, 1e9), st.floats(1e-7, 1e6))
def test_what_is_shown_is_within_a_twentieth_of_U(value: float, U: float) -> None:
    """Two digits of U: the last place is U/10 at most, so rounding moves a number by at most U/20. A U below a ten
    thousandth of the value is not shown with digits."""
    assume(abs(value) * 1e-4 <= U)
    shown, shown_U = (float(text.replace("−", "-")) for text in value_and_U(value, U))
    assert abs(shown - value) <= 0.0501 * U + 1e-9 * abs(value)
    assert abs(shown_U - U) <= 0.0501 * U


def test_limits_and_risk() -> None:
    assert limits({"lower": None, "upper": 10.0}) == "≤ 10"
    assert limits({"lower": -0.5, "upper": 10.0}) == "−0.5 … 10"
    assert limits({"lower": 304.0, "upper": None}) == "≥ 304"
    assert (risk(None, "no_result"), risk(0.0, "fail"), risk(0.0, "pass")) == ("–", "0 %", "< 0.001 %")
    assert (risk(0.0228, "pass"), risk(0.5, "conditional")) == ("2.3 %", "50 %")


@given(st.floats(-1e6, 1e6), st.floats(0, 1e5), st.sampled_from([(None, 10.0), (304.0, None), (4.4, 5.5)]))
def test_the_strip_always_shows_its_limits(value: float, U: float, zone: tuple[float | None, float | None]) -> None:
    low, high = _view(*zone, value, U)
    assert low < high
    assert all(low < limit < high for limit in zone if limit is not None)
    if None in zone:
        assert low <= value - U
        assert value + U <= high
