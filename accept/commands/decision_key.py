"""The key that signs decisions of quality assurance."""

from pathlib import Path

from accept.base.home import home
from accept.certificate.trust import keys
from accept.certificate.trust.keys import QA, KeysError
from accept.commands.trust.bench_keys import passphrase_of
from accept.commands.trust.keys import QA_PASSPHRASE
from accept.judging.decisions import Signer


def decision_signer(passphrase_file: Path | None) -> Signer:
    """Return the opened QA key of this bench. Raises KeysError."""
    phrase = passphrase_of(passphrase_file, "passphrase of the QA key: ", QA_PASSPHRASE)
    credential = keys.unlock(home(), QA, phrase)
    if credential.key is None:
        raise KeysError("no key found to sign a decision with")
    return Signer(credential.key, credential.certificate)
