"""The bench's services for its pipeline: judging and explaining, its keys and certificates."""

from collections.abc import Callable, Mapping, Sequence
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

from accept.base.documents.results import UnitRecord
from accept.base.home import home
from accept.batch.job import UnitJob
from accept.batch.ports import Judgement, JudgingOrder
from accept.capture.reference_check import days_checked
from accept.certificate import Issuer, Provenance, amended, ends_before, needs_reason
from accept.certificate.trust import keys
from accept.certificate.trust.commissioning import bench_statement
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.spec_approval import approval_of
from accept.gap import StartModel, applies, stands
from accept.judging.calibration import Statement
from accept.judging.superseded import Approval
from accept.store import Event, Store, UnitState
from accept.units.unit_folder import UnitFolder
from specs.bench import BenchFile
from specs.errors import AcceptError
from specs.spec import CheckSpec, Spec


class JudgingServices:
    """Implements `accept.batch.ports.JudgingPort` for a store, in the operator's name. credential: signs certificates.
    model: explains responses instead of the spec's. place: the bench's folder."""

    job = UnitJob

    def __init__(
        self,
        store: Store,
        operator: str,
        credential: Credential | None = None,
        model: str | None = None,
        place: Path | None = None,
    ) -> None:
        self._issuer = Issuer(store, place or home(), operator, credential)
        self._model = model
        self._starts: dict[str, StartModel | None] = {}
        self._approvals: dict[str, Approval | None] = {}

    @property
    def signs(self) -> bool:
        return self._issuer.credential is not None

    def start(self, unit: UnitFolder, spec: Spec) -> StartModel | None:
        if not applies(unit):
            return None
        if spec.sha256 not in self._starts:  # opening a model takes most of a second
            self._starts[spec.sha256] = StartModel.of(spec, self._model)
        return self._starts[spec.sha256]

    def explained(self, known: Mapping[str, Any] | None, start: StartModel | None, out: Path) -> bool:
        return stands(known, start, out)

    def statement(self, bench: BenchFile, checks: Mapping[str, CheckSpec], on: date) -> Statement:
        asked = any(check.reference_days is not None for check in checks.values())
        references = days_checked(self._issuer.store, bench) if asked else {}
        return bench_statement(bench, checks, on, self._issuer.home, references)

    def approval(self, spec: Spec) -> Approval | None:
        if spec.sha256 not in self._approvals:
            home = self._issuer.home
            try:
                stated = approval_of(spec, home, keys.ca(home), keys.revoked(home))
            except AcceptError:
                stated = {}
            approved = Approval(f"{spec.name}@{spec.sha256}", stated["time"]) if "time" in stated else None
            self._approvals[spec.sha256] = approved
        return self._approvals[spec.sha256]

    def amended(self, before: UnitState | None, result: UnitRecord) -> str:
        return amended(result.serial, before, result)

    def waits(self, before: UnitState | None, result: UnitRecord) -> bool:
        """Return whether a certificate in place of another one waits for a reason: also if an earlier program stored no
        result with the one that it replaces."""
        if before is None or before.handed_out is None:
            return False
        replaced = before.handed_out.result
        return replaced is None or needs_reason(result.verdict, before.verdict, replaced.verdict)

    def draw(
        self,
        path: Path,
        job: JudgingOrder,
        judgement: Judgement,
        before: UnitState | None,
        past: Sequence[Event],
        **stated: Any,
    ) -> Callable[[int], None]:
        decided, contents = Provenance(earlier=ends_before(before), **stated), partial(job.contents, judgement)
        return self._issuer.draw(path, job.spec, judgement.result, before, past, decided, contents, overwrites=True)
