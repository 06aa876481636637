"""JSON that an editor wrote, nested beyond any parser or of other types, ends in a sentence."""

from pathlib import Path

import pytest

from accept.base.home import home
from tests.shared.command_line import accept

DEEP = "[" * 100_000


@pytest.fixture(autouse=True)
def store() -> None:
    unit = home() / "A-1"
    unit.mkdir(parents=True)
    (unit / "unit.toml").write_text('serial = "A-1"\nkind = "apa"\n[stroke]\nstroke_um = 365.5\n')
    assert accept("batch", unit, "--out", home() / "o", "--spec", "apa-basic", "--no-certificates").exit_code == 4
    assert accept("store", "backup", home() / "kept.sqlite").exit_code == 0


@pytest.mark.parametrize("content", [DEEP, "[1]", "{", '{"seq": 1e400, "hash": "a"}', '{"record": 3}'])
def test_it_is_refused_where_it_is_asked_for(tmp_path: Path, content: str) -> None:
    (tmp_path / "a.json").write_text(content)
    (home() / "kept.sqlite.head.json").write_text(content)
    for asked in (
        ("store", "check", "--head", tmp_path / "a.json"),
        ("store", "restore", home() / "kept.sqlite"),
        ("hw", "transcript", tmp_path / "a.json"),
        ("frf", tmp_path / "a.json"),
    ):
        assert accept(*asked).exit_code == 6


@pytest.mark.parametrize("content", [DEEP, "[1]", "null"])
def test_a_seal_or_results_that_are_unusable_are_made_again(content: str) -> None:
    (home() / "store.seal").write_text(content)
    (home() / "o" / "results.json").write_text(content)
    assert accept("list").exit_code == 0
    assert accept("batch", home() / "A-1", "--out", home() / "o", "--no-certificates").exit_code == 4
