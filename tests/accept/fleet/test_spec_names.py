"""A spec that bears the name of one that comes with the program is told from it wherever a list names it."""

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from accept.cli.main import app
from specs.spec import builtin, listed_name, load
from tests.accept.units.units import GOOD, make_unit


def accept(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


@pytest.mark.parametrize("name", ["apa-basic", "apa"])
def test_a_spec_with_a_name_that_is_not_its_own_is_marked(name: str, tmp_path: Path) -> None:
    """`apa` is the spec of its product: a list leaves it out."""
    spec = tmp_path / "wide.toml"
    spec.write_text(load("apa-basic").text.replace('name = "apa-basic"', f'name = "{name}"').replace("304.0", "1.0"))
    unit = make_unit(tmp_path / "u", "A-1", GOOD.replace("373.2", "150.5"))
    done = accept("batch", unit, "--spec", spec, "--out", tmp_path / "out", "--no-certificates")
    assert done.exit_code == 0, done.output
    for words in (("list",), ("list", "--csv", "-"), ("history", "A-1"), ("store", "log")):
        done = accept(*words)
        assert done.exit_code == 0, done.output
        assert f"{name} (other content)" in " ".join(done.stdout.split()), words


@pytest.mark.parametrize("name", [*builtin()])
def test_the_program_s_own_is_not(name: str) -> None:
    assert listed_name(f"{name}@{load(name).sha256}") == name
    assert listed_name(name) == name
    assert listed_name(f"{name}@{'0' * 64}") == f"{name} (other content)"
    assert listed_name(f"mine@{'0' * 64}") == "mine"
    assert listed_name("") == ""
