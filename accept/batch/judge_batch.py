"""Many units: judge what changed, certify it, and leave results that scripts and people can read."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import Any

from accept.base.exit_codes import Exit, of_verdicts
from accept.base.progress import steps
from accept.batch.engines import folder_of, judge_far, judge_here
from accept.batch.request import CERTIFICATES, BatchRequest, spec_for
from accept.batch.results import WHOLE, Results, check_room
from accept.batch.roster import Roster
from accept.batch.unchanged import unchanged
from accept.batch.worker import Job, JudgedOrRefused
from accept.certificate import events, uncertified
from accept.certificate.certify import certify
from accept.fleet import golden
from accept.gap.text import one_line
from accept.judging.copies import copies_of, withhold_others
from accept.judging.parts import part_doubts
from accept.judging.result import UnitResult
from accept.pictures.labels import label_of
from accept.store import Event, SignedHead, Store, fold
from accept.store.spelling import mistaken_for
from accept.units import unit_folder
from accept.units.unit_folder import UnitError, UnitFolder
from checks.verdict import Verdict

Say = Callable[[str], None]


@dataclass
class BatchReport:
    """What a batch did. units: results.json entries in order of serial, where they are few enough to be held (`WHOLE`);
    verdicts: how many units have which; refused folders; unchanged: how many were as they had been judged."""

    units: list[dict[str, Any]] = field(default_factory=list)
    verdicts: Counter[str] = field(default_factory=Counter)
    refused: list[dict[str, str]] = field(default_factory=list)
    unchanged: int = 0

    @property
    def judged(self) -> int:
        return self.verdicts.total()

    def exit(self) -> Exit:
        return of_verdicts(self.verdicts, len(self.refused))


def run(request: BatchRequest, store: Store, say: Say) -> BatchReport:
    """Judge all units of a request. Every verdict is in the store before it is said; a run that was killed is taken up
    where it stopped, because the next one judges only what the store does not hold for the same inputs, spec and code.

    Raises OSError when `out` cannot be written, StoreError when the store cannot, ResultsError where there are more
    units than can be written.
    """
    with Roster() as roster:
        batch = _Batch(request, roster, store, say)
        batch.enrol()
        check_room(roster.count(), request.cluster is not None)
        names = {kind: f"{spec.name}@{spec.sha256}" for kind, spec in request.specs.items()}
        started = {"out": str(request.out), "units": roster.count(), "specs": names}
        store.append("batch_started", "", started, who=request.operator)
        if request.cluster is not None:
            judged, of = judge_far(batch.jobs(), request.cluster), roster.count()
        else:
            jobs = list(batch.jobs())
            judged, of = judge_here(jobs, request.workers, request.pool), len(jobs)
        for number, (job, outcome) in enumerate(steps(judged, "units judged", of), 1):
            batch.keep(job, outcome, f"[{number}/{of}] ")
        batch.judge_doubted_again()
        batch.report.unchanged = roster.count("unchanged")
        batch.write_results()
    report = batch.report
    store.append(
        "batch_finished", "", {"verdicts": report.verdicts, "refused": len(report.refused)}, who=request.operator
    )
    return report


@dataclass
class _Batch:
    """One batch under way: what is asked, who is enrolled, where it is stored, whom it is said to, what was done."""

    request: BatchRequest
    roster: Roster
    store: Store
    say: Say
    report: BatchReport = field(default_factory=BatchReport)
    doubted: list[str] = field(default_factory=list)  # judged earlier with a recording that another unit has too
    built: dict[str, tuple[Mapping[str, str], Sequence[str]]] = field(default_factory=dict)  # parts, stated doubts

    def enrol(self) -> None:
        """Units that can be judged into the roster; the others are refused, said and stored. One serial in two folders
        refuses both."""
        for address, reason in self.request.refused:
            self._refuse(address, reason)
        for path in self.request.paths:
            try:
                found = unit_folder.find(path)
            except UnitError as e:
                self._refuse(path, str(e))
                continue
            for folder in found:
                try:
                    one = unit_folder.read(folder)
                    spec_for(one, self.request.specs)
                    self.roster.add(one)
                except UnitError as e:
                    self._refuse(folder, str(e))
        for serial, path, others in self.roster.clashes():
            where = path / unit_folder.UNIT_FILE
            reason = f"{where}: serial = '{serial}' is also that of {', '.join(others)}; serials must be unique"
            self._refuse(path, reason)

    def jobs(self) -> Iterator[Job]:
        """What is to be judged, made as it is asked for; what is unchanged is said and marked."""
        stopped = golden.stopped(self.store) is not None  # asked where a verdict is stored; known before, it saves work
        head = self.store.signed_head()
        for path in self.roster.folders():
            try:
                folder, past = self._may_be_judged(path, stopped)
            except (UnitError, golden.BenchStopped) as e:
                self.roster.refuse(path)
                self._refuse(path, str(e))
                continue
            job = self._job(folder, past, head)
            if job is not None:
                yield job

    def _may_be_judged(self, path: Path, stopped: bool) -> tuple[UnitFolder, list[Event]]:
        """The unit and all that the store holds of it. Raises UnitError, BenchStopped."""
        folder = self.roster.unit(path)
        if stopped:
            golden.may_judge(self.store, folder.serial)
        past = list(self.store.events(folder.serial))  # of the others the store may hold many
        # Of two that the store knows both have been here since before this was looked at.
        if not past and (known := self.store.other_spelling(folder.serial)) is not None:
            raise UnitError(path / unit_folder.UNIT_FILE, [mistaken_for(folder.serial, known)])
        return folder, past

    def _job(self, folder: UnitFolder, past: list[Event], head: SignedHead | None) -> Job | None:
        """What is to be done with a unit; None where its result stands."""
        request, roster, store = self.request, self.roster, self.store
        before = fold(past).units.get(folder.serial)
        if before is not None:
            roster.known(folder.serial, before.attempts - 1, before.seq)
        if before is not None and unchanged(folder, request, before, store):
            roster.judged(folder.serial, before.seq, unchanged=True)
            # Said again: the run that judged it may have been killed before it could.
            self._doubt_others(folder.serial, before.result.get("copies", []))
            self._note_parts(folder.serial, folder.parts, before.result.get("part_doubts", []))
            self.say(f"{folder.serial}: unchanged, {before.verdict}")
            return None
        wanted = before if request.credential is not None else None
        if wanted and uncertified.is_due(wanted, folder, request.specs[folder.kind], request.operator):
            roster.expect(folder.serial, wanted.seq)
            before = uncertified.before(past, wanted)
        return request.job(folder, before, head)

    def keep(self, job: Job, judged: JudgedOrRefused, prefix: str) -> None:
        """Certify a judged unit; only then say its verdict. One whose recordings stand elsewhere too is drawn again,
        with what that leaves of it."""
        request, roster, store = self.request, self.roster, self.store
        if not isinstance(judged, str):
            copies = copies_of(store, judged.result.serial, str(judged.folder.resolve()), judged.result.samples)
            doubts = part_doubts(store, judged.result.serial, judged.result.parts)
            judged = job(copies=copies, doubts=doubts) if copies or doubts else judged
        if isinstance(judged, str):
            self._refuse_judged(job, judged, prefix)
            return
        serial = judged.result.serial
        due = roster.expected(serial)
        if due is not None and not uncertified.repeats(store, serial, due, judged.result):
            roster.expect(serial, None)
            before = fold(store.events(serial)).units[serial]
            other = request.job(roster.unit(folder_of(job)), before, store.signed_head())
            self.keep(other, other(), prefix)
            return
        try:
            event = certify(judged, store, request.certificate(serial), request.credential, stored=due is not None)
        except golden.BenchStopped as e:  # since this batch began
            self._refuse_judged(job, str(e), prefix)
            return
        roster.judged(serial, event.seq if event is not None else due)
        roster.expect(serial, None)
        self._doubt_others(serial, judged.result.copies)
        self._note_parts(serial, judged.result.parts, judged.result.part_doubts)
        self.say(f"{prefix}{serial}: {judged.result.verdict}{_why(judged.result)}")

    def judge_doubted_again(self) -> None:
        """Units of this run whose recording another one turned out to have too, or whose part was judged or built in
        elsewhere after them, are judged again, before anybody is handed what was said of them first; of others it is
        said that their results count no more."""
        for serial in sorted(set(self.doubted)):
            self._judge_again(serial, "a recording that is also another unit's")
        for serial, (parts, stated) in sorted(self.built.items()):
            if part_doubts(self.store, serial, parts) != list(stated):
                self._judge_again(serial, "parts that were judged again, or built in elsewhere, since then")

    def _judge_again(self, serial: str, because_of: str) -> None:
        path = self.roster.folder(serial)
        if path is None:
            self.say(f"warning: {serial} was judged with {because_of}; its result counts no more")
            return
        before = fold(self.store.events(serial)).units.get(serial)
        job = self.request.job(self.roster.unit(path), before, self.store.signed_head())
        self.keep(job, job(), "again, ")

    def write_results(self) -> None:
        """The files for scripts, from what the store holds."""
        request, roster, report = self.request, self.roster, self.report
        results = Results(request.out, whole=roster.count() <= WHOLE, dataset=request.cluster is not None)
        kinds = set()
        with results:
            for serial, seq, earlier, since in roster.results():
                *more, judged = _judgements(self.store, serial, since, seq)
                certificate = f"{CERTIFICATES}/{serial}.pdf" if request.credential else None
                entry = judged.data["result"] | {"certificate": certificate}
                report.verdicts[entry["verdict"]] += 1
                kinds.add(entry["kind"])
                results.add(entry, attempt=earlier + len(more) + 1, time=judged.time, operator=judged.who)
            used = [s for kind, s in request.specs.items() if kind in kinds] or list(request.specs.values())
            results.finish([{"name": s.name, "sha256": s.sha256} for s in used], report.refused, report.verdicts)
        report.units = results.entries

    def _doubt_others(self, serial: str, copies: Sequence[Mapping[str, Any]]) -> None:
        self.doubted += withhold_others(self.store, serial, copies, self.request.operator)

    def _note_parts(self, serial: str, parts: Mapping[str, str], stated: Sequence[str]) -> None:
        if parts:  # of units without any there may be many
            self.built[serial] = parts, stated

    def _refuse_judged(self, job: Job, reason: str, prefix: str) -> None:
        self.roster.refuse(folder_of(job))
        self._refuse(folder_of(job), reason, prefix)

    def _refuse(self, path: Path | str, reason: str, prefix: str = "") -> None:
        events.refused(self.store, path, reason, self.request.operator)
        self.report.refused.append({"path": str(path), "reason": reason})
        self.say(f"{prefix}refused: {reason}")


def _why(result: UnitResult) -> str:
    bad = [f for f in result.findings if f.verdict is not Verdict.PASS]
    words = "; ".join(f"{label_of(f.quantity)}: {f.verdict.replace('_', ' ')}" for f in bad)
    because = f" ({words})" if bad else ""
    return because + (f"; {one_line(result.gap)}" if result.gap is not None else "")


def _judgements(store: Store, serial: str, first: int, last: int) -> Iterator[Event]:
    """Of a unit, from one event to another."""
    return takewhile(lambda e: e.seq <= last, store.events(serial, "unit_judged", after=first - 1))
