"""`accept countersign`."""

from pathlib import Path
from typing import Annotated

import typer

from accept.base.console import say
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.base.plain_text import one_line
from accept.certificate import Validity, parse_disposition, read_certificate, sign_into
from accept.certificate.trust import keys
from accept.certificate.trust.authority import QA
from accept.certificate.trust.revocation_record import store_is_there
from accept.commands.answer import Answer, Remark, command
from accept.commands.options import LargeRecords, QaPassphrase, TimeStamping
from accept.commands.trust.bench_keys import QA_PASSPHRASE, check_reason, passphrase_of, warn_of_home
from accept.commands.trust.verify import VerifyOptions, verify_here
from accept.store import DATABASE, StoreError, open_store


@command
def run(
    certificate: Annotated[Path, typer.Argument(help="A certificate that the technician has signed.")],
    passphrase_file: QaPassphrase = None,
    records: LargeRecords = None,
    tsa: TimeStamping = None,
    disposition: Annotated[
        str,
        typer.Option(help="Of a unit that was not accepted: use-as-is, rework, measure-again, return or scrap."),
    ] = "",
    because: Annotated[str, typer.Option(help="Why: the reason of the disposition.")] = "",
) -> Answer:
    """Countersign a certificate as QA. It is verified first; a unit that was not accepted needs a disposition."""
    content, known = read_certificate(certificate), 0
    if store_is_there():
        with open_store() as store:
            known = store.head().seq
    before = verify_here(content, VerifyOptions(records=records))
    for line in before.details:
        say(f"  {line}")
    if not before.valid:
        exit = Exit.INCOMPLETE if before.outcome is Validity.SIGNED else Exit.REJECTED
        return Answer(Remark(f"not countersigned: {before.reason}"), exit=exit)
    decides = (f"decided about: {one_line(words)}" for words in before.nonconformances)
    say("\n".join(f"  {line}" for line in (before.reason, *decides)))
    decision = parse_disposition(before.serial, before.verdict, disposition, because)
    if not store_is_there():
        place = "countersign at the bench, or name its store with ACCEPT_STORE_URL"
        raise StoreError(f"{home() / DATABASE}: there is no store to keep the countersignature in; {place}")
    warn_of_home(home())
    passphrase = passphrase_of(passphrase_file, "passphrase of the QA key: ", QA_PASSPHRASE, only=True)
    check_reason(because, passphrase)
    credential = keys.stamping(keys.unlock(home(), QA, passphrase), tsa, home())
    with open_store() as store:
        sign_into(
            certificate, content, credential, store, before.serial, credential.person,
            disposition=decision, nonconformances=before.nonconformances, after=known,
        )  # fmt: skip
    tail = f"; disposition: {decision}" if decision else ""
    return Answer(Remark(f"{before.serial} {before.verdict}: countersigned by {credential.person}{tail}"))
