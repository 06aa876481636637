"""`accept countersign`."""

from pathlib import Path

from accept.base.console import clear_errors, say
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.certificate.certify import sign_into
from accept.certificate.trust import keys
from accept.certificate.trust.keys import QA
from accept.certificate.verify.rejudge import read_certificate
from accept.certificate.verify.verification import Validity
from accept.commands.trust.bench_keys import passphrase_of
from accept.commands.trust.keys import QA_PASSPHRASE
from accept.commands.trust.verify import VerifyOptions, verify_here
from accept.store import open_store


@clear_errors
def run(path: Path, passphrase_file: Path | None, records: Path | None = None, tsa: str | None = None) -> Exit:
    """Verify, then sign as QA and replace the file; what is not valid and judged again is not signed."""
    content = read_certificate(path)
    before = verify_here(content, VerifyOptions(records=records))
    for line in before.details:
        say(f"  {line}")
    if not before.valid:
        say(f"not countersigned: {before.reason}")
        return Exit.INCOMPLETE if before.outcome is Validity.SIGNED else Exit.REJECTED
    credential = keys.unlock(home(), QA, passphrase_of(passphrase_file, "passphrase of the QA key: ", QA_PASSPHRASE))
    credential = keys.stamping(credential, tsa, home())
    with open_store() as store:
        sign_into(path, content, credential, store, before.serial, credential.person)
    say(f"{before.serial} {before.verdict}: countersigned by {credential.person}")
    return Exit.ACCEPTED
