"""From an entry of the bench file to a driver on its line. Other packages add drivers under `accept.instruments`."""

from typing import Any

from hw.errors import SettingsError
from hw.instruments import heidenhain, ids3010, lcr800, manual, millimar_drivers, scpi_lcr
from hw.instruments.driver import Ask, Driver, Instrument
from specs import plugins
from specs.bench import OFFLINE, InstrumentEntry

_OWN = (millimar_drivers.DRIVER, lcr800.DRIVER, scpi_lcr.DRIVER, heidenhain.DRIVER, ids3010.DRIVER, manual.DRIVER)


def driver_problem(driver: Any) -> str:
    """What is wrong with a driver of another package, "" for nothing."""
    if not isinstance(driver, Driver):
        return f"is a {type(driver).__name__}, expected a Driver"
    if OFFLINE in driver.names or not all(driver.names):
        return f"a driver cannot be called {driver.names}"
    return ""


DRIVERS: dict[str, Driver] = {name: driver for driver in _OWN for name in driver.names}


def add_plugins() -> None:
    """The drivers of other packages; called when all that they may import is there."""
    for driver in plugins.plugins(plugins.INSTRUMENTS, driver_problem, DRIVERS).values():
        DRIVERS.update({name: driver for name in driver.names if name not in DRIVERS})


def open_instrument(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    """Driver of an entry; the port is opened by its first use. ask: how the manual driver asks a person.
    Raises SettingsError."""
    if entry.driver not in DRIVERS:
        words = f"'{OFFLINE}' has no wire to it" if entry.driver == OFFLINE else f"unknown driver {entry.driver!r}"
        raise SettingsError(f"{name}: {words} (known: {', '.join(DRIVERS)})")
    return DRIVERS[entry.driver].open(name, entry, ask)
