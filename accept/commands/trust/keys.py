"""`accept keys`."""

import os
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer
from cryptography.hazmat.primitives.serialization import Encoding

from accept.base.atomic_files import write_atomic
from accept.base.console import operator_name
from accept.base.documents.listings import KeyList, KeyListed
from accept.base.home import home
from accept.certificate.trust import key_changes, keys
from accept.certificate.trust.authority import BENCH, QA
from accept.certificate.trust.revocation import FILE
from accept.certificate.trust.revocation_record import fault_here
from accept.commands.answer import Answer, File, Remark, command, table
from accept.commands.options import JsonAnswer
from accept.commands.trust.bench_keys import QA_PASSPHRASE, new_prompt, passphrase_of

CA_PASSPHRASE = "ACCEPT_CA_PASSPHRASE"
NEW_PASSPHRASE = "ACCEPT_NEW_PASSPHRASE"

Office = Annotated[Path | None, typer.Option("--authority", help="Folder with ca.key.pem, where it is off the bench.")]
PassphraseFile = Annotated[Path | None, typer.Option("--passphrase-file", help="File with the passphrase.")]
Who = Annotated[str, typer.Argument(help="Name of the person, or sha256 of the certificate.")]


@command
def init(
    technician: Annotated[
        str | None, typer.Option(envvar="ACCEPT_OPERATOR", help="Name on the technician's certificate.")
    ] = None,
    qa: Annotated[
        str | None, typer.Option(help="Name on a QA engineer's certificate; without it none is made.")
    ] = None,
    passphrase_file: PassphraseFile = None,
    office: Annotated[
        Path | None, typer.Option("--authority", help="Folder off the bench for the authority's key, as on a stick.")
    ] = None,
) -> Answer:
    """Make the bench's authority and the technician's key."""
    phrase = passphrase_of(passphrase_file, "passphrase of the technician's key: ", new=True)
    own = os.environ.get(CA_PASSPHRASE) or new_prompt("passphrase of the authority (empty: one is made): ")
    theirs = None
    if qa is not None:
        theirs = passphrase_of(None, f"passphrase of the QA key of {qa}: ", QA_PASSPHRASE, only=True, new=True)
    named = operator_name(technician)
    place = keys.init(home(), phrase, named, qa, theirs, authority_passphrase=own or None, office=office)
    given = f"{place / 'ca.pem'} and {FILE} beside it"
    left = (office or place) / keys.AUTHORITY_PASSPHRASE
    advice = f"the authority's passphrase is in {left}; {'keep' if office else 'move'} it and ca.key.pem off the bench"
    made = f"keys made in {place}; give {given} to everybody who verifies certificates"
    return Answer(made, None if own else Remark(advice))


@command
def show(json: JsonAnswer = None) -> Answer:
    """List the authority and every person's key."""
    known = keys.listing(home())
    warnings = _warnings(known)
    listed = [
        KeyListed(
            key.role, key.person, key.valid_from.isoformat(), key.valid_to.isoformat(),
            key.revoked.isoformat() if key.revoked else None, key.sha256,
        )
        for key in known
    ]  # fmt: skip
    rows = (
        (key.role, key.person, *(f"{day:%Y-%m-%d}" if day else "" for day in days), key.sha256)
        for key in known
        for days in [(key.valid_from, key.valid_to, key.revoked)]
    )
    shown = table(("key", "person", "valid from", "valid to", "revoked", "sha256 of the certificate"), rows)
    remarks = (Remark(f"warning: {words}") for words in warnings)
    return Answer(File(json, KeyList(tuple(listed), tuple(warnings))), shown, *remarks)


def _warnings(known: Sequence[keys.KeyInfo]) -> list[str]:
    """Return warnings about the keys of this bench, each with its remedy."""
    now = datetime.now(UTC)
    found = [
        f"the key of {key.person} ({key.role}) is valid until {key.valid_to:%Y-%m-%d}"
        for key in known
        if key.valid_to - now < keys.WARN_BEFORE
    ]
    if keys.authority_here(home()):
        there = keys.folder(home()) / f"{keys.CA}.key.pem"
        found.append(f"the authority's key lies at this bench: who opens it can sign as everybody; move {there} off it")
    fault, _ = fault_here(home(), keys.folder(home()) / FILE, keys.ca(home()))
    if keys.bench_certificate(home(), keys.ca(home())) is None:
        found.append("this bench has no certificate of the authority: accept keys request --role bench --name NAME")
    found += [words for words in (keys.bench_problem(home()), fault) if words]
    found += [f"{path} can be read by others than its owner: chmod 600" for path in keys.exposed(home())]
    return found


@command
def request(
    role: Annotated[str, typer.Option(help="technician, qa, or bench for this bench's own key.")],
    name: Annotated[str, typer.Option(help="The person, or what the bench is called.")],
    out: Annotated[Path | None, typer.Option(help="Where to write the request; else beside the key.")] = None,
    passphrase_file: PassphraseFile = None,
) -> Answer:
    """Make a person's key and the request for its certificate. Of a bench: the request for the key that it has."""
    variable = QA_PASSPHRASE if role == QA else keys.PASSPHRASE
    words, only = f"passphrase of the key of {name}: ", role == QA
    phrase = "" if role == BENCH else passphrase_of(passphrase_file, words, variable, only=only, new=True)
    made, text = key_changes.request(home(), role, name, phrase)
    beside = f"{BENCH}.request.pem" if role == BENCH else made.name.replace(".key.pem", ".request.pem")
    target = out or keys.folder(home()) / beside
    if out is not None:
        write_atomic(out, text)
    place = "" if keys.authority_here(home()) else " --authority FOLDER"
    return Answer(f"key of {name} ({role}) made in {made}; to be issued: accept keys issue {target}{place}")


@command
def issue(
    file: Annotated[Path, typer.Argument(help="The request.")],
    out: Annotated[Path | None, typer.Option(help="Where to write the certificate; else beside the key.")] = None,
    office: Office = None,
    passphrase_file: PassphraseFile = None,
) -> Answer:
    """Answer a request with the authority's key. No person gets both roles."""
    certificate = key_changes.issue_request(
        _office(office), keys.read_key_file(file), _ca_passphrase(passphrase_file), home=home()
    )
    who = f"{certificate.subject.rfc4514_string()}, valid to {certificate.not_valid_after_utc:%Y-%m-%d}"
    if out is None:
        return Answer(f"certificate of {who} in {key_changes.install(home(), certificate)}")
    write_atomic(out, certificate.public_bytes(Encoding.PEM))
    return Answer(f"certificate of {who} in {out}; on the bench: accept keys install {out}")


@command
def install(file: Annotated[Path, typer.Argument(help="The certificate that the authority issued.")]) -> Answer:
    """Put a certificate beside its key at this bench."""
    return Answer(f"certificate in {key_changes.install(home(), keys.certificate_of(file))}")


@command
def revoke(
    who: Who,
    reason: Annotated[str, typer.Option(help="left, lost or compromised.")] = "left",
    since: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d"], help="First day; else from now on.")] = None,
    office: Office = None,
    passphrase_file: PassphraseFile = None,
) -> Answer:
    """Revoke a person's keys. What was signed before stays valid, unless the key was compromised."""
    now = datetime.now(UTC).replace(microsecond=0)
    moment = datetime(since.year, since.month, since.day, tzinfo=UTC) if since else now
    whose = key_changes.revoke(home(), _office(office), who, reason, _ca_passphrase(passphrase_file), moment)
    given = keys.folder(home()) / "ca.crl.pem"
    return Answer(
        f"revoked from {moment:%Y-%m-%d %H:%M} UTC ({reason}): {', '.join(whose)}",
        Remark(f"give {given} to everybody who verifies certificates; it belongs beside ca.pem"),
    )


@command
def renew(who: Who, office: Office = None, passphrase_file: PassphraseFile = None) -> Answer:
    """Renew the certificate of a person's key, for another five years."""
    new = key_changes.renew(home(), _office(office), who, _ca_passphrase(passphrase_file))
    return Answer(f"{new.subject.rfc4514_string()}: valid to {new.not_valid_after_utc:%Y-%m-%d}")


@command
def passphrase(
    who: Annotated[str, typer.Argument(help="Name of the person, or `authority`.")],
    office: Office = None,
    passphrase_file: PassphraseFile = None,
    new_passphrase_file: Annotated[Path | None, typer.Option(help="File with the new passphrase.")] = None,
) -> Answer:
    """Change the passphrase of a key."""
    variable = CA_PASSPHRASE if who == "authority" else QA_PASSPHRASE if who == QA else keys.PASSPHRASE
    old = passphrase_of(passphrase_file, f"present passphrase of {who}: ", variable)
    new = passphrase_of(new_passphrase_file, f"new passphrase of {who}: ", NEW_PASSPHRASE, only=True, new=True)
    return Answer(f"{key_changes.change_passphrase(home(), _office(office), who, old, new)} has a new passphrase")


def _office(given: Path | None) -> Path:
    return given or keys.folder(home())


def _ca_passphrase(file: Path | None) -> str:
    """Return the authority's passphrase: from the file that is named, the environment or the terminal, and from no
    other file. A passphrase that was left at the bench does not make its user the authority."""
    return passphrase_of(file, "passphrase of the authority: ", CA_PASSPHRASE, only=True)
