"""`accept keys`."""

import os
from pathlib import Path

from rich.table import Table

from accept.base.console import clear_errors, operator_name, stdout
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.certificate import keys
from accept.commands.trust.bench_keys import passphrase_of, terminal_prompt

QA_PASSPHRASE = "ACCEPT_QA_PASSPHRASE"


@clear_errors
def init(technician: str | None, qa: str | None, passphrase_file: Path | None) -> Exit:
    """Make the CA and both keys. The QA key has a passphrase of its own when one is given."""
    phrase = passphrase_of(passphrase_file, "passphrase of the technician's key: ")
    own = os.environ.get(QA_PASSPHRASE) or terminal_prompt("passphrase of the QA key (empty: the same): ")
    place = keys.init(home(), phrase, operator_name(technician), qa or "quality assurance", own or None)
    stdout.print(f"keys made in {place}; give {place / 'ca.pem'} to whoever verifies certificates")
    return Exit.ACCEPTED


@clear_errors
def show() -> Exit:
    """Print authority and keys of the bench."""
    table = Table("key", "person", "valid from", "valid to", "sha256 of the certificate")
    for key in keys.listing(home()):
        table.add_row(key.role, key.person, f"{key.valid_from:%Y-%m-%d}", f"{key.valid_to:%Y-%m-%d}", key.sha256)
    stdout.print(table)
    return Exit.ACCEPTED
