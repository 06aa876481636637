"""`accept hw`: what is on the bench, what it answers, and measuring with it."""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import TypeVar

from rich import box
from rich.table import Table
from serial.tools.list_ports import comports

from accept.base.console import clear_errors, operator_name, say, stdout
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.capture.capture import CAPTURES, capture
from accept.capture.operator_actions import Hands, Person, Player, Staged
from accept.capture.run import Run
from accept.capture.watch_folder import STABLE_S, Watched, declared_file, pick_up
from accept.store import open_store
from accept.units import toml_edit
from accept.units.unit_folder import UNIT_FILE
from checks.errors import RecordError
from hw.errors import InstrumentError, SettingsError
from hw.instruments import Reading, open_instrument
from specs.bench import OFFLINE, BenchFile, InstrumentEntry, load_bench
from specs.strict import SpecError

BENCH_FILE = "bench.toml"
LOOK_S = 0.2  # between two looks into the folder
T = TypeVar("T")


def bench_path(given: Path | None) -> Path:
    """The bench file named, else the one in the bench's folder. Raises SpecError where neither is there."""
    path = given if given is not None else home() / BENCH_FILE
    if given is None and not path.exists():
        raise SpecError(str(path), ["no bench file found; write one or name it with --bench"])
    return path


def ask_at_terminal(words: str) -> str:
    """What a person types. Raises SettingsError where there is no terminal: nothing prompts then."""
    if not sys.stdin.isatty():
        raise SettingsError(f"no terminal for a question: {words.rstrip(': ')}")
    return input(words)


@clear_errors
def show_list(path: Path | None) -> Exit:
    """The instruments of the bench file, and the serial ports that are there."""
    bench = load_bench(bench_path(path))
    table = _table("name", "driver", "measures", "model", "serial", "port", "calibrated until")
    for name, entry in bench.instruments.items():
        due = entry.calibration.due.isoformat() if entry.calibration else "unknown"
        table.add_row(
            name, entry.driver, ", ".join(entry.measures), entry.model or "-", entry.serial or "-", _port(entry), due
        )
    stdout.print(table)
    ports = [f"{port.device} ({port.description})" for port in comports()]
    say(f"serial ports: {', '.join(ports) or 'none'}")
    return Exit.ACCEPTED


def _port(entry: InstrumentEntry) -> str:
    if entry.link is None:
        return "-"
    return f"{entry.link.port}{'' if Path(entry.link.port).exists() else ' (not there)'}"


def _table(*columns: str) -> Table:
    table = Table(*columns, box=box.SIMPLE_HEAD, padding=0, pad_edge=False)
    for column in table.columns:
        column.overflow = "fold"  # half a port is none
    return table


@clear_errors
def test(path: Path | None, names: Sequence[str]) -> Exit:
    """Ask every instrument who it is and for one reading; exit 5 when one does not answer as it should."""
    bench = load_bench(bench_path(path))
    unknown = [name for name in names if name not in bench.instruments]
    if unknown:
        say(f"accept: {bench.path} has no instrument {', '.join(unknown)} (it has: {', '.join(bench.instruments)})")
        return Exit.BAD_INPUT
    table = _table("name", "connected as", "answered", "connect s", "reading s")
    failed = []
    for name, entry in bench.instruments.items():
        if (names and name not in names) or entry.driver in (OFFLINE, "manual"):
            continue
        cells, reason = _tried(name, entry)
        table.add_row(name, *cells)
        if reason:
            failed.append(reason if reason.startswith(f"{name}:") else f"{name}: {reason}")
    stdout.print(table)
    for words in failed:
        say(words)
    return Exit.INSTRUMENT if failed else Exit.ACCEPTED


def _tried(name: str, entry: InstrumentEntry) -> tuple[tuple[str, str, str, str], str | None]:
    """Cells of the table, and why it failed."""
    connect_s = reading_s = "-"
    said = answered = "no"
    try:
        with closing(open_instrument(name, entry, ask_at_terminal)) as instrument:
            identity, connect_s = _timed(instrument.connect)
            said = " ".join(word for word in (identity.model, identity.serial) if word) or "answers, tells no name"
            reading, reading_s = _timed(instrument.read)
            answered = _shown(reading)
    except InstrumentError as e:
        return (said, answered, connect_s, reading_s), str(e)
    return (said, answered, connect_s, reading_s), None


def _timed(what: Callable[[], T]) -> tuple[T, str]:
    began = time.monotonic()
    return what(), f"{time.monotonic() - began:.2f}"


def _shown(reading: Reading) -> str:
    scale, unit = {"m": (1e6, "um"), "F": (1e6, "uF")}.get(reading.unit, (1.0, reading.unit))
    return f"{reading.value * scale:.4f} {unit}" + "".join(f", {k} {v:g}" for k, v in reading.more.items())


@clear_errors
def measure(
    folder: Path, section: str, path: Path | None, begin: str | None, dwell_s: float | None, operator: str | None
) -> Exit:
    """Measure one section of a unit with the bench's instrument for it."""
    if section not in CAPTURES:
        say(f"accept: '{section}' is not measured by an instrument here (known: {', '.join(CAPTURES)})")
        return Exit.BAD_INPUT
    bench = load_bench(bench_path(path))
    try:
        name, entry = _serving(bench, section)
    except SettingsError as e:
        say(f"accept: {e}")
        return Exit.BAD_INPUT
    if begin is not None:
        toml_edit.begin(folder, begin, "apa")
    try:
        with open_store() as store:
            instrument = open_instrument(name, entry, ask_at_terminal)
            run = Run(folder, instrument, entry, _hands(bench, dwell_s), store, operator_name(operator), say)
            captured = capture(section, run)
    except InstrumentError as e:
        say(f"accept: {e}")
        return Exit.INSTRUMENT
    for note in captured.notes:
        say(note)
    say(f"{section}: {', '.join(captured.entries)} in {folder / UNIT_FILE}")
    return Exit.ACCEPTED


def _serving(bench: BenchFile, section: str) -> tuple[str, InstrumentEntry]:
    found = [(n, e) for n, e in bench.instruments.items() if section in e.measures and e.driver != OFFLINE]
    if len(found) != 1:
        names = ", ".join(n for n, _ in found) or "none"
        raise SettingsError(f"{bench.path}: instruments that measure {section}: {names}; expected one")
    return found[0]


def _hands(bench: BenchFile, dwell_s: float | None) -> Hands:
    if bench.stage is not None:
        return Staged(Path(bench.stage))
    return Person(ask_at_terminal) if dwell_s is None else Player(ask_at_terminal, dwell_s, 0.7 * dwell_s)


@clear_errors
def pickup(
    watched: Path, folder: Path, section: str, name: str, wait_s: float, old_too: bool, operator: str | None
) -> Exit:
    """Wait for the next complete record in a folder and enter it."""
    declared_file(folder, section, name)
    watch, until = Watched(watched, STABLE_S, old_too), time.monotonic() + wait_s
    say(f"waiting for a record in {watched}, at most {wait_s:g} s")
    for source in _arriving(watch, until):
        try:
            with open_store() as store:
                copy = pick_up(source, folder, section, name, store, operator_name(operator))
        except RecordError as e:
            say(f"{source.name} is left where it is: {e}")
            continue
        say(f"{source} copied to {folder / copy}, [{section}] {name}")
        return Exit.ACCEPTED
    say(f"accept: no record that could be used came into {watched} within {wait_s:g} s")
    return Exit.BAD_INPUT


def _arriving(watch: Watched, until: float) -> Iterator[Path]:
    while time.monotonic() < until:
        yield from watch.stable()
        time.sleep(LOOK_S)
