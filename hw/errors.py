"""Errors between the bench and an instrument. Every text names the instrument or port, the bytes received and those
expected. None of these errors carries a reading."""

from specs.errors import AcceptError


class InstrumentError(AcceptError, RuntimeError):
    """Base of errors in place of a reading; the text states the reason and what to check."""


class SettingsError(InstrumentError):
    """The bench file lacks a setting of the driver, or has an impossible one."""


class Unplugged(InstrumentError):
    """The port does not exist, or has disappeared."""


class NoReply(InstrumentError):
    """No complete reply came before the deadline."""


class Garbled(InstrumentError):
    """Bytes that the protocol does not allow: noise, lost or added bytes, wrong line settings."""


class InstrumentRefused(InstrumentError):
    """The instrument answered that it cannot or will not."""


class OverRange(InstrumentRefused):
    """The instrument reports that the value is outside its range."""


class WrongInstrument(InstrumentError):
    """Another instrument answers than the bench file names."""


class Implausible(InstrumentError):
    """A well-formed value that cannot be one: outside its range, another unit, or two readings that disagree."""
