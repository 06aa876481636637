"""A section measured live: at the screen of its step, and by `accept hw measure` into a folder of the user's."""

import threading
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from accept import units
from accept.base.atomic_files import write_atomic
from accept.base.home import home
from accept.capture.operator_actions import OperatorActions
from accept.capture.reading_loop import Journal, ReadingLoop, Say
from accept.capture.recipes import RECIPES
from accept.capture.recorded import RECORDED, Recording, ShowHits, nobody_looks
from accept.capture.setup import CaptureResult, CaptureSetup
from accept.judging import default_spec
from accept.store import Store
from accept.store.payloads import ReadingFailed
from accept.units import UnitSection, toml_edit
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.instruments.hardware import BenchInstrument, BenchRecorder
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from checks.declare import CsvTable, Series
from hw.errors import InstrumentError

MOST_LINES = 12_000  # in an event: a stroke, the longest run that is not followed, has some 10,000


def capture(
    session: Session,
    step: str,
    instrument: BenchInstrument | BenchRecorder,
    actions: OperatorActions,
    say: Say,
    *,
    journal_in: Path | None = None,
    known: Mapping[str, float] | None = None,
    stopped: threading.Event | None = None,
    show: ShowHits = nobody_looks,
) -> CaptureResult:
    """Measure a step by its recipe and store its values like any other entry, each with the instrument that was read;
    the traffic of its line is stored with the first.

    journal_in: folder of the journal, by default the attempt's. known: values that need not be asked for. show: is
    given the hits of a hammer so far. A run that fails stores why, and leaves its journal. Raises InstrumentError,
    EntryError, RecordError, StoreError, OSError.
    """
    recipes = RECORDED if isinstance(instrument, BenchRecorder) else RECIPES
    if step not in recipes or step not in {one.name for one in session.steps}:
        raise EntryError(f"spec {session.spec.name} asks for no '{step}' that an instrument measures here")
    if isinstance(instrument, BenchRecorder):
        return _record(session, step, instrument, actions, say, stopped or threading.Event(), show)
    given = {name: one.value for name, one in _typed(session, step).items()} | dict(known or {})
    driver = instrument.driver
    with closing(Journal(journal_in or session.folder, step)) as journal:
        loop = ReadingLoop(driver, journal, say, stopped)
        try:
            with instrument.mutex:
                for reminder in driver.reminders:
                    say(reminder)
                driver.connect()
                captured = RECIPES[step](CaptureSetup(loop, actions, say, instrument.entry.accuracy, given))
                driver.confirm()  # still the instrument that it was, set as it was, before anything is set
        except InstrumentError as e:
            session.append(ReadingFailed(step, "", str(e), instrument.name, _evidence(instrument, journal, ())))
            raise
        kept = _evidence(instrument, journal, captured.notes)
    _store(session, step, instrument.name, captured, kept)
    return captured


def _record(
    session: Session,
    step: str,
    instrument: BenchRecorder,
    actions: OperatorActions,
    say: Say,
    stopped: threading.Event,
    show: ShowHits,
) -> CaptureResult:
    """Take the records of a step with a recorder and store them. Raises as `capture`, ExcitationError."""
    of = session.step(step)
    recording = Recording(instrument.recorder, actions, say, of.asked, of.check.inputs, stopped.is_set, show)
    try:
        with instrument.mutex:
            instrument.recorder.connect()
            captured = RECORDED[step](recording)
    except InstrumentError as e:
        session.append(ReadingFailed(step, "", str(e), instrument.name, instrument.evidence()))
        raise
    _store(session, step, instrument.name, captured, {**instrument.evidence(), "notes": list(captured.notes)})
    return captured


def _typed(session: Session, step: str) -> dict[str, Any]:
    state = session.state(step)
    inputs = session.step(step).check.inputs
    return {name: readings[-1] for name in inputs if (readings := state.readings(name))}


def _store(session: Session, step: str, source: str, captured: CaptureResult, kept: Mapping[str, Any]) -> None:
    inputs = session.step(step).check.inputs
    brief = {key: kept[key] for key in ("instrument", "journal") if key in kept}
    evidence = iter([kept])
    for name, measured in captured.typed.items():
        session.entries.take(step, inputs[name], measured, text=f"{measured.value:.9g}")
    for name, measured in captured.values.items():
        text = f"{measured.value:.9g} {getattr(inputs[name], 'unit', '')}".strip()
        session.entries.take(step, inputs[name], measured, text=text, source=source, evidence=next(evidence, brief))
    with TemporaryDirectory() as folder:
        for name, file in captured.files.items():
            declared, path = inputs[name], Path(folder) / file.name
            if not isinstance(declared, Series | CsvTable):
                raise TypeError(f"{step}.{name}: expected a record")
            path.write_bytes(file.content)
            session.records.link(step, declared, path, instrument=source, evidence=next(evidence, brief))


def _evidence(instrument: BenchInstrument, journal: Journal, notes: tuple[str, ...]) -> dict[str, Any]:
    """Return what an event keeps of a run: both ends of long lists; the journal in the folder has all readings."""
    lines = journal.lines
    ends = lines if len(lines) <= MOST_LINES else [*lines[: MOST_LINES // 2], *lines[-MOST_LINES // 2 :]]
    return {
        **instrument.evidence(MOST_LINES),
        "readings": list(ends),
        "journal": journal.path.name,
        "notes": list(notes),
    }


def measure_folder(
    folder: Path,
    step: str,
    instrument: BenchInstrument | BenchRecorder,
    actions: OperatorActions,
    store: Store,
    operator: str,
    say: Say = lambda _: None,
    simulated: bool = False,
) -> CaptureResult:
    """Measure a section of a unit that has its `unit.toml`, in the attempt that the workflow goes on with, and enter it
    into the folder. simulated: so is the instrument. Raises as `capture`, UnitError, UnitBusy, EntryError."""
    unit = units.read(folder)
    session = open_session(store, home(), default_spec(unit.kind), operator, unit.serial, simulated=simulated)
    try:
        if session.run.attempt is None:
            session.begin(unit.header.parts, channels=unit.channels, simulated=unit.header.simulated)
        else:
            session.resume()
        captured = capture(
            session, step, instrument, actions, say, journal_in=folder, known=_numbers(unit.sections.get(step))
        )
    finally:
        session.close()
        instrument.close()
    for file in captured.files.values():
        write_atomic(folder / file.name, file.content, of_unit=True)
    toml_edit.enter(folder, step, captured.to_toml(), simulated)
    return captured


def _numbers(section: UnitSection[Any] | None) -> dict[str, float]:
    if section is None:
        return {}
    found = {name: section.number(name) for name in section.entries}
    return {name: value for name, value in found.items() if value is not None}
