"""Drivers are found by what lies in their folder."""

from pathlib import Path

import pytest

from hw import instruments

DRIVER = """
from hw.instruments.driver import Driver
DRIVER = Driver(("caliper", "calliper"), lambda *_: None)
"""


def test_a_file_with_a_driver_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "caliper_by_wire.py").write_text(DRIVER)
    (tmp_path / "no_driver.py").write_text("NOTHING = 1\n")
    monkeypatch.setattr(instruments, "__path__", [*instruments.__path__, str(tmp_path)])
    monkeypatch.setattr(instruments, "DRIVERS", {})
    instruments.find_drivers()
    assert instruments.DRIVERS["caliper"] is instruments.DRIVERS["calliper"]
    assert {"millimar", "lcr800", "scpi_lcr", "nd287", "nd281b", "ids3010", "manual"} <= set(instruments.DRIVERS)
