"""`accept spec approve`."""

from datetime import UTC, datetime
from typing import Annotated

from typer import Argument

from accept.base.home import home
from accept.certificate import models_words
from accept.certificate.trust import keys, spec_approval
from accept.certificate.trust.revocation_record import store_is_there
from accept.commands.answer import Answer, command
from accept.commands.options import QaPassphrase
from accept.commands.trust.bench_keys import qa_credential
from accept.judging import load_spec
from accept.models.evidence import evidence_of, named_models
from accept.store import Event, open_store
from accept.store.payloads import SpecApproved
from specs.spec import Spec


@command
def run(file: Annotated[str, Argument(help="TOML file of the spec.")], passphrase_file: QaPassphrase = None) -> Answer:
    """Approve a spec with the key of quality assurance."""
    spec = load_spec(file)
    credential = qa_credential(passphrase_file)
    approval = spec_approval.approve(spec, credential, datetime.now(UTC))
    with open_store() as store:
        store.write(SpecApproved(approval), who=credential.person, spec=spec.with_hash)
    place = spec_approval.write(home(), approval)
    models = models_words(evidence_of(named_models(spec)))
    covers = f"\nwith its model files: {models}" if models else ""
    return Answer(f"{spec.name}, sha256 {spec.sha256}: approved by {credential.person}; {place}{covers}")


def approval_words(spec: Spec) -> str | None:
    """Return by whom a spec is approved here, if at all; None without keys. Raises KeysError, StoreError."""
    if not keys.exist(home()):
        return None
    found = spec_approval.approval_of(spec, home(), keys.ca(home()), keys.revoked(home()))
    if "person" not in found:
        return f"not approved: {found['reason']}" if "reason" in found else None
    events = list[Event]()
    if store_is_there():
        with open_store() as store:
            events = [e for e in store.events(what=SpecApproved.KIND) if SpecApproved.of(e).approval == found]
    kept = f"event {events[-1].seq}" if events else "its event is not in the store: approve it again"
    return f"approved by {found['person']} on {found['time'][:10]}, {kept}"
