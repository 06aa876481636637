"""Nothing is believed that can be looked up: every statement of a certificate is changed, one at a time, by an insider
who has the technician's key and who tells the bench's store of what he signed. None is plainly valid."""

import copy
import hashlib
import io
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from pypdf import PdfReader, PdfWriter
from typer.testing import CliRunner, Result

from accept.base.documents.document import written_hints
from accept.base.documents.results import UnitRecord
from accept.base.home import home
from accept.certificate import CertificateContent, ContentError, Validity, read_contents, rejudge
from accept.certificate.contents import content as C
from accept.certificate.contents.content import MANIFEST, RESULTS, hashes_of, signed_text
from accept.certificate.contents.statements import PAGE, STATEMENTS, statement_of
from accept.certificate.page.document import render
from accept.certificate.page.fixed_parts import field_rectangles
from accept.certificate.signature.signing import sign
from accept.certificate.trust import keys
from accept.certificate.trust.keys import TECHNICIAN
from accept.certificate.verify.against_store import check_store
from accept.certificate.verify.statements import unlisted
from accept.cli.main import app
from accept.pictures.pdf.assemble import assemble
from accept.store import open_store
from accept.store.payloads import AttemptStarted
from accept.store.seal import own_key
from specs.model import builtin_models
from tests.accept.certificate.certificate_help import signed_event
from tests.accept.certificate.verify.verify_help import verify
from tests.soak import SOAK

PHRASE = "correct horse"
UNIT = """serial = "{serial}"
kind = "apa"
[flatness]
z_um = [0, -2.5, -3, 0, -1.5, 1, -2, {last}]
[capacitance]
sensor_uF = {sensor}
actuator_uF = 9.85
[stroke]
stroke_um = {stroke}
[stiffness]
k_N_per_um = 1.69
"""


def accept(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


def verified(pdf: Path, *words: object) -> Result:
    return accept("verify", pdf, *words)


def plainly(done: Result) -> bool:
    outcome = done.stdout.removeprefix("NOT AUTHORISED by quality assurance, ")  # of a laboratory, not countersigned
    return done.exit_code == 0 and outcome.startswith("valid: ")


def unit(folder: Path, serial: str = "B-1", sensor: float = 4.99, stroke: float = 365.5, last: float = -4) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "unit.toml").write_text(UNIT.format(serial=serial, sensor=sensor, stroke=stroke, last=last))
    return folder


def certified(place: Path, name: str, spec: str = "apa-basic", **more: Any) -> Path:
    """Judged and signed by the product's own command."""
    pdf = place / f"{name}.pdf"
    accept("report", unit(place / name, **more), "--spec", spec, "--out", pdf, "--reason", "measured again")
    assert pdf.exists()
    return pdf


def forged(path: Path, contents: CertificateContent, when: datetime | None = None, *, told: bool = True) -> Path:
    """Drawn and signed with the technician's own key; the bench's store is told of it."""
    technician = keys.unlock(home(), TECHNICIAN, PHRASE)
    path.write_bytes(sign(render(contents), technician, when or datetime.now(UTC)))
    if told:
        with open_store() as store:
            store.write(signed_event(path, path.read_bytes()), contents.serial, who=technician.person)
    return path


# --- every field ------------------------------------------------------------------------------------------------------


def leaves(document: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    pairs = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    for key, value in pairs:
        yield (*at, key), value
        yield from leaves(value, (*at, key))


def changed(document: Any, at: tuple[Any, ...], left_out: bool) -> Any:
    new = copy.deepcopy(document)
    place = new
    for key in at[:-1]:
        place = place[key]
    old = place[at[-1]]
    if left_out:
        del place[at[-1]]
    elif isinstance(old, bool):
        place[at[-1]] = not old
    else:
        place[at[-1]] = old * 1.01 + 0.01 if isinstance(old, int | float) else f"{old} x"
    return new


def with_one_more(document: Any, at: tuple[Any, ...]) -> Any:
    new = copy.deepcopy(document)
    place = new
    for key in at:
        place = place[key]
    place["more"] = "x"
    return new


def mutants(documents: Mapping[str, Any]) -> Iterator[tuple[str, str, bytes]]:
    """(document, what was changed, its new content). Of the manifest every third, of the result every fifteenth; all
    of them in a soak."""
    for name, document in documents.items():
        tried = [
            (at, left_out)
            for at, value in leaves(document)
            for left_out in (True, False)
            if not (left_out and isinstance(at[-1], int)) and (left_out or not isinstance(value, dict | list))
        ]
        every = 1 if SOAK else 3 if name == MANIFEST else 15
        for at, left_out in tried[::every]:
            words = f"{'.'.join(map(str, at))}{' left out' if left_out else ''}"
            yield name, words, C.canonical(changed(document, at, left_out))
        places = [(), *(at for at, value in leaves(document) if isinstance(value, dict))]
        for at in places[::every]:
            yield name, f"{'.'.join(map(str, at))} one more key", C.canonical(with_one_more(document, at))


def page_with(page: bytes, attachments: Mapping[str, bytes]) -> bytes:
    """A drawn page with other attachments than those that it was drawn from."""
    stripped = PdfWriter(clone_from=PdfReader(io.BytesIO(page)))
    for key in ("/Names", "/AF", "/AcroForm"):
        del stripped._root_object[key]
    out = io.BytesIO()
    stripped.write(out)
    return assemble(out.getvalue(), attachments, field_rectangles(), "x")


def drawn_from(page: bytes, attachments: Mapping[str, bytes]) -> bytes | None:
    """As an insider would make it: drawn anew if the program takes these attachments, else the old page over them."""
    try:
        return render(C.read(attachments))
    except (ContentError, KeyError, TypeError, ValueError, AttributeError):
        return page_with(page, attachments) if SOAK else None


@pytest.mark.slow
def test_no_field_can_be_changed_or_left_out(tmp_path: Path) -> None:
    pdf = certified(tmp_path, "B-1", sensor=1.72, stroke=181.7)
    contents = read_contents(pdf.read_bytes())
    technician, roots, now = keys.unlock(home(), TECHNICIAN, PHRASE), [keys.ca(home())], datetime.now(UTC)
    whole, page = contents.attachments(), render(contents)
    documents = {name: json.loads(whole[name]) for name in (MANIFEST, RESULTS)}
    tried, passed = 0, []
    for name, words, content in mutants(documents):
        attachments = {**whole, name: content}
        if name == RESULTS:
            manifest = {**documents[MANIFEST], "record_sha256": hashlib.sha256(content).hexdigest()}
            attachments[MANIFEST] = C.canonical(manifest)
        unsigned = drawn_from(page, attachments)
        if unsigned is None:
            continue
        tried += 1
        report = verify(sign(unsigned, technician, now), roots, rejudge)
        if report.outcome is Validity.VALID:
            passed.append(f"{name}: {words}")
    assert tried > (40 if SOAK else 20)
    assert passed == []


def test_the_table_names_every_statement(tmp_path: Path) -> None:
    contents = read_contents(certified(tmp_path, "B-1").read_bytes())
    assert unlisted(contents) == []
    assert all(s.how for s in STATEMENTS)
    assert {name for name in written_hints(UnitRecord) if statement_of(RESULTS, name) is None} == set()
    assert statement_of(PAGE, "anything") is not None
    more = replace(contents, result={**contents.result, "remark": "accepted after review"})
    assert unlisted(more) == ["results.json: remark"]
    assert verified(forged(tmp_path / "f.pdf", more)).exit_code == 3
    more = replaced(contents, customer="somebody")
    assert verified(forged(tmp_path / "g.pdf", more)).exit_code == 3


# --- code and format switch nothing off -------------------------------------------------------------------------------


def test_another_code_hash_is_never_plainly_valid(tmp_path: Path) -> None:
    """The pictures of a good unit and false words over a bad one's data, by a program that states another hash."""
    bad = read_contents(certified(tmp_path, "B-1", sensor=1.72).read_bytes())
    good = read_contents(certified(tmp_path, "G-1", serial="G-1", stroke=366.1, last=-1).read_bytes())
    words = "CORRECTION: the verdict above was withdrawn after review, the unit is ACCEPTED."
    other = replace(bad, code_sha256="0" * 64)
    for number, contents in enumerate((other, replace(other, panels=good.panels, statement=words))):
        done = verified(forged(tmp_path / f"{number}.pdf", contents))
        assert done.exit_code == 4, done.output
        assert "made by another program" in done.stdout
    assert "says of the verdicts what this program does not say" in done.stdout
    assert "does not show the attached records" in done.output


def test_this_program_writes_one_format(tmp_path: Path) -> None:
    contents = read_contents(certified(tmp_path, "B-1").read_bytes())
    headless = replaced(contents, without="head")
    old = replace(headless, format=1, operator="Somebody Else")
    assert verified(forged(tmp_path / "f.pdf", old, told=False)).exit_code == 3
    done = verified(forged(tmp_path / "g.pdf", headless), "--trust", keys.folder(home()) / "ca.pem")
    assert (done.exit_code, "does not state: head" in done.stdout) == (4, True), done.output


def test_copies_are_looked_for_in_the_attached_records(tmp_path: Path) -> None:
    """Typed readings of A-1 under the serial X-1, with the sketches left out of the result."""
    first = read_contents(certified(tmp_path, "A-1", serial="A-1").read_bytes())
    text = first.files["unit.toml"].replace(b"A-1", b"X-1")
    digest = hashlib.sha256(text).hexdigest()
    result = {k: v for k, v in first.result.items() if k != "samples"}
    result |= {"serial": "X-1", "inputs": {"unit.toml": digest}}
    sizes = {"unit.toml": len(text)}
    again = replaced(replace(first, result=result))  # the bench signs the serial too
    copied = replace(again, files={"unit.toml": text}, inputs=dict(result["inputs"]), sizes=sizes)
    for code in (first.code_sha256, "0" * 64):
        done = verified(forged(tmp_path / "x.pdf", replace(copied, code_sha256=code)))
        assert not plainly(done)
    assert "its recordings were given for other units too" in done.output


# --- what the bench's store has ---------------------------------------------------------------------------------------


def replaced(contents: CertificateContent, *, without: str = "", **more: Any) -> CertificateContent:
    """With other statements in its provenance, signed by the bench's own key, which lies open at the bench."""
    given = {k: v for k, v in {**contents.provenance, "result": hashes_of(contents), **more}.items() if k != without}
    signature = own_key(home() / "bench.key").sign(signed_text(contents.serial, given)).hex()
    return replace(contents, provenance=given | {"signature": signature})


def _attempt(contents: CertificateContent) -> CertificateContent:
    return replaced(contents, attempt=1, replaces=None)


def _replaces(contents: CertificateContent) -> CertificateContent:
    return replaced(contents, replaces={**contents.provenance["replaces"], "verdict": "accepted"})


def _calibrated(contents: CertificateContent) -> CertificateContent:
    made_up = {"bench": "lab bench 7", "sha256": "ab" * 32, "on": "2026-11-23", "instruments": []}
    return replace(contents, result={**contents.result, "calibration": made_up})


def _values_before(contents: CertificateContent) -> CertificateContent:
    return replaced(contents, without="before")


def _earlier(contents: CertificateContent) -> CertificateContent:
    return replaced(contents, earlier={"verdicts": {"accepted": 1}, "not_accepted": None})


def _amends(contents: CertificateContent) -> CertificateContent:
    return replaced(contents, without="amends")


@pytest.mark.parametrize("change", [_attempt, _replaces, _calibrated, _values_before, _earlier, _amends])
def test_what_the_store_knows_is_compared(
    tmp_path: Path, change: Callable[[CertificateContent], CertificateContent]
) -> None:
    certified(tmp_path, "B-1", stroke=265.5)
    second = certified(tmp_path, "B-1", stroke=366.1)
    assert plainly(verified(second))
    done = verified(forged(tmp_path / "f.pdf", change(read_contents(second.read_bytes()))))
    assert done.exit_code in (3, 4), done.output


@pytest.mark.parametrize(
    ("started", "rejected_in", "stated", "plain"),
    [
        (1, "B-1", 1, False),  # a rejected attempt lies in between
        (1, "B-1", 2, True),  # and is stated
        (2, "x/attempt-1", 1, False),  # the event has another number
        (1, "x/attempt-1", 1, True),  # judged twice in the workflow
    ],
)
def test_a_folder_with_the_name_of_an_attempt_hides_none(
    tmp_path: Path, started: int, rejected_in: str, stated: int, plain: bool
) -> None:
    keys.init(home(), PHRASE, "Test Technician")
    with open_store() as store:
        store.write(AttemptStarted(started, "apa", {}, "", {}), "B-1", who="Test Technician")
    certified(tmp_path, rejected_in, stroke=265.5)
    contents = read_contents(certified(tmp_path, "x/attempt-1").read_bytes())
    if stated == 1:
        contents = replaced(contents, without="before", attempt=1, replaces=None)
    done = verified(forged(tmp_path / "f.pdf", contents))
    assert plainly(done) == plain, done.output
    assert plain or "another attempt, another replaced judgement" in done.stdout
    assert "before: 1 rejected" in done.stderr  # also within an attempt


def test_newest_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An accepted certificate of a unit that was rejected since then is neither valid nor countersigned."""
    keys.init(home(), PHRASE, "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    first = certified(tmp_path, "A-1").rename(tmp_path / "first.pdf")
    assert plainly(verified(first, "--require", "accepted,current,approved"))
    second = certified(tmp_path, "A-1", stroke=265.5)
    done = verified(first)
    assert (done.exit_code, "knows a later attempt" in done.stdout, "rejected" in done.stdout) == (4, True, True)
    assert verified(first, "--require", "current").exit_code == 3
    assert accept("countersign", first).exit_code == 4
    assert plainly(verified(second, "--require", "current"))


def test_current_needs_somebody_to_ask(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pdf, ca = certified(tmp_path, "A-1"), keys.folder(home()) / "ca.pem"
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "elsewhere"))
    done = verified(pdf, "--trust", ca, "--require", "current")
    assert (done.exit_code, "neither a store nor a list" in done.stdout) == (3, True), done.output


def test_a_signature_before_what_it_replaces(tmp_path: Path) -> None:
    certified(tmp_path, "A-1", stroke=265.5)
    contents = read_contents(certified(tmp_path, "A-1", stroke=366.1).read_bytes())
    back = forged(tmp_path / "f.pdf", contents, datetime.now(UTC) - timedelta(minutes=40))
    done = verified(back)
    assert (done.exit_code, "clock ran back" in done.stdout) == (4, True), done.output


# --- approvals --------------------------------------------------------------------------------------------------------


def own_spec(path: Path) -> Path:
    assert accept("spec", "copy", "apa-basic", path).exit_code == 0
    path.write_text(path.read_text().replace('name = "apa-basic"', 'name = "mine"'))
    return path


def test_nobody_is_named_as_approving_without_a_signature(tmp_path: Path) -> None:
    contents = read_contents(certified(tmp_path, "A-1", spec=str(own_spec(tmp_path / "mine.toml"))).read_bytes())
    for approval in ({"person": "Grace Hopper", "time": "2026-11-01"}, {"reason": "approved by Grace on the phone"}):
        done = verified(forged(tmp_path / "f.pdf", replaced(contents, approval=approval)))
        assert done.exit_code == 3, done.output


def test_an_approval_is_required_where_it_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keys.init(home(), PHRASE, "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    own = own_spec(tmp_path / "mine.toml")
    pdf = certified(tmp_path, "A-1", spec=str(own))
    assert plainly(verified(pdf))
    assert verified(pdf, "--require", "approved").exit_code == 3
    for nothing in ("", "accepted,"):  # a variable of a script that is not set
        assert verified(pdf, "--require", nothing).exit_code == 6
    assert accept("spec", "approve", own).exit_code == 0
    assert plainly(
        verified(certified(tmp_path, "A-2", serial="A-2", stroke=366, spec=str(own)), "--require", "approved")
    )


MODELLED = """name = "lab"
kind = "strut"
title = "Lab"
[checks.hysteresis]
required = false
[checks.hysteresis.limits.hysteresis_percent]
upper = 20.0
unit = "percent"
rule = "guarded"
source = "x"
[checks.misalignment]
[checks.misalignment.limits.dy_um]
lower = -100.0
upper = 100.0
unit = "um"
rule = "guarded"
source = "x"
[checks.misalignment.settings]
model = "{model}"
"""


def test_an_approval_covers_the_model_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keys.init(home(), PHRASE, "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    model, lab = tmp_path / "m.toml", tmp_path / "lab.toml"
    model.write_text(builtin_models()["strut-as-built"].read_text())
    lab.write_text(MODELLED.format(model=model))
    done = accept("spec", "approve", lab)
    assert (done.exit_code, f"{model} (m.toml " in done.stdout) == (0, True), done.output  # what is signed is said
    folder = tmp_path / "S-1"
    folder.mkdir()
    (folder / "unit.toml").write_text('serial = "S-1"\nkind = "strut"\n')
    words = ("report", folder, "--spec", lab, "--out", tmp_path / "s.pdf")
    accept(*words)
    approved = read_contents((tmp_path / "s.pdf").read_bytes())
    assert verified(tmp_path / "s.pdf", "--require", "approved").exit_code == 0
    model.write_text(model.read_text() + "\n# another arm\n")
    accept(*words)
    edited = read_contents((tmp_path / "s.pdf").read_bytes())
    assert edited.provenance["approval"] == {"reason": f"its approval does not cover the model file {model}"}
    done = verified(tmp_path / "s.pdf", "--require", "approved")
    assert (done.exit_code, "NOT APPROVED" in done.stdout) == (3, True), done.output
    pasted = replaced(edited, approval=approved.provenance["approval"])
    done = verified(forged(tmp_path / "f.pdf", pasted))
    assert (done.exit_code, "does not cover the model file" in done.stdout) == (4, True), done.output


# --- keys -------------------------------------------------------------------------------------------------------------


def test_a_lost_key_is_as_good_as_a_found_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keys.init(home(), PHRASE, "Test Technician", authority_passphrase="authority phrase")
    monkeypatch.setenv("ACCEPT_CA_PASSPHRASE", "authority phrase")
    contents = read_contents(certified(tmp_path, "A-1").read_bytes())
    pdf = forged(tmp_path / "f.pdf", contents, datetime.now(UTC) - timedelta(minutes=30))
    assert accept("keys", "revoke", "Test Technician", "--reason", "lost").exit_code == 0
    done = verified(pdf)
    assert (done.exit_code, "lost or compromised" in done.stdout) == (4, True), done.output


def test_the_store_is_asked_by_default() -> None:
    from accept.certificate.verify.rejudge import check_store as asked

    assert asked is check_store


def test_a_store_that_is_not_that_of_its_bench_knows_nothing_of_later_attempts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At a desk with a store of its own: the unit may have been rejected since, at its bench."""
    first = certified(tmp_path, "A-1").rename(tmp_path / "first.pdf")
    certified(tmp_path, "A-1", stroke=265.5)
    ca, desk = keys.folder(home()) / "ca.pem", tmp_path / "desk"
    monkeypatch.setenv("ACCEPT_HOME", str(desk))
    certified(tmp_path, "Z-9", serial="Z-9", stroke=361)
    done = verified(first, "--trust", ca, "--require", "current")
    assert (done.exit_code, "neither a store nor a list" in done.stdout) == (3, True), done.output
