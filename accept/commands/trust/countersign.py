"""`accept countersign`."""

from pathlib import Path

from accept.base.console import clear_errors, say
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.certificate import keys
from accept.certificate.certify import sign_into
from accept.certificate.keys import QA
from accept.commands.trust.bench_keys import passphrase_of
from accept.commands.trust.keys import QA_PASSPHRASE
from accept.commands.trust.verify import verify_here
from accept.store import open_store


@clear_errors
def run(path: Path, passphrase_file: Path | None) -> Exit:
    """Verify, then sign as QA and replace the file; what does not verify is not signed."""
    content = path.read_bytes()
    before = verify_here(content, [])
    if not before.valid:
        say(f"not countersigned: {before.reason}")
        return Exit.REJECTED
    credential = keys.unlock(home(), QA, passphrase_of(passphrase_file, "passphrase of the QA key: ", QA_PASSPHRASE))
    with open_store() as store:
        sign_into(path, content, credential, store, before.serial, credential.person)
    say(f"{before.serial}: countersigned by {credential.person}")
    return Exit.ACCEPTED
