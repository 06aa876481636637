"""What a file states of its channels in names and texts beside them: sampling time, start, unit.

A statement stands beside a channel: `Va_X_Resolution`, `log.Va.dt`, or in the structure that holds it: `log.Ts`, or
around that: `Ts`. The nearest counts."""

import math
import re
from collections.abc import Iterator

from checks.errors import RecordError
from hw.records.variable import Clock, Variable, Variables
from specs.units import UnitMismatch, factor, parse_header

_TIMES = re.compile(r"(?:t|time|timestamps?|zeit|tout)(?:_(?P<unit>s|ms|us|ns))?", re.IGNORECASE)
_STEPS = {"ts", "dt", "sampletime", "samplingtime", "sampleperiod", "samplinginterval", "sampleinterval",
          "xresolution", "xincrement", "xdelta", "deltat", "timestep", "increment"}  # fmt: skip
_RATES = {"fs", "samplerate", "samplingrate", "samplefrequency", "samplingfrequency"}
_STARTS = {"t0", "x0", "xstart", "xoffset", "starttime", "tstart", "startoffset", "startdate", "start"}
_TIME_UNITS = {"xunit", "xunits", "timeunit", "timeunits"}
UNIT_NAMES = {"unit", "units", "yunit", "yunits"}
_SPELLED = re.compile(r"(?P<prefix>nano|micro|milli|kilo)?(?P<base>volt|met(?:er|re)|newton|second)s?", re.IGNORECASE)
_PREFIXES = {"nano": "n", "micro": "u", "milli": "m", "kilo": "k"}
_BASES = {"volt": "V", "newton": "N", "second": "s"}
_NO_UNIT = ("-", "none", "n/a", "unknown")  # words in the place of a unit


def spelled(unit: str) -> str:
    """Return a unit as a symbol: "Volts" is V, "milliseconds" ms; "" for words that say that there is none."""
    unit = unit.strip()
    if unit.lower() == "sec":
        return "s"
    if unit.lower() in _NO_UNIT:
        return ""
    found = _SPELLED.fullmatch(unit)
    if found is None:
        return unit
    prefix = _PREFIXES.get((found["prefix"] or "").lower(), "")
    return prefix + _BASES.get(found["base"].lower(), "m")


def seconds(unit: str) -> float:
    """Return the factor to seconds. Raises RecordError if it is no unit of time."""
    try:
        return factor(spelled(unit), "s")
    except UnitMismatch as e:
        raise RecordError(f"its times are in {unit}, expected a unit of time such as s or ms") from e


def plain(name: str) -> str:
    """Return a name without its unit and without the structures or groups around it."""
    return parse_header(name)[0].rsplit(".", 1)[-1].rsplit("/", 1)[-1].strip("\"'")


def key_of(name: str) -> str:
    """Return the last part of a name in the form in which statements are listed here."""
    return re.sub(r"[_ ]", "", plain(name)).lower()


def is_time(name: str) -> bool:
    """Return whether a vector of that name holds times, as other tools call them."""
    return _TIMES.fullmatch(plain(name)) is not None


def time_unit(name: str, unit: str) -> str:
    """Return the unit of a time vector: as stated, else as its name ends (`time_ms`), else ""."""
    found = _TIMES.fullmatch(plain(name))
    return spelled(unit) or (found["unit"] or "" if found else "")


def unit_of(v: Variable, found: Variables) -> str:
    """Return the unit that a file states for a channel, "" if it states none."""
    beside = (text for key, at in _beside(v, found) if key in UNIT_NAMES and (text := _text(at)))
    return spelled(v.unit) or spelled(next(beside, ""))


def clocks_of(v: Variable, found: Variables, axes: dict[str, Clock]) -> list[Clock]:
    """Return the statements of a file on the times of a channel, the first of which counts and which must agree. axes:
    time vectors that were read already. Raises RecordError if one of them is no time."""
    stated = [] if v.clock is None else [v.clock()]
    homes = [".".join(parts[:n]) for parts in [v.home.split(".")] for n in range(len(parts), 0, -1)]
    around = ({key_of(n): at for n, at in found.items() if at.home == home} for home in dict.fromkeys([*homes, ""]))
    for level in (dict(_beside(v, found)), *around):
        times = (at for at in level.values() if at is not v and at.size == v.size > 1 and at.load and is_time(at.name))
        if v.clock is None and (time := next(times, None)) is not None:
            if time.name not in axes:
                axes[time.name] = axis_of(time)
            stated = [axes[time.name], *stated]
        stated += _clocks(level)
        if any(c.axis is not None or c.step > 0 for c in stated):
            break
    return stated


def axis_of(v: Variable) -> Clock:
    """Return the clock of a vector of times."""
    unit = time_unit(v.name, v.unit)
    return Clock(v.name, axis=v.values * seconds(unit or "s"), in_seconds=bool(unit))


def _beside(v: Variable, found: Variables) -> Iterator[tuple[str, Variable]]:
    """Yield the statements that begin with the name of a channel, `Va_X_Unit` as "xunit"."""
    for name, at in found.items():
        if name.startswith((f"{v.name}_", f"{v.name}.")) and at is not v:
            yield re.sub(r"[_. ]", "", name[len(v.name) + 1 :]).lower(), at


def _clocks(level: Variables) -> list[Clock]:
    """Return what single numbers beside or around a channel state of its times. Raises RecordError if a sampling time
    or a rate is not above 0."""
    unit = next((text for key, at in level.items() if key in _TIME_UNITS and (text := _text(at))), "")
    scale = seconds(unit or "s")
    starts = {key: at for key, at in level.items() if key in _STARTS}
    start = next((scale * float(at.values[0]) for at in starts.values() if _is_number(at)), 0.0)
    origin = next((text for at in starts.values() if (text := _text(at))), "")
    found = []
    for key, at in level.items():
        if key in _STEPS | _RATES and _is_number(at):
            value = float(at.values[0])
            if not 0 < value < math.inf:
                raise RecordError(f"'{at.name}' holds {value:g}, expected a sampling time or rate above 0")
            step, stated = (scale * value, bool(unit)) if key in _STEPS else (1.0 / value, True)
            found.append(Clock(at.name, step, start, origin=origin, in_seconds=stated))
    return found or ([Clock("start", start=start, origin=origin)] if starts and (start or origin) else [])


def _is_number(v: Variable) -> bool:
    return v.load is not None and v.size == 1


def _text(v: Variable) -> str:
    return v.text().strip() if v.text is not None else ""
