"""`accept spec approve`."""

from datetime import UTC, datetime
from typing import Annotated

import typer

from accept.base.home import home
from accept.certificate.trust import keys, spec_approval
from accept.certificate.trust.authority import QA
from accept.commands.answer import Answer, command
from accept.commands.options import QaPassphrase
from accept.commands.trust.bench_keys import QA_PASSPHRASE, passphrase_of, warn_of_home
from accept.judging.judge_unit import load_spec


@command
def run(
    file: Annotated[str, typer.Argument(help="TOML file of the spec.")],
    passphrase_file: QaPassphrase = None,
) -> Answer:
    """Approve a spec with the key of quality assurance."""
    spec = load_spec(file)
    warn_of_home(home())
    passphrase = passphrase_of(passphrase_file, "passphrase of the QA key: ", QA_PASSPHRASE, only=True)
    credential = keys.unlock(home(), QA, passphrase)
    place = spec_approval.write(home(), spec_approval.approve(spec, credential, datetime.now(UTC)))
    return Answer(f"{spec.name}, sha256 {spec.sha256}: approved by {credential.person}; {place}")
