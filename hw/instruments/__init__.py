"""Instruments: what a bench file names, opened and read.

    bench = load_bench(Path("bench.toml"))
    instrument = open_instrument("gauge", bench.instruments["gauge"], input)
    instrument.connect()  # identity and settings, or an InstrumentError
    reading = instrument.read()
    reading.value, reading.unit, reading.raw  # SI; the bytes that came

A driver is a file of this folder with a `DRIVER`; other packages bring theirs as `accept.instruments`: a `Driver` with
its names, how it opens, and the `Trial`s of its commissioning. `find_instruments` lists the
instruments that are connected. A failed reading raises an `InstrumentError` of `hw.errors`, which carries no value."""

from typing import TYPE_CHECKING, Any

from hw.errors import SettingsError
from hw.instruments.driver import Ask, Driver, Instrument
from specs import door, plugins
from specs.bench import OFFLINE, InstrumentEntry

if TYPE_CHECKING:
    from hw.instruments.driver import Driver, Instrument, Sampling, Trial, link_of, serial_driver, settings_of
    from hw.instruments.find import find_instruments
    from hw.instruments.heidenhain import Heidenhain
    from hw.instruments.lcr800 import Lcr800
    from hw.instruments.manual import Manual
    from hw.instruments.millimar_protocols import MillimarM1240, MillimarOptors
    from hw.instruments.reading import Identity, Reading, scaled
    from hw.link import Traffic
else:
    __getattr__ = door(__name__)

DRIVERS: dict[str, Driver] = {}  # by each of its names in a bench file


def find_drivers() -> None:
    """Put the drivers of this folder into `DRIVERS`, then those of other packages, which can add but never replace."""
    plugins.fill_by_names(DRIVERS, __name__, "DRIVER", plugins.INSTRUMENTS, driver_problem)


def driver_problem(driver: Any) -> str:
    """Return the fault of a driver of another package, "" if it is valid."""
    if not isinstance(driver, Driver):
        return f"is a {type(driver).__name__}, expected a Driver"
    if OFFLINE in driver.names or not all(driver.names):
        return f"a driver cannot be called {driver.names}"
    return ""


def open_instrument(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    """Return the driver of an entry. Its first use opens the port. ask: asks a person. Raises SettingsError."""
    if entry.driver not in DRIVERS:
        words = f"'{OFFLINE}' has no wire to it" if entry.driver == OFFLINE else f"unknown driver {entry.driver!r}"
        raise SettingsError(f"{name}: {words} (known: {', '.join(DRIVERS)})")
    return DRIVERS[entry.driver].open(name, entry, ask)


find_drivers()
