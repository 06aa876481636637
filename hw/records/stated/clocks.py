"""One time base of channels whose times a file states apart: equal, shifted by whole samples, or refused."""

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime

from checks.errors import RecordError
from hw.records.variable import Clock
from hw.records.vet import JITTER, vet_rate, vet_time

# Sampling times that are stated twice are written with three digits at least.
SAME_STEP = 1e-3
# Shifts count as whole samples up to here, in samples: at a tenth of the sampling frequency 0.01 is 0.4 degrees.
WHOLE = 0.01
STAMP_s = 1e-6  # dates are written in microseconds
AHEAD_DAYS = 1.0  # time zones reach 14 hours


def agreed(file: str, channel: str, stated: list[Clock], min_samples: int) -> Clock:
    """Return the clock of a channel with its step and start, from its statements, the first of which counts. Raises
    RecordError if they contradict each other, or its times are no even grid."""
    first = next(c for c in stated if c.axis is not None or c.step > 0)
    if first.axis is not None:
        vet_time(file, first.axis, min_samples)
        even = (first.axis[-1] - first.axis[0]) / (first.axis.size - 1)
        own = [replace(first, axis=None)] if first.step > 0 else []  # the increment that stands beside the times
        stated = [*own, *(c for c in stated if c is not first)]
        first = replace(first, step=float(even), start=float(first.axis[0]))
    for other in stated:
        if other.step > 0 and abs(other.step / first.step - 1.0) > SAME_STEP:
            raise RecordError(
                f"{file}: channel '{channel}': its sampling time is {first.step:.6g} s by '{first.source}' and "
                f"{other.step:.6g} s by '{other.source}'; one of them is wrong: correct the file"
            )
    # A start beside times that begin elsewhere says from where they count.
    aside = [c for c in stated if c.start and c is not first and abs(c.start - first.start) > WHOLE * first.step]
    if first.axis is not None and aside and not first.origin:
        first = replace(first, origin=f"{aside[0].start:.9g} s")
    origins = [c.origin for c in stated if c.origin]
    first = replace(first, origin=first.origin or next(iter(origins), ""))
    in_seconds = first.in_seconds or any(c.in_seconds and c.step > 0 for c in stated)
    vet_rate(file, first.source, first.step, in_seconds)
    return first


def common_part(file: str, clocks: Mapping[str, Clock], sizes: Mapping[str, int]) -> tuple[dict[str, int], int, str]:
    """Return the first sample of each channel in the part that all have, its length, and a remark, "" if all start
    together. Raises RecordError if steps differ, starts lie apart by no whole number of samples, or the channels end
    apart."""
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
    """Return a doubt about a start in the future, "" if there is none."""
    if not clock.shown:
        return ""
    ahead = datetime.fromisoformat(clock.shown).replace(tzinfo=UTC) - datetime.now(UTC)
    days = ahead.total_seconds() / 86_400
    return f"starts on {clock.shown[:10]}, in the future: check the recorder's clock" if days > AHEAD_DAYS else ""
