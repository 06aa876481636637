"""The list that benches publish: append-only by Merkle proofs, and what it shows to who has no store."""

import json
import shutil
from pathlib import Path

import pytest

from accept.base.home import home
from accept.certificate import read_contents
from accept.certificate.trust import keys, merkle
from accept.certificate.trust.published_list import JUDGED, LEAST, VOIDED, Entry, ListError, entries_of
from accept.certificate.trust.published_list import read as read_lists
from accept.store import open_store
from accept.store.payloads import AttemptStarted
from tests.accept.certificate.verify.test_statements import accept, certified, forged, plainly, replaced, verified

# Of the reference implementation of [RFC6962]: these entries, and the roots over the first 0 to 8 of them.
ENTRIES = ["", "00", "10", "2021", "3031", "40414243", "5051525354555657", "606162636465666768696a6b6c6d6e6f"]
ROOTS = [
    "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
    "6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d",
    "fac54203e7cc696cf0dfcb42c92a1d9dbaf70ad9e621f4bd8d98662f00e3c125",
    "aeb6bcfe274b70a14fb067a5e5578264db0fa9b51af5e0ba159158f329e06e77",
    "d37ee418976dd95753c1c73862b9398fa2a2cf9b4ff0fdfe8b30cd95209614b7",
    "4e3bbb1f7b478dcfe71fb631631519a3bca12c9aefca1612bfce4c13a86264d4",
    "76e67dadbcdf1e10e1b74ddc608abd2f98dfb16fbce75277b5232a127f2087ef",
    "ddb89be403809e325750d3d263cd78929c2942b7942a34b77e122c9594a74c8c",
    "5dc9da79a70659a9ad559cb701ded9a2ab9d823aad2f4960cfe370eff4604328",
]
LEAVES = [merkle.leaf_hash(bytes.fromhex(entry)) for entry in ENTRIES]


def test_roots_are_those_of_the_reference() -> None:
    assert [merkle.root(LEAVES[:size]).hex() for size in range(9)] == ROOTS


def test_every_beginning_is_proven_and_no_rewritten_one() -> None:
    for size in range(1, 9):
        for earlier in range(1, size + 1):
            proof = merkle.consistency_proof(LEAVES[:size], earlier)
            first, second = bytes.fromhex(ROOTS[earlier]), bytes.fromhex(ROOTS[size])
            assert merkle.is_consistent(earlier, size, first, second, proof)
            rewritten = merkle.root([b"\1" * 32, *LEAVES[1:earlier]])
            assert not merkle.is_consistent(earlier, size, rewritten, second, proof)
    for wrong in (0, 9):
        with pytest.raises(IndexError):
            merkle.consistency_proof(LEAVES, wrong)


# --- what it shows away from the bench --------------------------------------------------------------------------------


@pytest.fixture
def office(tmp_path: Path) -> Path:
    """What somebody elsewhere has: the authority's certificate and its list of revoked keys."""
    keys.init(home(), "correct horse", "Test Technician", authority_passphrase="authority phrase")
    place = tmp_path / "office"
    place.mkdir()
    for name in ("ca.pem", "ca.crl.pem"):
        shutil.copy(keys.folder(home()) / name, place / name)
    return place


def elsewhere(monkeypatch: pytest.MonkeyPatch, office: Path, pdf: Path, *words: object):  # type: ignore[no-untyped-def]
    with monkeypatch.context() as patch:
        patch.setenv("ACCEPT_HOME", str(office / "home"))
        return verified(pdf, "--trust", office / "ca.pem", *words)


def test_replay_shows_up_away_from_the_bench(office: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = tmp_path / "list.json"
    first = certified(tmp_path, "A-1", serial="A-1").rename(tmp_path / "first.pdf")
    done = accept("store", "publish", log)
    assert done.exit_code == 0, done.output
    assert "A-1" not in log.read_text()
    done = elsewhere(monkeypatch, office, first, "--log", log, "--require", "current")
    assert plainly(done), done.output
    shutil.copy(log, tmp_path / "earlier.json")
    second = certified(tmp_path, "A-1", serial="A-1", stroke=265.5)
    done = elsewhere(monkeypatch, office, second, "--log", log)
    assert (done.exit_code, "published before it was signed" in done.stdout) == (4, True), done.output
    assert accept("store", "publish", log).exit_code == 0
    done = elsewhere(monkeypatch, office, first, "--log", log, "--log", tmp_path / "earlier.json")
    assert (done.exit_code, "knows a later attempt" in done.stdout) == (4, True), done.output
    assert plainly(elsewhere(monkeypatch, office, second, "--log", log, "--require", "current"))


def test_a_deleted_attempt_and_a_rolled_back_store_show_up(
    office: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bench's own technician measures until it is good, with an empty store each time."""
    log, kept = tmp_path / "list.json", tmp_path / "earlier.json"
    certified(tmp_path, "A-1", serial="A-1", stroke=265.5)
    assert accept("store", "publish", log).exit_code == 0
    shutil.copy(log, kept)
    for file in home().glob("store.*"):
        file.unlink()
    pdf = certified(tmp_path, "A-1", serial="A-1", stroke=366.1)
    assert plainly(elsewhere(monkeypatch, office, pdf))  # without the list nobody sees it
    refused = accept("store", "publish", log)
    assert (refused.exit_code, "its store does not hold" in refused.stderr) == (6, True)
    done = elsewhere(monkeypatch, office, pdf, "--log", log)
    assert done.exit_code == 4, done.output
    log.unlink()
    assert accept("store", "publish", log).exit_code == 0  # a new list, without the rejected attempt
    done = elsewhere(monkeypatch, office, pdf, "--log", log, "--log", kept)
    assert (done.exit_code, "was rewritten" in done.stderr) == (6, True), done.output


@pytest.mark.parametrize(
    ("started", "first_in", "numbers"),
    [(1, "B-1", [1, 2]), (2, "x/attempt-1", [1, 2]), (1, "x/attempt-1", [1, 1])],
    ids=["another folder in between", "another number", "judged twice in the workflow"],
)
def test_a_folder_with_the_name_of_an_attempt_hides_none_in_the_list(
    office: Path, tmp_path: Path, started: int, first_in: str, numbers: list[int]
) -> None:
    with open_store() as store:
        store.write(AttemptStarted(started, "apa", {}, "", {}), "B-1", who="Test Technician")
    certified(tmp_path, first_in, stroke=265.5)
    certified(tmp_path, "x/attempt-1")
    with open_store() as store:
        assert [entry.attempt for entry in entries_of(store.events()) if entry.what == JUDGED] == numbers


@pytest.mark.parametrize(
    "other",
    [None, {"time": "2026-01-01T00:00:00+00:00"}, {"certificate": "ab" * 32}],
    ids=["nothing", "another time", "another certificate"],
)
def test_what_it_replaces_is_that_of_the_list(
    office: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, other: dict[str, str] | None
) -> None:
    log = tmp_path / "list.json"
    certified(tmp_path, "A-1", serial="A-1", stroke=265.5)
    honest = certified(tmp_path, "A-1", serial="A-1", stroke=366.1)
    contents = read_contents(honest.read_bytes())
    stated = None if other is None else contents.provenance["replaces"] | other
    pdf = forged(tmp_path / "f.pdf", replaced(contents, replaces=stated))
    assert accept("store", "publish", log).exit_code == 0
    assert plainly(elsewhere(monkeypatch, office, honest, "--log", log))
    done = elsewhere(monkeypatch, office, pdf, "--log", log)
    assert (done.exit_code, "provenance.replaces" in done.stdout) == (4, True), done.output


def test_a_changed_list_and_a_foreign_one_are_refused(
    office: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = tmp_path / "list.json"
    pdf = certified(tmp_path, "A-1", serial="A-1")
    assert accept("store", "publish", log).exit_code == 0
    whole = json.loads(log.read_text())
    entries = whole["lists"][0]["entries"]
    changes = {
        "left out": entries[:-1],
        "changed": [[*entries[0][:-1], entries[0][-1] + 1], *entries[1:]],
        "of another form": [entry[:-1] for entry in entries],
    }
    for words, changed in changes.items():
        log.write_text(json.dumps({**whole, "lists": [{**whole["lists"][0], "entries": changed}]}))
        assert elsewhere(monkeypatch, office, pdf, "--log", log).exit_code == 6, words
    log.write_text("[" * 100_000)
    assert elsewhere(monkeypatch, office, pdf, "--log", log).exit_code == 6
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "foreign"))
    keys.init(tmp_path / "foreign", "correct horse", "Test Technician", authority_passphrase="authority phrase")
    certified(tmp_path, "F-1", serial="F-1")
    log.unlink()
    assert accept("store", "publish", log).exit_code == 0
    done = elsewhere(monkeypatch, office, pdf, "--log", log)
    assert (done.exit_code, "no bench of a trusted authority" in done.stderr) == (6, True), done.output


@pytest.mark.parametrize("filling", ["[],", "1,", "{},"])
def test_a_list_of_many_small_values_is_not_parsed(
    filling: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """36 MB of them fill a gigabyte."""
    path = tmp_path / "list.json"
    path.write_text('{"format": 1, "lists": [' + filling * 10_000 + "0]}")
    monkeypatch.setattr("accept.certificate.trust.published_list.json", None)
    with pytest.raises(ListError, match="more than any list of a bench"):
        read_lists(path)


def test_the_values_of_a_list_are_few(tmp_path: Path) -> None:
    """Beside what is allowed, in its shortest form."""
    entry = Entry(1, "2026-05-04T10:00:00+00:00", VOIDED, "a" * 64, "b" * 64, "c" * 64)
    text = json.dumps([list(vars(entry).values())] * 1000, separators=(",", ":"))
    assert sum(map(text.count, "[{,")) * LEAST < len(text)
