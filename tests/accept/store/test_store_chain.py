"""Tampering: any change of any stored value is found, and the first altered event is named."""

import shutil
import sqlite3
import tempfile
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from accept.store import Event, NewEvent, StoreError, StoreHead, open_store
from accept.store.chain import ChainBreak
from accept.store.event import digest

N = 8
COLUMNS = [field.name for field in fields(Event)]
ROWS = st.integers(1, N)
VALUES = st.one_of(
    st.text(max_size=70),
    st.binary(max_size=70),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False),
    st.sampled_from(["{}", "0" * 64, "unit_judged", "U1", "Ada", '{"i": 1}', b"Ada"]),
)
Tamper = Callable[[sqlite3.Connection], None]


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("original")
    with open_store(f"sqlite:///{folder}/store.sqlite") as store:
        for i in range(1, N + 1):
            store.append("unit_judged", f"U{i}", {"i": i}, who="Ada", spec="apa@1")
    return folder


def checked(
    original: Path, tamper: Tamper, exported: StoreHead | None = None, with_file: bool = True, forged: bool = False
) -> ChainBreak | None:
    """What `check` says of a copy of the store after `tamper`; nothing may be appended to it when it says anything.

    forged: the file beside it is rewritten too, to what the table says then."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(original / "store.sqlite", folder)
        if with_file:
            shutil.copy(original / "store.head", folder)
        raw = sqlite3.connect(f"{folder}/store.sqlite", isolation_level=None)
        raw.execute("PRAGMA synchronous=OFF")
        raw.execute("DROP TRIGGER events_no_update")
        raw.execute("DROP TRIGGER events_no_delete")
        raw.execute("BEGIN")
        tamper(raw)
        raw.execute("COMMIT")
        if forged:
            Path(folder, "store.head").write_text(
                f"{StoreHead(*raw.execute('SELECT seq, hash FROM head').fetchone())}\n"
            )
        raw.close()
        with open_store(f"sqlite:///{folder}/store.sqlite", check=False) as store:
            return store.check(exported)


def stored(raw: sqlite3.Connection, seq: int, column: str) -> tuple[str, Any]:
    raw.text_factory = bytes
    found: tuple[str, Any] = raw.execute(
        f"SELECT typeof({column}), {column} FROM events WHERE seq = ?", (seq,)
    ).fetchone()
    return found


def put(raw: sqlite3.Connection, seq: int, column: str, value: object) -> None:
    """Set one value; discards the example where the database refuses it or it is the same as before."""
    before = stored(raw, seq, column)
    try:
        raw.execute(f"UPDATE events SET {column} = ? WHERE seq = ?", (value, seq))
    except sqlite3.IntegrityError:
        assume(False)
    assume(column == "seq" or stored(raw, seq, column) != before)


def copied(raw: sqlite3.Connection) -> list[Event]:
    raw.text_factory = str
    return [Event(*row) for row in raw.execute("SELECT * FROM events ORDER BY seq")]


def rewritten(event: Event, prev: str, **changes: str) -> Event:
    """The event changed, and its own hash made to fit."""
    content = {name: getattr(event, name) for name in COLUMNS[:-1]} | changes | {"prev": prev}
    return Event(**content, hash=digest(*content.values()))


def replace_row(raw: sqlite3.Connection, event: Event) -> None:
    places = ", ".join("?" * len(COLUMNS))
    raw.execute(f"INSERT OR REPLACE INTO events VALUES ({places})", [getattr(event, name) for name in COLUMNS])


quick = settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.filter_too_much])


def test_untouched_is_unbroken(original: Path) -> None:
    assert checked(original, lambda raw: None) is None


@quick
@given(seq=ROWS, column=st.sampled_from(COLUMNS), value=VALUES)
def test_any_altered_value_is_found_and_named(original: Path, seq: int, column: str, value: object) -> None:
    if column == "seq":
        assume(isinstance(value, int) and value != seq)
    problem = checked(original, lambda raw: put(raw, seq, column, value))
    assert problem is not None
    assert problem.seq == (min(seq, value) if column == "seq" and isinstance(value, int) else seq)


@settings(quick, max_examples=50)
@given(seq=ROWS, column=st.sampled_from(COLUMNS[1:]), at=st.integers(0, 10**6), bit=st.integers(0, 7))
def test_any_flipped_bit_is_found_and_named(original: Path, seq: int, column: str, at: int, bit: int) -> None:
    """Also where the text is no UTF-8 afterwards."""

    def flip(raw: sqlite3.Connection) -> None:
        text = bytearray(stored(raw, seq, column)[1])
        text[at % len(text)] ^= 1 << bit
        raw.execute(f"UPDATE events SET {column} = CAST(? AS TEXT) WHERE seq = ?", (bytes(text), seq))

    problem = checked(original, flip)
    assert problem is not None
    assert problem.seq == seq
    assert str(problem).encode()  # can be printed


@settings(quick, max_examples=50)
@given(altered=st.dictionaries(ROWS, st.sampled_from(COLUMNS[1:]), min_size=2, max_size=N))
def test_of_several_altered_events_the_first_is_named(original: Path, altered: dict[int, str]) -> None:
    def tamper(raw: sqlite3.Connection) -> None:
        for seq, column in altered.items():
            put(raw, seq, column, "forged")

    problem = checked(original, tamper)
    assert problem is not None
    assert problem.seq == min(altered)


@pytest.mark.parametrize("seq", range(1, N + 1))
def test_a_missing_event_is_named(original: Path, seq: int) -> None:
    problem = checked(original, lambda raw: put_away(raw, seq, seq))
    assert problem is not None
    assert problem.seq == seq
    assert f"event {seq} is missing" in problem.words


def put_away(raw: sqlite3.Connection, first: int, last: int) -> None:
    raw.execute("DELETE FROM events WHERE seq BETWEEN ? AND ?", (first, last))


MISSING = ChainBreak(0, "store.head is missing: it stands beside every store")


@pytest.mark.parametrize("kept", range(N))
def test_a_tail_cut_off_together_with_the_table_head_is_missed_by_the_file(original: Path, kept: int) -> None:
    def cut(raw: sqlite3.Connection) -> None:
        put_away(raw, kept + 1, N)
        last = copied(raw)[-1].hash if kept else "0" * 64
        raw.execute("UPDATE head SET seq = ?, hash = ?", (kept, last))

    problem = checked(original, cut)
    assert problem == ChainBreak(kept + 1, f"event {kept + 1} is missing: store.head holds the hash of event {N}")
    without = checked(original, cut, with_file=False)
    assert without == (MISSING if kept else None)  # an empty store may have none: then only an exported head tells
    assert checked(original, cut, forged=True) is None  # likewise


@quick
@given(pair=st.tuples(ROWS, ROWS).filter(lambda p: p[0] != p[1]))
def test_reordered_events_are_found(original: Path, pair: tuple[int, int]) -> None:
    def swap(raw: sqlite3.Connection) -> None:
        for old, new in ((pair[0], 100), (pair[1], pair[0]), (100, pair[1])):
            raw.execute("UPDATE events SET seq = ? WHERE seq = ?", (new, old))

    problem = checked(original, swap)
    assert problem is not None
    assert problem.seq == min(pair)


@pytest.mark.parametrize("seq", [-1, 0, N + 1, N + 2])
def test_an_inserted_event_is_found_even_with_a_fitting_hash(original: Path, seq: int) -> None:
    def insert(raw: sqlite3.Connection) -> None:
        events = copied(raw)
        content = {name: getattr(events[-1], name) for name in COLUMNS[:-1]} | {"seq": seq, "prev": events[-1].hash}
        replace_row(raw, Event(**content, hash=digest(*content.values())))

    problem = checked(original, insert)
    assert problem is not None
    assert problem.seq == min(seq, N + 1)


@pytest.mark.parametrize("seq", range(1, N + 1))
def test_an_event_forged_with_its_own_hash_does_not_fit_the_next(original: Path, seq: int) -> None:
    def forge(raw: sqlite3.Connection) -> None:
        event = copied(raw)[seq - 1]
        replace_row(raw, rewritten(event, event.prev, payload='{"i":99}'))

    problem = checked(original, forge)
    assert problem is not None
    assert problem.seq == seq


@pytest.mark.parametrize("seq", range(1, N + 1))
def test_a_wholesale_rewrite_is_found_only_by_a_head_kept_outside(original: Path, seq: int) -> None:
    def rewrite(raw: sqlite3.Connection) -> None:
        events = copied(raw)
        prev = events[seq - 1].prev
        for event in events[seq - 1 :]:
            forged = rewritten(event, prev, who="Eve")
            replace_row(raw, forged)
            prev = forged.hash
        raw.execute("UPDATE head SET hash = ?", (prev,))

    with open_store(f"sqlite:///{original}/store.sqlite", check=False) as store:
        exported = store.head()
    assert checked(original, rewrite) is not None
    assert checked(original, rewrite, with_file=False) == MISSING
    assert checked(original, rewrite, forged=True) is None  # as documented: then only an exported head tells
    problem = checked(original, rewrite, exported, forged=True)
    assert problem is not None
    assert "the exported head" in problem.words


@pytest.mark.parametrize(
    "statement",
    [
        "DELETE FROM head",
        "UPDATE head SET seq = 3",
        "UPDATE head SET seq = 9",
        "UPDATE head SET seq = 'x'",
        "UPDATE head SET hash = 'x'",
        "UPDATE head SET hash = x'00'",
        "UPDATE head SET id = 2",
        "DROP TABLE head",
        "DROP TABLE events",
        "ALTER TABLE events ADD COLUMN note TEXT",
        "ALTER TABLE events DROP COLUMN spec",
    ],
)
def test_what_stands_around_the_events_is_checked_too(original: Path, statement: str) -> None:
    assert checked(original, lambda raw: execute(raw, statement)) is not None


def execute(raw: sqlite3.Connection, statement: str) -> None:
    if "DROP" in statement:
        raw.execute("DROP INDEX events_by_subject")
    raw.execute(statement)


@pytest.mark.parametrize(
    "statement", ["DELETE FROM events WHERE seq = 8", "UPDATE events SET who = 'Eve' WHERE seq = 8"]
)
def test_nothing_is_appended_to_a_damaged_end(original: Path, tmp_path: Path, statement: str) -> None:
    shutil.copytree(original, tmp_path, dirs_exist_ok=True)
    raw = sqlite3.connect(tmp_path / "store.sqlite", isolation_level=None)
    for verb in ("update", "delete"):
        raw.execute(f"DROP TRIGGER events_no_{verb}")
    raw.execute(statement)
    url = f"sqlite:///{tmp_path}/store.sqlite"
    with open_store(url, check=False) as store, pytest.raises(StoreError, match="store check"):
        store.append_many([NewEvent("a")], who="Ada")


@pytest.mark.parametrize("content", ["", "8", "8 abc", "x " + "0" * 64, "9 " + "0" * 64, "8 " + "0" * 64, "\xff"])
def test_a_damaged_head_file_is_said_and_stops_appends(original: Path, tmp_path: Path, content: str) -> None:
    shutil.copytree(original, tmp_path, dirs_exist_ok=True)
    (tmp_path / "store.head").write_text(content, "latin-1")
    with open_store(f"sqlite:///{tmp_path}/store.sqlite", check=False) as store:
        problem = store.check()
        assert problem is not None
        assert "store.head" in problem.words
        with pytest.raises(StoreError):
            store.append("a", "", {}, who="Ada")


def test_a_head_file_that_lags_is_no_problem(original: Path, tmp_path: Path) -> None:
    """A kill between the commit and the file leaves it behind."""
    shutil.copytree(original, tmp_path, dirs_exist_ok=True)
    with open_store(f"sqlite:///{tmp_path}/store.sqlite", check=False) as store:
        third = list(store.events())[2]
        (tmp_path / "store.head").write_text(str(StoreHead(3, third.hash)))
        assert store.check() is None
        assert store.append("a", "", {}, who="Ada").seq == N + 1
    assert (tmp_path / "store.head").read_text().startswith(f"{N + 1} ")
