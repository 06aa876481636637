"""Opening the bench's keys for a command: which passphrase, whose key; a missing key is made."""

import getpass
import os
import sys
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

from accept.base.console import say
from accept.base.home import home
from accept.base.names import operator_name, same_person
from accept.certificate.trust import authority, keys
from accept.certificate.trust.authority import TECHNICIAN
from accept.certificate.trust.keys import Credential, KeysError
from accept.certificate.trust.revocation import FILE
from accept.certificate.trust.revocation_record import fault_here
from accept.store import BENCH_KEY
from accept.store.decisions import Opens, Signer
from specs.files import read_bounded

QA_PASSPHRASE = "ACCEPT_QA_PASSPHRASE"
DEMO = "demo"  # keys and events of the demo, apart from those of the bench: a demo must never sign as the bench
_DEMO_PASSPHRASE = "no secret"  # the demo's authority says so, and only `accept verify --demo` trusts it


def terminal_prompt(words: str) -> str | None:
    """Return the typed answer, None without a terminal."""
    return getpass.getpass(words) if sys.stdin.isatty() else None


def new_prompt(words: str) -> str | None:
    """Return a new passphrase that the person types twice, None without a terminal. Raises KeysError if the two differ:
    a mistyped one would open nothing."""
    typed = terminal_prompt(words)
    if typed and terminal_prompt("the same once more: ") != typed:
        raise KeysError("the two passphrases differ; nothing was made or changed")
    return typed


def passphrase_of(
    file: Path | None, words: str, variable: str = keys.PASSPHRASE, *, only: bool = False, new: bool = False
) -> str:
    """Return the passphrase from a file named on the command line, the environment, or the terminal. Raises KeysError.

    variable : asked before `ACCEPT_PASSPHRASE`; only : do not read `ACCEPT_PASSPHRASE`, which would be that of another
    key. new : it is asked for twice."""
    prompt = new_prompt if new else terminal_prompt
    if file is not None:
        try:
            return read_bounded(file).decode("utf-8").rstrip("\r\n")
        except OSError as e:
            raise KeysError(f"{file}: no passphrase can be read from it ({e.strerror})") from e
        except UnicodeDecodeError as e:
            raise KeysError(f"{file}: no passphrase can be read from it (it is not UTF-8)") from e
    given = os.environ.get(variable)
    if only:
        typed = given or prompt(words)
        if not typed:
            raise KeysError(f"no passphrase: set {variable}, or run in a terminal")
        return typed
    return keys.passphrase(given, prompt=(lambda: prompt(words) or "") if sys.stdin.isatty() else None)


def bench_credential(home: Path, operator: str | None, tsa: str | None = None) -> Credential | None:
    """Return the technician's key of the bench; it is made if it is missing. None, with a message, if no passphrase is
    given; the units are judged all the same. operator: the name given for the record; None means the owner of the key.
    tsa: URL of the time stamping authority to ask, if any.

    Raises KeysError, also if another person than the operator would sign: the signer is the operator on the record."""
    try:
        phrase = passphrase_of(None, f"passphrase of the technician's key in {home}: ", new=not keys.exist(home))
    except KeysError as e:
        say(f"no certificates are written: {e}")
        return None
    if not keys.exist(home):
        try:
            _make_keys(home, phrase, operator_name(operator))
        except KeysError:
            if not keys.exist(home):  # another run that began at the same moment may have made them
                raise
    warn_of_home(home)
    credential = keys.unlock(home, TECHNICIAN, phrase, _technician_choice(home, operator))
    if operator is not None and not same_person(operator, credential.person):
        raise KeysError(
            f"operator '{operator}' has no key here, {credential.person} has: who signs is the operator on the record; "
            f"leave --operator out, or `accept keys request` a key for {operator}"
        )
    exposed = (f"{path} can be read by others than its owner: chmod 600" for path in keys.exposed(home))
    for words in (credential.warning(datetime.now(UTC)), _bench_key_warning(home, credential), *exposed):
        if words:
            say(f"warning: {words}")
    return keys.stamping(credential, tsa, home)


def who_acts(given: str | None) -> str:
    """Return who acts, for the store: the holder of a key at this bench, who opens it, or else the name as typed or of
    the login. given: the name, None for the login's. Raises KeysError if the key of that name is not opened."""
    name = operator_name(given)
    held = (keys.certificate_of(path) for path in keys.person_files(home()))
    found = next((c for c in held if same_person(authority.person_of(c), name)), None)
    if found is None:
        return name
    role, person = authority.role_of(found), authority.person_of(found)
    variable = QA_PASSPHRASE if role == authority.QA else keys.PASSPHRASE
    try:
        phrase = passphrase_of(None, f"passphrase of {person} ({role}): ", variable)
        return keys.unlock(home(), role, phrase, person).person
    except KeysError as e:
        way = f"give its passphrase ({variable}), or another name (--operator)"
        raise KeysError(
            f"{person} has a key at this bench, and nothing is done in that name without it: {e}; {way}"
        ) from e


def _technician_choice(home: Path, operator: str | None) -> str | None:
    """Return the technician to choose if several have a key: the operator named, else the login name if it has a
    key."""
    there = [k.person for k in keys.listing(home) if k.role == TECHNICIAN]
    wanted = operator or operator_name(None)
    return wanted if len(there) > 1 and any(same_person(wanted, one) for one in there) else None


def _make_keys(home: Path, phrase: str, technician: str) -> None:
    place = keys.init(home, phrase, technician)
    say(f"made the bench's authority and the key of {technician} (technician) in {place}")
    say(
        f"the authority's passphrase is in {place / keys.AUTHORITY_PASSPHRASE}: move that file and "
        f"{place / 'ca.key.pem'} off the bench. "
        "Quality assurance has no key yet: `accept keys request --role qa --name NAME`"
    )


def warn_of_home(home: Path) -> None:
    """Print what this home lacks of a bench: the bench's own key that bench.pem names, and a list of revoked keys if
    its authority is of a version that wrote none. Raises KeysError, RevocationError, StoreError."""
    if not keys.exist(home):
        return
    fault, never = fault_here(home, keys.folder(home) / FILE, keys.ca(home))
    for words in (keys.bench_problem(home), f"what this bench signs verifies with exit 4: {fault}" if never else ""):
        if words:
            say(f"warning: {words}")


def _bench_key_warning(home: Path, credential: Credential) -> str | None:
    """Return why what this bench signs is not plainly valid: its own key has no certificate, or that of another
    bench."""
    if keys.bench_certificate(home, credential.ca) is not None:
        return None
    return (
        "this bench has no certificate of the authority, so that its certificates of units verify with exit 4: "
        "`accept keys request --role bench --name NAME`, then `accept keys issue` by the authority"
    )


def demo_credential(home: Path) -> Credential:
    """Return the technician's key of the demo; it is made if it is missing."""
    place = home / DEMO
    if not keys.exist(place):
        own = home / BENCH_KEY
        keys.init(
            place, _DEMO_PASSPHRASE, "Demo technician", authority_passphrase=_DEMO_PASSPHRASE, demo=True, bench_key=own
        )
    return keys.unlock(place, TECHNICIAN, _DEMO_PASSPHRASE)


def qa_credential(passphrase_file: Path | None, reason: str | None = None) -> Credential:
    """Return the opened QA key of this bench. Raises KeysError, also if the reason of the decision that it signs, which
    is stored in clear, is the passphrase."""
    warn_of_home(home())
    passphrase = passphrase_of(passphrase_file, "passphrase of the QA key: ", QA_PASSPHRASE, only=True)
    if reason is not None and reason.strip() == passphrase.strip():
        raise KeysError("the reason is the passphrase: it would be stored in clear; nothing was done")
    return keys.unlock(home(), authority.QA, passphrase)


def decision_signer(passphrase_file: Path | None, reason: str) -> Opens:
    """Return what opens the QA key of this bench, which signs decisions, once. That raises KeysError, also if the
    reason of the decision is the passphrase."""

    @cache
    def opened() -> Signer:
        credential = qa_credential(passphrase_file, reason)
        if credential.key is None:
            raise KeysError("no key found to sign a decision with")
        return Signer(credential.key, credential.certificate)

    return opened


def signer_kept_here(passphrase_file: Path | None, reason: str) -> Signer | None:
    """Return the opened QA key of this bench, None if it has none. Raises KeysError as `decision_signer`."""
    return decision_signer(passphrase_file, reason)() if any(keys.person_files(home(), authority.QA)) else None
