"""The bench's services for its pipeline: judging and explaining, its keys and certificates."""

import math
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
from accept.certificate.trust import Credential, approved_at, bench_statement
from accept.fleet import check_may_judge, goldens, missed
from accept.gap import StartModel, applies, stands
from accept.judging import Statement, checked_calibration, same_calibration
from accept.judging.reservations import Approval, Reservations, counted, serial_question, tell_apart, withhold_others
from accept.models.evidence import Models
from accept.store import Event, Store, UnitState, fold
from accept.units import UnitFolder
from specs.bench import BenchFile
from specs.spec import CheckSpec, Spec


class JudgingServices:
    """Implements `accept.batch.ports.JudgingPort` for a store, in the operator's name. credential: signs certificates.
    model: explains responses instead of the spec's. place: the bench's folder."""

    job = UnitJob
    question = staticmethod(serial_question)
    same_calibration = staticmethod(same_calibration)

    def __init__(
        self,
        store: Store,
        operator: str,
        credential: Credential | None = None,
        model: str | None = None,
        place: Path | None = None,
    ) -> None:
        self._store, self._model = store, model
        self._issuer = Issuer(store, place or home(), operator, credential)
        self._stopped: bool | None = None
        self._models: dict[str, dict[str, dict[str, str]]] = {}
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

    def stands(
        self, entry: UnitRecord, unit: UnitFolder, spec: Spec, stated: Statement | None, held: Any, out: Path | None
    ) -> bool:
        if spec.sha256 not in self._models:
            self._models[spec.sha256] = Models().hashes(spec)
        if entry.models != self._models[spec.sha256] or not self.same_calibration(entry.calibration, stated):
            return False
        return held == Reservations.stated(entry) and stands(entry.gap, self.start(unit, spec), out or Path())

    def statement(
        self, bench: BenchFile, checks: Mapping[str, CheckSpec], on: date, measured: Mapping[str, date]
    ) -> Statement:
        asked = any(check.reference_days is not None for check in checks.values())
        references = days_checked(self._store, bench) if asked else {}
        return checked_calibration(bench_statement(bench, checks, on, self._issuer.home, references), measured)

    def check_may_judge(self, serial: str, known: bool = False) -> None:
        if self._stopped is None:
            self._stopped = missed(self._store) is not None
        if self._stopped or not known:
            check_may_judge(self._store, serial)

    def is_golden(self, serial: str) -> bool:
        return serial in goldens(self._store)

    def state(self, past: Sequence[Event], before: float = math.inf) -> UnitState | None:
        return fold(counted(self._store, past), before=before)

    def reservations(
        self, unit: UnitFolder, result: UnitRecord | None, spec: Spec, confirmed_by: str, past: Sequence[Event]
    ) -> Reservations:
        approval = self._approval(spec) if past else None
        return Reservations.known(self._store, unit, result, confirmed_by, past, approval)

    def tell_apart(self, serial: str) -> None:
        tell_apart(self._store, serial, self._issuer.who)

    def withhold_others(self, serial: str, copies: Sequence[Mapping[str, Any]]) -> dict[str, int]:
        return withhold_others(self._store, serial, copies, self._issuer.who)

    def _approval(self, spec: Spec) -> Approval | None:
        if spec.sha256 not in self._approvals:
            found = approved_at(self._store, spec, self._issuer.home)
            self._approvals[spec.sha256] = found and Approval(spec.with_hash, *found)
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
