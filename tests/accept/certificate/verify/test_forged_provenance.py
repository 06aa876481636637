"""Every statement of the provenance is changed, one at a time, by a forger who has the technician's key and the bench's
own key, and who tells the store that the technician signed it. At the bench none is plainly valid. Away from it a
change that is plainly valid is of a field that `accept verify` names as not looked up."""

import copy
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from accept.base.home import home
from accept.certificate import CertificateContent, Validity, Verification, read_contents, rejudge
from accept.certificate.contents.content import signed_text
from accept.certificate.page.document import render
from accept.certificate.signature.signing import sign
from accept.certificate.trust import keys
from accept.certificate.trust.keys import TECHNICIAN, Credential
from accept.certificate.trust.revocation import FILE, revoked_in
from accept.certificate.verify.against_store import check_store
from accept.certificate.verify.ports import Known
from accept.store import open_store
from accept.store.seal import own_key
from tests.accept.certificate.certificate_help import signed_event
from tests.accept.certificate.verify.test_statements import (
    PHRASE,
    accept,
    certified,
    leaves,
    own_spec,
    plainly,
    verified,
)
from tests.accept.certificate.verify.verify_help import verify
from tests.shared.kept_folder import KeptFolder, kept
from tests.soak import SOAK

LABORATORY = """name = "Acceptance laboratory"
address = "Example road 1"
site = "hall 2"
accreditation = "none"
customer = "Observatory"
sampling = "every unit"
certificate_number = "AC-{year}-{serial}/{attempt}"
[methods]
capacitance = "MP-02, revision 3"
others = "MP-01, revision 1"
"""
ABSENT = ("crl", "authority", "before", "laboratory", "number", "reason")  # a bench without them has nothing to state
EVERY = 1 if SOAK else 10  # of the mutants


def certify_twice(place: Path) -> None:
    """A second attempt at a bench with every statement that a provenance can have."""
    keys.init(home(), PHRASE, "Test Technician", "Grace", "battery staple", authority_passphrase="authority phrase")
    assert accept("keys", "request", "--role", "technician", "--name", "Eve").exit_code == 0
    assert accept("keys", "issue", keys.folder(home()) / "technician-eve.request.pem").exit_code == 0
    assert accept("keys", "revoke", "Eve", "--reason", "left").exit_code == 0
    (home() / "laboratory.toml").write_text(LABORATORY)
    spec = own_spec(place / "mine.toml")
    assert accept("spec", "approve", spec).exit_code == 0
    certified(place, "B-1", spec=str(spec), stroke=181.7)
    assert plainly(verified(certified(place, "B-1", spec=str(spec), stroke=366.1)))


twice_certified = kept(certify_twice, ACCEPT_CA_PASSPHRASE="authority phrase", ACCEPT_QA_PASSPHRASE="battery staple")


@pytest.fixture
def contents(twice_certified: KeptFolder, monkeypatch: pytest.MonkeyPatch) -> CertificateContent:
    whole = read_contents((twice_certified.put_back(monkeypatch) / "B-1.pdf").read_bytes())
    absent = {"head", "bench", "signature", "crl", "authority", "before", "laboratory", "number", "replaces"}
    assert absent <= whole.provenance.keys()
    return whole


def provenances(given: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield what was changed, and the provenance with it."""
    for at, value in [((), given), *leaves(given)]:
        for change in ("left out", "nothing", "one more key") if at else ("one more key",):
            new = copy.deepcopy(given)
            place: Any = new
            for key in at[:-1]:
                place = place[key]
            if change == "left out":
                del place[at[-1]]
            elif change == "nothing" and value is not None:
                place[at[-1]] = None
            elif change == "one more key" and isinstance(value, dict):
                (place[at[-1]] if at else place)["more"] = "x"
            else:
                continue
            yield f"{'.'.join(at)} {change}", new
        if at and not isinstance(value, dict | list):
            new = copy.deepcopy(given)
            place = new
            for key in at[:-1]:
                place = place[key]
            place[at[-1]] = other(value)
            yield f"{'.'.join(at)} changed", new


def other(value: Any) -> Any:
    """Return another value of the same kind."""
    match value:
        case bool():
            return not value
        case int() | float():
            return value + 1
        case _:
            return f"{value}x"


def forged(contents: CertificateContent, words: str, given: dict[str, Any], technician: Credential) -> bytes | None:
    """Sign as bench and technician; None if the program draws no such page."""
    if not words.startswith("signature"):
        key = own_key(home() / "bench.key")
        given = given | {"signature": key.sign(signed_text(contents.serial, given)).hex()}
    try:
        page = render(replace(contents, provenance=given))
    except (KeyError, TypeError, ValueError, AttributeError):
        return None
    return sign(page, technician, datetime.now(UTC))


def told(contents: CertificateContent, pdf: bytes) -> None:
    """Tell the bench's store that it was signed."""
    with open_store() as store:
        store.write(signed_event(Path("forged.pdf"), pdf), contents.serial, who="Test Technician")


def checked(pdf: bytes, known: Known | None = None) -> Verification:
    place = keys.folder(home())
    return verify(pdf, [keys.ca(home())], rejudge, revoked=revoked_in(place / FILE, keys.ca(home())), known=known)


@pytest.mark.parametrize("code", ["", "0" * 64], ids=["this program", "another"])
def test_the_operator_is_the_name_in_the_signers_certificate(contents: CertificateContent, code: str) -> None:
    """To the letter on a page of this program: signs that no comparison of persons weighs draw lines on it."""
    technician = keys.unlock(home(), TECHNICIAN, PHRASE, "Test Technician")
    written = replace(contents, operator=f"{'-' * 40} TEST TECHNICIAN", code_sha256=code or contents.code_sha256)
    report = checked(sign(render(written), technician, datetime.now(UTC)))
    assert (report.outcome is Validity.NOT_VALID) is (not code), report.reason
    assert ("but Test Technician signed as technician" in report.reason) is (not code)


@pytest.mark.slow
def test_no_statement_can_be_changed_with_the_key_of_the_bench(contents: CertificateContent) -> None:
    technician = keys.unlock(home(), TECHNICIAN, PHRASE, "Test Technician")
    again = forged(contents, "", dict(contents.provenance), technician)
    assert again is not None
    told(contents, again)
    assert checked(again, check_store).valid  # what it states is true
    tried, at_the_bench, unnamed = 0, [], []
    for words, given in list(provenances(dict(contents.provenance)))[::EVERY]:
        pdf = forged(contents, words, given, technician)
        if pdf is None:
            continue
        tried += 1
        told(contents, pdf)
        if checked(pdf, check_store).valid:
            at_the_bench.append(words)
        away = checked(pdf)
        field = f"provenance.{words.split('.')[0].split(' ')[0]}"
        if away.valid and field not in named(away) and words.split(" ")[0] not in ABSENT:
            unnamed.append(words)
    assert (at_the_bench, unnamed) == ([], [])
    assert tried * EVERY > 100


def named(report: Verification) -> list[str]:
    """Return the fields that are said not to have been looked up."""
    line = next((line for line in report.details if line.startswith("not looked up")), ": ")
    return line.split(": ")[1].split(", ")
