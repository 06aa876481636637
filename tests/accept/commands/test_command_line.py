"""What every command has: `-h`, completion in three shells; and that options are declared once."""

import io
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from inspect import signature
from pathlib import Path

import pytest
from rich.table import Table
from typer.testing import CliRunner

from accept.base.console import PlainConsole
from accept.cli.lazy_group import Command, Group, command_of
from accept.cli.main import COMMANDS, USERS, app
from accept.commands.bench.simulate import SimulateOptions
from accept.judging import load_spec
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


@pytest.mark.parametrize(
    ("shell", "typed", "offered"),
    [
        ("bash", "mis", "misalign"),
        ("bash", "simulate un", "unit"),
        ("zsh", "excite sweep --no", "--notch"),
        ("fish", "simulate un", "unit"),
    ],
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
    if shutil.which(shell):  # the shell itself reads it
        read = subprocess.run([shell, "-n", "/dev/stdin"], input=done.stdout, capture_output=True, text=True)
        assert read.returncode == 0, read.stderr


def leaves(table: Mapping[str, Command | Group] = COMMANDS, path: str = "") -> Iterator[tuple[str, Command]]:
    for name, entry in table.items():
        if isinstance(entry, Group):
            yield from leaves(entry.commands, f"{path}{name} ")
        else:
            yield path + name, entry


@pytest.mark.parametrize(("name", "entry"), [pytest.param(*leaf, id=leaf[0]) for leaf in leaves()])
def test_the_table_says_what_the_command_says(name: str, entry: Command) -> None:
    module, _, function = entry.place.partition(":")
    said = " ".join(getattr(import_module(f"accept.commands.{module}"), function).__doc__.split())
    assert entry.about == re.match(r".*?\.(?= |$)", said)[0]


def test_the_help_lists_every_command_once_under_its_user() -> None:
    listed = CliRunner().invoke(app, ["--help"]).stdout.split("Show this message and exit.")[1]
    assert [line[:-1] for line in listed.splitlines() if line.endswith(":")] == list(USERS)
    assert [line.split()[0] for line in listed.splitlines() if line.startswith("  ")] == list(COMMANDS)
    assert len(COMMANDS) == sum(map(len, USERS.values()))  # none in two


@pytest.mark.parametrize("asked", [["--help"], ["model", "--help"], ["nonsense"]])
def test_no_command_is_imported_for_the_list_of_commands(asked: list[str]) -> None:
    run = f"import sys; sys.argv = ['accept', *{asked}]; from accept.cli.main import main\ntry:\n    main()\nfinally:\n"
    run += "    print([m for m in sys.modules if m.startswith('accept.commands')])"
    done = subprocess.run([sys.executable, "-c", run], capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("options", [[], ["APA-01", "--operator", "Ann"]])
def test_the_first_screen_waits_for_nothing_that_the_bench_needs(options: list[str]) -> None:
    run = f"import sys; sys.argv = ['accept', 'run', *{options}]\nimport accept.commands.bench.run as command\n"
    run += "command.show = lambda wanted: print(wanted.unit, wanted.operator, *sys.modules) or 0\n"
    run += "from accept.cli.main import main; main()"
    named = {**os.environ, "ACCEPT_OPERATOR": "Bob"}
    done = subprocess.run([sys.executable, "-c", run], capture_output=True, text=True, check=True, env=named)
    unit, operator, *modules = done.stdout.split()
    assert [unit, operator] == (["APA-01", "Ann"] if options else ["None", "Bob"])
    assert not {"numpy", "pydantic", "multiprocessing", "sqlalchemy", "accept.workflow.bench"} & set(modules)


def test_a_misspelt_command_is_answered_with_the_one_that_was_meant() -> None:
    done = CliRunner().invoke(app, ["misaling"])
    assert done.exit_code == 2
    assert "'misalign'" in done.output


def test_a_copy_of_a_spec_is_one_to_change(tmp_path: Path) -> None:
    copied = CliRunner().invoke(app, ["spec", "copy", "apa-basic", str(tmp_path / "mine.toml")])
    assert copied.exit_code == 0, copied.output
    spec = load_spec(str(tmp_path / "mine.toml"))
    assert spec.name == "mine"
    assert spec.checks == load_spec("apa-basic").checks


def test_a_group_of_options_stands_as_its_fields() -> None:
    """Names, defaults and order are those of the dataclass: said once."""

    def command(wanted: SimulateOptions) -> int:
        assert is_dataclass(wanted)
        return 0

    seen = signature(command_of(command)).parameters
    assert list(seen) == [f.name for f in fields(SimulateOptions)]
    assert all(seen[f.name].default is f.default for f in fields(SimulateOptions) if f.name != "out")


@pytest.mark.parametrize("columns", [30, 80])
def test_a_table_on_a_narrow_terminal_loses_no_letter(columns: int) -> None:
    out = io.StringIO()
    words = ["sensor_highpass_Hz,actuator_uF", "2026-11-22", "incomplete"]
    table = Table("causes", "unit_verdict", "quantity")
    table.add_row(*words)
    PlainConsole(file=out, width=columns).print(table)
    shown = out.getvalue()
    assert "…" not in shown
    assert max(map(len, shown.splitlines())) <= columns
    for n in range(3):  # every cell, put together again
        parts = [re.split("[│┃]", line)[1 + n].strip() for line in shown.splitlines() if line.startswith("│")]
        assert "".join(parts) == words[n]


def test_a_pipe_has_no_width() -> None:
    """80 columns would cut what a script looks for."""
    run = "from accept.cli.main import main; import sys; sys.argv = ['accept', 'spec', 'show', 'strut']; main()"
    env = os.environ | {"COLUMNS": "40"}
    done = subprocess.run([sys.executable, "-c", run], env=env, capture_output=True, text=True, check=True)
    rows = [line for line in done.stdout.splitlines() if line.startswith("│")]
    assert rows
    assert all(line.count("│") == 6 and line.split("│")[2].strip() for line in rows)  # a row a limit, nothing wrapped
    assert any("effect on the 200 Hz mode studied from 100 um on" in line for line in rows)
    assert "…" not in done.stdout
