"""`accept hw`: list the instruments of a bench, ask them for readings, and measure with them."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, TypeVar

from rich.table import Column
from serial.tools.list_ports import comports
from typer import Argument, Option

from accept.base.console import say
from accept.base.documents.listings import BenchListing, InstrumentAsked, InstrumentListed, InstrumentsAsked
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.base.plain_text import listed
from accept.capture.operator_actions import OperatorActions, Person, Player, StagedOperator
from accept.capture.recipes import RECIPES
from accept.capture.recorded import RECORDED
from accept.capture.watch_folder import STABLE_S, WatchedFolder, declared_file, pick_up
from accept.commands.answer import PLAIN, Answer, File, Remark, command, refusal, table
from accept.commands.options import JsonAnswer
from accept.commands.trust.bench_keys import who_acts
from accept.store import open_store
from accept.units import UNIT_FILE, toml_edit
from accept.workflow.capture import measure_folder
from accept.workflow.instruments.hardware import BenchInstrument, BenchRecorder, open_bench_recorder
from checks.errors import RecordError
from hw.errors import InstrumentError, SettingsError
from hw.instruments import Identity, open_instrument
from specs.bench import NO_CHANNELS, OFFLINE, BenchFile, InstrumentEntry, RecorderEntry, RecordPattern, load_bench
from specs.strict import SpecError

BENCH_FILE = "bench.toml"
LOOK_S = 0.2  # between two looks into the folder
LISTED = ("name", "driver", "measures", "model", "serial", "port", "calibrated until")
ASKED = ("name", "connected as", "answered", "connect s", "reading s")
SOON_DAYS = 30  # before a calibration ends it is marked
T = TypeVar("T")
Bench = Annotated[Path | None, Option("--bench", help="Bench file; default: bench.toml in ACCEPT_HOME.")]
Measurer = Annotated[str | None, Option(envvar="ACCEPT_OPERATOR", help="Who measures.")]


def bench_path(given: Path | None) -> Path:
    """Return the bench file named, else the one in the bench's folder. Raises SpecError if neither exists."""
    path = given if given is not None else home() / BENCH_FILE
    if given is None and not path.exists():
        raise SpecError(str(path), ["no bench file found; write one or name it with --bench"])
    return path


def ask_at_terminal(words: str) -> str:
    """Return the answer of a person. Raises SettingsError without a terminal, at which a question could be asked."""
    if not sys.stdin.isatty():
        raise SettingsError(f"no terminal for a question: {words.rstrip(': ')}")
    return input(words)


@command
def show_list(bench: Bench = None, json: JsonAnswer = None) -> Answer:
    """List the instruments of the bench file. With port and calibration, and the serial ports that are there."""
    file = load_bench(bench_path(bench))
    listed = tuple(_listing_row(name, entry) for name, entry in file.equipment.items())
    ports = [f"{port.device} ({port.description})" for port in comports()]
    problems = [Remark(f"accept: {file.path}: {one.problem}") for one in listed if one.problem]
    return Answer(
        File(json, BenchListing(file.name, str(file.path), listed, tuple(ports))),
        table(map(_column, LISTED), (_row(*entry) for entry in file.equipment.items()), **PLAIN),
        Remark(f"serial ports: {', '.join(ports) or 'none'}"),
        *problems,
        exit=Exit.BAD_INPUT if problems else Exit.ACCEPTED,
    )


def _listing_row(name: str, entry: InstrumentEntry | RecorderEntry) -> InstrumentListed:
    link = entry.link if isinstance(entry, InstrumentEntry) else None
    resource = entry.resource if isinstance(entry, InstrumentEntry) else None
    return InstrumentListed(
        name, entry.driver, tuple(entry.measures), entry.model, entry.serial, isinstance(entry, RecorderEntry),
        resource if link is None else link.port, None if link is None else Path(link.port).exists(),
        None if entry.calibration is None else entry.calibration.due.isoformat(), _days_left(entry),
        entry_problem(name, entry) or None,
    )  # fmt: skip


def _row(name: str, entry: InstrumentEntry | RecorderEntry) -> tuple[str, ...]:
    if isinstance(entry, RecorderEntry):
        port = f"{len(entry.channels)} channels"
    elif entry.link is None:
        port = "-"
    else:
        port = f"{entry.link.port}{'' if Path(entry.link.port).exists() else ' (not there)'}"
    measures, model, serial = ", ".join(entry.measures), entry.model or "-", entry.serial or "-"
    return name, entry.driver, measures, model, serial, port, _calibration_words(entry)


def _column(title: str) -> Column:
    """Return a column in which a name to copy stays in one piece."""
    return Column(title, overflow="fold", no_wrap=title == "port")


def entry_problem(name: str, entry: InstrumentEntry | RecorderEntry) -> str:
    """Return why no driver takes an entry of the bench file, "" if one does; nothing is opened."""
    try:
        if isinstance(entry, RecorderEntry):
            open_bench_recorder(name, entry).close()
        elif entry.driver != OFFLINE:
            open_instrument(name, entry, ask_at_terminal).close()
    except SettingsError as e:
        return str(e)
    return ""


def _calibration_words(entry: InstrumentEntry | RecorderEntry) -> str:
    """Return the last day of the calibration, marked if it is past or within a month."""
    days = _days_left(entry)
    if entry.calibration is None or days is None:
        return "unknown"
    mark = " (expired)" if days < 0 else f" (in {days} days)" if days <= SOON_DAYS else ""
    return entry.calibration.due.isoformat() + mark


def _days_left(entry: InstrumentEntry | RecorderEntry) -> int | None:
    return None if entry.calibration is None else (entry.calibration.due - datetime.now(UTC).date()).days


@command
def ask(
    names: Annotated[list[str] | None, Argument(help="Names of instruments; default: all.")] = None,
    bench: Bench = None,
    json: JsonAnswer = None,
) -> Answer:
    """Ask every instrument for one reading. Exit 5 if one does not answer as it should, 6 for a fault of the file."""
    file = load_bench(bench_path(bench))
    unknown = [name for name in names or () if name not in file.equipment]
    if unknown:
        return refusal(f"{file.path} has no instrument {', '.join(unknown)} (it has: {', '.join(file.equipment)})")
    chosen = {
        name: entry
        for name, entry in file.equipment.items()
        if (not names or name in names) and entry.driver not in (OFFLINE, "manual")
    }
    problems = [problem for name, entry in chosen.items() if (problem := entry_problem(name, entry))]
    if problems:
        return Answer(*(Remark(f"accept: {file.path}: {words}") for words in problems), exit=Exit.BAD_INPUT)
    asked = [_answer_of(name, entry) for name, entry in chosen.items()]
    times = (["-" if s is None else f"{s:.2f}" for s in (one.connect_s, one.reading_s)] for one in asked)
    rows = ((one.name, _identity_words(one), _reading_words(one), *t) for one, t in zip(asked, times, strict=True))
    failed = [Remark(one.problem) for one in asked if one.problem]
    return Answer(
        File(json, InstrumentsAsked(str(file.path), tuple(asked))),
        table(map(_column, ASKED), rows, **PLAIN),
        *failed,
        exit=Exit.INSTRUMENT if failed else Exit.ACCEPTED,
    )


def _answer_of(name: str, entry: InstrumentEntry | RecorderEntry) -> InstrumentAsked:
    identity, reading, times = Identity(), None, list[float]()
    problem = None
    try:
        if isinstance(entry, RecorderEntry):
            with closing(open_bench_recorder(name, entry)) as recorder:
                identity = _timed(recorder.connect, times)
        else:
            with closing(open_instrument(name, entry, ask_at_terminal)) as instrument:
                identity = _timed(instrument.connect, times)
                reading = _timed(instrument.read, times)
    except InstrumentError as e:
        problem = str(e) if str(e).startswith(f"{name}:") else f"{name}: {e}"
    connect_s, reading_s = (*times, None, None)[:2]
    value, unit, more = (None, None, {}) if reading is None else (reading.value, reading.unit, reading.more)
    return InstrumentAsked(name, identity.model, identity.serial, value, unit, more, connect_s, reading_s, problem)


def _timed(what: Callable[[], T], times: list[float]) -> T:
    began = time.monotonic()
    done = what()
    times.append(round(time.monotonic() - began, 3))
    return done


def _identity_words(one: InstrumentAsked) -> str:
    if one.connect_s is None:
        return "no"
    return " ".join(word for word in (one.model, one.serial) if word) or "responds (no identification)"


def _reading_words(one: InstrumentAsked) -> str:
    if one.value is None or one.unit is None:
        return "no" if one.problem else "(a recorder)"
    return value_words(one.value, one.unit) + "".join(f", {k} {v:g}" for k, v in one.more.items())


def value_words(value: float, unit: str) -> str:
    """Return a reading in the unit that people use for it."""
    scale, shown = {"m": (1e6, "um"), "F": (1e6, "uF")}.get(unit, (1.0, unit))
    return f"{value * scale:.4f} {shown}"


@command
def measure(
    unit: Annotated[Path, Argument(help="Unit folder.")],
    section: Annotated[str, Argument(help="As in unit.toml: flatness, capacitance, stroke, stiffness, frf...")],
    bench: Bench = None,
    begin: Annotated[str | None, Option(help="Serial of a new APA: makes its folder.")] = None,
    dwell: Annotated[float | None, Option(min=0.1, help="Time per step if the rig drives the voltage [s].")] = None,
    operator: Measurer = None,
) -> Answer:
    """Measure a section of a unit with its instrument."""
    sections = list(dict.fromkeys([*RECIPES, *RECORDED]))
    if section not in sections:
        return refusal(f"'{section}' is not measured by an instrument here (known: {', '.join(sections)})")
    file = load_bench(bench_path(bench))
    try:
        instrument = _serving(file, section)
    except SettingsError as e:
        return refusal(e)
    who = who_acts(operator)
    if begin is not None:
        toml_edit.begin(unit, begin, "apa")
    actions = _actions(file, dwell)
    try:
        with open_store() as store:
            captured = measure_folder(unit, section, instrument, actions, store, who, say, simulated=file.simulated)
    except InstrumentError as e:
        return refusal(e, Exit.INSTRUMENT)
    words = f"{section}: {', '.join(captured.to_toml())} in {unit / UNIT_FILE}"
    return Answer(*map(Remark, captured.notes), Remark(words))


def _serving(bench: BenchFile, section: str) -> BenchInstrument | BenchRecorder:
    recorders = [n for n, e in bench.recorders.items() if section in e.measures]
    found = [n for n, e in bench.instruments.items() if section in e.measures and e.driver != OFFLINE]
    chosen = recorders or (found if section in RECIPES else [])
    if len(chosen) != 1:
        names = ", ".join(recorders + found) or "none"
        raise SettingsError(f"{bench.path}: instruments that measure {section}: {names}; expected one")
    (name,) = chosen
    if recorders:
        return BenchRecorder(name, open_bench_recorder(name, bench.recorders[name]))
    entry = bench.instruments[name]
    return BenchInstrument(name, open_instrument(name, entry, ask_at_terminal), entry)


def _actions(bench: BenchFile, dwell_s: float | None) -> OperatorActions:
    if bench.stage is not None:
        return StagedOperator(Path(bench.stage))
    return Person(ask_at_terminal) if dwell_s is None else Player(ask_at_terminal, dwell_s, 0.7 * dwell_s)


@command
def pickup(
    place: Annotated[Path, Argument(metavar="FOLDER", help="Folder of the rig's records; else as [rig] says.")],
    unit: Annotated[Path | None, Argument(help="Unit folder.")] = None,
    section: Annotated[str | None, Argument(help="Section of unit.toml, such as frf.")] = None,
    name: Annotated[str | None, Argument(help="The record's name there, such as low.")] = None,
    bench: Bench = None,
    wait: Annotated[float, Option(min=0.0, help="How long to wait for it [s].")] = 600.0,
    old: Annotated[bool, Option("--old", help="Also take a record that is there already.")] = False,
    operator: Measurer = None,
) -> Answer:
    """Copy the rig's next record into a unit folder. With [rig] in the bench file UNIT alone, and all that it names."""
    file = load_bench(bench_path(bench)) if bench is not None or unit is None else None
    rig = file.rig if file else None
    if unit is None and (rig is None or not rig.records):
        return refusal("without FOLDER, SECTION and NAME a bench file with [rig] and [[rig.records]] is needed")
    if unit is not None and (section is None or name is None):
        return refusal("SECTION and NAME are missing: which record of the unit is it?")
    if unit is not None and section is not None and name is not None:
        watched, records = place, [RecordPattern(pattern="*", section=section, name=name)]
    else:
        watched, unit, records = Path(rig.folder if rig else ""), place, list(rig.records if rig else ())
    who = who_acts(operator)
    for record in records:
        declared_file(unit, record.section, record.name)
    watch, until = WatchedFolder(watched, STABLE_S, old), time.monotonic() + wait
    say(f"waiting for {len(records)} record{'s' * (len(records) > 1)} in {watched}, at most {wait:g} s")
    if watch.not_offered:
        say(f"there already, and taken with --old only: {listed(watch.not_offered, 5)}")
    left = list(records)
    for source in _arriving(watch, until):
        fitting = [one for one in records if one.fits(source.name)]
        if not fitting:
            say(f"{source.name} is left where it is: no pattern of [rig] fits it")
            continue
        record = fitting[0]
        try:
            with open_store() as store:
                channels = rig.channels if rig else NO_CHANNELS
                copy = pick_up(source, unit, record.section, record.name, store, who, channels)
        except RecordError as e:
            say(f"{source.name} is left where it is: {e}")
            continue
        say(f"{source} copied to {unit / copy}, [{record.section}] {record.name}")
        left = [one for one in left if one is not record]
        if not left:
            return Answer()
    missing = ", ".join(f"[{one.section}] {one.name}" for one in left)
    words = f"no record that could be used as {missing} came into {watched} within {wait:g} s"
    return refusal(words, Exit.BAD_INPUT if len(left) == len(records) else Exit.INCOMPLETE)


def _arriving(watch: WatchedFolder, until: float) -> Iterator[Path]:
    while time.monotonic() < until:
        yield from watch.stable()
        time.sleep(LOOK_S)
