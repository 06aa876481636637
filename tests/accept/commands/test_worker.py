"""`accept worker`: listens on this machine alone unless it is told otherwise."""

import subprocess

import pytest
from typer.testing import CliRunner

from accept.cli.main import app


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The commands that would be started."""
    pytest.importorskip("distributed")
    commands: list[list[str]] = []

    def run(command: list[str], **_: object) -> subprocess.CompletedProcess[bytes]:
        commands.append(command)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(subprocess, "run", run)
    return commands


@pytest.mark.parametrize(
    ("words", "host"),
    [(("tcp://127.0.0.1:8786",), "127.0.0.1"), (("tcp://10.0.0.5:8786", "--host", "10.0.0.6"), "10.0.0.6")],
)
def test_its_host_is_this_machine_unless_told_otherwise(
    started: list[list[str]], words: tuple[str, ...], host: str
) -> None:
    assert CliRunner().invoke(app, ["worker", *words, "--workers", "2"]).exit_code == 0
    (command,) = started
    assert command[command.index("--host") + 1] == host
    assert command[command.index("--nworkers") + 1] == "2"


def test_a_scheduler_elsewhere_could_not_reach_it(started: list[list[str]]) -> None:
    done = CliRunner().invoke(app, ["worker", "tcp://10.0.0.5:8786"])
    assert done.exit_code == 6
    assert "--host" in done.output
    assert started == []
