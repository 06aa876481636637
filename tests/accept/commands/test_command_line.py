"""What every command has: `-h`, completion in three shells; and that options are declared once."""

import os
import subprocess
import sys
from dataclasses import fields, is_dataclass
from inspect import signature

import pytest
from typer.testing import CliRunner

from accept.cli.main import app
from accept.cli.options import spread
from accept.commands.bench.simulate_options import SimulateOptions
from tests.test_docs import command_names

SHELLS = {
    "bash": {"COMP_WORDS": "accept {}", "COMP_CWORD": "{n}"},
    "zsh": {"_TYPER_COMPLETE_ARGS": "accept {}"},
    "fish": {"_TYPER_COMPLETE_ARGS": "accept {}", "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
}


@pytest.mark.parametrize("command", ["accept", *command_names()])
def test_h_is_help(command: str) -> None:
    short, long = (CliRunner().invoke(app, [*command.split()[1:], flag]) for flag in ("-h", "--help"))
    assert short.exit_code == 0
    assert short.output == long.output
    assert "Usage" in short.output


@pytest.mark.parametrize("shell", SHELLS)
@pytest.mark.parametrize(
    ("typed", "offered"), [("mis", "misalign"), ("simulate un", "unit"), ("excite sweep --no", "--notch")]
)
def test_completion(shell: str, typed: str, offered: str) -> None:
    n = str(len(typed.split()))
    asked = {name: value.format(typed, n=n) for name, value in SHELLS[shell].items()}
    run = "import sys; sys.argv = ['accept']; from accept.cli.main import main; main()"
    env = os.environ | asked | {"_ACCEPT_COMPLETE": f"complete_{shell}"}
    done = subprocess.run([sys.executable, "-c", run], env=env, capture_output=True, text=True, check=False)
    assert offered in done.stdout, done.stderr


@pytest.mark.parametrize("shell", SHELLS)
def test_the_script_that_a_shell_sources(shell: str) -> None:
    run = "import sys; sys.argv = ['accept']; from accept.cli.main import main; main()"
    env = os.environ | {"_ACCEPT_COMPLETE": f"source_{shell}"}
    done = subprocess.run([sys.executable, "-c", run], env=env, capture_output=True, text=True, check=False)
    assert f"_ACCEPT_COMPLETE=complete_{shell}" in done.stdout


def test_a_group_of_options_stands_as_its_fields() -> None:
    """Names, defaults and order are those of the dataclass: said once."""

    def command(wanted: SimulateOptions) -> None:
        assert is_dataclass(wanted)

    seen = signature(spread(command)).parameters
    assert list(seen) == [f.name for f in fields(SimulateOptions)]
    assert all(seen[f.name].default is f.default for f in fields(SimulateOptions) if f.name != "out")
