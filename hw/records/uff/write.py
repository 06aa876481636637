"""Frequency response functions as universal files (data set 58, function type 4), with coherence and variance."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from hw.records.uff.set58 import COHERENCE, COMPLEX_DOUBLE, FRF, GENERAL, REAL_DOUBLE, UNNAMED, VARIANCE

NAME_CHARACTERS = 10  # of an entity in record 6
FREQUENCY, DISPLACEMENT, UNKNOWN = 18, 8, 0  # specific data types of records 8 to 10
ALONG_Z, SCALAR = 3, 0  # directions of record 6
# Bins may lie this far from start + k step, in steps, to be written as even: a hundredth of what 7 digits resolve at
# bin 1000 would already be lost in the stated abscissa.
EVEN = 1e-4


def frf_bytes(
    f: Array,
    H: NDArray[np.complex128],
    channels: Sequence[str],
    input_name: str,
    units: Mapping[str, str],
    coherence: Array | None = None,
    var: Array | None = None,
    averages: float | None = None,
) -> bytes:
    """Return H (F, C) over f (F,) [Hz] as text, one set a channel, with 13 digits in H and 7 in f.

    units : unit of every channel and of the input. coherence (F, C) becomes functions of type 6; var (F, C), for which
    the format has no type, of type 0 with "variance of" in ID line 1; both only if they are finite throughout.
    averages : written into ID line 5. Raises ValueError if the format cannot hold the data."""
    if H.shape != (f.size, len(channels)) or f.size < 2 or not (np.diff(f) > 0).all():
        raise ValueError(f"H is {H.shape} for {f.size} frequencies, which must increase, and {len(channels)} channels")
    if not (np.isfinite(f).all() and np.isfinite(H).all()):
        raise ValueError("f or H holds NaN or inf, which a universal file cannot")
    for name in (*channels, input_name):
        if not 0 < len(name) <= NAME_CHARACTERS or not name.isascii() or " " in name or name in UNNAMED:
            raise ValueError(f"the name {name!r} does not fit: 1 to {NAME_CHARACTERS} ASCII characters without spaces")
    id5 = "NONE" if averages is None else f"averages {averages:.12g}"
    sets = []
    for i, name in enumerate(channels):
        ratio = f"{name} / {input_name}"
        of = (i + 1, name, input_name)
        sets.append(_set(f, H[:, i], FRF, ratio, of, (units[name], units[input_name]), id5))
        for x, kind, title in ((coherence, COHERENCE, "coherence of "), (var, GENERAL, VARIANCE)):
            if x is not None and np.isfinite(x[:, i]).all():
                sets.append(_set(f, x[:, i], kind, title + ratio, of, ("NONE", "NONE")))
    return "".join(sets).encode("ascii")


def _set(
    f: Array,
    values: Array | NDArray[np.complex128],
    kind: int,
    title: str,
    of: tuple[int, str, str],
    units: tuple[str, str],
    id5: str = "NONE",
) -> str:
    """Return one function. of: node, name and input; units: of the values and of the input."""
    (node, name, input_name), (unit, per) = of, units
    start, step = float(f"{f[0]:.6e}"), float(f"{(f[-1] - f[0]) / (f.size - 1):.6e}")
    even = bool(np.abs(start + step * np.arange(f.size) - f).max() <= EVEN * step)
    along, data_type = (ALONG_Z, DISPLACEMENT) if unit == "m" else (SCALAR, UNKNOWN)
    columns = [values.real, values.imag] if np.iscomplexobj(values) else [values]
    number = COMPLEX_DOUBLE if len(columns) == 2 else REAL_DOUBLE
    if even:
        parts = [f"{part:20.12e}" for part in np.column_stack(columns).ravel()]
        lines = ["".join(parts[i : i + 4]) for i in range(0, len(parts), 4)]
    else:
        parts = [f"{x:13.6e}" + "".join(f"{y:20.12e}" for y in row) for x, *row in zip(f, *columns, strict=True)]
        width = 3 - len(columns)  # a line has two pairs of real values, one of complex
        lines = ["".join(parts[i : i + width]) for i in range(0, len(parts), width)]
    label = name if kind == FRF else title.split()[0]
    head = [
        f"{-1:6d}",
        f"{58:6d}{'':74}",
        *(f"{line:80}" for line in (title, "NONE", "NONE", "NONE", id5)),
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {name:>10}{node:10d}{along:4d} {input_name:>10}{0:10d}{SCALAR:4d}",
        f"{number:10d}{f.size:10d}{even:10d}{even * start:13.6e}{even * step:13.6e}{0.0:13.6e}",
        _axis(FREQUENCY, "Frequency", "Hz"),
        _axis(data_type, label, unit),
        _axis(UNKNOWN, input_name if kind == FRF else "NONE", per),
        _axis(UNKNOWN, "NONE", "NONE"),
    ]
    return "\n".join([*head, *lines, f"{-1:6d}"]) + "\n"


def _axis(data_type: int, label: str, unit: str) -> str:
    return f"{data_type:10d}{0:5d}{0:5d}{0:5d} {label:20} {unit:20}"
