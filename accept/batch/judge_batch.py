"""Many units: judge what changed, certify it, and leave results that scripts and people can read."""

import hashlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any

from accept.base.cluster.work import Cluster
from accept.base.exit_codes import Exit, of_verdicts
from accept.base.home import home
from accept.base.progress import steps
from accept.base.version import code_sha256
from accept.batch.engines import folder_of, judge_far, judge_here
from accept.batch.outputs import BatchEntry
from accept.batch.results import WHOLE, Results, check_room
from accept.batch.roster import Roster
from accept.batch.worker import Job, JudgedOrRefused, judge
from accept.certificate import events, uncertified
from accept.certificate.certify import certify
from accept.certificate.contents.provenance import Provenance
from accept.certificate.trust import keys, revocation
from accept.certificate.trust.commissioning import commissioned
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.spec_approval import approval_of
from accept.fleet import golden
from accept.gap.start_model import StartModel, applies, is_there, same_start
from accept.gap.text import one_line
from accept.judging import calibration, judge_unit
from accept.judging.calibration import Statement
from accept.judging.copies import copies_of, withhold_others
from accept.judging.result import UnitResult
from accept.models.evidence import evidence_of, hashes, named_models
from accept.pictures.labels import label_of
from accept.store import Event, SignedHead, Store, UnitState, fold
from accept.store.spelling import mistaken_for, other_spelling
from accept.units import unit_folder
from accept.units.unit_folder import UnitError, UnitFolder
from checks.verdict import Verdict
from specs.bench import BenchFile
from specs.files import read_bounded
from specs.spec import Spec

Say = Callable[[str], None]
CERTIFICATES = "certificates"
MAX_CERTIFICATE_BYTES = 200_000_000


@dataclass(frozen=True)
class BatchRequest:
    """What a batch is asked to do. specs: kind -> spec. credential: None writes no certificates. bench: judge with the
    calibration of its instruments, as it stands `on` a day (UTC). model: explains responses instead of the spec's.
    pool: processes that run already; the longest unit is then judged by this one. For units that are known not to
    break it. cluster: judges instead of processes of this machine. refused: (where, why) of units that did not even
    come this far."""

    paths: Sequence[Path]
    out: Path
    specs: dict[str, Spec]
    operator: str
    credential: Credential | None = None
    workers: int | None = None
    bench: BenchFile | None = None
    on: date = field(default_factory=lambda: datetime.now(UTC).date())
    model: str | None = None
    pool: ProcessPoolExecutor | None = None
    cluster: Cluster | None = None
    refused: Sequence[tuple[str, str]] = ()
    _models: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict, init=False, repr=False)
    _starts: dict[str, StartModel | None] = field(default_factory=dict, init=False, repr=False)

    def calibration(self, folder: UnitFolder) -> Statement | None:
        """Of the instruments behind the checks of a unit, where a bench file is in use."""
        if self.bench is None:
            return None
        proven = commissioned(self.bench, home())
        stated = calibration.statement(self.bench, self.specs[folder.kind].checks, self.on, proven)
        return calibration.checked(stated, folder.measured)

    def model_hashes(self, kind: str) -> dict[str, dict[str, str]]:
        """Of the model files that the spec of this kind names: when one changes, so may the verdict."""
        if kind not in self._models:
            self._models[kind] = hashes(evidence_of(named_models(self.specs[kind])))
        return self._models[kind]

    def start(self, folder: UnitFolder) -> StartModel | None:
        """The model that a unit's responses are explained by; None where there is nothing to explain or to explain
        it by."""
        if not applies(folder):
            return None
        if folder.kind not in self._starts:  # opening a model takes most of a second
            self._starts[folder.kind] = StartModel.of(self.specs[folder.kind], self.model)
        return self._starts[folder.kind]


@dataclass
class BatchReport:
    """What a batch did. units: results.json entries in order of serial, where they are few enough to be held (`WHOLE`);
    verdicts: how many units have which; refused folders; unchanged: how many were as they had been judged."""

    units: list[dict[str, Any]] = field(default_factory=list)
    verdicts: Counter[str] = field(default_factory=Counter)
    refused: list[dict[str, str]] = field(default_factory=list)
    unchanged: int = 0
    doubted: list[str] = field(default_factory=list)  # judged earlier with a recording that another unit has too

    @property
    def judged(self) -> int:
        return self.verdicts.total()

    def exit(self) -> Exit:
        return of_verdicts(self.verdicts, len(self.refused))


def run(order: BatchRequest, store: Store, say: Say) -> BatchReport:
    """Judge all units of an order. Every verdict is in the store before it is said; a run that was killed is taken up
    where it stopped, because the next one judges only what the store does not hold for the same inputs, spec and code.

    Raises OSError when `out` cannot be written, StoreError when the store cannot, ResultsError where there are more
    units than can be written.
    """
    report = BatchReport()
    with Roster() as roster:
        _enrol(order, roster, store, report, say)
        check_room(roster.count(), order.cluster is not None)
        names = {kind: f"{spec.name}@{spec.sha256}" for kind, spec in order.specs.items()}
        started = {"out": str(order.out), "units": roster.count(), "specs": names}
        store.append("batch_started", "", started, who=order.operator)
        jobs: Iterable[Job] = _jobs(order, roster, store, report, say)
        if order.cluster is not None:
            judged, of = judge_far(jobs, order.cluster, order.out), roster.count()
        else:
            jobs = list(jobs)
            judged, of = judge_here(jobs, order.workers, order.pool), len(jobs)
        for number, (job, outcome) in enumerate(steps(judged, "units judged", of), 1):
            _keep(job, outcome, order, roster, store, report, _numbered(say, number, of))
        _doubted_again(order, roster, store, report, say)
        report.unchanged = roster.count("unchanged")
        _write_results(order, roster, store, report)
    store.append(
        "batch_finished", "", {"verdicts": report.verdicts, "refused": len(report.refused)}, who=order.operator
    )
    return report


def _jobs(order: BatchRequest, roster: Roster, store: Store, report: BatchReport, say: Say) -> Iterator[Job]:
    """What is to be judged, made as it is asked for; what is unchanged is said and marked."""
    head = store.signed_head()
    stopped = golden.stopped(store) is not None  # asked where a verdict is stored; known before, the work is saved
    for path in roster.folders():
        try:
            folder = roster.unit(path)
            if stopped:
                golden.may_judge(store, folder.serial)
            past = list(store.events(folder.serial))  # of the others the store may hold many
            # Of two that the store knows both have been here since before this was looked at.
            if not past and (known := other_spelling(store, folder.serial)) is not None:
                raise UnitError(path / unit_folder.UNIT_FILE, [mistaken_for(folder.serial, known)])
        except (UnitError, golden.BenchStopped) as e:
            roster.refuse(path)
            _refuse(path, str(e), store, order, report, say)
            continue
        before = fold(past).units.get(folder.serial)
        if before is not None:
            roster.known(folder.serial, before.attempts - 1, before.seq)
        if before is not None and _unchanged(folder, order, before, store):
            roster.judged(folder.serial, before.seq, unchanged=True)
            # Said again: the run that judged it may have been killed before it could.
            report.doubted += withhold_others(store, folder.serial, before.result.get("copies", []), order.operator)
            say(f"{folder.serial}: unchanged, {before.verdict}")
            continue
        due = None
        if order.credential is not None and before is not None:
            due = uncertified.last_of(past, folder, order.specs[folder.kind], order.operator)
        if due is not None:
            roster.expect(folder.serial, due.seq)
        yield _job(folder, order, due.before if due else before, head)


def _doubted_again(order: BatchRequest, roster: Roster, store: Store, report: BatchReport, say: Say) -> None:
    """Units of this run whose recording another one turned out to have too are judged again, before anybody is handed
    what was said of them first; of others it is said that their results count no more."""
    for serial in sorted(set(report.doubted)):
        path = roster.folder(serial)
        if path is None:
            say(f"warning: {serial} was judged with a recording that is also another unit's; its result counts no more")
            continue
        before = fold(store.events(serial)).units.get(serial)
        job = _job(roster.unit(path), order, before, store.signed_head())
        _keep(job, job(), order, roster, store, report, lambda words: say(f"again, {words}"))


def _numbered(say: Say, number: int, of: int) -> Say:
    return lambda words: say(f"[{number}/{of}] {words}")


def _enrol(order: BatchRequest, roster: Roster, store: Store, report: BatchReport, say: Say) -> None:
    """Units that can be judged into the roster; the others are refused, said and stored. One serial in two folders
    refuses both."""
    for address, reason in order.refused:
        _refuse(address, reason, store, order, report, say)
    for path in order.paths:
        try:
            found = unit_folder.find(path)
        except UnitError as e:
            _refuse(path, str(e), store, order, report, say)
            continue
        for folder in found:
            try:
                one = unit_folder.read(folder)
                spec_for(one, order.specs)
                roster.add(one)
            except UnitError as e:
                _refuse(folder, str(e), store, order, report, say)
    for serial, path, others in roster.clashes():
        where = path / unit_folder.UNIT_FILE
        reason = f"{where}: serial = '{serial}' is also that of {', '.join(others)}; serials must be unique"
        _refuse(path, reason, store, order, report, say)


def spec_for(one: UnitFolder, specs: dict[str, Spec]) -> Spec:
    """Spec of a unit's kind. Raises UnitError when there is none, or the serial is not of the form that it asks for."""
    if one.kind not in specs:
        have = ", ".join(f"{s.name} for '{k}'" for k, s in specs.items())
        raise UnitError(one.path / unit_folder.UNIT_FILE, [f"kind = '{one.kind}' has no spec in this run ({have})"])
    spec = specs[one.kind]
    judge_unit.serial_fits(one, spec)
    return spec


def _refuse(path: Path | str, reason: str, store: Store, order: BatchRequest, report: BatchReport, say: Say) -> None:
    events.refused(store, path, reason, order.operator)
    report.refused.append({"path": str(path), "reason": reason})
    say(f"refused: {reason}")


def _certificate_path(order: BatchRequest, serial: str) -> Path:
    return order.out / CERTIFICATES / f"{serial}.pdf"


def _unchanged(folder: UnitFolder, order: BatchRequest, known: UnitState, store: Store) -> bool:
    """Whether inputs, spec and code are those of the unit's last judgement, its recordings stand where they stood, and
    its certificate, if one is wanted, lies in `out` as it was signed."""
    spec = order.specs[folder.kind]
    if not known.unchanged(folder.input_hashes(), spec.sha256, code_sha256()):
        return False
    if known.result.get("models", {}) != order.model_hashes(folder.kind):
        return False
    if not calibration.same(known.result.get("calibration"), order.calibration(folder)):
        return False
    copies = copies_of(store, folder.serial, str(folder.path.resolve()), known.result.get("samples", {}))
    if copies != known.result.get("copies", []):
        return False
    explanation = known.result.get("gap")
    if not (same_start(explanation, order.start(folder)) and is_there(explanation, order.out)):
        return False
    if order.credential is None:
        return True
    path = _certificate_path(order, folder.serial)
    return known.certificate is not None and _sha256(path) == known.certificate.sha256


def _sha256(path: Path) -> str | None:
    try:
        return hashlib.sha256(read_bounded(path, MAX_CERTIFICATE_BYTES)).hexdigest()
    except OSError:
        return None


def _job(folder: UnitFolder, order: BatchRequest, before: UnitState | None, head: SignedHead | None) -> Job:
    spec = order.specs[folder.kind]
    return partial(
        judge,
        folder,
        spec,
        order.operator,
        stated=order.calibration(folder),
        start=order.start(folder),
        out=order.out,
        draw=order.credential is not None,
        provenance=_provenance(order, spec, before, head),
    )


def _provenance(
    order: BatchRequest, spec: Spec, before: UnitState | None, head: SignedHead | None
) -> Provenance | None:
    if order.credential is None:
        return None
    listed = keys.folder(home()) / revocation.FILE
    gone = () if order.credential.demo else revocation.revoked_in(listed, order.credential.ca)
    approval = approval_of(spec, home(), order.credential.ca, gone)
    crl = revocation.kept(listed)
    return Provenance.of(before, head, approval, demo=order.credential.demo, crl=crl)


def _keep(
    job: Job, judged: JudgedOrRefused, order: BatchRequest, roster: Roster, store: Store, report: BatchReport, say: Say
) -> None:
    """Certify a judged unit; only then say its verdict. One whose recordings stand elsewhere too is drawn again, with
    what that leaves of it."""
    if not isinstance(judged, str):
        copies = copies_of(store, judged.result.serial, str(judged.folder.resolve()), judged.result.samples)
        judged = job(copies=copies) if copies else judged
    if isinstance(judged, str):
        roster.refuse(folder_of(job))
        _refuse(folder_of(job), judged, store, order, report, say)
        return
    serial = judged.result.serial
    due = roster.expected(serial)
    if due is not None and not uncertified.repeats(store, serial, due, judged.result):
        roster.expect(serial, None)
        before = fold(store.events(serial)).units[serial]
        other = _job(roster.unit(folder_of(job)), order, before, store.signed_head())
        _keep(other, other(), order, roster, store, report, say)
        return
    try:
        event = certify(judged, store, _certificate_path(order, serial), order.credential, stored=due is not None)
    except golden.BenchStopped as e:  # since this batch began
        roster.refuse(folder_of(job))
        _refuse(folder_of(job), str(e), store, order, report, say)
        return
    roster.judged(serial, event.seq if event is not None else due)
    roster.expect(serial, None)
    report.doubted += withhold_others(store, serial, judged.result.copies, order.operator)
    say(f"{serial}: {judged.result.verdict}{_why(judged.result)}")


def _why(result: UnitResult) -> str:
    bad = [f for f in result.findings if f.verdict is not Verdict.PASS]
    words = "; ".join(f"{label_of(f.quantity)}: {f.verdict.replace('_', ' ')}" for f in bad)
    because = f" ({words})" if bad else ""
    return because + (f"; {one_line(result.gap)}" if result.gap is not None else "")


def _judgements(store: Store, serial: str, first: int, last: int) -> Iterator[Event]:
    """Of a unit, from one event to another."""
    return takewhile(lambda e: e.seq <= last, store.events(serial, "unit_judged", after=first - 1))


def _write_results(order: BatchRequest, roster: Roster, store: Store, report: BatchReport) -> None:
    """The files for scripts, from what the store holds."""
    results = Results(order.out, whole=roster.count() <= WHOLE, dataset=order.cluster is not None)
    kinds = set()
    with results:
        for serial, seq, earlier, since in roster.results():
            *more, judged = _judgements(store, serial, since, seq)
            certificate = f"{CERTIFICATES}/{serial}.pdf" if order.credential else None
            entry = judged.data["result"] | {"certificate": certificate}
            report.verdicts[entry["verdict"]] += 1
            kinds.add(entry["kind"])
            results.add(BatchEntry(entry, earlier + len(more) + 1, judged.time, judged.who))
        used = [s for kind, s in order.specs.items() if kind in kinds] or list(order.specs.values())
        results.finish([{"name": s.name, "sha256": s.sha256} for s in used], report.refused, report.verdicts)
    report.units = results.entries
