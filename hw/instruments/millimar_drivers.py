"""A Millimar by the protocol that is set in its menu."""

from hw.instruments.driver import Ask, Driver, Instrument, serial_driver
from hw.instruments.millimar_m1240 import M1240Settings, MillimarM1240
from hw.instruments.millimar_optors import MillimarOptors, OptorsSettings
from specs.bench import InstrumentEntry

_M1240, _OPTORS = serial_driver(MillimarM1240, M1240Settings), serial_driver(MillimarOptors, OptorsSettings)


def _open(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    return (_M1240 if entry.settings.get("protocol") == "M1240" else _OPTORS).open(name, entry, ask)


DRIVER = Driver(("millimar",), _open)
