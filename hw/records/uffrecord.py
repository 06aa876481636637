"""Time records of a universal file as variables."""

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records import uff58
from hw.records.uff58 import TIME, UNNAMED, UffFunction
from hw.records.variable import Variable, unique


def open_uff(file: str, raw: bytes) -> dict[str, Variable]:
    """Return the time records of the bytes of a universal file, with their common time as "t".

    A channel is named by its response entity; without one by ID line 1, if that differs between the sets; else by its
    degree of freedom, such as "3+Z". Raises RecordError and the errors that `damage.refused` converts.
    """
    records = [f for f in uff58.functions(file, raw) if f.kind == TIME]
    if not records:
        raise RecordError(f"{file}: holds no time record (data set 58 of function type {TIME})")
    names = _names(records)
    channels = [_channel(file, name, f) for name, f in zip(names, records, strict=True)]
    time = Variable("t", (records[0].count,), "double", lambda: _common_time(file, names, records), records[0].x_unit)
    return unique(file, [time, *channels])


def _names(records: list[UffFunction]) -> list[str]:
    ids = [f.id1 for f in records]
    telling = len(set(ids)) == len(ids) and not set(ids) & set(UNNAMED)
    return [_name(f, telling) for f in records]


def _name(f: UffFunction, id1_tells: bool) -> str:
    if f.response not in UNNAMED:
        return f.response
    return f.id1 if id1_tells else f.response_dof


def _channel(file: str, name: str, f: UffFunction) -> Variable:
    if f.is_complex:
        return Variable(name, (f.count,), "complex", None, f.unit)
    return Variable(name, (f.count,), "double", lambda: np.asarray(uff58.ordinate(file, f), np.float64), f.unit)


def _common_time(file: str, names: list[str], records: list[UffFunction]) -> Array:
    first = uff58.abscissa(file, records[0])
    for name, f in zip(names[1:], records[1:], strict=True):
        if not np.array_equal(first, uff58.abscissa(file, f)):
            raise RecordError(f"{file}: channel '{name}' has another time axis than '{names[0]}'")
    return first
