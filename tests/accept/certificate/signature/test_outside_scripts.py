"""Scripts outside this repository enter the product by names of their own; each must be there."""

import importlib
import re
from pathlib import Path

import pytest

from accept.judging import judge_unit

SHARED = Path(__file__).parents[4] / "../shared"
IMPORT = re.compile(r"^\s*from ((?:accept|checks|hw|specs)[\w.]*) import (.+)$", re.MULTILINE)


@pytest.mark.needs_data
def test_scripts_of_red_teams_find_the_names_by_which_they_enter():
    scripts = [SHARED / "attacks.py", *SHARED.glob("attacks3/*.py")]
    entered = {
        (room, name.split("#")[0].split(" as ")[0].strip(" ()"))
        for script in scripts
        for room, names in IMPORT.findall(script.read_text())
        for name in names.split(",")
    }
    assert len(entered) >= 23  # so many when this was written: the pattern still reads them
    gone = []
    for room, name in sorted(entered):
        if not hasattr(importlib.import_module(room), name):
            try:
                importlib.import_module(f"{room}.{name}")
            except ImportError:
                gone.append(f"{room}.{name}")
    assert not gone


def test_a_unit_is_judged_by_the_name_of_the_room_too():
    assert judge_unit.__dict__["judge_unit"] is judge_unit
