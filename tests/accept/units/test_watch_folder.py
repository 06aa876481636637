"""Records picked up from a watched folder: complete, copied, hashed, linked; the original stays."""

import hashlib
import tomllib

import numpy as np
import pytest

from accept.capture.watch_folder import WatchedFolder, pick_up
from accept.store import open_store
from accept.units.unit_folder import UnitError
from checks.errors import RecordError
from hw import records
from tests.hw.instruments.simbench import new_unit


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def stroke_bytes(top=100e-6):
    x = np.sin(np.linspace(0, 3.1, 500)) ** 2
    return records.mat_bytes({"t": np.arange(500) * 1e-2, "V": -20 + 170 * x, "d": top * x})


def test_a_file_is_offered_once_when_it_stops_changing(tmp_path):
    clock = Clock()
    watch = WatchedFolder(tmp_path, stable_s=2.0, clock=clock)
    path, content = tmp_path / "a.mat", stroke_bytes()
    path.write_bytes(content[:1000])
    assert watch.stable() == []
    clock.now = 3.0
    path.write_bytes(content)  # still growing
    assert watch.stable() == []
    clock.now = 4.9
    assert watch.stable() == []
    clock.now = 5.1
    assert watch.stable() == [path]
    assert watch.stable() == []
    clock.now = 20.0
    path.write_bytes(content + b"more")
    assert watch.stable() == []
    clock.now = 23.0
    assert watch.stable() == [path]


def test_old_files_and_other_files_are_not_offered(tmp_path):
    clock = Clock()
    (tmp_path / "old.mat").write_bytes(b"x")
    watch, both = WatchedFolder(tmp_path, 1.0, clock=clock), WatchedFolder(tmp_path, 1.0, old_too=True, clock=clock)
    for name in ("notes.txt", ".new.mat", "a.mat"):
        (tmp_path / name).write_bytes(b"x")
    watch.stable(), both.stable()
    clock.now = 2.0
    assert [p.name for p in watch.stable()] == ["a.mat"]
    assert [p.name for p in both.stable()] == ["a.mat", "old.mat"]
    (tmp_path / "a.mat").unlink()
    assert watch.stable() == []


def test_a_record_is_copied_hashed_and_linked(tmp_path):
    folder, rig = new_unit(tmp_path / "U"), tmp_path / "rig"
    rig.mkdir()
    source = rig / "run 7.mat"
    source.write_bytes(stroke_bytes())
    before = source.stat()
    with open_store() as store:
        copy = pick_up(source, folder, "stroke", "one_stack", store, "T")
        (event,) = store.events("APA-01", "record_picked_up")
    assert (folder / copy).read_bytes() == source.read_bytes()
    assert tomllib.loads((folder / "unit.toml").read_text())["stroke"] == {"one_stack": copy}
    assert event.data["sha256"] == hashlib.sha256(source.read_bytes()).hexdigest()
    assert event.data["origin"] == str(source)
    assert (source.stat().st_mtime_ns, source.stat().st_ino) == (before.st_mtime_ns, before.st_ino)


def test_a_second_record_of_the_same_name_does_not_replace_the_first(tmp_path):
    folder, source = new_unit(tmp_path / "U"), tmp_path / "a.mat"
    with open_store() as store:
        source.write_bytes(stroke_bytes())
        first = pick_up(source, folder, "stroke", "one_stack", store, "T")
        source.write_bytes(stroke_bytes(200e-6))
        second = pick_up(source, folder, "stroke", "two_stacks", store, "T")
    assert first != second
    assert (folder / first).read_bytes() == stroke_bytes()


@pytest.mark.parametrize("cut", [100, 2000])
def test_an_incomplete_record_is_left_alone(tmp_path, cut):
    folder, source = new_unit(tmp_path / "U"), tmp_path / "a.mat"
    source.write_bytes(stroke_bytes()[:cut])
    with open_store() as store, pytest.raises(RecordError):
        pick_up(source, folder, "stroke", "one_stack", store, "T")
    assert sorted(p.name for p in folder.iterdir()) == ["unit.toml"]
    assert "stroke" not in (folder / "unit.toml").read_text()


@pytest.mark.parametrize(
    ("section", "name", "words"), [("strokes", "a", "no check"), ("stroke", "stroke_um", "no file")]
)
def test_inputs_that_are_no_files(tmp_path, section, name, words):
    with open_store() as store, pytest.raises(UnitError, match=words):
        pick_up(tmp_path / "a.mat", new_unit(tmp_path / "U"), section, name, store, "T")
