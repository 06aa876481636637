"""Time records of a universal file as variables."""

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.contents.variable import Variable, unique
from hw.records.uff import set58 as uff58
from hw.records.uff.set58 import TIME, UNNAMED, UffFunction, listing
from hw.records.uff.units import ordinate_unit, time_scale

WHOLE = 1e-3  # samples: half a degree of phase at half of the sampling frequency would be 3e-3


def open_uff(file: str, raw: bytes) -> dict[str, Variable]:
    """Return the time records of the bytes of a universal file, with their common time as "t" [s].

    A channel is named by its response entity; without one by ID line 1, if that differs between the sets; else by its
    degree of freedom, such as "3+Z". Sets that start at other times of one sampling are cut to the time that they
    share. Raises RecordError and the errors that `damage.refused` converts."""
    functions = uff58.functions(file, raw)
    records = [f for f in functions if f.kind == TIME]
    if not records:
        raise RecordError(
            f"{file}: holds no time record (data set 58 of function type {TIME}); it has {listing(functions)}"
        )
    names = _names(records)
    unique(file, [Variable(name, (f.count,), "double", None) for name, f in zip(names, records, strict=True)])
    spans = _common_spans(file, names, records)
    count = spans[0].stop - spans[0].start
    channels = [_channel(file, *each) for each in zip(names, records, spans, strict=True)]

    def time() -> Array:
        return uff58.abscissa(file, records[0])[spans[0]] * time_scale(file, records[0])

    return unique(file, [Variable("t", (count,), "double", time, "s"), *channels])


def _names(records: list[UffFunction]) -> list[str]:
    ids = [f.id1 for f in records]
    telling = len(set(ids)) == len(ids) and not set(ids) & set(UNNAMED)
    return [_name(f, telling) for f in records]


def _name(f: UffFunction, id1_tells: bool) -> str:
    if f.response not in UNNAMED:
        return f.response
    return f.id1 if id1_tells else f.response_dof


def _channel(file: str, name: str, f: UffFunction, span: slice) -> Variable:
    found = ordinate_unit(file, f, f.y, f"'{name}'")
    if f.is_complex:
        return Variable(name, (span.stop - span.start,), "complex", None, found.unit)

    def load() -> Array:
        return np.asarray(uff58.ordinate(file, f), np.float64)[span] * found.scale

    return Variable(name, (span.stop - span.start,), "double", load, found.unit)


def _common_spans(file: str, names: list[str], records: list[UffFunction]) -> list[slice]:
    """Return the samples of each record common to all. Raises RecordError if they were sampled otherwise."""
    first = records[0]
    x = uff58.abscissa(file, first) * time_scale(file, first)
    axes = [uff58.abscissa(file, f) * time_scale(file, f) for f in records]
    if all(np.array_equal(x, axis) for axis in axes):
        return [slice(0, x.size)] * len(records)
    step = first.step * time_scale(file, first)
    offsets = []
    for name, f, axis in zip(names, records, axes, strict=True):
        even = "x" not in (f.layout.names or ()) and "x" not in (first.layout.names or ())
        own = f.step * time_scale(file, f)
        if even and not np.isclose(own, step, rtol=1e-9, atol=0.0):
            raise RecordError(
                f"{file}: channel '{name}' has another time axis than '{names[0]}': sampled in steps of {own:g} s "
                f"and of {step:g} s; export both with one sampling time"
            )
        if not even or not step > 0.0:
            raise RecordError(f"{file}: channel '{name}' has another time axis than '{names[0]}'")
        offset = (axis[0] - x[0]) / step if axis.size and x.size else 0.0
        if abs(offset - round(offset)) > WHOLE:
            raise RecordError(
                f"{file}: channel '{name}' starts {offset:.4g} samples after '{names[0]}': no whole number, so that "
                "their samples were not taken together"
            )
        offsets.append(round(offset))
    if not any(offsets):
        short = next(n for n, f in zip(names, records, strict=True) if f.count != first.count)
        raise RecordError(f"{file}: channel '{short}' has another time axis than '{names[0]}': it is shorter or longer")
    start = max(offsets)
    stop = min(k + f.count for k, f in zip(offsets, records, strict=True))
    if stop <= start:
        raise RecordError(f"{file}: its channels {', '.join(names)} have no time in common")
    return [slice(start - k, stop - k) for k in offsets]
