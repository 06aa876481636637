"""Two specs or two revisions of one: every limit, setting and source that differs, and nothing else."""

import json
from pathlib import Path

import pytest

from specs.spec import differences, load, parse
from tests.shared.command_line import accept

ONE = """
name = "lab"
kind = "apa"
title = "Lab"
[checks.capacitance.limits.sensor_uF]
lower = 4.4
upper = 5.5
unit = "uF"
rule = "guarded"
source = "drawing A"
[checks.stroke]
settings = { stroke_max_um = 456.0 }
[checks.stroke.limits.stroke_um]
lower = 304.0
unit = "um"
rule = "guarded"
source = "drawing A"
"""
TWO = (
    ONE.replace("lower = 304.0", "lower = 345.0").replace("456.0", "460.0").replace("upper = 5.5\n", "")
    + """
[checks.stiffness.limits.k_closed_N_per_um]
upper = 1.98
unit = "N/um"
rule = "simple"
source = "drawing B"
"""
)


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    one, two = tmp_path / "one.toml", tmp_path / "two.toml"
    one.write_text(ONE)
    two.write_text(TWO)
    return one, two


def test_each_limit_setting_and_source_that_differs_is_named(files: tuple[Path, Path]) -> None:
    one, two = map(load, files)
    assert {key: tuple(values) for key, *values in differences(one, two)} == {
        "checks.capacitance.limits.sensor_uF.upper": (5.5, None),
        "checks.stroke.limits.stroke_um.lower": (304.0, 345.0),
        "checks.stroke.settings.stroke_max_um": (456.0, 460.0),
        "checks.stiffness.required": (None, True),
        "checks.stiffness.limits.k_closed_N_per_um.upper": (None, 1.98),
        "checks.stiffness.limits.k_closed_N_per_um.unit": (None, "N/um"),
        "checks.stiffness.limits.k_closed_N_per_um.rule": (None, "simple"),
        "checks.stiffness.limits.k_closed_N_per_um.source": (None, "drawing B"),
        "checks.stiffness.limits.k_closed_N_per_um.assumed": (None, False),
    }


def test_comments_and_order_are_no_difference(files: tuple[Path, Path]) -> None:
    one = load(files[0])
    assert list(differences(one, parse(f"# said\n{ONE}".encode(), "two.toml"))) == []


def test_the_command_prints_a_table_and_says_by_its_exit_that_they_differ(files: tuple[Path, Path]) -> None:
    done = accept("spec", "diff", *files, "--json", "-")
    told = json.loads(done.stdout)
    assert done.exit_code == 4
    assert told["first"]["name"] == told["second"]["name"] == "lab"
    assert len(told["differences"]) == 9
    shown = " ".join(accept("spec", "diff", *files).stdout.split())
    for words in ("stroke_um.lower", "304", "345", "not stated"):
        assert words in shown
    same = accept("spec", "diff", files[0], files[0])
    assert (same.exit_code, "the same" in same.stdout) == (0, True)
    assert accept("spec", "diff", files[0], "no-such").exit_code == 6
