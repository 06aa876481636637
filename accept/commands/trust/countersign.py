"""`accept countersign`."""

from dataclasses import dataclass
from pathlib import Path

from accept.base.console import clear_errors, say
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.certificate.certify import sign_into
from accept.certificate.contents.disposition import decided
from accept.certificate.trust import keys
from accept.certificate.trust.keys import QA
from accept.certificate.verify.rejudge import read_certificate
from accept.certificate.verify.verification import Validity
from accept.commands.trust.bench_keys import passphrase_of
from accept.commands.trust.keys import QA_PASSPHRASE
from accept.commands.trust.verify import VerifyOptions, verify_here
from accept.store import open_store


@dataclass(frozen=True)
class CountersignOptions:
    """records: folder with what was too large to attach. disposition, because: what is to be done with a unit that was
    not accepted, and why."""

    passphrase_file: Path | None = None
    records: Path | None = None
    tsa: str | None = None
    disposition: str = ""
    because: str = ""


@clear_errors
def run(path: Path, wanted: CountersignOptions) -> Exit:
    """Verify, then sign as QA and replace the file; what is not valid and judged again is not signed, and nothing that
    was not accepted without a disposition."""
    content = read_certificate(path)
    before = verify_here(content, VerifyOptions(records=wanted.records))
    for line in before.details:
        say(f"  {line}")
    if not before.valid:
        say(f"not countersigned: {before.reason}")
        return Exit.INCOMPLETE if before.outcome is Validity.SIGNED else Exit.REJECTED
    disposition = decided(before.serial, before.verdict, wanted.disposition, wanted.because)
    passphrase = passphrase_of(wanted.passphrase_file, "passphrase of the QA key: ", QA_PASSPHRASE)
    credential = keys.stamping(keys.unlock(home(), QA, passphrase), wanted.tsa, home())
    with open_store() as store:
        sign_into(path, content, credential, store, before.serial, credential.person, disposition=disposition)
    tail = f"; disposition: {disposition}" if disposition else ""
    say(f"{before.serial} {before.verdict}: countersigned by {credential.person}{tail}")
    return Exit.ACCEPTED
