"""What stands in the place of a named file and cannot be read is refused before anything is judged: a certificate of it
would be judged again elsewhere from no file at all, with another reason."""

import json
import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from accept.capture.watch_folder import WatchedFolder
from accept.units import unit_folder
from accept.units.attach import take_in
from accept.units.loaded_unit import LoadedUnit
from accept.units.unit_folder import UnitError
from accept.workflow.entry.record_folder import look, new_photo
from checks.acceptance import CHECKS
from checks.declare import CsvTable
from checks.errors import RecordError
from tests.accept.units.units import GOOD, make_unit
from tests.shared.command_line import accept

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="links, pipes and sockets of Unix")
FLATNESS = GOOD.replace("z_um = [0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]", 'points = "flatness.csv"')


def a_socket(path: Path) -> None:
    """Bound from its folder, as a path to a socket is short."""
    before = Path.cwd()
    os.chdir(path.parent)
    try:
        with socket.socket(socket.AF_UNIX) as opened:
            opened.bind(path.name)
    finally:
        os.chdir(before)


def a_pipe(path: Path) -> None:
    os.mkfifo(path)  # only looked up here: Windows has none


def in_a_circle(path: Path) -> None:
    (path.parent / "other.csv").symlink_to(path.name)
    path.symlink_to("other.csv")


def of_another_folder(path: Path) -> None:
    outside = path.parents[1] / "elsewhere.csv"
    outside.write_text("x,y,z\n")
    path.symlink_to(outside)


FAULTS: dict[str, tuple[Callable[[Path], None], str, str]] = {  # made by, said of a unit's file, said of a source
    "a circle": (in_a_circle, "is a link that leads in a circle", "symbolic links"),
    "a dangling link": (lambda path: path.symlink_to("gone"), "is a link to a file that is not there", "no such file"),
    "a device": (lambda path: path.symlink_to("/dev/zero"), "is a pipe or a device", "is a pipe or a device"),
    "a folder": (Path.mkdir, "is a folder", "is a folder"),
    "a pipe": (a_pipe, "is a pipe or a device", "is a pipe or a device"),
    "a socket": (a_socket, "is a pipe or a device", "cannot be read"),
    "a file elsewhere": (of_another_folder, "is a link that leads outside the unit folder", ""),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_nothing_is_signed(tmp_path: Path, fault: str) -> None:
    make, words, _ = FAULTS[fault]
    folder, pdf = make_unit(tmp_path / "T-01", text=FLATNESS), tmp_path / "T-01.pdf"
    make(folder / "flatness.csv")
    done = accept("report", folder, "--out", pdf)
    assert done.exit_code == 6, done.output
    assert "flatness.csv" in done.output
    assert words in done.output
    assert "take its line out" in done.output
    assert not pdf.exists()


def test_the_other_units_of_a_batch_are_judged(tmp_path: Path) -> None:
    in_a_circle(make_unit(tmp_path / "units" / "T-01", text=FLATNESS) / "flatness.csv")
    make_unit(tmp_path / "units" / "T-02", "T-02")
    done = accept("batch", tmp_path / "units", "--out", tmp_path / "out", "--no-certificates")
    assert done.exit_code == 4, done.output
    found = json.loads((tmp_path / "out" / "results.json").read_text())
    assert [each["serial"] for each in found["units"]] == ["T-02"]
    assert "is a link that leads in a circle" in found["refused"][0]["reason"]


def test_a_unit_file_that_leads_nowhere_is_not_left_out(tmp_path: Path) -> None:
    for name, target in (("A", "gone"), ("B", "unit.toml")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "unit.toml").symlink_to(target)
    make_unit(tmp_path / "C")
    assert [folder.name for folder in unit_folder.find(tmp_path)] == ["A", "B", "C"]


def test_a_folder_that_is_a_link_to_itself(tmp_path: Path) -> None:
    (tmp_path / "T-01").symlink_to("T-01")
    for command in ("report", "batch"):
        done = accept(command, tmp_path / "T-01", "--out", tmp_path / "T-01.pdf")
        assert done.exit_code == 6, done.output
        assert "T-01" in done.output


@pytest.mark.parametrize("refused", ["the file", "its folder"])
def test_what_may_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: str) -> None:
    """As who is not root sees it."""
    folder = make_unit(tmp_path, text=FLATNESS.replace("flatness.csv", "data/flatness.csv"))
    path = folder / "data" / "flatness.csv"
    path.parent.mkdir()
    path.write_text("x,y,z\n")
    if refused == "the file":
        monkeypatch.setattr(os, "access", lambda place, mode: Path(place) != path)
    else:
        known = os.path.realpath

        def closed(place: Path, strict: bool = False) -> str:
            if strict:
                raise PermissionError(13, "Permission denied", str(place))
            return known(place)

        monkeypatch.setattr(os.path, "realpath", closed)
    with pytest.raises(UnitError, match=r"data/flatness[.]csv cannot be read: Permission denied"):
        unit_folder.read(folder)


def test_a_file_that_fails_while_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a network drive: a finding of it would come out otherwise where the file is not attached."""
    folder = make_unit(tmp_path, text=FLATNESS)
    (folder / "flatness.csv").write_text("x,y,z\n")

    def fails(*_: object) -> None:
        raise OSError(5, "Input/output error", "flatness.csv")

    monkeypatch.setattr("hw.records.source.read_bounded", fails)
    monkeypatch.setattr(unit_folder, "file_hash", fails)
    for room in (1000, 0):
        with pytest.raises(UnitError, match=r"flatness[.]csv: .*Input/output error"):
            _ = LoadedUnit(unit_folder.read(folder), room).hashes


@pytest.mark.parametrize("fault", [name for name, (_, _, words) in FAULTS.items() if words])
def test_no_such_source_comes_into_a_workflow(tmp_path: Path, fault: str) -> None:
    make, _, words = FAULTS[fault]
    (tmp_path / "rig").mkdir()
    (tmp_path / "unit").mkdir()
    make(tmp_path / "rig" / "flatness.csv")
    declared = CHECKS["flatness"].inputs["points"]
    assert isinstance(declared, CsvTable)
    with pytest.raises(RecordError, match=rf"flatness\.csv: .*{words}"):
        take_in(tmp_path / "rig" / "flatness.csv", declared, tmp_path / "unit")
    assert not list((tmp_path / "unit").iterdir())


def test_a_folder_of_records_is_looked_through(tmp_path: Path) -> None:
    """One link in a circle hides none of the others."""
    for name in ("a.csv", "a.png"):
        (tmp_path / name).symlink_to(name)
    for name in ("b.csv", "b.png"):
        (tmp_path / name).write_text("x_mm\n1\n")
    assert [file.name for file in look(tmp_path).files] == ["b.csv"]
    assert new_photo(tmp_path) == "b.png"
    assert WatchedFolder(tmp_path).not_offered == ["b.csv"]
