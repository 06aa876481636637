"""Forgeries by an insider, made of the product's own parts and signed with the right keys: none is plainly valid."""

import hashlib
import io
import json
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from cryptography import x509
from pyhanko.pdf_utils import generic
from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
from typer.testing import Result

from accept.base.home import home
from accept.certificate import CertificateContent, SigningRefused, Validity, content_of, read_contents, rejudge
from accept.certificate.contents.content import signed_text
from accept.certificate.page.document import render
from accept.certificate.signature.signing import _metadata, _signer, sign
from accept.certificate.trust import authority, key_changes, keys, revocation, spec_approval
from accept.certificate.trust.keys import QA, TECHNICIAN, Credential, KeysError
from accept.certificate.trust.revocation import Revoked
from accept.certificate.verify.rejudge import verify_file
from accept.judging import judge_unit, load_spec
from accept.store import open_store
from accept.store.seal import own_key
from accept.units import unit_folder
from accept.workflow.certify import Signing
from specs.model import builtin_models
from specs.spec import builtin
from tests.accept.certificate.certificate_help import WHEN, bench_signed, certificate_contents, judged_again, stated
from tests.accept.certificate.verify.verify_help import LATER, NOW, Bench, credentials, refused, verify
from tests.accept.units.units import make_unit
from tests.shared.command_line import accept

HERE = Path(__file__).parent
APA_02 = """
serial = "APA-02"
kind = "apa"
[flatness]
z_um = [0, -2.5, -3, 0, -1.5, 1, -2, -4]
[capacitance]
sensor_uF = {sensor}
actuator_uF = 9.85
[stroke]
stroke_um = 365.5
[stiffness]
k_N_per_um = 1.75
"""


def written(folder: Path, sensor: float) -> Path:
    folder.mkdir(parents=True)
    (folder / "unit.toml").write_text(APA_02.format(sensor=sensor))
    return folder


def judged(folder: Path, sensor: float = 4.99, spec: str = "apa-basic") -> CertificateContent:
    unit = unit_folder.read(written(folder, sensor))
    chosen = load_spec(spec)
    return content_of(
        judge_unit(unit, chosen), chosen, folder, "M. Keller",
        provenance=stated(approval={"builtin": True}),
    )  # fmt: skip


# --- 1: the authority of the demo ------------------------------------------------------------------------------------


def test_the_demo_signs_nothing_that_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Everything that opens with the passphrase in the source, and a bad unit with a good one's findings pasted in."""
    from accept.commands.trust.bench_keys import _DEMO_PASSPHRASE, demo_credential

    technician = demo_credential(home())
    place = keys.folder(home() / "demo")
    key = authority.new_key()
    leaf = key_changes.issue(place, QA, "Some Body", key.public_key(), _DEMO_PASSPHRASE)
    good, bad = judged(tmp_path / "good"), judged(tmp_path / "bad", sensor=1.72)
    pasted = replace(bad, result={**good.result, "inputs": bad.result["inputs"]})
    now = datetime.now(UTC)
    pdf = sign(sign(render(pasted), technician, now), Credential(QA, key, leaf, technician.ca), now)
    (tmp_path / "forged.pdf").write_bytes(pdf)
    plain = accept("verify", tmp_path / "forged.pdf")
    assert (plain.exit_code, "NOT VALID" in plain.stdout) == (3, True)
    as_demo = accept("verify", "--demo", tmp_path / "forged.pdf")
    assert as_demo.exit_code == 3
    assert as_demo.stdout.startswith("DEMO")
    named = accept("verify", "--trust", place / "ca.pem", tmp_path / "forged.pdf")
    assert (named.exit_code, "is that of a demo" in named.stdout) == (3, True)
    assert accept("countersign", tmp_path / "forged.pdf").exit_code == 3


# --- 2: judged again cannot be switched off --------------------------------------------------------------------------


def doctored(bad: CertificateContent, good: CertificateContent, **more: Any) -> CertificateContent:
    """The inputs of a bad unit, the findings of a good one, and what else."""
    inputs = dict(bad.inputs) | more.pop("inputs", {})
    return replace(bad, result={**good.result, "inputs": inputs}, inputs=inputs, **more)


def test_a_phantom_input_is_found(bench: Bench, tmp_path: Path) -> None:
    good, bad = judged(tmp_path / "good"), judged(tmp_path / "bad", sensor=1.72)
    phantom = {"huge.mat": "0" * 64}
    forged = doctored(bad, good, inputs=phantom, sizes={**bad.sizes, "huge.mat": 10**9})
    pdf = sign(render(forged), bench.technician, WHEN)
    refused(verify(pdf, bench.trust, rejudge, NOW), "unit.toml names no such file")


def test_a_record_is_not_left_out_by_claiming_its_size(bench: Bench, tmp_path: Path) -> None:
    """Named in unit.toml and said to be large: the other sections are judged all the same, and it is not valid."""
    good, bad = judged(tmp_path / "good"), judged(tmp_path / "bad", sensor=1.72)
    text = bad.files["unit.toml"].replace(b"stroke_um = 365.5", b'one_stack = "a.mat"\ntwo_stacks = "b.mat"')
    named = {"a.mat": "0" * 64, "b.mat": "1" * 64}
    forged = doctored(bad, good, inputs=named, files={"unit.toml": text})
    digest = hashlib.sha256(text).hexdigest()
    inputs = {**forged.inputs, "unit.toml": digest}
    forged = replace(forged, inputs=inputs, result={**forged.result, "inputs": inputs})
    small = sign(render(replace(forged, sizes={"a.mat": 100, "b.mat": 100})), bench.technician, WHEN)
    refused(verify(small, bench.trust, rejudge, NOW), "although there is room for it")
    large = sign(render(replace(forged, sizes={"a.mat": 10**9, "b.mat": 10**9})), bench.technician, WHEN)
    refused(verify(large, bench.trust, rejudge, NOW), "sensor_uF")


@pytest.mark.parametrize("name", ["results.json", "Manifest.JSON", "a/../spec.toml", "spec-models/0/m.toml"])
def test_names_that_a_certificate_keeps_are_refused(tmp_path: Path, name: str) -> None:
    folder = written(tmp_path / "unit", 4.99)
    text = (folder / "unit.toml").read_text().replace("stroke_um = 365.5", f'one_stack = "{name}"')
    (folder / "unit.toml").write_text(text)
    with pytest.raises(unit_folder.UnitError, match="keeps this name for itself"):
        unit_folder.read(folder)


def test_a_verdict_that_does_not_follow_from_its_numbers_is_found(bench: Bench, tmp_path: Path) -> None:
    bad = judged(tmp_path / "bad", sensor=1.72)
    findings = [{**f, "verdict": "pass"} for f in bad.result["findings"]]
    forged = replace(bad, result={**bad.result, "findings": findings, "verdict": "accepted"})
    refused(verify(sign(render(forged), bench.technician, WHEN), bench.trust, rejudge, NOW), "contradicts itself")


def test_countersigning_waits_until_it_was_judged_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from accept.certificate.verify import attachments

    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    monkeypatch.setattr(attachments, "SIZE_LIMIT", 0)
    monkeypatch.setattr(content_of, "__defaults__", (0, {}, None))
    unit, pdf = make_unit(tmp_path / "unit", "A-1"), tmp_path / "a.pdf"
    (unit / "heights.csv").write_text("x_mm,y_mm,z_um\n" + "".join(f"{x},{x * x % 7},{x % 3}\n" for x in range(8)))
    text = (unit / "unit.toml").read_text()
    start = text.index("z_um")
    text = text[:start] + 'points = "heights.csv"' + text[text.index("\n", start) :]
    (unit / "unit.toml").write_text(text)
    assert accept("report", unit, "--spec", "apa-basic", "--out", pdf).exit_code in (0, 3, 4)
    plain = accept("verify", pdf)
    assert plain.exit_code == 4, plain.output
    assert "not judged again: flatness" in plain.stdout
    assert accept("countersign", pdf).exit_code == 4
    assert accept("verify", pdf, "--records", unit).exit_code == 0
    decided = ("--disposition", "rework", "--because", "flatness")  # of a unit that was not accepted
    assert accept("countersign", pdf, "--records", unit, *decided).exit_code == 0
    assert accept("verify", pdf, "--records", unit, "--require", "countersigned").exit_code == 0


def test_what_is_required_beside_validity(tmp_path: Path) -> None:
    pdf = tmp_path / "a.pdf"
    accept("report", written(tmp_path / "bad", 1.72), "--spec", "apa-basic", "--out", pdf)
    assert accept("verify", pdf).exit_code == 0
    renamed = ["--require", "serial=APA-03"]  # a good unit's certificate under the name of a bad one
    for words in (["--require", "accepted"], ["--require", "countersigned"], ["--spec", "apa"], renamed):
        done = accept("verify", pdf, *words)
        assert (done.exit_code, "BUT NOT AS REQUIRED" in done.stdout) == (3, True), words
    assert accept("verify", pdf, "--spec", "apa-basic", "--require", "serial=APA-02").exit_code == 0
    assert accept("verify", pdf, "--require", "perfect").exit_code == 6


# --- 4: four eyes are those of two persons ---------------------------------------------------------------------------


def test_one_person_never_has_both_roles(tmp_path: Path) -> None:
    with pytest.raises(KeysError, match="cannot be both"):
        keys.init(tmp_path, "correct horse", "Ada  Lovelace", "ada lovelace", "battery staple")
    with pytest.raises(KeysError, match="passphrase of its own"):
        keys.init(tmp_path, "correct horse", "Ada", "Grace", "correct horse")
    keys.init(tmp_path, "correct horse", "Ada", authority_passphrase="authority phrase")
    office = keys.folder(tmp_path)
    _, asked = key_changes.request(tmp_path, QA, "ADA", "battery staple")
    with pytest.raises(KeysError, match="is known as technician"):
        key_changes.issue_request(office, asked, "authority phrase")
    _, asked = key_changes.request(tmp_path, QA, "Grace", "battery staple")
    with pytest.raises(KeysError, match="does not open"):
        key_changes.issue_request(office, asked, "correct horse")  # the technician's opens nothing of the authority
    key_changes.install(tmp_path, key_changes.issue_request(office, asked, "authority phrase"))
    assert keys.unlock(tmp_path, QA, "battery staple").person == "Grace"
    ada = keys.certificate_of(office / "technician.pem").public_key()
    with pytest.raises(KeysError, match="a key has one role"):
        key_changes.issue(office, QA, "Mallory", ada, "authority phrase")


def test_signatures_of_one_person_in_two_roles_are_not_valid(bench: Bench) -> None:
    technician, qa = credentials("M. Keller", "m.  KELLER")
    pdf = sign(sign(bench.unsigned, technician, WHEN), qa, LATER)
    refused(verify(pdf, [technician.ca], lambda _: judged_again(), NOW), "as technician and as quality assurance")


def test_a_fresh_bench_has_no_qa_key(tmp_path: Path) -> None:
    done = accept("report", written(tmp_path / "u", 4.99), "--spec", "apa-basic", "--out", tmp_path / "a.pdf")
    assert done.exit_code == 0
    left = keys.folder(home()) / keys.AUTHORITY_PASSPHRASE
    assert str(left) in done.stderr
    assert "off the bench" in done.stderr
    assert left.stat().st_mode & 0o077 == 0
    assert [k.role for k in keys.listing(home())] == ["ca", TECHNICIAN, "bench"]
    with pytest.raises(KeysError, match="no key for the role 'qa'"):
        keys.unlock(home(), QA, "correct horse")
    other = accept("report", tmp_path / "u", "--spec", "apa-basic", "--operator", "Eve", "--out", tmp_path / "b.pdf")
    assert (other.exit_code, "has no key here" in other.stderr) == (6, True)


def test_a_revoked_key_is_honoured_by_date(bench: Bench) -> None:
    number = bench.qa.certificate.serial_number
    for days, compromised, expected in (
        (-1, False, Validity.NOT_VALID), (1, False, Validity.VALID), (1, True, Validity.SIGNED),
    ):  # fmt: skip
        entry = revocation.Revoked(number, LATER + timedelta(days=days), compromised)
        report = bench.check(bench.countersigned, revoked=[entry])
        assert report.outcome is expected, report.reason
    assert bench.check(bench.signed, revoked=[entry]).valid


def test_a_list_of_revoked_keys_counts_only_with_its_signature(tmp_path: Path) -> None:
    keys.init(tmp_path, "correct horse", "Ada", "Grace", "battery staple", authority_passphrase="authority phrase")
    office = keys.folder(tmp_path)
    key_changes.revoke(tmp_path, office, "Ada", "left", "authority phrase", datetime.now(UTC))
    assert [k.person for k in keys.listing(tmp_path) if k.revoked] == ["Ada"]
    with pytest.raises(KeysError, match="was revoked"):
        keys.unlock(tmp_path, TECHNICIAN, "correct horse")
    foreign = authority.new_key()
    (office / revocation.FILE).write_bytes(revocation.made(keys.ca(tmp_path), foreign, number=9))
    with pytest.raises(revocation.RevocationError, match="is not signed by the authority"):
        keys.unlock(tmp_path, TECHNICIAN, "correct horse")


def test_keys_run_out_are_renewed_and_have_another_passphrase(tmp_path: Path) -> None:
    long_ago = datetime.now(UTC) - timedelta(days=365 * 5 - 30)
    keys.init(tmp_path, "correct horse", "Ada", when=long_ago, authority_passphrase="authority phrase")
    office, now = keys.folder(tmp_path), datetime.now(UTC)
    assert "is valid until" in str(keys.unlock(tmp_path, TECHNICIAN, "correct horse").warning(now))
    with pytest.raises(KeysError, match="ran out"):
        keys.unlock(tmp_path, TECHNICIAN, "correct horse", now=now + timedelta(days=60))
    key_changes.renew(tmp_path, office, "Ada", "authority phrase")
    renewed = keys.unlock(tmp_path, TECHNICIAN, "correct horse", now=now + timedelta(days=60))
    assert renewed.warning(now) is None
    for who, old in (("Ada", "correct horse"), ("authority", "authority phrase")):
        with pytest.raises(KeysError, match="expected 8 or more"):
            key_changes.change_passphrase(tmp_path, office, who, old, "short")
        key_changes.change_passphrase(tmp_path, office, who, old, f"another {who}")
    assert keys.unlock(tmp_path, TECHNICIAN, "another Ada").person == "Ada"
    key_changes.renew(tmp_path, office, "Ada", "another authority")


# --- 7: the page ------------------------------------------------------------------------------------------------------


def overlaid(pdf: bytes, credential: Credential, change: Callable[[IncrementalPdfFileWriter], None]) -> bytes:
    """Signed as it should be, but in the revision of the signature something else is changed too."""
    from pyhanko.sign.signers import PdfSigner

    writer = IncrementalPdfFileWriter(io.BytesIO(pdf))
    change(writer)
    out = io.BytesIO()
    PdfSigner(_metadata(credential, None), signer=_signer(credential)).sign_pdf(writer, output=out)
    return out.getvalue()


def green(writer: IncrementalPdfFileWriter) -> None:
    stream = generic.StreamObject(
        stream_data=b"0 0.6 0 rg 250 700 250 80 re f BT /F1 40 Tf 260 720 Td (ACCEPTED) Tj ET"
    )
    writer.add_stream_to_page(0, writer.add_object(stream))


def test_nothing_is_drawn_over_the_page_while_it_is_signed(bench: Bench) -> None:
    refused(
        bench.check(overlaid(bench.unsigned, bench.technician, green)), "holds more than a signature", "was changed"
    )


def test_a_page_that_adds_a_verdict_is_not_valid_in_any_version(bench: Bench, tmp_path: Path) -> None:
    """With an unknown hash of the program the page cannot be drawn again: what it says is compared, and it is never
    plainly valid."""
    contents = replace(certificate_contents(tmp_path), code_sha256="0" * 64)
    writer = IncrementalPdfFileWriter(io.BytesIO(render(contents)))
    green(writer)
    out = io.BytesIO()
    writer.write(out)
    from pypdf import PdfWriter

    flat, whole = io.BytesIO(), PdfWriter(clone_from=io.BytesIO(out.getvalue()))
    whole.metadata = {"/Producer": "another"}  # no time of change: signing would write another one a second later
    whole.write(flat)
    report = bench.check(sign(flat.getvalue(), bench.technician, WHEN))
    assert not report.valid
    assert "shows 'ACCEPTED'" in report.reason or report.outcome is Validity.SIGNED


# --- 6: any spec -----------------------------------------------------------------------------------------------------


def test_a_spec_of_ones_own_is_named_and_said_not_to_be_approved(tmp_path: Path) -> None:
    own, pdf = tmp_path / "own.toml", tmp_path / "a.pdf"
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    assert accept("spec", "copy", "apa-basic", own).exit_code == 0
    own.write_text(own.read_text().replace("lower = 4.4", "lower = 0.1"))
    unit = written(tmp_path / "u", 1.72)
    assert accept("report", unit, "--spec", own, "--out", pdf).exit_code == 0  # by these limits it is accepted
    done = accept("verify", pdf)
    assert (done.exit_code, "not approved" in done.stderr) == (0, True)
    assert accept("verify", pdf, "--spec", "apa-basic").exit_code == 3
    phrase = tmp_path / "qa"
    phrase.write_text("battery staple")
    assert accept("spec", "approve", own, "--passphrase-file", phrase).exit_code == 0
    assert accept("report", unit, "--spec", own, "--out", pdf).exit_code == 0
    done = accept("verify", pdf)
    assert (done.exit_code, "approved by Grace" in done.stderr) == (0, True), done.output


def test_a_spec_with_the_name_of_a_built_in_one_is_not_plainly_valid(tmp_path: Path) -> None:
    own, pdf = tmp_path / "apa-basic.toml", tmp_path / "a.pdf"
    own.write_text(builtin()["apa-basic"].read_text().replace("lower = 4.4", "lower = 0.1"))
    accept("report", written(tmp_path / "u", 1.72), "--spec", own, "--out", pdf)
    done = accept("verify", pdf)
    assert (done.exit_code, "bears the name of a built-in" in done.stdout) == (4, True), done.output


def test_a_spec_is_not_approved_by_a_key_that_was_revoked(bench: Bench, tmp_path: Path) -> None:
    """Whoever finds a lost key of quality assurance can sign an approval of his own; one of before still counts, unless
    somebody else had the key."""
    own = tmp_path / "own.toml"
    text = builtin()["apa-basic"].read_text().replace('"apa-basic"', '"own"')
    own.write_text(text.replace("lower = 4.4", "lower = 0.1"))
    spec = load_spec(str(own))
    unit = unit_folder.read(written(tmp_path / "u", 1.72))

    def verified(since: datetime, compromised: bool) -> Validity:
        said = stated(bench.technician.ca, "APA-02", approval=spec_approval.approve(spec, bench.qa, LATER))
        contents = content_of(judge_unit(unit, spec), spec, unit.path, "M. Keller", provenance=said)
        revoked = [Revoked(bench.qa.certificate.serial_number, since, compromised)]
        pdf = sign(render(bench_signed(contents)), bench.technician, LATER)
        return verify(pdf, bench.trust, rejudge, now=NOW, revoked=revoked).outcome

    day = timedelta(days=1)
    assert verified(LATER - day, compromised=False) is Validity.NOT_VALID
    assert verified(LATER + day, compromised=False) is Validity.VALID
    assert verified(LATER + day, compromised=True) is Validity.SIGNED


# --- 3 and 8: what the bench's store says of a certificate -----------------------------------------------------------


def reported(folder: Path) -> Path:
    pdf = folder / "a.pdf"
    assert accept("report", written(folder / "u", 4.99), "--spec", "apa-basic", "--out", pdf).exit_code == 0
    return pdf


def test_a_certificate_of_a_store_that_was_rewritten_is_not_plainly_valid(tmp_path: Path) -> None:
    """An insider with the bench's own key puts an old store in its place, or writes the chain again from some event on,
    heads and seal as well: the store holds in itself, and no certificate of before does."""
    for number in range(4):
        with open_store() as store:
            store.append("noted", f"U-{number}", {"verdict": "rejected"}, who="Ann")
    pdf = reported(tmp_path)
    done = accept("verify", pdf)
    assert (done.exit_code, "store holds that it was signed" in done.stderr) == (0, True), done.output
    with open_store() as store:
        events = list(store.events())
    for file in home().glob("store.*"):
        file.unlink()
    with open_store() as store:  # the same program, the same bench key: every hash, head and seal is right
        for event in events:
            payload = event.data | ({"verdict": "accepted"} if event.seq == 2 else {})
            store.append(event.what, event.subject, payload, who=event.who, spec=event.spec)
    assert accept("store", "check").exit_code == 0
    done = accept("verify", pdf)
    assert (done.exit_code, "does not hold event" in done.stdout) == (4, True), done.output


def test_a_certificate_that_the_store_never_heard_of_is_not_plainly_valid(tmp_path: Path) -> None:
    """Signed with the technician's own key and the bench's by a program of his own, with the head of the day: he
    measured until it was good, and left the other attempts out."""
    pdf = reported(tmp_path)
    technician = keys.unlock(home(), TECHNICIAN, "correct horse")
    with open_store() as store:
        head = store.signed_head()
    contents = read_contents(pdf.read_bytes())

    def signed(name: str, head: dict[str, Any] | None) -> Result:
        given = {k: v for k, v in {**contents.provenance, "head": head}.items() if v is not None or k == "replaces"}
        given["signature"] = own_key(home() / "bench.key").sign(signed_text(contents.serial, given)).hex()
        aside = replace(contents, provenance=given)
        (tmp_path / name).write_bytes(sign(render(aside), technician, datetime.now(UTC)))
        return accept("verify", tmp_path / name)

    done = signed("b.pdf", head.to_json())
    assert (done.exit_code, "does not hold that it was signed" in done.stdout) == (4, True), done.output
    assert accept("verify", pdf).exit_code == 0
    assert signed("d.pdf", None).exit_code == 4
    done = signed("c.pdf", head.to_json() | {"seq": 1})
    assert (done.exit_code, "changed after the bench signed it" in done.stdout) == (3, True), done.output


def test_the_workflow_countersigns_no_certificate_of_a_revoked_key(tmp_path: Path) -> None:
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple", authority_passphrase="the office")
    pdf = reported(tmp_path)
    office, gone = keys.folder(home()), datetime.now(UTC) + timedelta(hours=1)
    key_changes.revoke(home(), office, "Test Technician", "compromised", "the office", gone)
    attempt = SimpleNamespace(certificate=str(pdf))
    session = SimpleNamespace(
        home=home(), operator="Grace", serial="APA-02", attempt=attempt, folder=tmp_path / "u", training=False,
        refresh=lambda: SimpleNamespace(seq=0), store=SimpleNamespace(events=lambda *_: []),
    )  # fmt: skip
    with pytest.raises(SigningRefused, match="compromised"):
        Signing(session).countersign("battery staple")


# --- before this change ----------------------------------------------------------------------------------------------


def test_a_certificate_from_before_still_has_an_answer() -> None:
    """Made by the program as it was: signed and judged again; what it lacks is said."""
    ca = x509.load_pem_x509_certificate((HERE / "before" / "ca.pem").read_bytes())
    report = verify_file(HERE / "before" / "APA-02.pdf", [ca])
    assert report.outcome is Validity.SIGNED, report.reason
    assert (report.serial, report.verdict) == ("APA-02", "accepted")
    assert "page not compared" in report.reason
    assert "made by another program" in report.reason
    judged_again_line = next(line for line in report.details if line.startswith("judged again"))
    assert "the same values, limits and verdicts" in judged_again_line
    assert "does not state" in judged_again_line
    assert sum("not stated" in line for line in report.details) >= 3


def test_the_manifest_says_what_replaces_what(bench: Bench, tmp_path: Path) -> None:
    unit, pdf = written(tmp_path / "u", 1.72), tmp_path / "a.pdf"
    accept("report", unit, "--spec", "apa-basic", "--out", pdf)
    (unit / "unit.toml").write_text(APA_02.format(sensor=4.99))
    accept("report", unit, "--spec", "apa-basic", "--out", pdf)
    done = accept("verify", pdf)
    assert "attempt: 2, replaces 'rejected' of" in done.stderr
    assert "calibration: not stated" in done.stderr
    assert json.loads(json.dumps(judged(tmp_path / "x").manifest()))["format"] == 2


# --- 9: a model file that a spec names -------------------------------------------------------------------------------


def test_a_model_file_that_changed_after_certification_is_found(tmp_path: Path) -> None:
    """Named by a check's setting, without [gap]: it is judged again, not 'unchanged', and its file is in the
    certificate, so that another one in its place is not valid."""
    model, own, unit = tmp_path / "m.toml", tmp_path / "own.toml", tmp_path / "u"
    model.write_text(builtin_models()["strut-as-built"].read_text())
    own.write_text(
        'name = "own"\nkind = "strut"\ntitle = "x"\n[checks.hysteresis.limits.hysteresis_percent]\nupper = 20.0\n'
        'unit = "percent"\nrule = "simple"\nsource = "test"\n[checks.misalignment]\n'
        '[checks.misalignment.limits.dx_um]\nupper = 50.0\nunit = "um"\nrule = "simple"\nsource = "test"\n'
        f'[checks.misalignment.settings]\nmodel = "{model}"\n'
    )
    unit.mkdir()
    (unit / "unit.toml").write_text('serial = "S-1"\nkind = "strut"\n')
    words = ("batch", unit, "--spec", own, "--out", tmp_path / "out")
    accept(*words)
    pdf = tmp_path / "out" / "certificates" / "S-1.pdf"
    assert "S-1: unchanged" in accept(*words).stderr
    before = read_contents(pdf.read_bytes())
    assert list(before.result["models"]) == [str(model)]
    assert model.read_bytes() in before.models[str(model)].values()
    assert accept("verify", pdf).exit_code == 0

    model.write_text(model.read_text() + "\n# another tolerance\n")
    again = accept(*words)
    assert "unchanged" not in again.stderr
    after = read_contents(pdf.read_bytes())
    assert after.result["models"] != before.result["models"]
    assert accept("verify", pdf).exit_code == 0


# --- what the bench signed, beside another result --------------------------------------------------------------------


def test_the_bench_signs_what_it_states_for_one_result(tmp_path: Path) -> None:
    """The provenance of a rejected attempt under an accepted result, by the technician's key alone, away from the
    bench. Red before: the bench signed no result."""
    pdf = tmp_path / "a.pdf"
    accept("report", written(tmp_path / "u", 1.72), "--spec", "apa-basic", "--out", pdf)
    technician, honest = keys.unlock(home(), TECHNICIAN, "correct horse"), read_contents(pdf.read_bytes())
    trust = [keys.ca(home())]
    assert "which signed the result and" in " ".join(verify(pdf.read_bytes(), trust, rejudge).details)
    good = replace(judged(tmp_path / "good"), operator=honest.operator, provenance=honest.provenance)
    found = verify(sign(render(good), technician, datetime.now(UTC)), trust, rejudge)
    refused(found, "for another result")
    given = {k: v for k, v in honest.provenance.items() if k not in ("result", "signature")}  # as signed before
    given["signature"] = own_key(home() / "bench.key").sign(signed_text(honest.serial, given)).hex()
    earlier = replace(honest, provenance=given, code_sha256="0" * 64)
    found = verify(sign(render(earlier), technician, datetime.now(UTC)), trust, rejudge)
    assert found.outcome is Validity.SIGNED
    assert any("did not sign the result" in line for line in found.details), found.details
