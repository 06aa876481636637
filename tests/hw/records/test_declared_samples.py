"""How many numbers a file declares is known before they are unpacked, whatever holds them."""

import io
from collections.abc import Callable, Mapping

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from hw.records import csv_bytes, declared_samples, mat_bytes

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
