"""Instruments: one file each, and what opens them from a bench file's entry."""

from hw.instruments.driver import Driver, Instrument, link_of, serial_driver, settings_of
from hw.instruments.heidenhain import Heidenhain
from hw.instruments.lcr800 import Lcr800
from hw.instruments.manual import Manual
from hw.instruments.millimar_m1240 import MillimarM1240
from hw.instruments.millimar_optors import MillimarOptors
from hw.instruments.opening import DRIVERS, add_plugins, open_instrument
from hw.instruments.reading import Identity, Reading

__all__ = [
    "DRIVERS",
    "Driver",
    "Heidenhain",
    "Identity",
    "Instrument",
    "Lcr800",
    "Manual",
    "MillimarM1240",
    "MillimarOptors",
    "Reading",
    "link_of",
    "open_instrument",
    "serial_driver",
    "settings_of",
]

add_plugins()
