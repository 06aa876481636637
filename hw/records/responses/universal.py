"""Responses of universal files: data set 58 of function type 4, coherence of type 6."""

import re
from collections.abc import Sequence

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.responses.file import Curve, ResponseFile, response_file
from hw.records.responses.units import converted, hertz, is_frequency_unit
from hw.records.source import Source
from hw.records.uff import set58 as uff58
from hw.records.uff.set58 import COHERENCE, FRF, GENERAL, VARIANCE, UffFunction, listing
from hw.records.uff.units import KINDS, AxisUnit, ordinate_unit

FREQUENCY_TYPES = {0: "Hz", 1: "Hz", 18: "Hz", 19: "rpm"}  # specific data type of the abscissa: unit without a label
AVERAGES = re.compile(r"^averages (\d+(?:\.\d+)?)$")  # of this program, in ID line 5
F_DIGITS = 1e-6  # relative: of the abscissas of two functions


def read_universal(source: Source, input: str) -> ResponseFile:
    """Return the responses of a universal file, in the units of its labels, or in SI by its data set 164."""
    file = source.file
    functions = uff58.functions(file, source.raw)
    found = [f for f in functions if f.kind == FRF]
    if not found:
        raise RecordError(
            f"{file}: holds no frequency response (data set 58 of function type {FRF}); it has {listing(functions)}"
        )
    inputs = sorted({f.input for f in found})
    if len(inputs) > 1:
        if input not in inputs:
            raise RecordError(f"{file}: has responses to {', '.join(inputs)}; name one of them with --input")
        found = [f for f in found if f.input == input]
    if real := next((f for f in found if not f.is_complex), None):
        raise RecordError(
            f"{file}: the response '{real.name}' has real values (ordinate data type 2 or 4), so it has no phase; "
            "export complex values"
        )
    f, said = _frequencies(file, found[0])
    for other in found[1:]:
        if not _same(f, _frequencies(file, other)[0]):
            raise RecordError(f"{file}: '{other.name}' has other frequencies than '{found[0].name}'")
    beside = _quality(file, functions, found, f)
    curves = []
    for each in found:
        unit = ordinate_unit(file, each, each.y, each.name)
        per = ordinate_unit(file, each, each.denominator, each.input or "the input")
        said += [words for words in (unit.said, per.said) if words]
        curves.append(_curve(file, each, unit, per, beside[each.name]))
    stated = found[0].input
    own = [float(n[1]) for each in found if (n := AVERAGES.match(each.id5))]
    words = f"{', '.join(each.name for each in found)} over {stated or 'an unnamed input'}"
    taken = {id(f) for f in found} | {id(each) for each, _ in _beside(functions, found)}
    left = [each for each in functions if id(each) not in taken]
    said += [f"left out: {listing(left)}"] if left else []
    return response_file(source, f, curves, input or stated, [words, *said], min(own) if own else None)


def _curve(file: str, f: UffFunction, unit: AxisUnit, per: AxisUnit, beside: dict[int, tuple[Array, str]]) -> Curve:
    scale = unit.scale / per.scale
    H = uff58.ordinate(file, f) * scale
    var = beside.get(GENERAL)
    squared = None if var is None else (var[0] * scale**2, var[1])
    top, bottom = unit.unit, per.unit
    if not bottom and f.denominator.kind == 0 and "/" in top:  # some write the whole ratio into record 9
        head, _, last = top.rpartition("/")
        top, bottom = (head, last) if last not in ("s", "s2") else (top, "")
    return Curve(f.name, np.asarray(H, complex), top, bottom, beside.get(COHERENCE), squared)


def _frequencies(file: str, f: UffFunction) -> tuple[Array, list[str]]:
    """Return the frequencies [Hz] of a function by label and data type of its abscissa, and the words on their
    conversion. Raises RecordError if these are no frequencies or contradict each other."""
    label = f.x.label.lower()
    if f.x.kind not in FREQUENCY_TYPES or label in ("time", "order"):
        kind = KINDS.get(f.x.kind, ("unknown",))[0]
        raise RecordError(
            f"{file}: the abscissa of '{f.name}' has data type {f.x.kind} ({kind}), label '{f.x.label}'; a response "
            "stands over frequencies (18) or rpm (19)"
        )
    unit = f.x.unit or FREQUENCY_TYPES[f.x.kind]
    if f.x.kind == 19 and is_frequency_unit(unit) and unit.lower() not in ("rpm", "1/min", "rev/min", "u/min", "r/min"):
        raise RecordError(f"{file}: the abscissa of '{f.name}' has data type 19 (rpm) and the unit {unit}; correct one")
    scale = hertz(file, f"the abscissa of '{f.name}'", unit)
    return uff58.abscissa(file, f) * scale, converted("abscissa", unit)


def _beside(functions: Sequence[UffFunction], found: Sequence[UffFunction]) -> list[tuple[UffFunction, str]]:
    """Return the coherences and variances of the responses, with their names in messages."""
    names = [each.name for each in found]
    return [
        (each, f"the {'coherence' if each.kind == COHERENCE else 'variance'} of {each.name}")
        for each in functions
        if (each.kind == COHERENCE or (each.kind == GENERAL and each.id1.startswith(VARIANCE)))
        and each.name in names
        and each.input in ("", found[0].input)
    ]


def _quality(
    file: str, functions: Sequence[UffFunction], found: Sequence[UffFunction], f: Array
) -> dict[str, dict[int, tuple[Array, str]]]:
    """Return coherence and variance by response. Raises RecordError for two, or for other frequencies."""
    beside: dict[str, dict[int, tuple[Array, str]]] = {each.name: {} for each in found}
    for each, what in _beside(functions, found):
        if not _same(f, _frequencies(file, each)[0]):
            raise RecordError(f"{file}: {what} stands over other frequencies than its response; export both alike")
        if each.kind in beside[each.name]:
            raise RecordError(f"{file}: {what} comes twice; leave one")
        values = uff58.ordinate(file, each)
        if np.iscomplexobj(values) and np.any(values.imag):
            raise RecordError(f"{file}: {what} is complex; expected real values")
        beside[each.name][each.kind] = (np.asarray(values.real, float), each.unit if each.kind == COHERENCE else "")
    return beside


def _same(f: Array, other: Array) -> bool:
    return f.size == other.size and bool(np.allclose(f, other, rtol=F_DIGITS, atol=0.0))
