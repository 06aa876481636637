"""Record files, written for a test."""

from collections.abc import Mapping
from pathlib import Path

from numpy.typing import ArrayLike

from hw.records import csv_bytes, mat_bytes


def write_mat(path: Path, mapping: Mapping[str, ArrayLike]) -> None:
    path.write_bytes(mat_bytes(mapping))


def write_csv(path: Path, mapping: Mapping[str, ArrayLike]) -> None:
    path.write_bytes(csv_bytes(mapping))
