"""Errors between the bench and an instrument. Every text names the instrument or port, the bytes received and those
expected. None of these errors carries a reading."""

from specs.errors import AcceptError


class InstrumentError(AcceptError, RuntimeError):
    """Base of errors in place of a reading; the text states the reason and what to check. cause: of every such error,
    for a person at the bench; "" if the text alone tells it."""

    cause = ""


class SettingsError(InstrumentError):
    """The bench file lacks a setting of the driver, or has an impossible one."""


class Unplugged(InstrumentError):
    """The port does not exist, or has disappeared."""

    cause = "its port is gone. Cable in?"


class NoReply(InstrumentError):
    """No complete reply came before the deadline."""

    cause = "no whole answer in time. On? Cable in?"


class Garbled(InstrumentError):
    """Bytes that the protocol does not allow: noise, lost or added bytes, wrong line settings."""

    cause = "its answer came damaged. Cable firm?"


class InstrumentRefused(InstrumentError):
    """The instrument answered that it cannot or will not."""


class OverRange(InstrumentRefused):
    """The instrument reports that the value is outside its range."""

    cause = "over its range, or no probe. Set it up."


class WrongInstrument(InstrumentError):
    """Another instrument answers than the bench file names."""


class Implausible(InstrumentError):
    """A well-formed value that cannot be one: outside its range, another unit, or two readings that disagree."""
