"""The path from a unit to its stored, certified judgement, shared by batch, report and workflow.

`Pipeline.ask` and `Pipeline.prepare` turn a unit into a job; `UnitJob.judge` judges it, here or on another machine; and
`settle` adds the reservations that the store has by then, stores the verdict, signs and writes the certificate, and
stores that it was signed, in this order: if the program is stopped in between, the store never names a certificate that
does not exist, and no certificate states a verdict that is not stored.

A judgement may be stored without its certificate: the program was killed, no time stamp could be had, or no certificate
was wanted then. If it is made later, the unit is not judged a second time: it is the same attempt, as of the day of the
judgement, and replaces what that attempt replaced.

A verdict is stored only if no other program stored an event about the unit since this one read them; else what it
replaces is read again. A certificate with another result than the one before needs a reason ([ISO17025] 7.8.8.3):
without one the verdict is stored, which makes the certificate before a superseded one, and nothing is signed.
"""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from accept.base.documents.results import ALIKE, CONFIRMED, NAME, UnitRecord
from accept.base.home import home
from accept.base.names import KeyHolder, same_person, shown_name
from accept.base.spelling import mistaken_for
from accept.base.version import code_sha256
from accept.batch.ports import Judgement, JudgingOrder, JudgingPort, Statement
from accept.store import Event, Overtaken, Store, UnitState
from accept.store.payloads import PlaceInBatch, UnitJudged, UnitRefused
from accept.units import UNIT_FILE, UnitError, UnitFolder
from specs.bench import BenchFile
from specs.errors import AcceptError
from specs.files import CERTIFICATE_BYTES, read_bounded
from specs.spec import Spec

_UNITS_READ = 100  # whose events a run keeps
_SAME_DATA = "the same data: what the bench's store knows of them, or a calibration, has changed"
_DECIDED = "quality assurance has decided about what held it"
_NO_REASON = (
    "{0}: judged and stored, and not certified: its certificate {1} has another result, and no reason was given why it "
    "is replaced: --reason"
)
ASKING = ("rejected", "incomplete")  # verdicts after which another judgement asks for a reason
LONGEST = 200  # characters of the reason: two lines of the certificate


class ReasonError(AcceptError):
    """A reason that a certificate cannot state."""


@dataclass(frozen=True)
class Known:
    """The store's knowledge of a unit: its last judgement, None for a new one, and its reservations."""

    before: UnitState | None
    reservations: Any  # as `JudgingPort.reservations` returns them


@dataclass(frozen=True, eq=False)
class StoredJudgement:
    """A judgement that is stored. result: with its reservations; seq: number of its event; weakened: serials of units
    that share its recordings: invalid; unsigned: why no certificate was written, "" if it was or none was wanted."""

    result: UnitRecord
    seq: int
    weakened: tuple[str, ...]
    unsigned: str = ""


class Pipeline:
    """Judges units for one store: by these specs (kind -> spec), under this operator's name, with the calibration of
    a bench file's instruments as it stands `on` a day (UTC). out: folder of the results. confirm: asks the operator a
    question, None if it cannot be asked. reason: why units that were not accepted are judged again, None to ask;
    ask_reason: asks for it, None if it cannot be asked."""

    def __init__(
        self,
        store: Store,
        specs: Mapping[str, Spec],
        operator: str,
        services: JudgingPort,
        *,
        bench_file: BenchFile | None = None,
        on: date | None = None,
        out: Path | None = None,
        place: Path | None = None,
        confirm: Callable[[str], bool | None] = lambda _: None,
        reason: str | None = None,
        ask_reason: Callable[[str], str | None] = lambda _: None,
    ) -> None:
        self.store, self.specs, self.operator, self.services = store, specs, operator, services
        self.bench_file, self.on, self.out = bench_file, on or datetime.now(UTC).date(), out
        self.home = place or home()
        self._confirm, self._confirmed = confirm, set[Path]()
        self._reason = None if reason is None else reason_line(reason)
        self._read: dict[str, list[Event]] = {}  # by serial, the latest asked for last
        self._weakened = set[int]()  # judgements that this run stored of other units
        self._ask_reason = ask_reason

    def ask(self, unit: UnitFolder) -> Known:
        """Ask the store for what it knows of a unit. Raises UnitError, BenchStopped, StoreError."""
        self.services.check_may_judge(unit.serial, known=True)  # asked again when the verdict is stored
        past = self.events(unit.serial)
        # Of two serials that the store knows both have been here since before this was looked at.
        if not past and (other := self.store.other_spelling(unit.serial)) is not None:
            raise UnitError(unit.path / UNIT_FILE, [mistaken_for(unit.serial, other)])
        before = self.services.state(past)
        last = None if before is None else before.result
        known = Known(before, self._reservations(unit, last))
        doubted = known.reservations.folder  # only who signs the certificate states that it was confirmed
        named = NAME in doubted and not same_person(doubted.get(CONFIRMED, ""), self.operator)
        if named or ALIKE in doubted:
            answer = self._confirm(self.services.question(unit.serial, doubted))
            if answer is False:
                raise UnitError(unit.path / UNIT_FILE, [f"serial = '{unit.serial}' was not confirmed for this folder"])
            if answer:
                self._confirmed.add(unit.path)
                self.services.tell_apart(unit.serial)
                known = Known(before, self._reservations(unit, last))
        return known

    def stands(self, unit: UnitFolder, known: Known, certificate: Path | None) -> bool:
        """Return whether the unit's last judgement stands: its inputs, spec and code are unchanged, and its files, an
        improved model and the certificate if one is wanted, are in their place."""
        before, spec = known.before, self.specs[unit.kind]
        if before is None or not before.unchanged(unit.input_hashes(), spec.sha256, code_sha256()):
            return False
        if not self.services.stands(before.result, unit, spec, self.statement(unit), known.reservations, self.out):
            return False
        if certificate is None:
            return True
        return before.certificate is not None and _sha256(certificate) == before.certificate.sha256

    def prepare(
        self,
        unit: UnitFolder,
        known: Known,
        certificate: Path | None = None,
        place: PlaceInBatch | None = None,
        reason: str | None = None,
    ) -> JudgingOrder:
        """Return the job that judges a unit. certificate: the file wanted, None for none. place: in its batch. reason:
        why it is judged again, if the operator need not be asked."""
        before, due = known.before, None
        typed = not isinstance(self.operator, KeyHolder)
        if certificate is not None and before is not None and self._lacks_only_certificate(unit, before):
            due, reason = before, before.judged.reason
        elif reason is None:
            reason = self._reason_for(before)
        return self.services.job(
            unit,
            self.specs[unit.kind],
            self.operator if self.services.signs else shown_name(self.operator, typed),
            stated=self.statement(unit) if due is None else self.statement_of(unit, due.result),
            start=self.services.start(unit, self.specs[unit.kind]),
            out=self.out,
            certificate=certificate,
            home=self.home,
            bench=self.store.bench,
            uncertified=None if due is None else due.seq,
            place=place,
            reason=reason,
        )

    def settle(self, job: JudgingOrder, judgement: Judgement) -> StoredJudgement:
        """Store a judgement with what the store knows against the unit, and certify it.

        Raises StoreError, BenchStopped, ContentError, SigningRefused, OSError."""
        while True:
            try:
                return self._settle(job, judgement)
            except Overtaken:  # another program stored something of the unit: it is read again
                continue

    def _settle(self, job: JudgingOrder, judgement: Judgement) -> StoredJudgement:
        past, found = self.events(job.unit.serial), judgement.result
        last = self.services.state(past)
        result = self._reservations(job.unit, found).apply(found)
        if last is not None and job.certificate is None and self._is_last(job, last, result):
            self.services.check_may_judge(result.serial)
            return StoredJudgement(result, last.seq, (), "")
        due = last if last is not None and last.seq in {job.uncertified, *self._weakened} else None
        if due is not None and not (self._unchanged(job.unit, due) and self._is_stored(due.seq, result)):
            due = None
        if job.uncertified is not None and due is None:  # it was judged as of that day
            job = replace(job, uncertified=None, stated=self.statement(job.unit))
            return self._settle(job, job.judge())
        before, reason, because = last, job.reason, ""
        if due is not None:
            before, reason = self.services.state(past, before=due.seq), due.judged.reason
        elif reason is None:
            reason = self._reason_for(before)
        signs = job.certificate is not None and self.services.signs
        if amends := self.services.amended(before, result) if signs else "":
            given = reason or self._reason_to_amend(result, amends, before)
            reason, because = (given, "") if due is None else (reason, "" if reason else given)
        job, unsigned, issue = replace(job, reason=reason), "", None
        if amends and not (reason or because) and self.services.waits(before, result):
            unsigned = _NO_REASON.format(result.serial, amends)
        elif job.certificate is not None:
            judged = "" if due is None else due.time
            stated = {"reason": reason, "amends": amends, "judged": judged, "signed_because": because}
            judgement = replace(judgement, result=result)
            issue = self.services.draw(job.certificate, job, judgement, before, past, **stated)
        seq = self._store_verdict(job, result, past[-1].seq if past else 0).seq if due is None else due.seq
        if issue is not None:
            issue(seq)
        others = tuple(self.weaken_others(result.serial, result.copies))
        return StoredJudgement(result, seq, others, unsigned)

    def weaken_others(self, serial: str, copies: Sequence[Mapping[str, Any]]) -> list[str]:
        """Re-judge the other units that hold a copy, without it, and return their serials. Raises StoreError."""
        changed = self.services.withhold_others(serial, copies)
        self._weakened |= set(changed.values())
        return list(changed)

    def refuse(self, path: Path | str, reason: str) -> None:
        """Store that a folder, here or at an address, could not be judged at all. Raises StoreError."""
        self.store.write(UnitRefused(str(path), reason), who=self.operator)

    def statement(self, unit: UnitFolder, on: date | None = None) -> Statement | None:
        """Return the calibration of the instruments behind the checks of a unit, None without a bench file. on: the day
        of judging, if it is not that of this run."""
        if self.bench_file is None:
            return None
        return self.services.statement(self.bench_file, self.specs[unit.kind].checks, on or self.on, unit.measured)

    def events(self, serial: str) -> list[Event]:
        """Return the events of a unit. Of those that this run has read only later ones are read."""
        known = self._read.pop(serial, [])
        self._read[serial] = known = [*known, *self.store.events(serial, after=known[-1].seq if known else 0)]
        if len(self._read) > _UNITS_READ:
            del self._read[next(iter(self._read))]
        return known

    def _reservations(self, unit: UnitFolder, result: UnitRecord | None) -> Any:
        confirmed_by = self.operator if unit.path in self._confirmed else ""
        return self.services.reservations(unit, result, self.specs[unit.kind], confirmed_by, self.events(unit.serial))

    def _reason_for(self, before: UnitState | None) -> str | None:
        """Return why a unit is judged again, "" if no reason was given; None if its last judgement asks for none."""
        if before is None or before.voided or before.verdict not in ASKING:
            return None
        return self._asked(f"{before.serial} was {before.verdict} on {before.time[:10]}; why is it judged again?")

    def _reason_to_amend(self, result: UnitRecord, number: str, before: UnitState | None) -> str:
        """Return why a certificate is replaced by one with another result, "" if no reason was given. None is asked for
        where quality assurance decided or the data are the same, and for golden units."""
        last = before.handed_out if before is not None else None
        if last is not None and last.result is not None and _only_decided(last.result, result):
            return _DECIDED
        if last is not None and last.result is not None and last.spec_sha256 == result.spec.partition("@")[2]:
            benches = {(stated or {}).get("sha256") for stated in (last.result.calibration, result.calibration)}
            same = dict(last.result.inputs) == dict(result.inputs) and len(benches) == 1
            if same and before is not None and before.judged.code_sha256 == code_sha256():
                return _SAME_DATA
        if self.services.is_golden(result.serial):
            return "a golden unit, measured again"
        return self._asked(f"{result.serial}: its certificate {number} has another result; why is it replaced?")

    def _asked(self, question: str) -> str:
        """Return the reason that was given, or asked for once in a run; "" for none."""
        if self._reason is None:
            self._reason = reason_line(self._ask_reason(question) or "")
        return self._reason

    def _lacks_only_certificate(self, unit: UnitFolder, last: UnitState) -> bool:
        """Return whether the last judgement is `_unchanged`, its calibrations too, and could be signed now."""
        same = self.services.signs and self._unchanged(unit, last)
        return same and self.services.same_calibration(last.result.calibration, self.statement_of(unit, last.result))

    def _unchanged(self, unit: UnitFolder, last: UnitState) -> bool:
        """Return whether the last judgement has no certificate and the same person, inputs, spec and code."""
        if last.certificate is not None or last.who != self.operator:
            return False
        return last.unchanged(unit.input_hashes(), self.specs[unit.kind].sha256, code_sha256())

    def _is_last(self, job: JudgingOrder, last: UnitState, result: UnitRecord) -> bool:
        """Return whether the last judgement has a certificate and found the same in the same inputs by the same spec
        and code: to look at a unit that is certified is no attempt at it."""
        same = last.certificate is not None and last.unchanged(result.inputs, job.spec.sha256, code_sha256())
        return same and self._is_stored(last.seq, result)

    def statement_of(self, unit: UnitFolder, judged: UnitRecord) -> Statement | None:
        """Return the calibration as it stood on the day of a judgement."""
        given = judged.calibration
        return self.statement(unit, None if given is None else date.fromisoformat(str(given["on"])))

    def _is_stored(self, seq: int, result: UnitRecord) -> bool:
        """Return whether a result is that of an event, so that one certificate states both."""
        stored = UnitJudged.of(next(self.store.events(result.serial, UnitJudged.KIND, after=seq - 1)))
        one, other = (json.dumps(each.to_json(), sort_keys=True) for each in (stored.result, result))
        return one == other

    def _store_verdict(self, job: JudgingOrder, result: UnitRecord, after: int) -> Event:
        """Store a result, as results.json has it, with all that it depends on. The golden units are checked here, so
        that every verdict passes them. after: the last event of the unit that was read. Raises also Overtaken."""
        self.services.check_may_judge(result.serial)
        path = str(job.unit.path.resolve())
        judged = UnitJudged(
            path, result.inputs, job.spec.sha256, code_sha256(), result, job.place, self.store.bench, job.reason
        )
        return self.store.write(judged, result.serial, who=self.operator, spec=result.spec, after=after)


def _only_decided(before: UnitRecord, now: UnitRecord) -> bool:
    """Return whether quality assurance has decided since about what held a unit, and every value is as it was."""
    one, other = ([(f.quantity, f.value, f.U) for f in each.findings] for each in (before, now))
    return one == other and any(given not in before.dispositions for given in now.dispositions)


def reason_line(text: str) -> str:
    """Return a reason on one line, "" for none. Raises ReasonError if it is too long or cannot be printed."""
    reason = " ".join(text.split())
    if reason and (not reason.isprintable() or len(reason) > LONGEST):
        raise ReasonError(f"the reason to judge again is one line of at most {LONGEST} characters, got '{reason}'")
    return reason


def _sha256(path: Path) -> str | None:
    try:
        return hashlib.sha256(read_bounded(path, CERTIFICATE_BYTES)).hexdigest()
    except OSError:
        return None
