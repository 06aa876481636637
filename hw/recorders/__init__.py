"""Recorders: converters that play a drive and record all channels on one clock.

    recorder = open_recorder("daq", bench.recorders["daq"])
    record = recorder.record({"Va": "V", "de": "m"}, 10e3, 20.0, drive=volts)  # refused if an input was overloaded

A back end is a file of this folder with a `RECORDER`; other packages bring theirs as `accept.recorders`: a
`RecorderDriver` that opens a `Converter`. A device that fails raises an `InstrumentError`."""

from typing import TYPE_CHECKING, Any

from hw.errors import SettingsError
from hw.recorders.recorder import Recorder, RecorderDriver
from specs import door, plugins
from specs.bench import SIMULATED, RecorderEntry

if TYPE_CHECKING:
    from hw.instruments.driver import settings_of
    from hw.recorders.recorder import Converter, Heard, Recorder, RecorderDriver
else:
    __getattr__ = door(__name__)

RECORDERS: dict[str, RecorderDriver] = {}  # by each of its names in a bench file


def find_recorders() -> None:
    """Put the back ends of this folder into `RECORDERS`, then those of other packages, which never replace one."""
    plugins.fill_by_names(RECORDERS, __name__, "RECORDER", plugins.RECORDERS, recorder_problem)


def recorder_problem(driver: Any) -> str:
    """Return the fault of a recorder of another package, "" if it is valid."""
    if not isinstance(driver, RecorderDriver):
        return f"is a {type(driver).__name__}, expected a RecorderDriver"
    return "" if driver.names and all(driver.names) else f"a recorder cannot be called {driver.names}"


def open_recorder(name: str, entry: RecorderEntry) -> Recorder:
    """Return the recorder of an entry; its device is opened by the first record. Raises SettingsError."""
    if entry.driver not in RECORDERS:
        raise SettingsError(f"{name}: unknown recorder {entry.driver!r} (known: {', '.join(RECORDERS)}, {SIMULATED})")
    return Recorder(name, entry, RECORDERS[entry.driver].open(name, entry))


find_recorders()
