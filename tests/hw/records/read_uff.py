"""Frequency response functions of universal files, read back: what was written is what is there."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.damage import refused
from hw.records.limits import DEFAULT_LIMITS, ReadLimits
from hw.records.source import load_bytes
from hw.records.uff import set58 as uff58
from hw.records.uff.set58 import FRF, UNNAMED, UffFunction


@dataclass(frozen=True, eq=False)
class UffResponse:
    """f (F,) [Hz], H (F, C) complex: output over input; units : of the channels and of the input, "" where unknown."""

    f: Array
    H: NDArray[np.complex128]
    channels: tuple[str, ...]
    input_name: str
    units: Mapping[str, str]


def read_frf(path: Path, limits: ReadLimits = DEFAULT_LIMITS) -> UffResponse:
    """All frequency response functions of a universal file, text or binary. Raises RecordError unless they share one
    input and one frequency axis, and all values are finite."""
    source = load_bytes(path, limits.max_bytes)
    with refused(source.file):
        found = [s for s in uff58.functions(source.file, source.raw) if s.kind == FRF]
        if not found:
            raise RecordError(f"{source.file}: holds no frequency response function (data set 58 of type {FRF})")
        return _frf(source.file, found)


def _frf(file: str, found: list[UffFunction]) -> UffResponse:
    inputs = sorted({_name(s.reference, s.reference_dof) for s in found})
    channels = tuple(_name(s.response, s.response_dof) for s in found)
    if len(inputs) > 1 or len(set(channels)) < len(channels):
        raise RecordError(f"{file}: holds the outputs {channels} of the inputs {inputs}; expected one input, each once")
    axes = [uff58.abscissa(file, s) for s in found]
    f = axes[0]
    if not all(np.array_equal(f, axis) for axis in axes):
        raise RecordError(f"{file}: its functions {channels} have different frequency axes")
    H = np.column_stack([uff58.ordinate(file, s).astype(np.complex128) for s in found])
    if f.size < 2 or not (np.isfinite(f).all() and (np.diff(f) > 0).all() and np.isfinite(H).all()):
        raise RecordError(f"{file}: frequencies must increase and all values be finite numbers; they are not")
    units = {name: s.unit for name, s in zip(channels, found, strict=True)}
    return UffResponse(f, H, channels, inputs[0], {**units, inputs[0]: found[0].per})


def _name(entity: str, dof: str) -> str:
    return dof if entity in UNNAMED else entity
