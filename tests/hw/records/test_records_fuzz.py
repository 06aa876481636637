"""Damaged files: whatever the bytes, a valid record or a RecordError; nothing else, nothing on stderr, no hang.

ACCEPT_SOAK=1 reads 10,000 damaged files and every header word set to every extreme; by default a few hundred.
"""

import time
import warnings

import numpy as np
import pytest

from checks.errors import RecordError
from checks.record import Record
from hw import records
from tests.hw.records import records_files as made
from tests.soak import SOAK

FORMATS = (
    "plain.mat", "packed.mat", "v73.mat", "v73-packed.mat", "table.csv", "text.uff", "binary.uff", "uneven.uff",
)  # fmt: skip
DAMAGED_FILES = 10_000 if SOAK else 400
HANG_S = 5.0  # a file of these takes 0.3 to 2 ms; the rest is for a busy machine
EXTREMES = (b"\0\0\0\0", b"\1\0\0\0", b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\x80")


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    return made.every_format(tmp_path_factory.mktemp("originals"))


def cut(raw: bytearray, at: int, rng: np.random.Generator) -> None:
    del raw[at:]


def flip(raw: bytearray, at: int, rng: np.random.Generator) -> None:
    raw[at] ^= 1 << int(rng.integers(8))


def overwrite(raw: bytearray, at: int, rng: np.random.Generator) -> None:
    raw[at : at + 1] = rng.bytes(1)


def insert(raw: bytearray, at: int, rng: np.random.Generator) -> None:
    raw[at:at] = rng.bytes(int(rng.integers(1, 9)))


def drop(raw: bytearray, at: int, rng: np.random.Generator) -> None:
    del raw[at : at + int(rng.integers(1, 9))]


def extreme(raw: bytearray, at: int, rng: np.random.Generator) -> None:
    raw[at : at + 4] = EXTREMES[rng.integers(len(EXTREMES))]


def swap_words(raw: bytearray, at: int, rng: np.random.Generator) -> None:
    """Swaps neighbouring words of 4: the two dimensions of an array, or a tag's type and size."""
    at -= at % 4
    raw[at : at + 8] = raw[at + 4 : at + 8] + raw[at : at + 4]


def copy_over(raw: bytearray, at: int, rng: np.random.Generator) -> None:
    start, size = int(rng.integers(len(raw))), int(rng.integers(1, 65))
    raw[at : at + size] = raw[start : start + size]


WAYS = (cut, flip, overwrite, insert, drop, extreme, swap_words, copy_over)


def damaged(raw: bytes, rng: np.random.Generator) -> bytes:
    """One to three kinds of damage, every other in the first 3000 bytes, where the headers are."""
    out = bytearray(raw)
    for _ in range(int(rng.integers(1, 4))):
        reach = min(len(out), 3000) if rng.random() < 0.5 else len(out)
        if reach:
            WAYS[rng.integers(len(WAYS))](out, int(rng.integers(reach)), rng)
    return bytes(out)


def outcome(path, raw: bytes) -> Record | RecordError:
    path.write_bytes(raw)
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            result: Record | RecordError = records.read(path, made.SERIES)
        except RecordError as refused:
            result = refused
    assert time.perf_counter() - start < HANG_S
    return result


def assert_usable(record: Record) -> None:
    assert set(made.SERIES.channels) - {"t"} <= set(record.channels)
    for x in (record.t, *record.channels.values()):
        assert x.shape == record.t.shape
        assert x.dtype == np.float64
        assert np.isfinite(x).all()
    assert (np.diff(record.t) > 0).all()
    assert record.fs > 0


@pytest.mark.parametrize("name", FORMATS)
def test_damaged_files_are_refused_or_valid(name, originals, tmp_path, capfd):
    rng = np.random.default_rng([17, FORMATS.index(name)])
    refused = 0
    for _ in range(DAMAGED_FILES // len(FORMATS)):
        result = outcome(tmp_path / name, damaged(originals[name], rng))
        if isinstance(result, Record):
            assert_usable(result)
        else:
            assert str(result).startswith(f"{name}: ")
            refused += 1
    assert refused > 0.3 * DAMAGED_FILES / len(FORMATS)  # else the damage damages nothing
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["plain.mat", "v73.mat", "v73-packed.mat", "binary.uff"])
@pytest.mark.slow
def test_every_header_word_at_its_extremes(name, originals, tmp_path, capfd):
    raw = originals[name]
    words = range(124, min(len(raw), 6000), 4 if SOAK else 92)
    for at in words:
        for value in EXTREMES:
            result = outcome(tmp_path / name, raw[:at] + value + raw[at + 4 :])
            if isinstance(result, Record):
                assert_usable(result)
    assert capfd.readouterr() == ("", "")


def test_noise_of_every_length_is_refused(tmp_path):
    rng = np.random.default_rng(23)
    for size in (1, 7, 127, 128, 129, 512, 520, 4096):
        for start in (b"", made.mat5(made.channels())[:128], b"\x89HDF\r\n\x1a\n", b"    -1\n    58\n"):
            for suffix in ("mat", "csv", "uff"):
                assert isinstance(outcome(tmp_path / f"noise.{suffix}", start + rng.bytes(size)), RecordError)
