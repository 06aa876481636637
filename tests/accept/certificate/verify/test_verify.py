"""Verification: what is valid is said to be; every attack is found, with one line for the reason and no traceback."""

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from cryptography.hazmat.primitives.serialization import Encoding
from pypdf import PdfReader, PdfWriter

from accept.base import child_processes, version
from accept.base.documents.results import UnitRecord
from accept.certificate import CertificateContent, InvalidCertificate, Validity, Verification, read_contents
from accept.certificate.contents import content as certificate_content
from accept.certificate.page.document import render
from accept.certificate.page.fixed_parts import field_rectangles
from accept.certificate.signature.signing import sign
from accept.certificate.trust import keys
from accept.certificate.trust.keys import QA, TECHNICIAN
from accept.certificate.verify import attachments as contents
from accept.certificate.verify import structure
from accept.certificate.verify.rejudge import unpack
from accept.certificate.verify.result_diff import differences, is_said_otherwise, is_within_U
from accept.pictures.pdf.assemble import assemble
from accept.store.seal import own_key
from tests.accept.certificate.certificate_help import (
    UNIT_TOML,
    WHEN,
    bench_signed,
    certificate_contents,
    judged_again,
    result,
    stated,
    stated_head,
)
from tests.accept.certificate.verify.verify_help import LATER, NOW, Bench, refused, verify


@pytest.fixture(autouse=True)
def processes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Files are read as the product reads them, in processes of their own; how many there were."""
    counted: list[int] = []

    def bounded(*given: Any, **limits: Any) -> Any:
        counted.append(1)
        return child_processes.bounded(*given, **limits)

    monkeypatch.setattr(structure, "bounded", bounded)
    return counted


# --- what holds ------------------------------------------------------------------------------------------------------


def test_signed_by_the_technician_alone_is_valid_and_open(bench: Bench, processes: list[int]) -> None:
    report = bench.check(bench.signed)
    assert len(processes) == 1
    assert report.valid, report.reason
    assert not report.countersigned
    assert "countersignature open" in report.reason
    assert (report.serial, report.verdict) == ("APA-03", "rejected")
    assert [(s.role, s.person, s.when) for s in report.signatures] == [(TECHNICIAN, "M. Keller", WHEN)]
    assert any("identical to the byte" in line for line in report.details)


def test_countersigned_is_valid(bench: Bench) -> None:
    report = bench.check(bench.countersigned, rejudge=lambda a: judged_again())
    assert report.valid, report.reason
    assert report.countersigned
    assert [(s.role, s.when) for s in report.signatures] == [(TECHNICIAN, WHEN), (QA, LATER)]
    assert any("the same result" in line for line in report.details)


def test_without_its_countersignature_it_is_the_certificate_before(bench: Bench) -> None:
    """Nobody can take a signature off unseen: the state it leaves says that the countersignature is open."""
    report = bench.check(bench.countersigned[: len(bench.signed)])
    assert report.valid
    assert not report.countersigned


def test_it_still_holds_when_the_certificates_have_run_out(bench: Bench) -> None:
    later = WHEN + timedelta(days=365 * 15)
    assert verify(bench.countersigned, bench.trust, lambda _: judged_again(), later).valid


# --- page, data and result -------------------------------------------------------------------------------------------


def good_content(tmp_path: Path) -> certificate_content.CertificateContent:
    return certificate_contents(tmp_path, result(4.99, 365.5))


def page_over(page: certificate_content.CertificateContent, data: certificate_content.CertificateContent) -> bytes:
    """The page of one certificate's content over the attachments of another."""
    stripped = PdfWriter(clone_from=PdfReader(io.BytesIO(render(page))))
    for key in ("/Names", "/AF", "/AcroForm"):
        del stripped._root_object[key]
    out = io.BytesIO()
    stripped.write(out)
    return assemble(out.getvalue(), data.attachments(), field_rectangles(), "x")


@pytest.mark.parametrize(("sensor", "stroke"), [(4.99, 365.5), (1.73, 181.7)])
def test_a_page_that_says_other_than_its_data_is_found(
    bench: Bench, tmp_path: Path, sensor: float, stroke: float
) -> None:
    """Signed with the right keys: another verdict, or one digit of a number."""
    mixed = page_over(certificate_contents(tmp_path, result(sensor, stroke)), certificate_contents(tmp_path))
    refused(bench.check(sign(mixed, bench.technician, WHEN)), "page does not agree with the attached data")


def resigned(bench: Bench, attachments: Mapping[str, bytes]) -> Verification:
    """Report on a certificate with these attachments, signed with the right key."""
    plain = render(certificate_content.read(attachments))
    return bench.check(sign(plain, bench.technician, WHEN))


def test_inputs_that_are_not_those_judged_are_found(bench: Bench, tmp_path: Path) -> None:
    made = certificate_contents(tmp_path)
    as_long = made.files["unit.toml"].replace(b"1.72", b"4.99")  # of another size it does not agree with the manifest
    refused(resigned(bench, made.attachments() | {"unit.toml": as_long}), "unit.toml is not the file that was judged")
    refused(resigned(bench, made.attachments() | {"more.csv": b"1"}), "more.csv is not the file that was judged")
    wrong = replace(made, inputs=dict(made.inputs) | {"x.mat": "0" * 64})
    refused(resigned(bench, wrong.attachments()), "name different inputs")


def test_a_page_of_another_version_is_told(bench: Bench, tmp_path: Path) -> None:
    """Another version may draw another page: the bytes are not compared, serial and verdict are."""
    old, good = (replace(d, code_sha256="0" * 64) for d in (certificate_contents(tmp_path), good_content(tmp_path)))
    report = bench.check(sign(page_over(old, old), bench.technician, WHEN))
    assert report.outcome is Validity.SIGNED, report.reason
    assert "page not compared" in report.reason
    assert "its text says the same" in report.reason
    refused(bench.check(sign(page_over(old, good), bench.technician, WHEN)), "does not show 'ACCEPTED'")


def test_a_result_that_comes_out_differently_is_reported(bench: Bench) -> None:
    refused(bench.check(bench.signed, rejudge=lambda a: judged_again(1.73)), "findings[sensor_uF].value is 1.72")
    refused(bench.check(bench.signed, rejudge=lambda a: judged_again(4.99, 365.5)), "judged again")


def said_in_words(tmp_path: Path, note: str) -> CertificateContent:
    made = certificate_contents(tmp_path)
    first, *others = made.result["findings"]
    return replace(made, result=made.result | {"findings": [first | {"note": note}, *others]})


def noted(value: float) -> UnitRecord:
    again = judged_again(value)
    first, *others = again.findings
    return replace(again, findings=(replace(first, note="in the words of today"), *others))


def test_other_words_are_told_of_another_version_and_refused_of_the_same(bench: Bench, tmp_path: Path) -> None:
    """A sentence that a later version says otherwise makes no certificate invalid: values, limits, causes and verdicts
    are what was judged. The same program says the same."""
    said = said_in_words(tmp_path, "in older words")

    def checked(made: CertificateContent, value: float = 1.72) -> Verification:
        return bench.check(sign(render(made), bench.technician, WHEN), rejudge=lambda a: noted(value))

    refused(checked(said), "note is 'in older words' attached")
    report = checked(replace(said, code_sha256="0" * 64))
    assert report.outcome is Validity.SIGNED, report.reason
    assert "the same values, limits and verdicts, said in other words" in report.reason
    refused(checked(replace(said, code_sha256="0" * 64), 1.73), "findings[sensor_uF].value is 1.72")


@pytest.mark.parametrize(
    ("attached", "again", "holds"),
    [
        ({"value": 1.7}, {"value": 1.702}, True),
        ({"value": 1.7}, {"value": 1.72}, False),  # beyond U
        ({"value": 1.7, "U": None}, {"value": 1.7001}, False),  # of no known U
        ({"U": 0.004}, {"U": 0.008, "budget": []}, True),
        ({"value": 1.8, "U": 9.0}, {"value": 1.7}, False),  # the U that is attached widens nothing
        ({"value": None}, {"value": 1.7}, False),
        ({"value": "1.7"}, {"value": 1.7}, False),
        ({"verdict": "pass"}, {"verdict": "fail"}, False),
        ({"verdict": "pass"}, {"verdict": "no_result", "value": None, "U": None}, False),
        ({"lower": 4.4}, {"lower": 4.5}, False),
        ({"value": 1.7}, {"value": 1.701, "unit": "nF"}, False),
    ],
)
def test_numbers_of_another_version_hold_within_U(
    attached: dict[str, object], again: dict[str, object], holds: bool
) -> None:
    """What is claimed keeps its limits and its verdict; a U may grow. Red before: each of the first and fourth."""
    finding = {"quantity": "k", "value": 1.7, "U": 0.004, "budget": [{"u": 0.002}], "verdict": "pass", "unit": "uF"}
    results = [{"verdict": "accepted", "findings": [{**finding, **more}]} for more in (attached, again)]
    lines = differences(*results)
    assert lines
    assert all(is_within_U(line, *results) for line in lines) == holds


def test_what_another_version_had_no_result_for_may_have_one_now() -> None:
    """Unless it was accepted all the same: no version of this program does that."""
    finding = {"quantity": "dx_um", "value": None, "U": None, "verdict": "no_result"}
    found = {"verdict": "accepted", "findings": [{**finding, "value": 5.9, "U": 32.0, "verdict": "pass"}]}
    for verdict, holds in (("incomplete", True), ("accepted", False)):
        before = {"verdict": verdict, "findings": [finding]}
        assert all(is_within_U(line, before, found) for line in differences(before, found)) == holds
    rejected = {"verdict": "rejected", "findings": []}
    assert not is_within_U("verdict is 'accepted' attached, 'rejected' judged again", found, rejected)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("findings[dx_um].note is 'a' attached, 'b' judged again", True),
        ("notes has 1 entries attached, 2 judged again", True),
        ("findings[dx_um].verdict is 'pass' attached, 'fail' judged again", False),
        ("findings[dx_um].cause.code is 'a' attached, 'b' judged again", False),
        ("findings[a note].value is 1.0 attached, 2.0 judged again", False),
    ],
)
def test_what_is_only_said_otherwise(line: str, words: bool) -> None:
    assert is_said_otherwise(line) is words


def test_the_judge_receives_what_was_judged(bench: Bench, tmp_path: Path) -> None:
    seen: list[CertificateContent] = []

    def judge(attached: CertificateContent) -> UnitRecord:
        seen.append(attached)
        unit = tmp_path / "again"
        unpack(attached, unit)
        assert (unit / "unit.toml").read_bytes() == UNIT_TOML
        assert (
            hashlib.sha256((unit / "raw/stroke.mat").read_bytes()).hexdigest()
            == attached.result["inputs"]["raw/stroke.mat"]
        )
        return judged_again()

    assert bench.check(bench.signed, rejudge=judge).valid
    assert 'name = "basic"' in seen[0].spec_text


def test_a_judge_that_fails_makes_it_invalid(bench: Bench) -> None:
    def judge(attached: CertificateContent) -> UnitRecord:
        raise OSError("disk\nfull")

    refused(bench.check(bench.signed, rejudge=judge), "judging again cannot be read: OSError: disk full")


def test_too_large_records_are_not_judged_but_the_other_sections_are(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An outcome of its own; with the records beside it is judged in full, and only with those records."""
    small = sign(render(certificate_contents(tmp_path, ca=bench.technician.ca, size_limit=100)), bench.technician, WHEN)
    refused(bench.check(small), "although there is room for it")
    monkeypatch.setattr(contents, "SIZE_LIMIT", 100)
    report = bench.check(small)
    assert report.outcome is Validity.SIGNED
    assert "not judged again: stroke (raw/stroke.mat not attached" in report.reason
    refused(bench.check(small, rejudge=lambda a: judged_again(1.73)), "sensor_uF")
    assert bench.check(small, records=tmp_path).valid
    (tmp_path / "raw/stroke.mat").write_bytes(b"other")
    refused(bench.check(small, records=tmp_path), "is not the file that was judged")


@pytest.mark.parametrize("name", ["../evil", "/etc/passwd", "a/../../b", "c:\\x", "..\\x", ""])
def test_no_attachment_is_unpacked_outside_its_folder(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidCertificate, match="leads out of its folder"):
        unpack(CertificateContent({}, "", "", "", "", files={name: b"x"}), tmp_path / "inner")
    assert list(tmp_path.rglob("*")) == []


def test_differences_by_rounding_are_none() -> None:
    """1e-6 between processors is rounding, one digit of a number is not; verdicts and words are exact."""
    unit = result().to_json()
    again = json.loads(json.dumps(unit))
    again["findings"][0]["value"] *= 1 + 1e-9
    again["findings"][0]["reason"] = again["findings"][0]["reason"].replace("1.72 ", "1.7200 ")
    assert differences(unit, again) == []
    for digits in (3, 800):  # rounding adds no such zeros, which push what follows off the page
        assert differences({"note": "below 304.0 um, U 3.0"}, {"note": f"below 304.0{'0' * digits} um, U 3.0"}) != []
    for path, value in (("value", 1.7201), ("verdict", "pass"), ("U", None), ("required", 1), ("reason", "other")):
        changed = json.loads(json.dumps(unit))
        changed["findings"][0][path] = value
        assert len(differences(unit, changed)) == 1, path
    assert differences({"a": [1, 2]}, {"a": [1]}) == ["a has 2 entries attached, 1 judged again"]
    assert differences({"a": 1}, {"b": 1}) == ["a is only attached", "b is only judged again"]
    assert differences({"n": "x 12 y"}, {"n": "x 13 y"}) != []
    part = {"parts": {"joint": "J-100000.1"}}  # near as a number, and another part
    assert differences({"note": "J-100000.1"}, {"note": "J-100000.9"}) == []
    assert differences(part, {"parts": {"joint": "J-100000.9"}}) != []


def test_the_code_hash_is_in_the_certificate(bench: Bench) -> None:
    assert read_contents(bench.signed).code_sha256 == version.code_sha256()


def test_keys_made_by_init_verify_by_the_bench_ca(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys.init(tmp_path, "correct horse", "M. Keller", "B. Assurance", "battery staple", when=WHEN)
    own = own_key(tmp_path / "bench.key")
    certificate = keys.bench_certificate(tmp_path, keys.ca(tmp_path))
    given = stated(head=stated_head(key=own)) | {"bench": certificate.public_bytes(Encoding.PEM).decode()}
    unsigned = render(bench_signed(certificate_contents(tmp_path / "unit", provenance=given), own))
    pdf = sign(unsigned, keys.unlock(tmp_path, TECHNICIAN, "correct horse"), WHEN)
    assert verify(
        sign(pdf, keys.unlock(tmp_path, QA, "battery staple"), LATER),
        [keys.ca(tmp_path)],
        lambda _: judged_again(),
        NOW,
    ).valid
