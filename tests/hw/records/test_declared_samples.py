"""How many numbers a file declares is known before they are unpacked, whatever holds them."""

import io
import struct
import time
from collections.abc import Callable, Mapping

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from checks.errors import RecordError
from hw.records import csv_bytes, declared_samples, mat_bytes, record_by_input
from hw.records.source import Source

COUNT = 200_000
COLUMNS = {"t": np.arange(COUNT) * 1e-3, "de": np.zeros(COUNT)}


def matlab5(variables: Mapping[str, object]) -> bytes:
    out = io.BytesIO()
    savemat(out, dict(variables), do_compression=True)
    return out.getvalue()


def hdf5(group: str) -> bytes:
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        for name, column in COLUMNS.items():
            file.create_dataset(f"{group}{name}", data=column, compression="gzip")
    return out.getvalue()


def cells() -> bytes:
    """A cell whose element holds the columns."""
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        inner = file.create_dataset("#refs#/a", data=np.zeros(2 * COUNT), compression="gzip")
        file.create_dataset("cell", data=np.array([inner.ref], dtype=h5py.ref_dtype))
    return out.getvalue()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("own.mat", lambda: mat_bytes(COLUMNS)),
        ("plain.mat", lambda: matlab5(COLUMNS)),
        ("structure.mat", lambda: matlab5({"run": COLUMNS})),
        ("bytes.mat", lambda: matlab5({"run": {n: x.astype(np.int8) for n, x in COLUMNS.items()}})),
        ("groups.mat", lambda: hdf5("run/")),
        ("sets.mat", lambda: hdf5("")),
        ("cells.mat", cells),
        ("table.csv", lambda: csv_bytes(COLUMNS)),
    ],
)
def test_all_numbers_are_counted(name: str, content: Callable[[], bytes]) -> None:
    raw = content()
    assert 2 * COUNT <= declared_samples(name, raw, 10 * COUNT) <= 2.1 * COUNT
    assert declared_samples(name, raw[:200], 10 * COUNT) < COUNT


def test_no_structure_is_unpacked_beyond_the_most(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = matlab5({"run": COLUMNS})
    monkeypatch.setattr("hw.records.reader.expand", None)
    assert declared_samples("structure.mat", raw, COUNT) > COUNT


def in_a_circle() -> bytes:
    """A group with twelve links to itself: 12^8 paths lead through it."""
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        group = file.create_group("a")
        for n in range(12):
            group[f"x{n}"] = group
    return out.getvalue()


def many_columns() -> bytes:
    names = [f"c{n}" for n in range(60_000)]
    return f"{','.join(names)}\n{','.join('1' for _ in names)}\n".encode()


def many_tdms_channels() -> bytes:
    paths = [f"/'g'/'c{n}'".encode() for n in range(30_000)]
    objects = [struct.pack("<I", len(p)) + p + struct.pack("<IIIQI", 20, 10, 1, 1, 0) for p in paths]
    head = struct.pack("<I", len(paths)) + b"".join(objects)
    lead = b"TDSm" + struct.pack("<IIQQ", 0b1110, 4713, len(head) + 8 * len(paths), len(head))
    return lead + head + bytes(8 * len(paths))


@pytest.mark.parametrize(
    ("name", "content"),
    [("a.mat", in_a_circle), ("a.csv", many_columns), ("a.tdms", many_tdms_channels)],
)
def test_a_small_file_takes_no_long_time(name: str, content: Callable[[], bytes]) -> None:
    raw, start = content(), time.process_time()
    declared_samples(name, raw, 10 * COUNT)
    with pytest.raises(RecordError):
        record_by_input(Source(name, f".{name[2:]}", raw), "Va")
    assert time.process_time() - start < 10.0
