"""Many units: judge what changed, certify it, and leave results that scripts and people can read."""

import hashlib
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from accept.base.atomic_files import write_atomic
from accept.base.exit_codes import Exit, of_verdicts
from accept.base.home import home
from accept.base.version import code_sha256
from accept.batch import outputs
from accept.batch.worker import Errand, Job, Outcome, judge, run_errand
from accept.certificate import events, keys, revocation
from accept.certificate.certify import certify
from accept.certificate.commissioning import commissioned
from accept.certificate.keys import Credential
from accept.certificate.provenance import provenance_of
from accept.certificate.spec_approval import approval_of
from accept.cluster.work import Cluster, WorkerDied
from accept.fleet import golden
from accept.gap.attach_to_result import StartModel, applies, is_there, same_start
from accept.gap.text import one_line
from accept.judging import calibration, judge_unit
from accept.judging.calibration import Statement
from accept.judging.copies import copies_of, withhold_others
from accept.models.evidence import evidence_of, hashes, named_models
from accept.store import Store, UnitState, fold
from accept.units import unit_folder
from accept.units.unit_folder import UnitError, UnitFolder
from specs.bench import BenchFile
from specs.files import read_bounded
from specs.spec import Spec

Say = Callable[[str], None]
Head = dict[str, Any] | None
CERTIFICATES = "certificates"
MAX_CERTIFICATE_BYTES = 200_000_000
MIN_UNITS_PER_WORKER = 3  # a worker takes about a second to start: fewer units are done sooner in this process


@dataclass(frozen=True)
class BatchRequest:
    """What a batch is asked to do. specs: kind -> spec. credential: None writes no certificates. bench: judge with the
    calibration of its instruments, as it stands `on` a day (UTC). model: explains responses instead of the spec's.
    pool: processes that run already; the longest unit is then judged by this one. For units that are known not to
    break it. cluster: judges instead of processes of this machine."""

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
    """What a batch did: results.json entries in order of serial, refused folders, and which units were unchanged."""

    units: list[dict[str, Any]] = field(default_factory=list)
    refused: list[dict[str, str]] = field(default_factory=list)
    unchanged: list[str] = field(default_factory=list)
    doubted: list[str] = field(default_factory=list)  # judged earlier with a recording that another unit has too

    def exit(self) -> Exit:
        return of_verdicts((u["verdict"] for u in self.units), len(self.refused))


def run(order: BatchRequest, store: Store, say: Say) -> BatchReport:
    """Judge all units of an order. Every verdict is in the store before it is said; a run that was killed is taken up
    where it stopped, because the next one judges only what the store does not hold for the same inputs, spec and code.

    Raises OSError when `out` cannot be written, StoreError when the store cannot.
    """
    report = BatchReport()
    folders = list(_readable(order.paths, store, order, report, say))
    names = {kind: f"{spec.name}@{spec.sha256}" for kind, spec in order.specs.items()}
    store.append(
        "batch_started", "", {"out": str(order.out), "units": len(folders), "specs": names}, who=order.operator
    )
    head = store.signed_head()
    jobs = []
    for folder in folders:
        before = fold(store.events(folder.serial)).units.get(folder.serial)  # of the others the store may hold many
        known = _unchanged(folder, order, before, store)
        if known is not None:
            report.units.append(known)
            report.unchanged.append(folder.serial)
            say(f"{folder.serial}: unchanged, {known['verdict']}")
        else:
            jobs.append(_job(folder, order, before, head))
    for number, (job, judged) in enumerate(_judged(jobs, order), 1):
        _keep(job, judged, order, store, report, _numbered(say, number, len(jobs)))
    _doubted_again(folders, order, store, report, say)
    report.units.sort(key=lambda u: u["serial"])
    _write_results(order, report)
    counts = Counter(u["verdict"] for u in report.units)
    store.append("batch_finished", "", {"verdicts": counts, "refused": len(report.refused)}, who=order.operator)
    return report


def _doubted_again(folders: list[UnitFolder], order: BatchRequest, store: Store, report: BatchReport, say: Say) -> None:
    """Units of this run whose recording another one turned out to have too are judged again, before anybody is handed
    what was said of them first; of others it is said that their results count no more."""
    here = {folder.serial: folder for folder in folders}
    for entry in report.units:  # of a run that was killed before it could say so
        report.doubted += withhold_others(store, entry["serial"], entry.get("copies", []), order.operator)
    for serial in sorted(set(report.doubted)):
        if serial not in here:
            say(f"warning: {serial} was judged with a recording that is also another unit's; its result counts no more")
            continue
        report.units = [u for u in report.units if u["serial"] != serial]
        report.unchanged = [one for one in report.unchanged if one != serial]
        before = fold(store.events(serial)).units.get(serial)
        job = _job(here[serial], order, before, store.signed_head())
        _keep(job, job(), order, store, report, lambda words: say(f"again, {words}"))


def _numbered(say: Say, number: int, of: int) -> Say:
    return lambda words: say(f"[{number}/{of}] {words}")


def _readable(
    paths: Iterable[Path], store: Store, order: BatchRequest, report: BatchReport, say: Say
) -> Iterator[UnitFolder]:
    """Units that can be judged; the others are refused, said and stored. One serial in two folders refuses both."""
    units: list[UnitFolder] = []
    for path in paths:
        try:
            found = unit_folder.find(path)
        except UnitError as e:
            _refuse(path, str(e), store, order, report, say)
            continue
        for folder in dict.fromkeys(found):
            try:
                one = unit_folder.read(folder)
                spec_for(one, order.specs)
                units.append(one)
            except UnitError as e:
                _refuse(folder, str(e), store, order, report, say)
    first_seen = {u.path.resolve(): u for u in reversed(units)}  # the same folder named twice is one unit
    distinct = sorted(first_seen.values(), key=lambda u: u.serial)
    folders = Counter(u.serial.casefold() for u in distinct)  # a file system may take a and A for one
    for one in distinct:
        if folders[one.serial.casefold()] > 1:
            same = [u for u in distinct if u.serial.casefold() == one.serial.casefold() and u is not one]
            others = ", ".join(str(u.path) for u in same)
            where = one.path / unit_folder.UNIT_FILE
            reason = f"{where}: serial = '{one.serial}' is also that of {others}; serials must be unique"
            _refuse(one.path, reason, store, order, report, say)
            continue
        try:
            golden.may_judge(store, one.serial)
        except golden.BenchStopped as e:
            _refuse(one.path, str(e), store, order, report, say)
        else:
            yield one


def spec_for(one: UnitFolder, specs: dict[str, Spec]) -> Spec:
    """Spec of a unit's kind. Raises UnitError when there is none, or the serial is not of the form that it asks for."""
    if one.kind not in specs:
        have = ", ".join(f"{s.name} for '{k}'" for k, s in specs.items())
        raise UnitError(one.path / unit_folder.UNIT_FILE, [f"kind = '{one.kind}' has no spec in this run ({have})"])
    spec = specs[one.kind]
    judge_unit.serial_fits(one, spec)
    return spec


def _refuse(path: Path, reason: str, store: Store, order: BatchRequest, report: BatchReport, say: Say) -> None:
    events.refused(store, path, reason, order.operator)
    report.refused.append({"path": str(path), "reason": reason})
    say(f"refused: {reason}")


def _certificate_path(order: BatchRequest, serial: str) -> Path:
    return order.out / CERTIFICATES / f"{serial}.pdf"


def _unchanged(
    folder: UnitFolder, order: BatchRequest, known: UnitState | None, store: Store
) -> dict[str, Any] | None:
    """The stored entry of a unit whose inputs, spec and code are those of its last judgement, whose recordings stand
    where they stood, and whose certificate, if one is wanted, lies in `out` as it was signed."""
    spec = order.specs[folder.kind]
    if known is None or not known.unchanged(folder.input_hashes(), spec.sha256, code_sha256()):
        return None
    if known.result.get("models", {}) != order.model_hashes(folder.kind):
        return None
    if not calibration.same(known.result.get("calibration"), order.calibration(folder)):
        return None
    copies = copies_of(store, folder.serial, str(folder.path.resolve()), known.result.get("samples", {}))
    if copies != known.result.get("copies", []):
        return None
    explanation = known.result.get("gap")
    if not (same_start(explanation, order.start(folder)) and is_there(explanation, order.out)):
        return None
    if order.credential is None:
        return dict(known.result) | {"certificate": None}
    path = _certificate_path(order, folder.serial)
    if known.certificate is None or _sha256(path) != known.certificate.sha256:
        return None
    return dict(known.result) | {"certificate": f"{CERTIFICATES}/{folder.serial}.pdf"}


def _sha256(path: Path) -> str | None:
    try:
        return hashlib.sha256(read_bounded(path, MAX_CERTIFICATE_BYTES)).hexdigest()
    except OSError:
        return None


def _job(folder: UnitFolder, order: BatchRequest, before: UnitState | None, head: Head) -> Job:
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


def _provenance(order: BatchRequest, spec: Spec, before: UnitState | None, head: Head) -> dict[str, Any] | None:
    if order.credential is None:
        return None
    approval = approval_of(spec, home(), order.credential.ca)
    crl = revocation.kept(keys.folder(home()) / revocation.FILE)
    return provenance_of(before, head, approval, demo=order.credential.demo, crl=crl)


def processes(count: int) -> ProcessPoolExecutor:
    """Fresh ones, which share nothing with this one."""
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))


def _judged(jobs: list[Job], order: BatchRequest) -> Iterator[tuple[Job, Outcome]]:
    if order.cluster is None:
        return _judge_all(jobs, order.workers, order.pool)
    return _judge_far(jobs, order.cluster, order.out)


def _judge_far(jobs: Iterable[Job], cluster: Cluster, out: Path) -> Iterator[tuple[Job, Outcome]]:
    """Judge on a cluster; what a worker made beside the result comes back with it."""
    for errand, back in cluster.unordered(run_errand, map(Errand.of, jobs)):
        if isinstance(back, WorkerDied):
            yield errand.job, f"{_folder(errand.job)}: every worker that judged it died (out of memory?)"
            continue
        for name, content in back.files.items():
            write_atomic(unit_folder.inside(out, name), content)
        yield errand.job, back.outcome


def _judge_all(
    jobs: list[Job], workers: int | None, pool: ProcessPoolExecutor | None = None
) -> Iterator[tuple[Job, Outcome]]:
    """Judge here, or in fresh processes when there is enough to do; a worker that dies costs only its own unit. With a
    pool of its own the caller judges the longest unit here."""
    wanted = workers if workers is not None else min(os.cpu_count() or 1, len(jobs) // MIN_UNITS_PER_WORKER)
    if wanted <= 1 or len(jobs) <= 1:
        yield from ((job, job()) for job in jobs)
        return
    left = dict(enumerate(sorted(jobs, key=_bytes, reverse=True)))  # the longest first, so that no worker waits for it
    try:
        with nullcontext(pool) if pool else processes(min(wanted, len(jobs))) as running:
            own = 0 if pool else None
            pending = {running.submit(job): key for key, job in left.items() if key != own}
            if own is not None:
                yield left[own], left[own]()
                del left[own]
            for future in as_completed(pending):
                judged = future.result()
                yield left.pop(pending[future]), judged
    except BrokenProcessPool:
        yield from ((job, _judge_apart(job)) for job in left.values())


def _folder(job: Job) -> Path:
    unit: UnitFolder = job.args[0]
    return unit.path


def _bytes(job: Job) -> int:
    """Of the files in a unit's folder, which say how long it takes."""
    return sum(path.stat().st_size for path in _folder(job).iterdir() if path.is_file())


def _judge_apart(job: Job) -> Outcome:
    """Judge one unit in a process of its own after a worker died; the unit that kills its worker is refused."""
    try:
        with processes(1) as pool:
            return pool.submit(job).result()
    except BrokenProcessPool:
        return f"{_folder(job)}: the process that judged it died (out of memory?)"


def _keep(job: Job, judged: Outcome, order: BatchRequest, store: Store, report: BatchReport, say: Say) -> None:
    """Certify a judged unit; only then say its verdict. One whose recordings stand elsewhere too is drawn again, with
    what that leaves of it."""
    if not isinstance(judged, str):
        copies = copies_of(store, judged.result.serial, str(judged.folder.resolve()), judged.result.samples)
        judged = job(copies=copies) if copies else judged
    if isinstance(judged, str):
        _refuse(_folder(job), judged, store, order, report, say)
        return
    serial, entry = judged.result.serial, judged.result.to_json()
    certify(judged, store, _certificate_path(order, serial), order.credential)
    certificate = f"{CERTIFICATES}/{serial}.pdf" if order.credential else None
    report.units.append(entry | {"certificate": certificate})
    report.doubted += withhold_others(store, serial, judged.result.copies, order.operator)
    say(f"{serial}: {entry['verdict']}{_why(entry)}")


def _why(entry: dict[str, Any]) -> str:
    bad = [f"{f['quantity']} {f['verdict'].replace('_', ' ')}" for f in entry["findings"] if f["verdict"] != "pass"]
    because = f" ({', '.join(bad)})" if bad else ""
    return because + (f"; {one_line(entry['gap'])}" if "gap" in entry else "")


def _write_results(order: BatchRequest, report: BatchReport) -> None:
    used = [s for kind, s in order.specs.items() if any(u["kind"] == kind for u in report.units)]
    listed = [{"name": s.name, "sha256": s.sha256} for s in used or order.specs.values()]
    write_atomic(order.out / "results.json", outputs.results_json(listed, report.units, report.refused))
    write_atomic(order.out / "results.csv", outputs.results_csv(report.units))
    write_atomic(order.out / "junit.xml", outputs.junit_xml(report.units, report.refused))
