"""Batches of many units: judge what changed, certify it, and leave results that scripts and people can read."""

import pickle
import sqlite3
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from accept import units
from accept.base.atomic_files import remove_leftovers
from accept.base.documents.results import ListedUnit, UnitHeader, UnitRecord
from accept.base.exit_codes import Exit, of_verdicts
from accept.base.plain_text import as_utf8
from accept.base.progress import steps
from accept.base.runner import GivenUp, Workers
from accept.base.spelling import spelling_key
from accept.batch.executors import run_jobs
from accept.batch.pipeline import Pipeline
from accept.batch.ports import Judgement, JudgingOrder, Refusal, Say
from accept.batch.results import WHOLE, Results, check_room
from accept.batch.services import JudgingServices
from accept.certificate import ContentError, InvalidCertificate, ends_before
from accept.certificate.trust import Credential
from accept.fleet import BenchStopped, keep_findings
from accept.gap import one_line
from accept.judging import spec_for
from accept.judging.reservations import part_doubts
from accept.pictures.labels import label_of
from accept.store import Store, StoreError
from accept.store.payloads import BatchFinished, BatchStarted, PlaceInBatch, UnitJudged, without_hashes
from accept.units import UnitError, UnitFolder
from checks.picture import Panel
from checks.verdict import Verdict
from specs.bench import BenchFile
from specs.files import CERTIFICATE_BYTES, read_bounded
from specs.spec import Spec

HELD = 2000  # units kept as they were read; the others are read again


class Roster:
    """Folders by serial, and which of them were judged, by which event. A context manager.

    One serial in two folders is a clash, also if they differ only in capitals: a file system may take a and A for one.
    """

    def __init__(self) -> None:
        self._file = sqlite3.connect("")  # in memory while it is small, else in a temporary file without a name
        self._file.execute(
            "CREATE TABLE unit (place TEXT PRIMARY KEY, path TEXT, serial TEXT, key TEXT, "
            "refused INTEGER DEFAULT 0, seq INTEGER, unchanged INTEGER, found BLOB, "
            "earlier INTEGER DEFAULT 0, since INTEGER DEFAULT 1)"
        )
        self._held: dict[Path, UnitFolder] = {}
        self._file.execute("CREATE INDEX by_key ON unit (key)")
        self._file.execute("CREATE INDEX by_serial ON unit (serial)")

    def __enter__(self) -> "Roster":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, unit: UnitFolder) -> None:
        """Add a folder; a folder that is named twice counts once."""
        if len(self._held) < HELD:
            self._held.setdefault(unit.path, unit)
        row = (str(unit.path.resolve()), str(unit.path), unit.serial, spelling_key(unit.serial))
        self._file.execute("INSERT OR IGNORE INTO unit (place, path, serial, key) VALUES (?, ?, ?, ?)", row)

    def clashes(self) -> Iterator[tuple[str, Path, list[str]]]:
        """Yield (serial, folder, the other folders) of each that shares a serial; they are refused from here on."""
        twice = "SELECT key FROM unit GROUP BY key HAVING COUNT(*) > 1"
        rows = self._file.execute(f"SELECT serial, path, key FROM unit WHERE key IN ({twice}) ORDER BY serial, path")
        for serial, path, key in rows.fetchall():
            others = self._file.execute("SELECT path FROM unit WHERE key = ? AND path != ? ORDER BY path", (key, path))
            yield serial, Path(path), [other for (other,) in others]
        self._file.execute(f"UPDATE unit SET refused = 1 WHERE key IN ({twice})")

    def folders(self) -> Iterator[Path]:
        rows = self._file.execute("SELECT path FROM unit WHERE refused = 0 ORDER BY serial")
        return (Path(path) for (path,) in rows)

    def unit(self, path: Path) -> UnitFolder:
        """Return the cached unit, read again if it was evicted. Raises UnitError."""
        return self._held.get(path) or units.read(path)

    def folder(self, serial: str) -> Path | None:
        """Return the folder of a unit of this batch, None if it has no such unit."""
        path = self._get("path", serial)
        return None if path is None else Path(path)

    def place(self, serial: str) -> int:
        """Return the place of a unit among the folders, in the order in which they were found."""
        return int(self._get("rowid", serial)) - 1

    def refuse(self, path: Path) -> None:
        self._file.execute("UPDATE unit SET refused = 1 WHERE place = ?", (str(path.resolve()),))

    def judged(self, serial: str, seq: int | None, unchanged: bool = False) -> None:
        """Note the event that holds the unit's result; a later one replaces an earlier one."""
        self._set(serial, seq=seq, unchanged=int(unchanged))

    def event(self, serial: str) -> int | None:
        """Return the number of the event that holds the unit's result, None before it was judged."""
        seq: int | None = self._get("seq", serial)
        return seq

    def keep(self, result: UnitRecord) -> None:
        """Keep the result of a unit in this run, without its pictures."""
        self._set(result.serial, found=zlib.compress(pickle.dumps(replace(result, panels={})), 1))

    def found(self, serial: str) -> UnitRecord | None:
        """Return the result of a unit in this run, None if it was not judged in it."""
        kept = self._get("found", serial)
        result: UnitRecord | None = None if kept is None else pickle.loads(zlib.decompress(kept))
        return result

    def known(self, serial: str, earlier: int, since: int) -> None:
        """Note how many judgements of the serial were counted, in events before number `since`."""
        self._set(serial, earlier=earlier, since=since)

    def results(self) -> Iterator[tuple[str, int, int, int]]:
        """Yield (serial, number of its event, and what `known` counted: earlier, since), by serial."""
        columns = "serial, seq, earlier, since"
        return iter(self._file.execute(f"SELECT {columns} FROM unit WHERE seq IS NOT NULL ORDER BY serial"))

    def count(self, which: str = "refused = 0") -> int:
        """Return the number of units that are not refused. which: `seq IS NOT NULL` for judged, `unchanged` for those
        judged before."""
        found: tuple[int] = self._file.execute(f"SELECT COUNT(*) FROM unit WHERE {which}").fetchone()
        return found[0]

    def _get(self, column: str, serial: str) -> Any:
        row = self._file.execute(f"SELECT {column} FROM unit WHERE serial = ? AND refused = 0", (serial,)).fetchone()
        return None if row is None else row[0]

    def _set(self, serial: str, **row: Any) -> None:
        columns = ", ".join(f"{column} = ?" for column in row)
        self._file.execute(f"UPDATE unit SET {columns} WHERE serial = ? AND refused = 0", (*row.values(), serial))


CERTIFICATES = "certificates"


@dataclass(frozen=True)
class BatchRequest:
    """The request of a batch. specs: kind -> spec. credential: None writes no certificates. bench: judge with the
    calibration of its instruments, as it stands `on` a day (UTC). model: explains responses instead of the spec's.
    pool: processes that run already; the longest unit is then judged by this one. For units that are known not to
    break it. cluster: judges instead of processes of this machine. refused: (where, why) of units that did not even
    come this far. confirm: asks the operator a question, None if it cannot be asked. reason: why units that were not
    accepted are judged again, None to ask for it by `ask_reason`."""

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
    cluster: Workers | None = None
    refused: Sequence[tuple[str, str]] = ()
    confirm: Callable[[str], bool | None] = lambda _: None
    reason: str | None = None
    ask_reason: Callable[[str], str | None] = lambda _: None

    def certificate(self, serial: str) -> Path | None:
        return None if self.credential is None else self.out / CERTIFICATES / f"{serial}.pdf"


@dataclass
class BatchReport:
    """The report of a batch. units: those of results.json in order of serial, if they are few enough to be held
    (`WHOLE`); verdicts: how many have which; refused folders; unchanged: how many were judged before."""

    units: list[ListedUnit] = field(default_factory=list)
    verdicts: Counter[str] = field(default_factory=Counter)
    refused: list[dict[str, str]] = field(default_factory=list)
    unchanged: int = 0

    @property
    def judged(self) -> int:
        return self.verdicts.total()

    def exit(self) -> Exit:
        return of_verdicts(self.verdicts, len(self.refused))


def run(request: BatchRequest, store: Store, say: Say) -> BatchReport:
    """Judge all units of a request. Every verdict is stored before it is printed. A run that was killed can be
    repeated: it judges only what the store does not hold for the same inputs, spec and code.

    Raises OSError if `out` cannot be written, StoreError if the store cannot, ResultsError if there are more units than
    can be written.
    """
    remove_leftovers(request.out, request.out / CERTIFICATES)
    with Roster() as roster:
        batch = _Batch(request, roster, store, say)
        batch.enrol()
        check_room(roster.count(), request.cluster is not None)
        names = {kind: spec.with_hash for kind, spec in request.specs.items()}
        started = store.write(BatchStarted(str(request.out), roster.count(), names), who=request.operator)
        batch.started = started.seq
        jobs: Iterator[JudgingOrder] | list[JudgingOrder] = batch.jobs()
        if request.cluster is None:
            jobs = list(jobs)
        of = len(jobs) if isinstance(jobs, list) else roster.count()
        done = run_jobs(jobs, request.workers, request.pool, request.cluster)
        for number, (job, outcome) in enumerate(steps(done, "units judged", of), 1):
            batch.keep(job, outcome, f"[{number}/{of}] ")
        batch.settle_doubted_again()
        batch.report.unchanged = roster.count("unchanged")
        batch.write_results()
    report = batch.report
    store.write(BatchFinished(report.verdicts, len(report.refused)), who=request.operator)
    with suppress(StoreError):  # an earlier judgement that cannot be read is no fault of this batch
        keep_findings(store, report.judged - report.unchanged)  # so that no question has to read so many judgements
    return report


class _Batch:
    def __init__(self, request: BatchRequest, roster: Roster, store: Store, say: Say) -> None:
        self.request, self.roster, self.store, self.say = request, roster, store, say
        self.report = BatchReport()
        services = JudgingServices(store, request.operator, request.credential, request.model)
        self.pipeline = Pipeline(
            store, request.specs, request.operator, services, bench_file=request.bench, on=request.on, out=request.out,
            confirm=request.confirm, reason=request.reason, ask_reason=request.ask_reason,
        )  # fmt: skip
        self.doubted: list[str] = []  # judged earlier with a recording that another unit has too
        self.unsigned = set[str]()  # judged without a new certificate, though one was wanted
        self.started = 0  # number of the event that says so
        self.built: dict[str, tuple[UnitHeader, Sequence[str]]] = {}  # with parts, and the doubts that were stated

    def enrol(self) -> None:
        """Put the units that can be judged into the roster; refuse the others, and folders that share a serial."""
        for address, reason in self.request.refused:
            self._refuse(address, reason)
        for path in self.request.paths:
            try:
                found = units.find(path)
            except UnitError as e:
                self._refuse(path, str(e))
                continue
            for folder in found:
                try:
                    one = units.read(folder)
                    spec_for(one, self.request.specs)
                    self.roster.add(one)
                except UnitError as e:
                    self._refuse(folder, str(e))
        for serial, path, others in self.roster.clashes():
            where = path / units.UNIT_FILE
            reason = f"{where}: serial = '{serial}' is also that of {', '.join(others)}; serials must be unique"
            self._refuse(path, reason)

    def jobs(self) -> Iterator[JudgingOrder]:
        """Yield the jobs as they are asked for; report and mark units that are unchanged."""
        for path in self.roster.folders():
            try:
                job = self._job(path)
            except (UnitError, BenchStopped) as e:
                self._refuse_unit(path, str(e))
                continue
            if job is not None:
                yield job

    def _job(self, path: Path) -> JudgingOrder | None:
        """Return the job of a unit, None if its result stands. Raises UnitError, BenchStopped."""
        pipeline, roster = self.pipeline, self.roster
        unit = roster.unit(path)
        known, certificate = pipeline.ask(unit), self.request.certificate(unit.serial)
        before = known.before
        if before is not None:
            roster.known(unit.serial, before.attempts - 1, before.seq)
        if before is not None and pipeline.stands(unit, known, certificate):
            roster.judged(unit.serial, before.seq, unchanged=True)
            # Noted again: the run that judged it may have been killed before it could.
            self.doubted += pipeline.weaken_others(unit.serial, known.reservations.copies)
            self._note_parts(unit.header, known.reservations.part_doubts)
            self.say(f"{unit.serial}: unchanged, {before.result.marked_word}")
            return None
        return pipeline.prepare(unit, known, certificate, self._place(unit))

    def _place(self, unit: UnitFolder) -> PlaceInBatch:
        return PlaceInBatch(self.started, self.roster.place(unit.serial))

    def keep(self, job: JudgingOrder, outcome: Judgement | Refusal | GivenUp, prefix: str) -> None:
        """Settle the outcome of a job, then print the verdict."""
        if isinstance(outcome, Refusal | GivenUp):
            words = outcome.reason if isinstance(outcome, Refusal) else f"{job.unit.path}: {outcome}"
            self._refuse_unit(job.unit.path, words, prefix)
            return
        try:
            settled = self.pipeline.settle(job, outcome)
        except (BenchStopped, ContentError) as e:  # since this batch began
            self._refuse_unit(job.unit.path, str(e), prefix)
            return
        result = settled.result
        self.roster.judged(result.serial, settled.seq)
        self.roster.keep(outcome.result)
        self.doubted += settled.weakened
        self._note_parts(job.unit.header, result.part_doubts)
        self.say(f"{prefix}{result.serial}: {result.marked_word}{_why(result)}")
        if settled.unsigned:
            self.unsigned.add(result.serial)
            self._refuse(job.unit.path, settled.unsigned, prefix)

    def settle_doubted_again(self) -> None:
        """Settle again the units of this run that share a recording with a later one, or whose part was judged or built
        in elsewhere after them, before their first results are handed on. Report those of other runs as invalid."""
        for serial in sorted(set(self.doubted)):
            self._settle_again(serial, "a recording that is also another unit's")
        for serial, (strut, stated) in sorted(self.built.items()):
            if part_doubts(self.store, strut) != list(stated):
                self._settle_again(serial, "parts that were judged again, or built in elsewhere, since then")

    def _settle_again(self, serial: str, because_of: str) -> None:
        """Settle the judgement of a unit with the present store; no unit is judged twice in one run."""
        path = self.roster.folder(serial)
        if path is None:
            self.say(f"warning: {serial} was judged with {because_of}; its result is invalid; judge it again")
            return
        unit = self.roster.unit(path)
        found, certificate = self.roster.found(serial), self.request.certificate(serial)
        known = self.pipeline.ask(unit)
        listed = known.before is not None and self.roster.event(serial) == known.before.seq
        if listed and (serial in self.unsigned or self.pipeline.stands(unit, known, certificate)):
            return
        panels = {} if certificate is None else _pictures(certificate)
        why = f"in the same batch, because of {because_of}"
        job = self.pipeline.prepare(unit, known, certificate, self._place(unit), why)
        judgement = job.run() if found is None or panels is None else Judgement(replace(found, panels=panels))
        self.keep(job, judgement, "again, ")

    def write_results(self) -> None:
        """Write the files for scripts, from what the store holds."""
        request, roster, report = self.request, self.roster, self.report
        results = Results(request.out, whole=roster.count() <= WHOLE, dataset=request.cluster is not None)
        kinds = set()
        with results:
            for serial, seq, earlier, since in roster.results():
                known = self.store.events(serial, UnitJudged.KIND, after=since - 1)
                *more, judged = (event for event in known if event.seq <= seq)
                path = None if serial in self.unsigned else request.certificate(serial)
                certificate = None if path is None else path.relative_to(request.out).as_posix()
                unit = ListedUnit(**vars(UnitJudged.of(judged).result), certificate=certificate)
                if attempts := earlier + len(more):
                    past = self.pipeline.events(serial)
                    ended = ends_before(self.pipeline.services.state(past, before=judged.seq))
                    unit = replace(unit, attempt=attempts + 1, earlier=None if ended is None else ended.to_json())
                report.verdicts[str(unit.verdict)] += 1
                kinds.add(unit.kind)
                results.add(unit, attempt=attempts + 1, time=judged.time, operator=judged.who)
            used = [s for kind, s in request.specs.items() if kind in kinds] or list(request.specs.values())
            results.finish([{"name": s.name, "sha256": s.sha256} for s in used], report.refused, report.verdicts)
        report.units = results.units

    def _note_parts(self, unit: UnitHeader, stated: Sequence[str]) -> None:
        if unit.parts:  # of units without any there may be many
            self.built[unit.serial] = unit, stated

    def _refuse_unit(self, path: Path, reason: str, prefix: str = "") -> None:
        self.roster.refuse(path)
        self._refuse(path, reason, prefix)

    def _refuse(self, path: Path | str, reason: str, prefix: str = "") -> None:
        self.pipeline.refuse(path, reason)
        self.report.refused.append({"path": as_utf8(str(path)), "reason": reason})
        self.say(f"{prefix}refused: {reason}")


def _why(result: UnitRecord) -> str:
    bad = [f for f in result.findings if f.verdict is not Verdict.PASS]
    words = [f"{label_of(f.quantity)}: {f.verdict.replace('_', ' ')}" for f in bad]
    words += [without_hashes(noted) for noted in result.nonconformances]
    because = f" ({'; '.join(words)})" if words else ""
    return because + (f"; {one_line(result.gap)}" if result.gap is not None else "")


def _pictures(certificate: Path) -> Mapping[str, Panel] | None:
    from accept.certificate import read_contents

    try:
        content = read_bounded(certificate, CERTIFICATE_BYTES)
        return read_contents(content).panels
    except (InvalidCertificate, OSError):
        return None
