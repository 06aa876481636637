"""No file of a stranger stops or fills the machine that verifies it: a line, an exit code, seconds, some 100 MB."""

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from accept.base.exit_codes import Exit
from accept.certificate import InvalidCertificate, read_contents
from accept.certificate.contents.content import ContentError, read
from accept.certificate.trust import keys
from accept.certificate.verify.rejudge import read_unit
from accept.certificate.verify.structure import check_structure
from tests.accept.certificate.verify.hostile_files import HAND_MADE, mutated, signed_by
from tests.accept.certificate.verify.verify_help import Bench

MOST_S, MOST_MB = 10.0, 500.0  # 6 s, and 150 MB beside the file (at most 100 MB, twice) and the program (150 MB)
# Of those that take all the time or memory that reading has, one beside the heavy lane, which has every file.
WORST = ["index of milliards", "deflated table", "millions of numbers", "nested arrays"]


def verified(folder: Path, bench: Bench, files: Mapping[str, Callable[[], bytes]]) -> list[dict[str, Any]]:
    """What verifying each file took, in another process."""
    (folder / "files").mkdir()
    for name, content in files.items():
        (folder / "files" / f"{name}.pdf").write_bytes(content())
    (folder / "ca.pem").write_bytes(bench.technician.ca.public_bytes(keys.Encoding.PEM))
    module = "tests.accept.certificate.verify.hostile_files"
    command = [sys.executable, "-m", module, str(folder / "files"), str(folder / "ca.pem")]
    done = subprocess.run(command, cwd=Path(__file__).parents[4], capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def check(told: list[dict[str, Any]]) -> None:
    for each in told:
        assert (each["exit"], each["raised"]) == (Exit.REJECTED, ""), each
        assert each["out"].startswith("NOT VALID: "), each
        assert each["out"].count("\n") == 1, each
        assert each["seconds"] < MOST_S, each
        assert each["MB"] < MOST_MB, each


@pytest.mark.slow
def test_the_worst_files_end_soon(bench: Bench, tmp_path: Path) -> None:
    some = {f"mutated {seed}": lambda seed=seed: mutated(bench.countersigned, seed) for seed in range(2)}
    told = verified(tmp_path, bench, {name: HAND_MADE[name] for name in WORST} | some)
    assert len(told) == len(WORST) + 2
    check(told)


@pytest.mark.soak
def test_every_hostile_file_ends_soon(bench: Bench, tmp_path: Path) -> None:
    pages = (bench.signed, bench.countersigned)
    many = {f"mutated {seed}": lambda seed=seed: mutated(pages[seed % 2], seed) for seed in range(500)}
    told = verified(tmp_path, bench, {**HAND_MADE, **many})
    assert len(told) == len(HAND_MADE) + 500
    check(told)


def test_what_the_program_writes_is_let_in(bench: Bench) -> None:
    before = Path(__file__).parent / "before" / "APA-02.pdf"
    for pdf in (bench.unsigned, bench.signed, bench.countersigned, before.read_bytes()):
        check_structure(pdf)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("index of milliards", "stands no plain table of objects"),
        ("hybrid table", "no trailer of the keys that a certificate has"),
        ("escaped key", "no trailer of the keys that a certificate has"),
        ("table of milliards", "lists 2000000000 objects from 0, expected 1 to 10000"),
        ("first of milliards", "lists 1 objects from 2000000000"),
        ("parts of no rows", "lists 0 objects from 0"),
        ("rows as promised", "lists 5000000 objects"),
        ("table of itself", "is followed by an earlier one at byte"),
        ("two earlier tables", "has a key twice"),
        ("nine revisions", "more than 8 revisions"),
    ],
)
def test_tables_are_refused_before_any_parser(name: str, words: str) -> None:
    with pytest.raises(InvalidCertificate, match=words):
        check_structure(HAND_MADE[name]())


def test_attachments_of_an_unknown_file_are_read_through_the_same_door() -> None:
    with pytest.raises(InvalidCertificate, match="stands no plain table"):
        read_contents(HAND_MADE["index of milliards"]())
    with pytest.raises(InvalidCertificate):
        read_contents(signed_by(b"<00>"))


def test_a_unit_file_longer_than_any_is_not_parsed() -> None:
    with pytest.raises(ValueError, match="at most 1000000 are read"):
        read_unit(b"#" * 1_000_001)


@pytest.mark.parametrize(
    ("key", "entry", "words"),
    [
        ("notes", ["stroke: x"] * 20_000, r"\[notes\] has 20000 entries, at most 2000 are read"),
        ("notes", ["x" * 2_000_000], r"\[notes\] has 2000005 letters, at most 1000000 are read"),
        ("notes", ["x " * 10_001], r"\[notes\] has 20002 letters in one text, at most 20000 are read"),
        ("gap", {"verdict": "refused", "reason": "x " * 500_000}, r"\[gap\] has 1000000 letters in one text"),
        ("parts", {f"p{n}": f"Q-{n}" for n in range(30_000)}, r"\[parts\] has 30000 entries"),
        ("copies", [{"sample": "stroke/a", "with": [{"serial": "Q-1"}] * 20_000}], r"\[copies\] has 20000 entries"),
    ],
    ids=["many notes", "long notes", "a long note", "a long reason", "parts", "copies"],
)
def test_a_result_that_would_take_minutes_is_neither_read_nor_signed(
    bench: Bench, key: str, entry: Any, words: str
) -> None:
    """Who holds a technician's key could sign one: 20,000 copies took 69 s, a reason of a million letters minutes."""
    contents = read_contents(bench.signed)
    huge = replace(contents, result={**contents.result, key: entry})
    with pytest.raises(ContentError, match=words):
        read(huge.attachments())


def test_what_a_bench_states_is_bounded_too(bench: Bench) -> None:
    contents = read_contents(bench.signed)
    huge = replace(contents, provenance={**contents.provenance, "laboratory": {"name": "x " * 10_001}})
    with pytest.raises(ContentError, match=r"\[provenance\] has 20002 letters in one text"):
        read(huge.attachments())
    long = replace(contents, provenance={**contents.provenance, "crl": "x" * 30_000})
    assert read(long.attachments()).provenance["crl"]  # a long list of revoked keys is on no page
