"""A Millimar by the protocol that is set in its menu."""

from hw.instruments.driver import Ask, Driver, Instrument, Trial, serial_driver
from hw.instruments.millimar_m1240 import M1240Settings, MillimarM1240
from hw.instruments.millimar_optors import MillimarOptors, OptorsSettings
from specs.bench import InstrumentEntry

_M1240, _OPTORS = serial_driver(MillimarM1240, M1240Settings), serial_driver(MillimarOptors, OptorsSettings)


def _open(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    return (_M1240 if entry.settings.get("protocol") == "M1240" else _OPTORS).open(name, entry, ask)


TRIALS = (
    Trial("At the gauge, set the display to another unit"),
    Trial("Set another connection formula, such as C1 + C2", asked=False),
    Trial("Set the factor of the feature to 0.5", asked=False),
    Trial("Open the gauge's menu"),
    Trial("Set the gauge to send by itself (SEND)", asked=False),
    Trial("Switch the gauge off and on again", asked=False),
)
DRIVER = Driver(("millimar",), _open, TRIALS)
