"""What is in the store is believed only when it holds: edits, truncation, rollback and forks are found before use."""

import json
import os
import shutil
import sqlite3
import time
from pathlib import Path

import pytest

from accept.base.home import home
from accept.store import NewEvent, StoreError, open_store
from accept.store.event import Event, digest
from tests.accept.units.units import make_unit
from tests.shared.command_line import accept


def filled(events: int = 6) -> Path:
    with open_store() as store:
        for number in range(events):
            store.append("noted", f"U-{number}", {"verdict": "rejected"}, who="Ann")
    return home() / "store.sqlite"


def edit(file: Path, seq: int, rest_too: bool = False) -> None:
    """Change an event and give it its own hash; with `rest_too` all after it as well, and both heads."""
    with sqlite3.connect(file) as database:
        database.execute("DROP TRIGGER events_no_update")
        rows = [Event(*row) for row in database.execute("SELECT * FROM events ORDER BY seq")]
        prev = rows[seq - 1].prev
        for event in rows[seq - 1 :] if rest_too else rows[seq - 1 : seq]:
            words = event.payload[:-1] + ((", " if len(event.payload) > 2 else "") + '"more":1}')
            whole = digest(
                event.seq, event.time, event.who, event.what, event.subject, event.spec, event.code, words, prev
            )
            database.execute(
                "UPDATE events SET payload = ?, prev = ?, hash = ? WHERE seq = ?", (words, prev, whole, event.seq)
            )
            prev = whole
        if rest_too:
            database.execute("UPDATE head SET hash = ?", (prev,))
    database.close()
    if rest_too:
        file.with_suffix(".head").write_text(f"{len(rows)} {prev}\n")


@pytest.mark.slow
def test_an_edited_event_with_its_own_hash_is_not_believed(tmp_path: Path) -> None:
    """The verdict of a judged unit altered in the database: a batch takes nothing from it and appends nothing."""
    unit = make_unit(tmp_path / "u", "A-1")
    assert accept("batch", unit, "--spec", "apa-basic", "--out", tmp_path / "out").exit_code in (0, 3, 4)
    file = home() / "store.sqlite"
    edit(file, 2)
    done = accept("batch", unit, "--spec", "apa-basic", "--out", tmp_path / "out")
    assert (done.exit_code, "integrity check failed" in done.stderr) == (6, True)
    assert accept("store", "check").exit_code == 3


@pytest.mark.parametrize("seq", [1, 4, 6])
def test_a_chain_rewritten_with_its_heads_is_found_by_the_seal(seq: int) -> None:
    file = filled()
    edit(file, seq, rest_too=True)
    with pytest.raises(StoreError, match="the bench's seal holds another hash"):
        open_store()


@pytest.mark.parametrize("rest_too", [False, True])
def test_an_edit_of_what_was_sealed_is_found_though_only_the_end_would_be_walked(rest_too: bool) -> None:
    """Times of the file put back: its change of state cannot be."""
    file = filled()
    before = file.stat()
    edit(file, 2, rest_too)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    with pytest.raises(StoreError, match="integrity check failed"):
        open_store()


def test_a_lost_head_file_is_a_fault() -> None:
    file = filled()
    file.with_suffix(".head").unlink()
    with pytest.raises(StoreError, match=r"store\.head is missing"):
        open_store()


def test_a_rollback_and_a_fork_are_found_against_a_certificate_and_an_exported_head(tmp_path: Path) -> None:
    """The whole home is put back to yesterday, seal and all: it holds in itself, but not against what it gave out."""
    filled()
    yesterday = tmp_path / "yesterday"
    shutil.copytree(home(), yesterday)
    unit, pdf = make_unit(tmp_path / "u", "A-1"), tmp_path / "a.pdf"
    accept("store", "head", "--out", tmp_path / "early.json")
    accept("batch", unit, "--spec", "apa-basic", "--out", tmp_path / "out")
    pdf = tmp_path / "out" / "certificates" / "A-1.pdf"
    accept("store", "head", "--out", tmp_path / "late.json")
    for kept in (pdf, tmp_path / "late.json", tmp_path / "early.json"):
        assert accept("store", "check", "--head", kept).exit_code == 0
    place = home()
    shutil.rmtree(place)
    shutil.copytree(yesterday, place)
    assert accept("store", "check").exit_code == 0
    assert accept("store", "check", "--head", tmp_path / "early.json").exit_code == 0
    for kept in (pdf, tmp_path / "late.json"):  # cut off
        done = accept("store", "check", "--head", kept)
        assert (done.exit_code, "is missing" in done.stderr) == (3, True)
    filled(8)
    for kept in (pdf, tmp_path / "late.json"):  # gone on in another way
        done = accept("store", "check", "--head", kept)
        assert (done.exit_code, "holds another hash" in done.stderr) == (3, True)


def test_an_exported_head_that_was_changed_is_refused(tmp_path: Path) -> None:
    filled()
    out = tmp_path / "head.json"
    accept("store", "head", "--out", out)
    given = json.loads(out.read_text())
    out.write_text(json.dumps(given | {"seq": 3}))
    done = accept("store", "check", "--head", out)
    assert (done.exit_code, "changed after the bench signed it" in done.stderr) == (6, True)


def test_backup_and_restore(tmp_path: Path) -> None:
    file = filled()
    assert accept("store", "backup", tmp_path / "b.sqlite").exit_code == 0
    filled(3)
    edit(file, 2)
    done = accept("store", "restore", tmp_path / "b.sqlite")
    assert done.exit_code == 0, done.output
    with open_store() as store:
        assert store.head().seq == 6
        store.append("noted", "", {}, who="Ann")
    assert list(home().glob("store-replaced-*.sqlite"))
    edit(tmp_path / "b.sqlite", 2, rest_too=True)
    before = file.read_bytes()
    assert accept("store", "restore", tmp_path / "b.sqlite").exit_code == 6
    assert file.read_bytes() == before


def test_the_log_says_verdicts_and_prints_no_forged_line() -> None:
    with open_store() as store:
        store.append("unit_refused", "A-1", {"path": "x", "reason": "bad\n9  now  QA  approved\x1b[2J"}, who="Ann")
    done = accept("store", "log", "--full")
    assert "\x1b" not in done.stdout
    assert not [line for line in done.stdout.splitlines() if line.startswith("9  now")]


def test_a_long_store_is_not_walked_again_when_nobody_touched_it() -> None:
    """2,000 events: opening a sealed store reads the end of it, whatever its length."""
    with open_store() as store:
        store.append_many([NewEvent("noted", "U", {"n": n, "words": "x" * 500}) for n in range(2000)], who="Ann")
    with open_store() as store:
        assert store._made > 0.0
        began = time.perf_counter()
    with open_store() as store:
        walked_anew = store._made > time.time() - 0.001
    assert time.perf_counter() - began < 1.0
    assert not walked_anew


def test_two_programs_at_once_keep_the_store_whole() -> None:
    """What another program wrote meanwhile is not sealed unseen: the next one walks the chain."""
    filled()
    one, other = open_store(), open_store()
    one.append("noted", "A", {}, who="Ann")
    other.append("noted", "B", {}, who="Bob")
    one.append("noted", "C", {}, who="Ann")
    one.close()
    other.close()
    with open_store() as store:
        assert store.check() is None
        assert store.head().seq == 9
