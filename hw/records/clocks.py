"""Statements of a file on its channels, in names and texts (sampling time, start, unit), and the time base of a record:
its channels start together or whole samples apart, or they are refused.

A statement is next to a channel (`Va_X_Resolution`, `log.Va.dt`), in the structure of the channel (`log.Ts`), or
outside it (`Ts`). The nearest counts."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from checks.errors import RecordError
from hw.records.contents.variable import Clock, Variable, Variables
from hw.records.vet import JITTER, vet_rate, vet_time
from specs.units import UnitMismatch, factor, parse_header, spelled

_TIMES = re.compile(r"(?:t|time|timestamps?|zeit|tout)(?:_(?P<unit>s|ms|us|ns))?", re.IGNORECASE)
_STEPS = {"ts", "dt", "sampletime", "samplingtime", "sampleperiod", "samplinginterval", "sampleinterval",
          "xresolution", "xincrement", "xdelta", "deltat", "timestep", "increment"}  # fmt: skip
_RATES = {"fs", "samplerate", "samplingrate", "samplefrequency", "samplingfrequency"}
_STARTS = {"t0", "x0", "xstart", "xoffset", "starttime", "tstart", "startoffset", "startdate", "start"}
_TIME_UNITS = {"xunit", "xunits", "timeunit", "timeunits"}
UNIT_NAMES = {"unit", "units", "yunit", "yunits"}
# Sampling times that are stated twice are written with three digits at least.
SAME_STEP = 1e-3
# Shifts count as whole samples up to here, in samples: at a tenth of the sampling frequency 0.01 is 0.4 degrees.
WHOLE = 0.01
STAMP_s = 1e-6  # dates are written in microseconds
AHEAD_DAYS = 1.0  # time zones reach 14 hours


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
    """Return whether a vector's name is one that other programs use for times."""
    return _TIMES.fullmatch(plain(name)) is not None


def time_unit(name: str, unit: str) -> str:
    """Return the unit of a time vector: as stated, else as its name ends (`time_ms`), else ""."""
    found = _TIMES.fullmatch(plain(name))
    return spelled(unit) or (found["unit"] or "" if found else "")


def unit_of(v: Variable, found: Variables) -> str:
    """Return the unit that a file states for a channel, "" if it states none."""
    beside = (text for key, at in _beside(v, found) if key in UNIT_NAMES and (text := _text(at)))
    return spelled(v.unit) or spelled(next(beside, ""))


def clocks_of(
    file: str, v: Variable, found: Variables, axes: dict[str, Clock], time: Variable | None = None
) -> list[Clock]:
    """Return a file's statements on the times of a channel. They must agree; the first counts. axes: time vectors that
    were already read; time: named by the user, instead of others. Raises RecordError for one that is no time, or if two
    differ."""
    stated = [] if v.clock is None else [v.clock()]
    if time is None and stated and stated[0].axis is None:  # an increment, maybe with a vector of times beside it
        times = [at for at in found.values() if at.home == v.home and _is_axis_of(v, at)]
        stated += [_same_axis(file, v, times, axes)] if times else []
    homes = [".".join(parts[:n]) for parts in [v.home.split(".")] for n in range(len(parts), 0, -1)]
    around = ([(key_of(n), at) for n, at in found.items() if at.home == home] for home in dict.fromkeys([*homes, ""]))
    for level in (list(_beside(v, found)), *around):
        times = [at for _, at in level if _is_axis_of(v, at)]
        if v.clock is None and times:
            axis = _same_axis(file, v, times, axes) if time is None else axes.setdefault(time.name, axis_of(time))
            stated = [axis, *stated]
        stated += _clocks(level)
        if tells(stated):
            break
    return stated


def _is_axis_of(v: Variable, at: Variable) -> bool:
    return at is not v and at.size == v.size > 1 and at.load is not None and is_time(at.name)


def _same_axis(file: str, v: Variable, times: list[Variable], axes: dict[str, Clock]) -> Clock:
    """Return the time vector of a channel: that of its own group; no "T" among others, which is a temperature. Raises
    RecordError if several remain that drift apart."""
    group = v.name.rpartition("/")[0]
    times = [at for at in times if at.name.rpartition("/")[0] == group] or times
    times = [at for at in times if plain(at.name) != "T"] or times
    for at in times:
        if at.name not in axes:
            axes[at.name] = axis_of(at)
    first, *others = (axes[at.name] for at in times)
    t = np.asarray(first.axis)
    for other in others:
        x = np.asarray(other.axis)
        if not np.allclose(x - x[0], t - t[0], rtol=SAME_STEP, atol=STAMP_s):
            raise RecordError(
                f"{file}: several time axes: '{first.source}' and '{other.source}' run apart; name one of them as 't'"
            )
    return first


def tells(stated: Iterable[Clock]) -> bool:
    """Return whether one of the statements gives times or a sampling time."""
    return any(c.axis is not None or c.step > 0 for c in stated)


def only_axis(file: str, v: Variable, found: Variables, axes: dict[str, Clock]) -> list[Clock]:
    """Return the time vector of another structure with the channel's length. Raises RecordError if several differ."""
    times = [at for at in found.values() if _is_axis_of(v, at)]
    clocks = [axes.setdefault(at.name, axis_of(at)) for at in times]
    if any(not np.array_equal(np.asarray(c.axis), np.asarray(clocks[0].axis)) for c in clocks[1:]):
        named = ", ".join(c.source for c in clocks)
        raise RecordError(f"{file}: holds several time axes ({named}); name one of them as 't'")
    return clocks[:1]


def axis_of(v: Variable) -> Clock:
    """Return the clock of a vector of times."""
    unit = time_unit(v.name, v.unit)
    return Clock(v.name, axis=v.values * seconds(unit or "s"), in_seconds=bool(unit))


def _beside(v: Variable, found: Variables) -> Iterator[tuple[str, Variable]]:
    """Yield the statements that begin with the name of a channel, `Va_X_Unit` as "xunit"."""
    for name, at in found.items():
        if name.startswith((f"{v.name}_", f"{v.name}.")) and at is not v:
            yield re.sub(r"[_. ]", "", name[len(v.name) + 1 :]).lower(), at


def _clocks(level: Sequence[tuple[str, Variable]]) -> list[Clock]:
    """Return the clocks that numbers at a channel state. Raises RecordError for a time or rate that is not above 0."""
    unit = next((text for key, at in level if key in _TIME_UNITS and (text := _text(at))), "")
    scale = seconds(unit or "s")
    starts = {key: at for key, at in level if key in _STARTS}
    start = next((scale * float(at.values[0]) for at in starts.values() if _is_number(at)), 0.0)
    origin = next((text for at in starts.values() if (text := _text(at))), "")
    found = []
    for key, at in level:
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


def agreed(file: str, channel: str, stated: list[Clock], min_samples: int) -> Clock:
    """Return the clock of a channel with step and start, from its statements; the first counts. Raises RecordError if
    they contradict each other, or its times are not an even grid."""
    first = next(c for c in stated if c.axis is not None or c.step > 0)
    if first.axis is not None:
        vet_time(file, first.axis, min_samples)
        even = (first.axis[-1] - first.axis[0]) / (first.axis.size - 1)
        own = [replace(first, axis=None)] if first.step > 0 else []  # the increment next to the times
        stated = [*own, *(c for c in stated if c is not first)]
        first = replace(first, step=float(even), start=float(first.axis[0]))
    for other in stated:
        if other.axis is not None and other.axis is not first.axis:
            even = float((other.axis[-1] - other.axis[0]) / (other.axis.size - 1))
            other = replace(other, step=even if math.isfinite(even) and even > 0 else math.nan)
        if other.step > 0 and abs(other.step / first.step - 1.0) > SAME_STEP:
            raise RecordError(
                f"{file}: channel '{channel}': its sampling time is {first.step:.6g} s by '{first.source}' and "
                f"{other.step:.6g} s by '{other.source}'; one of them is wrong: correct the file"
            )
    # A start next to times that begin elsewhere is their origin.
    aside = [c for c in stated if c.start and c is not first and abs(c.start - first.start) > WHOLE * first.step]
    if first.axis is not None and aside and not first.origin:
        first = replace(first, origin=f"{aside[0].start:.9g} s")
    origins = [c.origin for c in stated if c.origin]
    first = replace(first, origin=first.origin or next(iter(origins), ""))
    in_seconds = first.in_seconds or any(c.in_seconds and c.step > 0 for c in stated)
    vet_rate(file, first.source, first.step, in_seconds)
    return first


def common_part(file: str, clocks: Mapping[str, Clock], sizes: Mapping[str, int]) -> tuple[dict[str, int], int, str]:
    """Return the first sample of each channel in the common part, its length, and a remark ("" if all start together).
    Raises RecordError if steps differ, starts are not whole samples apart, or the channels end apart."""
    names = list(clocks)
    step = clocks[names[0]].step
    latest = max(names, key=lambda n: clocks[n].start)
    start, tolerance = clocks[latest].start, max(WHOLE, min(STAMP_s / step, JITTER))
    skipped: dict[str, int] = {}
    for name in names:
        one, other = clocks[name], clocks[names[0]]
        if abs(one.step - step) * sizes[name] > JITTER * step:
            raise RecordError(
                f"{file}: '{name}' is sampled every {one.step:.9g} s ({one.source}), '{names[0]}' every {step:.9g} s "
                f"({other.source}): several time axes; a record has one"
            )
        if one.origin != other.origin:
            raise RecordError(
                f"{file}: '{name}' counts its time from {one.origin or 'no stated start'}, '{names[0]}' from "
                f"{other.origin or 'no stated start'}: several time axes; export both with one start"
            )
        shift = (start - one.start) / step
        skipped[name] = round(shift)
        if abs(shift - skipped[name]) > tolerance:
            raise RecordError(
                f"{file}: '{latest}' starts {start - one.start:.9g} s after '{name}' "
                f"({_starts(clocks, name, latest)}), which is {shift:.6g} samples: several time axes; only whole "
                "samples can be aligned"
            )
    ends = {name: sizes[name] - skipped[name] for name in names}
    count = min(ends.values())
    if count <= 0:
        early = min(names, key=lambda n: clocks[n].start)
        raise RecordError(
            f"{file}: several time axes: '{latest}' starts after '{early}' has ended ({_starts(clocks, early, latest)})"
        )
    if len(set(sizes.values())) > 1 and len(set(ends.values())) > 1:
        longest, shortest = max(names, key=sizes.__getitem__), min(names, key=sizes.__getitem__)
        raise RecordError(
            f"{file}: channel '{shortest}' has {sizes[shortest]} samples, '{longest}' has {sizes[longest]}, and they "
            "neither start nor end together"
            if len(set(skipped.values())) > 1
            else f"{file}: channel '{shortest}' has {sizes[shortest]} samples, '{longest}' has {sizes[longest]}"
        )
    if not any(skipped.values()):
        return skipped, count, ""
    early = max(names, key=skipped.__getitem__)
    return (
        skipped,
        count,
        (
            f"{latest} starts {start - clocks[early].start:.9g} s ({skipped[early]} samples) after {early} "
            f"({_starts(clocks, early, latest)}): cut to the {count} samples that all have"
        ),
    )


def _starts(clocks: Mapping[str, Clock], *names: str) -> str:
    return ", ".join(f"{n}: {clocks[n].shown or f'{clocks[n].start:.9g} s'}" for n in names)


def date_doubt(clock: Clock) -> str:
    """Return a doubt about a start in the future, "" without one."""
    if not clock.shown:
        return ""
    ahead = datetime.fromisoformat(clock.shown).replace(tzinfo=UTC) - datetime.now(UTC)
    days = ahead.total_seconds() / 86_400
    return f"starts on {clock.shown[:10]}, in the future: check the recorder's clock" if days > AHEAD_DAYS else ""
