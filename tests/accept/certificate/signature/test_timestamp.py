"""Trusted timestamps: asked for over HTTP of a local authority, looked at by verify, refused where they are wrong."""

import io
import time
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import requests
from asn1crypto import crl, ocsp
from cryptography.hazmat.primitives import serialization
from pyhanko.sign.validation.dss import DocumentSecurityStore
from typer.testing import CliRunner

from accept.base.home import home
from accept.certificate import SigningRefused, Validity
from accept.certificate.signature import servers, signing, stamping_authority
from accept.certificate.signature.long_term import RevocationData
from accept.certificate.signature.signing import sign
from accept.certificate.signature.stamping_authority import stamper
from accept.certificate.trust import keys
from accept.certificate.trust.revocation import Revoked
from accept.cli.main import app
from tests.accept.certificate.certificate_help import WHEN
from tests.accept.certificate.signature.time_authority import WRONG, Authority, made_authority, responder
from tests.accept.certificate.verify.verify_help import LATER, Bench, hole_of, refused, with_cms
from tests.accept.units.units import make_unit


@pytest.fixture(autouse=True)
def nothing_asked_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stamping_authority, "_asked", {})  # a port may come again


@pytest.fixture(scope="module")
def tsa() -> Authority:
    return made_authority("Local time")


@pytest.fixture(scope="module")
def stamped(bench: Bench, tsa: Authority) -> bytes:
    return sign(bench.unsigned, bench.technician, WHEN, stamping=tsa.at(WHEN + timedelta(minutes=1)))


@pytest.fixture
def server(tsa: Authority) -> Iterator[str]:
    """A responder on a port of this machine, for an authority without a list."""
    with responder([tsa]) as url:
        yield url


@pytest.fixture
def answering() -> Iterator[tuple[str, Authority]]:
    """One whose issuer answers by OCSP and has no list."""
    asked: list[Authority] = []
    with responder(asked) as url:
        asked.append(made_authority("Answering time", ocsp_at=f"{url}ocsp"))
        yield url, asked[0]


@pytest.fixture
def listed() -> Iterator[tuple[str, Authority]]:
    """One whose certificate names the place of its issuer's list."""
    asked: list[Authority] = []
    with responder(asked) as url:
        asked.append(made_authority("Listed time", f"{url}crl"))
        yield url, asked[0]


def test_verify_says_which_time_it_had(bench: Bench, stamped: bytes, tsa: Authority) -> None:
    both = sign(stamped, bench.qa, LATER)
    known = bench.check(both, stamping=[tsa.root])
    assert known.valid, known.reason
    lines = [line for line in known.details if line.startswith("time of")]
    assert "trusted timestamp of 2026" in lines[0] or "trusted timestamp of" in lines[0]
    assert "Local time" in lines[0]
    assert "ordered" in lines[1] or "order certificates" in lines[1]
    unknown = bench.check(stamped)
    assert unknown.valid
    assert any("not trusted here" in line for line in unknown.details)
    other = bench.check(stamped, stamping=[made_authority("Another").root])
    assert any("not trusted here" in line for line in other.details)


def test_a_wrong_timestamp_is_not_valid(bench: Bench, stamped: bytes, tsa: Authority) -> None:
    """Of another signature, of another day, taken out, doubled, or with anything in it changed."""
    trust = {"stamping": [tsa.root]}
    late = sign(bench.unsigned, bench.technician, WHEN, stamping=tsa.at(WHEN + timedelta(days=3)))
    refused(bench.check(late, **trust), "its timestamp says")
    foreign = sign(bench.unsigned, bench.technician, WHEN + timedelta(seconds=5), stamping=tsa.at(WHEN))
    tokens = []
    with_cms(foreign, lambda c: tokens.append(c["content"]["signer_infos"][0]["unsigned_attrs"].copy()))

    def put(content: object) -> None:
        content["content"]["signer_infos"][0]["unsigned_attrs"] = tokens[0]

    refused(bench.check(with_cms(stamped, put), **trust), "not of this signature", "canonically")
    start, end = hole_of(stamped, 0)
    used = len(stamped[start:end].rstrip(b"0"))
    for place in range(start + 2400, start + used, 211):  # behind the signature value: within the token
        changed = bytearray(stamped)
        changed[place] = ord("0") if changed[place] != ord("0") else ord("1")
        refused(bench.check(bytes(changed), **trust))


def test_a_trusted_timestamp_outlives_a_compromised_key(bench: Bench, stamped: bytes, tsa: Authority) -> None:
    entry = Revoked(bench.technician.certificate.serial_number, WHEN + timedelta(days=10), True)
    assert bench.check(bench.signed, revoked=[entry]).outcome is Validity.SIGNED
    assert bench.check(stamped, revoked=[entry]).outcome is Validity.SIGNED
    assert bench.check(stamped, revoked=[entry], stamping=[tsa.root]).outcome is Validity.VALID


def test_commands_ask_and_say(tmp_path: Path, server: str, tsa: Authority, monkeypatch: pytest.MonkeyPatch) -> None:
    pdf, unit, run = tmp_path / "a.pdf", make_unit(tmp_path / "u", "A-1"), CliRunner().invoke
    words = ["report", str(unit), "--spec", "apa-basic", "--out", str(pdf)]
    assert run(app, [*words, "--tsa", server]).exit_code == 0
    (keys.folder(home()) / "tsa.pem").write_bytes(tsa.root.public_bytes(serialization.Encoding.PEM))
    done = run(app, ["verify", str(pdf)])
    assert (done.exit_code, "trusted timestamp of" in done.stderr) == (0, True), done.output
    silent = run(app, [*words, "--tsa", "http://127.0.0.1:9/"])
    assert (silent.exit_code, "no timestamp from http://127.0.0.1:9/" in silent.stderr) == (6, True), silent.output


def test_without_an_answer_nothing_is_signed(bench: Bench) -> None:
    with pytest.raises(SigningRefused, match="nothing was signed"):
        sign(bench.unsigned, bench.technician, WHEN, stamping=stamper("http://127.0.0.1:9/"))


def test_the_list_of_revoked_keys_is_kept_with_the_certificate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As it was when the unit was judged, so that it is there when the authority is gone; one that was forged or left
    out of the authority's own says nothing."""
    from accept.certificate import read_contents
    from accept.certificate.trust import key_changes

    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple", authority_passphrase="the office")
    office = keys.folder(home())
    key_changes.revoke(home(), office, "Grace", "left", "the office", datetime.now(UTC))
    pdf, unit = tmp_path / "a.pdf", make_unit(tmp_path / "u", "A-1")
    run = CliRunner().invoke
    assert run(app, ["report", str(unit), "--spec", "apa-basic", "--out", str(pdf)]).exit_code == 0
    assert "BEGIN X509 CRL" in read_contents(pdf.read_bytes()).provenance["crl"]
    assert run(app, ["verify", str(pdf)]).exit_code == 0
    other = keys.init(tmp_path / "other", "correct horse", "Eve", authority_passphrase="the office") / "ca.pem"
    assert run(app, ["verify", str(pdf), "--trust", str(other)]).exit_code == 3


def test_the_answers_of_the_authoritys_servers_are_kept(bench: Bench, listed: tuple[str, Authority]) -> None:
    """Also beside the countersignature's, and after the servers are gone: nothing is asked in verifying."""
    url, authority = listed
    now = datetime.now(UTC)
    signed = sign(bench.unsigned, bench.technician, now, stamping=stamper(url))
    both = sign(signed, bench.qa, now, stamping=stamper(url))
    for pdf, count in ((signed, 1), (both, 2)):
        found = bench.check(pdf, stamping=[authority.root], now=now)
        assert found.valid, found.reason
        assert sum("was not revoked then, by what its servers answered" in line for line in found.details) == count
    assert not any("not revoked then" in line for line in bench.check(both, now=now).details)  # nobody trusts it here


def test_answers_by_ocsp_are_kept_too(bench: Bench, answering: tuple[str, Authority]) -> None:
    """Those that say good prove it; one that says revoked stops the signing."""
    url, authority = answering
    now = datetime.now(UTC)
    pdf = sign(bench.unsigned, bench.technician, now, stamping=stamper(url))
    assert b"/OCSPs" in pdf
    found = bench.check(pdf, stamping=[authority.root], now=now)
    assert found.valid, found.reason
    assert any("was not revoked then, by what its servers answered" in line for line in found.details), found.details
    authority.revoked.append(now - timedelta(days=1))
    stamping_authority._asked.clear()
    with pytest.raises(SigningRefused, match=r"certificate is revoked.*nothing was signed"):
        sign(bench.unsigned, bench.technician, now, stamping=stamper(url))


@pytest.mark.parametrize("what", ["old", "foreign", "revoked"])
def test_an_answer_by_ocsp_that_proves_nothing(
    what: str, bench: Bench, answering: tuple[str, Authority], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From a month before, signed by somebody else under the same name, or saying revoked: never a proof."""
    url, authority = answering
    now = datetime.now(UTC)
    signer = authority
    if what == "foreign":
        signer = replace(made_authority("Answering time"), leaf=authority.leaf)
    if what == "revoked":
        signer = replace(authority, revoked=[now - timedelta(days=1)])
    given = ocsp.OCSPResponse.load(signer.ocsp(now - timedelta(days=30 if what == "old" else 0, minutes=1)))

    async def careless(*_: object) -> RevocationData:
        return RevocationData((), (), [given])

    monkeypatch.setattr(signing, "revocation_data", careless)
    pdf = sign(bench.unsigned, bench.technician, now, stamping=stamper(url))
    details = bench.check(pdf, stamping=[authority.root], now=now).details
    said = "whose certificate had been revoked" if what == "revoked" else "is not seen here"
    assert any("time of the technician" in line and said in line for line in details), details


def test_an_authority_without_a_list_is_said(bench: Bench, stamped: bytes, tsa: Authority) -> None:
    details = bench.check(stamped, stamping=[tsa.root]).details
    assert any("this document keeps no answer of its servers" in line for line in details)


def test_a_revoked_authority_stamps_nothing(
    bench: Bench, listed: tuple[str, Authority], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is not asked where its list says so; a stamp that was made all the same is not a trusted time."""
    url, authority = listed
    now = datetime.now(UTC)
    authority.revoked.append(now - timedelta(days=1))
    with pytest.raises(SigningRefused, match=r"certificate is revoked.*nothing was signed"):
        sign(bench.unsigned, bench.technician, now, stamping=stamper(url))
    old = crl.CertificateList.load(authority.crl(now - timedelta(minutes=1)))

    async def careless(*_: object) -> RevocationData:
        return RevocationData((), [old], ())

    monkeypatch.setattr(signing, "revocation_data", careless)
    pdf = sign(bench.unsigned, bench.technician, now, stamping=stamper(url))
    lost = Revoked(bench.technician.certificate.serial_number, now + timedelta(days=10), True)
    found = bench.check(pdf, stamping=[authority.root], now=now, revoked=[lost])
    assert found.outcome is Validity.SIGNED, found.reason
    assert any("whose certificate had been revoked" in line for line in found.details)


@pytest.mark.parametrize("what", ["old", "foreign"])
def test_a_list_that_says_nothing_of_that_moment_proves_nothing(
    what: str, bench: Bench, listed: tuple[str, Authority], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From a month before, or signed by somebody else under the same name: not a reason to refuse, but no proof."""
    url, authority = listed
    now = datetime.now(UTC)
    signer = authority if what == "old" else made_authority("Listed time")
    given = crl.CertificateList.load(signer.crl(now - timedelta(days=30 if what == "old" else 0)))

    async def careless(*_: object) -> RevocationData:
        return RevocationData((), [given], ())

    monkeypatch.setattr(signing, "revocation_data", careless)
    pdf = sign(bench.unsigned, bench.technician, now, stamping=stamper(url))
    found = bench.check(pdf, stamping=[authority.root], now=now)
    assert any("time of the technician" in line and "is not seen here" in line for line in found.details), found.details


def test_what_is_kept_is_covered_by_the_signature(bench: Bench, listed: tuple[str, Authority]) -> None:
    url, authority = listed
    now = datetime.now(UTC)
    pdf = sign(bench.unsigned, bench.technician, now, stamping=stamper(url))
    start, end = hole_of(pdf, 0)
    kept = pdf.index(b"/DSS")
    assert len(bench.unsigned) < kept
    assert not start <= kept < end
    for place in (kept + 1, pdf.index(b"/CRLs") + 1):
        changed = bytearray(pdf)
        changed[place] ^= 1
        refused(bench.check(bytes(changed), stamping=[authority.root], now=now))
    later = io.BytesIO(pdf)
    DocumentSecurityStore.add_dss(later, None, crls=[crl.CertificateList.load(authority.crl(now))])
    refused(bench.check(later.getvalue(), stamping=[authority.root], now=now), "revisions")


@pytest.mark.parametrize("how", WRONG)
def test_an_answer_that_would_not_verify_signs_nothing(
    bench: Bench, tsa: Authority, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is signed with it would never verify, or the parser's error would end a batch; one that never ends would
    hold the bench up for ever, or fill its memory."""
    if how == "a byte at a time":
        monkeypatch.setattr(stamping_authority, "TIMEOUT_S", 1.0)  # its answer takes five seconds
    with responder([tsa], how) as url, pytest.raises(SigningRefused, match=WRONG[how]) as e:
        sign(bench.unsigned, bench.technician, WHEN, stamping=stamper(url))
    assert "nothing was signed" in str(e.value)


@pytest.mark.parametrize("how", ["list without end", "list a byte at a time"])
def test_a_list_without_end_is_no_list(bench: Bench, how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever runs a server that the authority's certificate names would hold the bench up, or fill its memory."""
    monkeypatch.setattr(servers, "ANSWER_S", 1.0)  # its 200 bytes take 10 s
    largest = list[int]()
    read = servers.requests.Response.iter_content

    def counted(answer: requests.Response, *size: int) -> Iterator[bytes]:
        for piece in read(answer, *size):
            largest.append(len(piece))
            yield piece

    monkeypatch.setattr(servers.requests.Response, "iter_content", counted)
    asked: list[Authority] = []
    with responder(asked, how) as url:
        asked.append(made_authority("Endless time", f"{url}crl"))
        before = time.monotonic()
        pdf = sign(bench.unsigned, bench.technician, now := datetime.now(UTC), stamping=stamper(url))
    assert time.monotonic() - before < 8.0  # three answers of a second each, beside other work
    assert sum(largest) < 2 * servers.LARGEST  # of 20e6 bytes; 65,536 at a time
    found = bench.check(pdf, stamping=[asked[0].root], now=now)
    assert any("is not seen here: this document keeps no answer of its servers" in line for line in found.details)


def test_an_authority_that_is_not_there_tells_no_secret(bench: Bench) -> None:
    with pytest.raises(SigningRefused, match="it cannot be reached") as e:
        sign(bench.unsigned, bench.technician, WHEN, stamping=stamper("http://127.0.0.1:1/?token=s3cr3t"))
    assert "s3cr3t" not in str(e.value)
