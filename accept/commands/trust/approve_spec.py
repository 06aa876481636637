"""`accept spec approve`."""

from datetime import UTC, datetime
from typing import Annotated

from typer import Argument

from accept.base.home import home
from accept.certificate.trust import spec_approval
from accept.commands.answer import Answer, command
from accept.commands.options import QaPassphrase
from accept.commands.trust.bench_keys import qa_credential
from accept.judging import load_spec


@command
def run(file: Annotated[str, Argument(help="TOML file of the spec.")], passphrase_file: QaPassphrase = None) -> Answer:
    """Approve a spec with the key of quality assurance."""
    spec = load_spec(file)
    credential = qa_credential(passphrase_file)
    place = spec_approval.write(home(), spec_approval.approve(spec, credential, datetime.now(UTC)))
    return Answer(f"{spec.name}, sha256 {spec.sha256}: approved by {credential.person}; {place}")
