"""Units at addresses of fsspec: judged from the bytes that were fetched, as any folder; refused where not whole."""

import functools
import hashlib
import http.server
import json
import os
import threading
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fsspec
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

from accept.base.plain_text import without_secrets
from accept.cli.main import app
from accept.units import remote_folders
from accept.units.remote_folders import RemoteError, fetched, is_remote
from hw.records import ReadLimits
from tests.accept.units.units import GOOD, make_unit

AT = [(-29.5, 9), (-16, 9), (-16, -9), (-29.5, -9), (16, 9), (29.5, 9), (29.5, -9), (16, -9)]
HEIGHTS = (0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46)
ROWS = "".join(f"{x},{y},{z}\n" for (x, y), z in zip(AT, HEIGHTS, strict=True))
TABLE = f"x_mm,y_mm,z_um\n{ROWS}".encode()
WITH_FILE = GOOD.replace("z_um = [0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]", 'points = "flatness.csv"')


def batch(*words: object) -> Result:
    return CliRunner().invoke(app, ["batch", *map(str, words), "--spec", "apa-basic", "--no-certificates"])


def results(out: Path) -> Any:
    return json.loads((out / "results.json").read_text())


def without_place(document: Any) -> str:
    return json.dumps(document["units"])


@pytest.fixture
def memory() -> Iterator[fsspec.AbstractFileSystem]:
    """An object store that is empty before and after."""
    store = fsspec.filesystem("memory")
    store.store.clear()
    yield store
    store.store.clear()


@pytest.fixture
def units(tmp_path: Path) -> Path:
    """Two good units, one of them with a file."""
    make_unit(tmp_path / "units" / "A-1", "A-1", WITH_FILE)
    (tmp_path / "units" / "A-1" / "flatness.csv").write_bytes(TABLE)
    make_unit(tmp_path / "units" / "batch-2" / "A-2", "A-2")
    return tmp_path / "units"


@pytest.fixture
def addresses(units: Path, tmp_path: Path, memory: fsspec.AbstractFileSystem) -> Iterator[dict[str, str]]:
    """The same units in an object store, an archive and on a web server."""
    for path in units.rglob("*.*"):
        memory.pipe(f"/lab/units/{path.relative_to(units).as_posix()}", path.read_bytes())
    with zipfile.ZipFile(tmp_path / "units.zip", "w") as archive:
        for path in sorted(units.rglob("*.*")):
            archive.write(path, Path("units") / path.relative_to(units))
    handler = functools.partial(Quiet, directory=str(units))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield {
            "memory": "memory://lab/units",
            "zip": f"zip://units::{tmp_path / 'units.zip'}",
            "http": f"http://127.0.0.1:{server.server_address[1]}/",
            "file": f"file://{units}",
        }
        server.shutdown()


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


def test_the_results_are_those_of_the_folders_themselves(
    units: Path, addresses: dict[str, str], tmp_path: Path
) -> None:
    """From everywhere; and the list says whence each file came, with the hash that is the evidence's."""
    assert batch(units, "--out", tmp_path / "here").exit_code == 0
    due = without_place(results(tmp_path / "here"))
    for name, where in addresses.items():
        done = batch(where, "--out", tmp_path / name)
        assert done.exit_code == 0, (name, done.output, done.exception)
        assert without_place(results(tmp_path / name)) == due, name
    (listed,) = (tmp_path / "memory" / remote_folders.FETCHED).glob(f"*/{remote_folders.LIST}")
    rows = pd.read_csv(listed)
    row = rows[rows["file"] == "flatness.csv"].iloc[0]
    assert row["sha256"] == hashlib.sha256(TABLE).hexdigest()
    assert (row["address"], row["bytes"]) == ("memory://lab/units/A-1", len(TABLE))
    assert results(tmp_path / "memory")["units"][0]["inputs"]["flatness.csv"] == row["sha256"]


def test_what_is_there_now_counts_and_not_what_an_earlier_time_has_left(
    addresses: dict[str, str], memory: fsspec.AbstractFileSystem, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    batch(addresses["memory"], "--out", out)
    assert "2 of 2 units unchanged" in batch(addresses["memory"], "--out", out).stderr
    memory.rm("/lab/units/A-1/flatness.csv")
    memory.rm("/lab/units/batch-2", recursive=True)
    done = batch(addresses["memory"], "--out", out)
    assert done.exit_code == 4
    assert [(u["serial"], u["verdict"]) for u in results(out)["units"]] == [("A-1", "incomplete")]


def test_a_unit_that_cannot_be_fetched_whole_is_refused_and_the_others_are_judged(
    addresses: dict[str, str], memory: fsspec.AbstractFileSystem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cut off in the middle, and a file that does not end: nobody judges half of a unit, nobody waits for ever."""
    whole = fsspec.implementations.memory.MemoryFileSystem.open

    class Endless:
        def __init__(self, piece: bytes) -> None:
            self.piece = piece

        def __enter__(self) -> "Endless":
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def read(self, size: int) -> bytes:
            if not self.piece:
                raise ConnectionError("reset by s3://user:secret@peer")
            return self.piece

    for piece, words in (
        (b"", "could not be fetched whole: flatness.csv: ConnectionError: reset by s3://peer"),
        (b"1\n" * 4000, "is larger than"),
    ):

        def broken(fs: Any, path: str, mode: str = "rb", piece: bytes = piece, **more: Any) -> Any:
            return Endless(piece) if path.endswith(".csv") else whole(fs, path, mode, **more)

        monkeypatch.setattr(fsspec.implementations.memory.MemoryFileSystem, "open", broken)
        monkeypatch.setattr(remote_folders, "DEFAULT_LIMITS", ReadLimits(max_bytes=100_000))
        done = batch(addresses["memory"], "--out", tmp_path / "out")
        assert done.exit_code == 4, done.output
        (refused,) = results(tmp_path / "out")["refused"]
        assert refused["path"] == "memory://lab/units/A-1"
        assert words in refused["reason"]
        assert [u["serial"] for u in results(tmp_path / "out")["units"]] == ["A-2"]
        assert not list((tmp_path / "out").rglob("flatness.csv"))
    memory.pipe("/empty/readme.txt", b"")
    with pytest.raises(RemoteError, match="memory://empty: holds no unit"):  # whatever was refused elsewhere
        fetched([addresses["memory"], "memory://empty"], tmp_path / "out", lambda _: None)


def test_names_that_lead_elsewhere_are_not_followed(memory: fsspec.AbstractFileSystem, tmp_path: Path) -> None:
    """In `unit.toml`, and in the listing of an archive."""
    (tmp_path / "outside.csv").write_bytes(TABLE)
    memory.pipe("/lab/outside.csv", TABLE)
    memory.pipe(
        "/lab/A/unit.toml", WITH_FILE.replace("{serial}", "A").replace("flatness.csv", "../outside.csv").encode()
    )
    out = tmp_path / "out"
    done = batch("memory://lab", "--out", out)
    assert done.exit_code == 4
    assert "lies outside the unit folder" in json.dumps(results(out)["units"])
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("../../escaped/unit.toml", GOOD.replace("{serial}", "Z"))
    before = {p for p in tmp_path.rglob("*") if "out" not in p.parts}
    batch(f"zip://::{tmp_path / 'a.zip'}", "--out", out)
    assert {p for p in tmp_path.rglob("*") if out not in p.parents} - before <= {out}
    assert not (tmp_path / "escaped").exists()


def test_a_place_that_holds_nothing_or_cannot_be_reached_is_said(
    memory: fsspec.AbstractFileSystem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    memory.pipe("/empty/readme.txt", b"")
    cases = {
        "memory://empty": "holds no unit.toml",
        "memory://nowhere": "cannot be listed: FileNotFoundError",
        "nonsense://x": "cannot be listed: ValueError",
        f"zip://::{tmp_path / 'missing.zip'}": "cannot be listed: FileNotFoundError",
    }
    for where, words in cases.items():
        done = batch(where, "--out", tmp_path / "out")
        assert done.exit_code == 6, done.output
        assert f"{where}: {words}" in done.stderr
        assert "Traceback" not in done.stderr
    monkeypatch.setattr(remote_folders, "MAX_ENTRIES", 0)
    with pytest.raises(RemoteError, match="lists more than 0 names"):
        fetched(["memory://empty"], tmp_path, lambda _: None)


def test_paths_stay_paths_and_passwords_stay_at_home(tmp_path: Path) -> None:
    assert [is_remote(w) for w in ("units", "C:/units", "s3://b/units", "zip://::a.zip", "file:///x")] == [
        False, False, True, True, False,
    ]  # fmt: skip
    assert fetched([str(tmp_path), f"file://{tmp_path}"], tmp_path, lambda _: None) == ([tmp_path, tmp_path], [])
    assert without_secrets("https://ada:secret@host/units") == "https://host/units"
    assert not os.path.exists(tmp_path / remote_folders.FETCHED)
