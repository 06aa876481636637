"""The printer of all commands: lines and tables on stdout, remarks on stderr, files in their places, the exit code."""

import json
from pathlib import Path

import pytest

from accept.base.exit_codes import Exit
from accept.commands.answer import Answer, File, Remark, command, picture, print_answer, refusal, table
from accept.commands.fleet.options import Outputs
from specs.errors import AcceptError


def test_each_part_goes_to_its_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = table(("name", "value"), [("a", "1"), ("b\nc", "2")])
    exit = print_answer(
        Answer("a line", Remark("a remark"), Remark(""), None, rows, File(tmp_path / "new" / "a.json", {"a": [1]}),
               File(tmp_path / "b.csv", lambda: b"x\n1\n", announced=True), File(None, lambda: 1 // 0),
               exit=Exit.INCOMPLETE)
    )  # fmt: skip
    out, err = capsys.readouterr()
    assert exit is Exit.INCOMPLETE
    assert out.startswith("a line\n")
    assert "b\\nc" in out
    assert err == f"a remark\n{tmp_path / 'b.csv'}: written\n"
    assert (tmp_path / "new" / "a.json").read_text() == '{\n "a": [\n  1\n ]\n}\n'
    assert (tmp_path / "b.csv").read_bytes() == b"x\n1\n"


def test_a_document_on_stdout_takes_the_place_of_lines_and_tables(capsys: pytest.CaptureFixture[str]) -> None:
    rows = table(("name",), [("a",)])
    print_answer(Answer("a line", File(Path("-"), {"a": 1}, announced=True), rows, Remark("a remark")))
    out, err = capsys.readouterr()
    assert json.loads(out) == {"a": 1}
    assert err == "a remark\n"


def test_an_error_comes_after_what_is_known(capsys: pytest.CaptureFixture[str]) -> None:
    @command
    def ask() -> Answer:
        return Answer("known", error=AcceptError("the rest is missing"))

    assert ask() is Exit.BAD_INPUT
    assert capsys.readouterr() == ("known\n", "accept: the rest is missing\n")


def test_places_are_checked_before_the_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In options by themselves and in groups of options; a picture by its format, too."""
    done = []
    evidence = tmp_path / "rows.csv"
    evidence.write_text("t,Va\n")
    (tmp_path / "unit.toml").write_text('[frf]\nlow = "rows.csv"\n')

    @command
    def work(outputs: Outputs, plot: Path | None = None) -> Answer:
        done.append(outputs)
        return Answer(picture(plot, list), File(outputs.csv, b""))

    assert work(Outputs(csv=evidence)) is Exit.BAD_INPUT
    assert work(Outputs(json=tmp_path)) is Exit.BAD_INPUT
    assert work(Outputs(), plot=tmp_path / "a.gif") is Exit.BAD_INPUT
    assert not done
    err = capsys.readouterr().err.splitlines()
    assert ["is evidence" in err[0], "is a folder" in err[1], "ends in .pdf" in err[2]] == [True] * 3
    assert work(Outputs(csv=tmp_path / "new.csv")) is Exit.ACCEPTED
    assert evidence.read_text() == "t,Va\n"


def test_a_refusal_is_one_line_with_its_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert print_answer(refusal("no such thing")) is Exit.BAD_INPUT
    assert print_answer(refusal(AcceptError("no reply"), Exit.INSTRUMENT)) is Exit.INSTRUMENT
    assert capsys.readouterr() == ("", "accept: no such thing\naccept: no reply\n")
