"""No text of a file makes a message of megabytes or a page of minutes."""

import time
from pathlib import Path

import pytest

from accept.units import unit_folder
from accept.units.unit_folder import UnitError
from checks.errors import RecordError
from specs.spec import parse
from specs.strict import SpecError

HEAD = 'serial = "A-1"\nkind = "apa"\n'
UNKNOWN = "\n".join(f"key{n} = 1" for n in range(40_000))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (HEAD + UNKNOWN, "has 40002 entries, at most 200 are read"),
        (HEAD + "[capacitance]\n" + UNKNOWN, "[capacitance] has 40000 entries, at most 200 are read"),
        (HEAD + f"[notes]\nstroke = {['x'] * 5000}", "[notes] has 5000 entries, at most 200 are read"),
        (HEAD + f'[notes]\nstroke = ["{"long " * 100_000}"]', "[notes] has 500011 letters, at most 100000 are read"),
        (HEAD + f'[origin]\ncondition = "{"x" * 900_000}"', "[origin] has 900015 letters, at most 100000 are read"),
        (f'serial = "{"x" * 900_000}"\nkind = "apa"', "[serial] has 900006 letters"),
        (HEAD + "[capacitance]\n" + "\n".join(f"{'k' * 900}{n} = 1" for n in range(100)), "and 90 more problems"),
        (f'serial = "A-1"\nkind = "{"x" * 99_000}"', "[kind] has 99000 letters in one text, at most 20000 are read"),
        (f'serial = "A-1"\nkind = "{"x" * 19_000}"', "more characters)"),
    ],
    ids=[
        "top level",
        "section",
        "notes",
        "long note",
        "long text",
        "serial",
        "long keys",
        "longest value",
        "long value",
    ],
)
def test_a_unit_file_is_refused_in_few_words(tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "unit.toml").write_text(content)
    began = time.process_time()
    with pytest.raises(UnitError) as refused:
        unit_folder.read(tmp_path)
    assert words in str(refused.value)
    assert len(str(refused.value)) < 10_000
    assert time.process_time() - began < 5.0


def test_a_spec_is_refused_in_few_words() -> None:
    with pytest.raises(SpecError) as refused:
        parse((UNKNOWN + "\n[checks.stroke]\n" + UNKNOWN).encode(), "own.toml")
    assert str(refused.value).count("\n") == 10
    assert "more problems" in str(refused.value)
    assert len(str(refused.value)) < 10_000


def test_every_error_is_of_bounded_length() -> None:
    assert len(str(RecordError("a.csv: column " + "x" * 1_000_000))) < 10_000
    assert str(RecordError("short")) == "short"


def test_what_a_workflow_can_write_is_read(tmp_path: Path) -> None:
    notes = [f"{'n' * 1990} {n}" for n in range(40)]
    (tmp_path / "unit.toml").write_text(HEAD + f"[notes]\nstroke = {notes}\n")
    assert list(unit_folder.read(tmp_path).notes["stroke"]) == notes
