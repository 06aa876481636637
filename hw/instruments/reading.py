"""The data of an instrument: a reading in SI, its identity, and its settings."""

import re
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from hw.errors import Garbled, Implausible, InstrumentError, OverRange, WrongInstrument


@dataclass(frozen=True)
class Reading:
    """value in `unit` (SI: "m", "F"); t: when it came [s since 1970]; raw: the replies it was read from, in order;
    more: values that came with it (D of a capacitance), dimensionless; settings: before and after it."""

    value: float
    unit: str
    t: float
    raw: tuple[bytes, ...]
    more: Mapping[str, float] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)


DIGITS = 10  # as many as any instrument here sends


def scaled(value: float, factor: float) -> float:
    """Return a reading in another unit, in the instrument's digits: 5.1e-06 F is 5.1 uF, not 5.1000000000000005."""
    return float(f"{value * factor:.{DIGITS}g}")


@dataclass(frozen=True)
class Identity:
    """The instrument's identity by its own answer; None if it was not asked or the protocol has no such question.
    identification: words without fixed fields."""

    model: str | None = None
    serial: str | None = None
    firmware: str | None = None
    identification: str | None = None


def check_identity(who: str, said: Identity, model: str | None, serial: str | None) -> None:
    """Raise WrongInstrument if the instrument states another model or serial number than the bench file."""
    for name, found, expected in (("model", said.model, model), ("serial number", said.serial, serial)):
        if found is not None and expected is not None and found != expected:
            words = "are two instruments swapped?"
            raise WrongInstrument(f"{who}: the instrument says {name} {found!r}, the bench file {expected!r}; {words}")


def check_unchanged(who: str, before: Mapping[str, str], now: Mapping[str, str]) -> None:
    """Raise Implausible if the instrument's settings have changed."""
    changed = [
        f"{key} was {before[key]!r} and is {now[key]!r}"
        for key in before.keys() & now.keys()
        if before[key] != now[key]
    ]
    if changed:
        words = "was it changed at the instrument? Set it back and measure again from the start"
        raise Implausible(f"{who}: {'; '.join(sorted(changed))}: {words}")


def agreed(who: str, readings: Sequence[Reading], within: float, more_within: float = 0.0) -> Reading:
    """Return the mean of readings, at the time of the last. Raises Implausible if two differ by more than `within`
    [SI], their accompanying values by more than `more_within`, or their settings.

    A serial line without checksum cannot distinguish 12.3 from a damaged 18.3; two answers to two questions can."""
    last = readings[-1]
    columns = [(last.unit, [reading.value for reading in readings], within)]
    columns += [(key, [reading.more[key] for reading in readings], more_within) for key in last.more]
    raw = tuple(line for reading in readings for line in reading.raw)
    for name, values, most in columns:
        apart = max(values) - min(values)
        if not apart <= most:
            raise Implausible(
                f"{who}: readings in a row differ by {apart:.3g} {name} ({raw!r}), at most {most:.3g} are allowed; is "
                "something moving, or the line disturbed?"
            )
    for reading in readings:
        check_unchanged(who, reading.settings, last.settings)
    (_, values, _), *more = columns
    means = {name: statistics.fmean(column) for name, column, _ in more}
    return replace(last, value=statistics.fmean(values), raw=raw, more=means)


def no_value(who: str, line: bytes, expected: str) -> InstrumentError:
    """Return the error for a reply that is not a value, by its look."""
    if re.search(rb"-{3,}|_{3,}|OVER|^\s*OV|\bOL\b", line):
        return OverRange(f"{who}: it is over range, or has no probe ({line!r})")
    if re.search(rb"\d,\d", line):
        return Garbled(f"{who}: {line!r} has a decimal comma: set the instrument to a decimal point")
    if b"\x13" in line or b"\x11" in line:
        return Garbled(f"{who}: {line!r} holds XON or XOFF: the bench file needs handshake = 'xonxoff'")
    return Garbled(f"{who}: {line!r}, expected {expected}")
