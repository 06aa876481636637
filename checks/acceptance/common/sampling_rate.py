"""Stated sampling rate of a record from which a frequency is measured.

Nothing else in a record contradicts a wrong time step: with it every frequency is wrong by its share. So a spec may
state the rates of the bench's clocks; if it does not, a rate that is unusual for a clock gets a remark."""

from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any

from checks.cause import Cause, NoResult, record_label
from checks.declare import Setting
from checks.record import Record
from specs.spec import CheckSpec

WITHIN = 1e-3  # quartz clocks are right to 1e-4; a time vector of rounded steps strays further
NEIGHBOUR = 1.2  # times another rate: no clock has two closer rates, so one time step is wrong
ROUND = 5e-5  # relative: a rate that is this near a number of few digits was meant to be that number
DOUBLINGS = 16  # of 1 Hz to 65536 Hz
SAMPLING = Setting(
    "sampling_Hz", [], "rates of the bench's clocks; a record of another rate is not used; empty: any", positive=True
)


def vet_rates(values: Mapping[str, Any], spec: CheckSpec) -> None:
    """Raise NoResult if the spec does not list a record's sampling rate, or if two rates are a few percent apart."""
    stated = _stated(spec)
    for key, record in _records(values):
        if stated and not any(abs(record.fs / f - 1) <= WITHIN for f in stated):
            listed = " or ".join(f"{f:g}" for f in stated)
            raise NoResult(Cause.SAMPLING_RATE, record=key, file=record.name, rate=record.fs, expected=listed)
    _vet_one_clock(_records(values))


def _vet_one_clock(records: list[tuple[str, Record]]) -> None:
    """Raise NoResult if the rates of two records are a few percent apart: one clock may have twice the rate."""
    for (a, one), (b, other) in combinations(records, 2):
        ratio = max(one.fs, other.fs) / min(one.fs, other.fs)
        if 1 + WITHIN < ratio < NEIGHBOUR:
            raise NoResult(
                Cause.SAMPLING_RATES,
                record=a,
                file=one.name,
                rate=one.fs,
                other_record=b,
                other_file=other.name,
                other_rate=other.fs,
            )


def remarks(values: Mapping[str, Any], spec: CheckSpec) -> Iterator[str]:
    """Yield a line for each record whose rate is not stated in the spec and unusual for a clock."""
    if _stated(spec):
        return
    for key, record in _records(values):
        if not is_round(record.fs):
            label = record_label(key)
            yield f"{label}: sampled at {record.fs:.6g} Hz, which clocks are seldom set to: is its time step right?"


def is_round(fs: float) -> bool:
    """Return whether a rate has at most three digits, or is a power of ten doubled several times: 5120, 32768 Hz."""
    return _digits(fs, 3) or any(_digits(fs / 2**k, 1) for k in range(1, DOUBLINGS + 1))


def _digits(f: float, n: int) -> bool:
    return abs(f / float(f"{f:.{n}g}") - 1) <= ROUND


def _stated(spec: CheckSpec) -> list[float]:
    given: float | Iterable[float] = spec.settings.get(SAMPLING.name, SAMPLING.default)
    return [float(given)] if isinstance(given, int | float) else [float(f) for f in given]


def _records(values: Mapping[str, Any]) -> list[tuple[str, Record]]:
    return [(key, value) for key, value in values.items() if isinstance(value, Record)]
