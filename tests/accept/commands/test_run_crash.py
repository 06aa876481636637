"""A fault of the program in the guided workflow: loud, and with the exit code of a crash."""

import pytest

from accept.commands.bench.run import RunOptions, run
from accept.tui.app import BenchApp


def test_a_fault_of_the_program_is_no_verdict(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    def broken(self: BenchApp) -> None:
        raise RuntimeError("a fault")

    monkeypatch.setenv("TEXTUAL_DRIVER", "textual.drivers.headless_driver:HeadlessDriver")
    monkeypatch.setattr(BenchApp, "on_mount", broken)
    with pytest.raises(SystemExit) as ended:
        run(RunOptions())
    assert ended.value.code == 1
    said = capsys.readouterr().err
    assert "RuntimeError: a fault" in said
    assert "every saved entry is kept" in said
