"""Units that name a part are found by an index. What it must give is read out of all payloads here, without it."""

import json
import signal
import sqlite3
import tracemalloc
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from random import Random

import pytest

from accept.base.documents.results import UnitHeader
from accept.judging.reservations.parts import part_doubts
from accept.store import NewEvent, Store, StoreError, indexes, open_store
from accept.store.backup import back_up, restore
from tests.accept.batch.killing import Points, fork

PLAIN = ["X-1", "x-1", "X-10", "X-11", "Y-1", "y-1", "1", "S-3"]
ODD = ["", 'X"-1', "X\\-1", "X-1 ", "µ-1", "\ud800", "a\0b", "%", "X_1"]
ROLES = ["apa", "joint_top", "joint_bottom", "encoder"]


def judgement(serial: str, parts: object, verdict: str = "accepted", **more: object) -> NewEvent:
    result = {"serial": serial, "kind": "strut", "verdict": verdict, "parts": parts, "notes": ["beside X-1"]}
    about = {"path": f"/units/{serial}", "inputs": {}, "spec_sha256": "", "code_sha256": ""}
    return NewEvent("unit_judged", serial, {**about, "result": result | {"findings": []}, **more})


def drawn(seed: int, count: int = 200, broken: bool = True) -> list[NewEvent]:
    """Judgements of a few units again and again, with other parts each time, and events of other kinds and programs."""
    rng, events = Random(seed), []
    for _ in range(count):
        serial = rng.choice([*(f"S-{n}" for n in range(20)), "X-1", "Y-1", "X-10"])
        parts = {role: rng.choice(rng.choice([PLAIN, ODD])) for role in rng.sample(ROLES, rng.randrange(5))}
        other: list[NewEvent] = [
            NewEvent("attempt_started", serial, {"parts": {"apa": "X-11"}}),
        ]
        if broken:  # what no version of this program wrote: the index takes what it can of them
            spare, number = {"spare": {"parts": {"apa": "X-1"}}}, {"parts": {"apa": 7, "encoder": "Y-1"}}
            other += [NewEvent("unit_judged", serial, {"result": {"verdict": "rejected"} | r}) for r in (spare, number)]
        verdict = rng.choice(["accepted", "rejected"])
        events.append(
            rng.choice(other) if rng.random() < 0.2 else judgement(serial, parts, verdict, spare={"parts": {}})
        )
    return events


def url_of(folder: Path) -> str:
    return f"sqlite:///{folder / 'store.sqlite'}"


def filled(folder: Path, events: list[NewEvent]) -> str:
    with open_store(url_of(folder)) as store:
        for start in range(0, len(events), 7):
            store.append_many(events[start : start + 7], who="Ada")
    return url_of(folder)


def payloads(folder: Path) -> list[tuple[str, str, dict[str, object]]]:
    with closing(sqlite3.connect(folder / "store.sqlite")) as raw:
        rows = raw.execute("SELECT what, subject, payload FROM events ORDER BY seq").fetchall()
    return [(what, subject, json.loads(payload)) for what, subject, payload in rows]


def named_by_all(folder: Path) -> dict[str, list[str]]:
    """Part in lower case -> units of which any judgement names it."""
    found: dict[str, set[str]] = {}
    for what, subject, payload in payloads(folder):
        result = payload.get("result")
        named = result.get("parts", {}) if what == "unit_judged" and isinstance(result, dict) else {}
        for part in filter(lambda p: isinstance(p, str), named.values()):
            found.setdefault(part.lower(), set()).add(subject)
    return {part: sorted(units) for part, units in found.items()}


def named_by_last(folder: Path) -> dict[str, set[str]]:
    """Unit -> parts in lower case of its last judgement."""
    last = {subject: payload["result"] for what, subject, payload in payloads(folder) if what == "unit_judged"}
    return {unit: {p.lower() for p in r.get("parts", {}).values() if isinstance(p, str)} for unit, r in last.items()}


def in_raw(folder: Path, *statements: str) -> None:
    with closing(sqlite3.connect(folder / "store.sqlite")) as raw, raw:
        for statement in statements:
            raw.execute(statement)


def before_the_index(folder: Path) -> None:
    """As an accept that knew no index of parts left it."""
    in_raw(folder, "DROP TABLE parts", "UPDATE head SET store_schema = 1")


def holds_and_answers(folder: Path, truth: dict[str, list[str]]) -> None:
    with open_store(url_of(folder)) as store:
        assert store.check() is None
        for part in [*PLAIN, *ODD]:
            assert store.naming(part) == truth.get(part.lower(), []), part


@pytest.mark.parametrize("seed", range(3))
def test_every_unit_that_names_a_part_is_found(tmp_path: Path, seed: int) -> None:
    """Each that a scan of all payloads finds, and no other: any text may be a part; the same text elsewhere is none."""
    filled(tmp_path, drawn(seed))
    truth = named_by_all(tmp_path)
    assert len(truth) == len({part.lower() for part in [*PLAIN, *ODD]})  # every one of them stands somewhere
    holds_and_answers(tmp_path, truth)
    whole = tmp_path / "whole"
    whole.mkdir()
    url = filled(whole, drawn(seed, broken=False))
    last = named_by_last(whole)
    with open_store(url) as store:
        for part in ("X-1", "Y-1", "X-10"):  # the store knows these as units
            said = part_doubts(store, UnitHeader(serial="new", kind="strut", parts={"apa": part}))
            others = sorted(unit for unit, parts in last.items() if part.lower() in parts)
            assert [words for words in said if words.startswith(f"apa {part} stands in")] == [
                f"apa {part} stands in {o} too" for o in others
            ]


@pytest.mark.parametrize(
    "earlier",
    [
        ("DROP TABLE parts", "UPDATE head SET store_schema = 1"),
        ("DROP TABLE parts", "DROP TABLE samples", "DROP INDEX events_by_look", "UPDATE head SET store_schema = 1"),
        ("DROP TABLE parts",),
        ("DELETE FROM parts", "UPDATE head SET store_schema = 1"),
    ],
)
def test_a_store_from_before_the_index_is_filled_once(
    tmp_path: Path, earlier: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(indexes, "AT_ONCE", 11)  # several pages
    filled(tmp_path, drawn(3))
    truth = named_by_all(tmp_path)
    in_raw(tmp_path, *earlier)
    holds_and_answers(tmp_path, truth)
    with closing(sqlite3.connect(tmp_path / "store.sqlite")) as raw:
        assert raw.execute("SELECT store_schema FROM head").fetchone() == (2,)  # an accept from before refuses it
    monkeypatch.setattr(indexes, "build", None)  # not again
    holds_and_answers(tmp_path, truth)


def open_and_close(url: str, points: Points) -> None:
    points.install()
    open_store(url).close()
    (Path(url[10:]).parent / "points").write_text(str(points.passed))


def opened(folder: Path, kill_at: int | None) -> int | None:
    process = fork.Process(target=open_and_close, args=(url_of(folder), Points(kill_at)))
    process.start()
    process.join(60)
    return process.exitcode


def test_a_filling_that_is_killed_is_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At points between the first statement and the last one: the index is there whole, or not at all."""
    monkeypatch.setattr(indexes, "AT_ONCE", 30)
    whole = tmp_path / "whole"
    whole.mkdir()
    filled(whole, drawn(4, 100))
    truth = named_by_all(whole)
    before_the_index(whole)
    content = (whole / "store.sqlite").read_bytes()
    assert opened(whole, None) == 0
    total = int((whole / "points").read_text())
    halves = []
    for point in range(1, total, 8):
        folder = tmp_path / str(point)
        folder.mkdir()
        (folder / "store.sqlite").write_bytes(content)
        (folder / "store.head").write_bytes((whole / "store.head").read_bytes())
        assert opened(folder, point) == -signal.SIGKILL
        with closing(sqlite3.connect(folder / "store.sqlite")) as raw:
            (schema,) = raw.execute("SELECT store_schema FROM head").fetchone()
            tables = raw.execute("SELECT count(*) FROM sqlite_master WHERE name = 'parts'").fetchone()
        halves.append((schema, *tables))
        holds_and_answers(folder, truth)
    assert set(halves) == {(1, 0), (2, 1)}
    assert halves.count((1, 0)) > 3


def test_two_programs_open_a_store_from_before(tmp_path: Path) -> None:
    filled(tmp_path, drawn(5))
    truth = named_by_all(tmp_path)
    before_the_index(tmp_path)
    both = [fork.Process(target=open_and_close, args=(url_of(tmp_path), Points(None))) for _ in range(2)]
    for process in both:
        process.start()
    for process in both:
        process.join(60)
    assert [process.exitcode for process in both] == [0, 0]
    holds_and_answers(tmp_path, truth)


def test_the_filling_reads_page_by_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four times the judgements take no more memory: a page of ten of 20 kB and its copies, not all of them."""
    monkeypatch.setattr(indexes, "AT_ONCE", 10)
    peaks = []
    for count in (50, 200):
        folder = tmp_path / str(count)
        folder.mkdir()
        many = [judgement(f"S-{n}", {"apa": f"A-{n}"}, text=f"{n}" * 7000) for n in range(count)]
        with open_store(filled(folder, many)) as store, store.engine.begin() as connection:
            tracemalloc.start()
            indexes.build(connection)
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0] < 2e6


@pytest.mark.parametrize(
    "statement",
    [
        "DELETE FROM parts WHERE seq = (SELECT max(seq) FROM parts)",
        "DELETE FROM parts WHERE key = (SELECT min(key) FROM parts)",
        "DELETE FROM parts",
        "INSERT INTO parts VALUES (7, 7)",
        "INSERT INTO parts VALUES (7, 100000)",
        "INSERT INTO parts VALUES ('x', 'y')",
        "INSERT INTO samples VALUES ('x', 'y')",
        "UPDATE parts SET key = key + 1 WHERE seq = (SELECT min(seq) FROM parts)",
        "UPDATE parts SET seq = seq + 1 WHERE seq = (SELECT max(seq) FROM parts)",
        "UPDATE parts SET key = x'00' WHERE key = (SELECT max(key) FROM parts WHERE seq = 2) AND seq = 2",
    ],
)
def test_an_index_that_was_changed_is_found(tmp_path: Path, statement: str) -> None:
    """A part that the index has lost would be built in twice: nothing in such a store is believed."""
    index = "samples" if "samples" in statement else "parts"
    url = filled(tmp_path, [judgement("S-1", {"apa": "X-1"})] * 2 + drawn(6, 60))
    in_raw(tmp_path, statement)
    with pytest.raises(StoreError, match=f"the index of {index} is not that of event"):
        open_store(url)
    with open_store(url, check=False) as store:
        problem = store.check()
    assert problem is not None
    assert f"the index of {index} is not that of event" in problem.words


def altered(store: Store) -> None:
    store.append_many([judgement("S-99", {"apa": "X-1"})], who="Ada")


@pytest.mark.parametrize("prepare", [before_the_index, lambda folder: None], ids=["backup from before", "backup"])
def test_a_backup_and_what_is_restored_of_it_find_the_same(tmp_path: Path, prepare: Callable[[Path], None]) -> None:
    bench, kept = tmp_path / "bench", tmp_path / "kept"
    bench.mkdir()
    kept.mkdir()
    filled(bench, drawn(7))
    truth = named_by_all(bench)
    with open_store(url_of(bench)) as store:
        back_up(store, kept / "store.sqlite")
        altered(store)
    prepare(kept)
    in_raw(bench, "DELETE FROM parts")
    content = (kept / "store.sqlite").read_bytes()
    restore(kept / "store.sqlite", bench / "store.sqlite")
    assert (kept / "store.sqlite").read_bytes() == content  # kept as it was, whatever accept wrote it
    (kept / "store.head").unlink(missing_ok=True)
    for folder in (kept, bench):
        with open_store(url_of(folder), check=False) as store:
            assert {part: store.naming(part) for part in truth} == truth
    holds_and_answers(bench, truth)


def test_a_store_that_cannot_be_written_is_read_or_says_what_to_do(tmp_path: Path) -> None:
    filled(tmp_path, drawn(8))
    truth = named_by_all(tmp_path)
    only_read = f"sqlite:///file:{tmp_path}/store.sqlite?mode=ro&uri=true"
    with open_store(only_read) as store:
        assert {part: store.naming(part) for part in truth} == truth
    before_the_index(tmp_path)
    with pytest.raises(StoreError, match=r"store\.sqlite.*of an earlier accept: cannot be written.*make it writable"):
        open_store(only_read)
    holds_and_answers(tmp_path, truth)
    with open_store(only_read) as store:
        assert {part: store.naming(part) for part in truth} == truth


def test_an_event_that_was_altered_is_named_also_where_the_index_is_to_be_made(tmp_path: Path) -> None:
    url = filled(tmp_path, [judgement("S-1", {"apa": "X-1"}), *drawn(9, 60)])
    in_raw(tmp_path, "DROP TRIGGER events_no_update", "UPDATE events SET payload = x'00ff' WHERE seq = 1")
    before_the_index(tmp_path)
    with pytest.raises(StoreError, match=r"event 1 .*altered"):
        open_store(url)


def test_a_database_that_is_no_store_is_no_backup(tmp_path: Path) -> None:
    (tmp_path / "bench").mkdir()
    filled(tmp_path / "bench", drawn(10, 20))
    with closing(sqlite3.connect(tmp_path / "b.sqlite")) as raw, raw:
        raw.execute("CREATE TABLE other (x)")
    with pytest.raises(StoreError, match=r"b\.sqlite.*no such table"):
        restore(tmp_path / "b.sqlite", tmp_path / "bench" / "store.sqlite")
    holds_and_answers(tmp_path / "bench", named_by_all(tmp_path / "bench"))
