"""Temporary files of a batch that was killed do not stay for ever."""

import os
import time
from pathlib import Path

from typer.testing import CliRunner

from accept.base.atomic_files import LEFTOVER_S, remove_leftovers
from accept.cli.main import app
from tests.accept.units.units import make_unit


def test_a_later_batch_removes_what_a_killed_one_left(tmp_path: Path) -> None:
    """A young one may still be written by another batch; what is called otherwise is none of them."""
    place = tmp_path / "out" / "certificates"
    place.mkdir(parents=True)
    old, young, other = (place / name for name in (".A.pdf.x1.part", ".A.pdf.x2.part", "kept.part"))
    for path in (old, young, other):
        path.write_bytes(b"%PDF-")
    for path in (old, other):
        os.utime(path, (time.time() - 2 * LEFTOVER_S,) * 2)
    make_unit(tmp_path / "A", "A")
    asked = ["batch", tmp_path / "A", "--out", tmp_path / "out", "--spec", "apa-basic"]
    assert CliRunner().invoke(app, [str(word) for word in asked]).exit_code == 0
    assert (old.exists(), young.exists(), other.exists()) == (False, True, True)


def test_a_folder_that_is_not_there_holds_no_leftovers(tmp_path: Path) -> None:
    remove_leftovers(tmp_path / "missing")
