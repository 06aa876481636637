"""`accept countersign`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from accept.base.console import say
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.base.plain_text import one_line
from accept.certificate import (
    DispositionError,
    Validity,
    Verification,
    parse_disposition,
    read_certificate,
    sign_into,
)
from accept.certificate.trust import keys
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.revocation_record import store_is_there
from accept.commands.answer import Answer, Remark, command
from accept.commands.options import LargeRecords, QaPassphrase, TimeStamping
from accept.commands.trust.bench_keys import qa_credential
from accept.commands.trust.verify import VerifyOptions, set_aside, verified, verifier
from accept.store import DATABASE, StoreError, open_store
from checks.verdict import UnitVerdict
from specs.errors import AcceptError


@command
def run(
    certificates: Annotated[
        list[Path], Argument(help="A certificate that the technician has signed; several, or folders.")
    ],
    passphrase_file: QaPassphrase = None,
    records: LargeRecords = None,
    tsa: TimeStamping = None,
    disposition: Annotated[
        str, Option(help="Of a unit that was not accepted: use-as-is, rework, measure-again, return or scrap.")
    ] = "",
    because: Annotated[str, Option(help="Why: the reason of the disposition.")] = "",
) -> Answer:
    """Countersign certificates as QA. Each is verified first; a unit that was not accepted needs a disposition."""
    known = 0
    if store_is_there():
        with open_store() as store:
            known = store.head().seq
    if len(certificates) > 1 or certificates[0].is_dir():
        if disposition:
            raise DispositionError("--disposition is about one unit: countersign its certificate alone")
        return _many(certificates, passphrase_file, records, tsa, known)
    content = read_certificate(certificates[0])
    before = verifier(VerifyOptions(records=records))(content)
    for line in before.details:
        say(f"  {line}")
    if not before.valid:
        exit = Exit.INCOMPLETE if before.outcome is Validity.SIGNED else Exit.REJECTED
        return Answer(Remark(f"not countersigned: {before.reason}"), exit=exit)
    decides = (f"decided about: {one_line(words)}" for words in before.nonconformances)
    say("\n".join(f"  {line}" for line in (before.reason, *decides)))
    decision = parse_disposition(before.serial, before.verdict, disposition, because)
    credential = _credential(passphrase_file, because, tsa)
    with open_store() as store:
        sign_into(
            certificates[0], content, credential, store, before.serial, credential.person,
            disposition=decision, nonconformances=before.nonconformances, after=known,
        )  # fmt: skip
    tail = f"; disposition: {decision}" if decision else ""
    return Answer(Remark(f"{before.serial} {before.verdict}: countersigned by {credential.person}{tail}"))


def _credential(passphrase_file: Path | None, because: str, tsa: str | None) -> Credential:
    """Return QA's key. Raises StoreError where no store would keep the countersignature."""
    if not store_is_there():
        place = "countersign at the bench, or name its store with ACCEPT_STORE_URL"
        raise StoreError(f"{home() / DATABASE}: there is no store to keep the countersignature in; {place}")
    return keys.stamping(qa_credential(passphrase_file, because), tsa, home())


def _many(
    certificates: Sequence[Path], passphrase_file: Path | None, records: Path | None, tsa: str | None, known: int
) -> Answer:
    """Show each certificate verified, ask for the passphrase once, and countersign those that are valid without a
    remark and of accepted units. The others are left as they are and named: each needs a look of its own."""
    wait, looked_at = dict[Path, tuple[bytes, Verification]](), list[tuple[Path, bytes, Verification]]()
    left = list[str]()
    for path, content, found in verified(certificates, verifier(VerifyOptions(records=records))):
        say(f"  {one_line(str(path))}: {found.serial} {found.verdict or ''}: {found.reason}")
        looked_at.append((path, content, found))
    aside = set_aside([(path, found) for path, _, found in looked_at])
    total = len(looked_at) - len(aside)
    for path, content, found in looked_at:
        if path in aside:
            continue
        if not found.valid:
            left.append(f"{one_line(str(path))}: {found.reason}")
        elif found.countersigned:
            left.append(f"{one_line(str(path))}: it is countersigned already")
        elif found.verdict != UnitVerdict.ACCEPTED or found.nonconformances:
            left.append(f"{one_line(str(path))}: {found.verdict}; countersign it alone, with a disposition")
        elif found.remarks:  # the first line is not what a table of many is read for
            left.append(f"{one_line(str(path))}: {'; '.join(found.remarks)}; countersign it alone")
        else:
            wait[path] = content, found
    signed, by = 0, ""
    if wait:
        say(f"  {len(wait)} of {total} can be countersigned")
        credential = _credential(passphrase_file, "", tsa)
        by = f" by {credential.person}"
        with open_store() as store:
            for path, (content, found) in wait.items():
                try:
                    sign_into(path, content, credential, store, found.serial, credential.person, after=known)
                    signed += 1
                except (AcceptError, OSError) as e:  # also of a second certificate of one unit
                    left.append(f"{one_line(str(path))}: {e}")
    words = f"{signed} of {total} countersigned{by}"
    return Answer(*left, Remark(words), exit=Exit.INCOMPLETE if left else Exit.ACCEPTED)
