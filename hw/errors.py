"""Errors between the bench and an instrument. Every text names the instrument or port, what came and what was expected;
no reading ever comes with one of these."""

from specs.errors import AcceptError


class InstrumentError(AcceptError, RuntimeError):
    """No reading: the text says why and what to look at."""


class SettingsError(InstrumentError):
    """The bench file lacks a setting of the driver, or has an impossible one."""


class Unplugged(InstrumentError):
    """The port is not there, or went away."""


class NoReply(InstrumentError):
    """Nothing came, or not all of it, before the deadline."""


class Garbled(InstrumentError):
    """The bytes that came are not what the protocol allows: noise, lost or added bytes, wrong line settings."""


class InstrumentRefused(InstrumentError):
    """The instrument answered that it cannot or will not."""


class OverRange(InstrumentRefused):
    """The instrument reports that the value is outside its range."""


class WrongInstrument(InstrumentError):
    """Another instrument answers than the bench file names."""


class Implausible(InstrumentError):
    """A well-formed value that cannot be one: outside its range, another unit, or two readings that disagree."""
