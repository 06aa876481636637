"""Faults of data acquisition put upon the records of a unit, as an analyser, its clock or a loose plug make them."""

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from checks.acceptance.frf import CHECK
from checks.arrays import Array
from checks.cause import Cause
from checks.record import Record
from hw.records import load_bytes, mat_bytes, record_of

Columns = Mapping[str, Array]
AT_s, BLOCK_s = 3.0, 0.02  # where a block is lost, and how long it is


def clipped(channel: str, share: float = 1e-3) -> Callable[[Columns], Columns]:
    """A share of the samples beyond the range."""

    def spoil(c: Columns) -> Columns:
        x, middle = c[channel], np.median(c[channel])
        limit = np.quantile(np.abs(x - middle), 1.0 - share)
        return {**c, channel: middle + np.clip(x - middle, -limit, limit)}

    return spoil


def _block(c: Columns) -> slice:
    fs = 1.0 / (c["t"][1] - c["t"][0])
    return slice(int(AT_s * fs), int((AT_s + BLOCK_s) * fs))


def held(channel: str) -> Callable[[Columns], Columns]:
    return lambda c: {**c, channel: _put(c[channel], _block(c), c[channel][_block(c).start])}


def zeroed(channel: str) -> Callable[[Columns], Columns]:
    return lambda c: {**c, channel: _put(c[channel], _block(c), 0.0)}


def _put(x: Array, where: slice, value: float) -> Array:
    out = x.copy()
    out[where] = value
    return out


def lost(*channels: str) -> Callable[[Columns], Columns]:
    """A block that is missing in some channels, the rest moved up; in all of them without any named."""

    def spoil(c: Columns) -> Columns:
        where = _block(c)
        n = c["t"].size - (where.stop - where.start)
        cut = {k: np.delete(x, np.arange(where.start, where.stop)) for k, x in c.items()}
        return {k: cut[k] if k != "t" and (not channels or k in channels) else x[:n] for k, x in c.items()}

    return spoil


def jittered(us: float) -> Callable[[Columns], Columns]:
    def spoil(c: Columns) -> Columns:
        when = c["t"] + 1e-6 * us * np.random.default_rng(5).standard_normal(c["t"].size)
        when = np.clip(when, c["t"][0], c["t"][-1])
        return {k: x if k == "t" else CubicSpline(c["t"], x)(when) for k, x in c.items()}

    return spoil


def in_nm(*channels: str) -> Callable[[Columns], Columns]:
    return lambda c: {k: 1e9 * x if k in channels else x for k, x in c.items()}


FAULTS: dict[str, tuple[Callable[[Columns], Columns], Cause, str]] = {  # name -> fault, cause, channel in the reason
    "de clipped": (clipped("de"), Cause.CHANNEL_CLIPPED, "de"),
    "Vs clipped": (clipped("Vs"), Cause.CHANNEL_CLIPPED, "Vs"),
    "Vs clipped a little": (clipped("Vs", 2e-4), Cause.CHANNEL_CLIPPED, "Vs"),
    "de held": (held("de"), Cause.CHANNEL_HELD, "de"),
    "Va held": (held("Va"), Cause.CHANNEL_HELD, "Va"),
    "de zeroed": (zeroed("de"), Cause.CHANNEL_HELD, "de"),
    "block of all lost": (lost(), Cause.SAMPLES_LOST, ""),
    "block of de lost": (lost("de"), Cause.CHANNEL_SLIPPED, "de"),
    "block of Va lost": (lost("Va"), Cause.CHANNEL_SLIPPED, "Va"),
    "jitter": (jittered(5.0), Cause.SAMPLING_JITTER, ""),
    "in nm": (in_nm("de", "da"), Cause.CHANNEL_UNIT, "de"),
}


def columns(path: Path) -> dict[str, Array]:
    """Every column of a record file, with its time."""
    record = read_record(path)
    return {"t": record.t, **record.channels}


def read_record(path: Path) -> Record:
    declared = CHECK.forms[0].inputs[0]
    return record_of(load_bytes(path), declared, {})


def spoilt_unit(source: Path, place: Path, spoil: Callable[[Columns], Columns], file: str = "frf_noise.mat") -> Path:
    """A copy of a unit with a fault in one record."""
    shutil.copytree(source, place)
    (place / file).write_bytes(mat_bytes(dict(spoil(columns(place / file)))))
    return place
