"""Names and words from outside: none harms a file system, a spreadsheet or a terminal."""

import os
from pathlib import Path

import pytest

from accept.base import atomic_files
from accept.base.console import one_line
from accept.batch.outputs import csv_rows, findings_frame
from accept.units import unit_folder
from specs.files import read_bounded


@pytest.mark.parametrize("serial", ["CON", "con.1", "Lpt1", "A-1."])
def test_serials_that_windows_keeps_are_refused(tmp_path: Path, serial: str) -> None:
    (tmp_path / "unit.toml").write_text(f'serial = "{serial}"\nkind = "apa"\n')
    with pytest.raises(unit_folder.UnitError, match="Windows keeps"):
        unit_folder.read(tmp_path)


def test_a_pipe_and_an_endless_device_are_said_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "unit.toml")
    with pytest.raises(unit_folder.UnitError, match="a pipe or a device"):
        unit_folder.read(tmp_path)
    with pytest.raises(OSError, match="a pipe or a device"):
        read_bounded(Path("/dev/zero"))
    (tmp_path / "large").write_bytes(b"x" * 101)
    with pytest.raises(OSError, match="larger than 100 bytes"):
        read_bounded(tmp_path / "large", 100)


def test_no_cell_is_a_formula_and_no_line_moves_the_cursor() -> None:
    finding = {"check": "=1+1", "quantity": "q", "value": -1.5, "reason": "@SUM(A1)\x1b[2J"}
    text = csv_rows(
        findings_frame([{"serial": "A", "kind": "apa", "verdict": "rejected", "findings": [finding]}]), header=True
    ).decode()
    assert "'=1+1" in text
    assert "'@SUM" in text
    assert "-1.5" in text
    assert "'-1.5" not in text
    assert "\x1b" not in text
    assert one_line("a\n2  now\x1b[2J\u202e") == "a\\n2  now\\x1b[2J\\u202e"


def test_files_keep_the_umask(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(atomic_files, "_UMASK", 0o077)
    atomic_files.write_atomic(tmp_path / "a", b"x")
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o600
