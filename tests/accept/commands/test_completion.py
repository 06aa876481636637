"""Names and values that a shell completes, and that nothing heavy is loaded while a key is held."""

import os
import re
import subprocess
import sys

import pytest

from accept.base.home import home
from accept.cli.completion import MOST, OPTIONS, VALUES, values
from accept.cli.lazy_group import Command, Group
from accept.cli.main import COMMANDS
from accept.store import open_store
from accept.store.payloads import AttemptStarted, UnitJudged
from accept.store.store import NewEvent
from checks.acceptance import CHECKS
from specs.model import builtin_models
from specs.plugins import products
from specs.spec import builtin, load

HEAVY = ("numpy", "scipy", "pandas", "sqlalchemy", "textual", "matplotlib", "hw", "checks")
BENCH = '[instruments.gauge]\nserial = "1234/56"\n[instruments.lcr]\n[recorders.daq]\nserial = "R7"\n'


@pytest.fixture
def bench():
    path = home() / "bench.toml"
    path.write_text(BENCH)
    return path


def completed(line: str) -> tuple[list[str], set[str]]:
    """Return what bash is offered for a line's last word, and the packages that were loaded for it."""
    words = line.split(" ")
    asked = {"_ACCEPT_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)}
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-c", "from accept.cli.main import main; import sys; "
         "sys.argv[0] = 'accept'; main()"],
        env=os.environ | asked, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    loaded = {match[1] for match in re.finditer(r"\|\s+\d+ \|\s+(\w+)", done.stderr)}
    return done.stdout.split(), loaded


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("accept hw te", ["test"]),
        ("accept hw test ", ["daq", "gauge", "lcr"]),
        ("accept hw test gauge l", ["lcr"]),
        ("accept spec show apa", ["apa", "apa-basic"]),
        ("accept batch units --spec strut-", ["strut-basic", "strut-plates"]),
        ("accept gap UNIT --model apa-", ["apa-2dof", "apa-frame"]),
        ("accept recall --instrument 12", ["1234/56"]),
        ("accept report ", []),
    ],
)
def test_a_shell_is_offered_values_at_once(bench, line, expected):
    offered, loaded = completed(line)
    assert offered == expected
    assert "typer" in loaded
    assert not loaded & set(HEAVY)


def test_options_are_those_of_the_command(bench):
    offered, _ = completed("accept hw check lcr --in-")
    assert offered == ["--in-place"]


def test_values_are_what_is_there(bench):
    assert values(("spec",), [], "") == sorted(builtin())
    assert values(("model",), [], "") == sorted(builtin_models())
    assert values(("product",), [], "") == sorted(products())
    assert set(values(("check",), [], "")) <= set(CHECKS)
    limits = {q for spec in map(load, builtin()) for check in spec.checks.values() for q in check.limits}
    assert set(values(("quantity",), [], "")) == limits | {"check:daq", "check:gauge", "check:lcr"}
    assert values(("instrument",), [], "") == ["daq", "gauge", "lcr"]


def judged_units(serials):
    """As far as completion looks: events by their names."""
    names = [UnitJudged.KIND, AttemptStarted.KIND]
    with open_store() as store:
        store.append_many([NewEvent(names[k % 2], serial, {}, "") for k, serial in enumerate(serials)], who="Ann")
        store.append("certificate_signed", "no unit", {}, who="Ann")


def test_serials_are_those_of_units_in_the_store(tmp_path):
    assert values(("serial",), [], "") == []  # no store yet, and none is made
    assert not (home() / "store.sqlite").exists()
    judged_units(["APA-01", "APA-02", "S_1", "S%"])
    assert values(("serial",), [], "") == ["APA-01", "APA-02", "S%", "S_1"]
    assert values(("serial",), [], "APA") == ["APA-01", "APA-02"]
    assert values(("serial",), [], "S_") == ["S_1"]
    judged_units([f"N-{k:04}" for k in range(MOST + 5)])
    assert len(values(("serial",), [], "N-")) == MOST


def test_the_bench_file_of_the_line_counts(tmp_path):
    other = tmp_path / "other.toml"
    other.write_text("[instruments.probe]\n")
    assert values(("instrument",), ["--bench", str(other)], "") == ["probe"]
    assert values(("file", "check"), ["--bench", str(other), "UNIT"], "str") == ["stroke"]
    assert values(("file", "check"), ["--bench", str(other)], "") == []  # the unit's folder: the shell's own


@pytest.mark.parametrize("text", [None, "[instruments", "instruments = 3\n", "\udcff"])
def test_a_bench_file_that_cannot_be_read_completes_nothing(text):
    if text is not None:
        (home() / "bench.toml").write_text(text, errors="surrogateescape")
    for kind in VALUES:
        values((kind,), [], "x")
    assert values(("instrument",), [], "") == []


def test_a_damaged_store_completes_nothing():
    (home() / "store.sqlite").write_bytes(b"no database" * 100)
    assert values(("serial",), [], "") == []


def test_every_kind_of_value_is_known():
    def commands(table):
        for entry in table.values():
            yield from commands(entry.commands) if isinstance(entry, Group) else [entry]

    kinds = {kind for entry in commands(COMMANDS) if isinstance(entry, Command) for kind in entry.values}
    assert kinds | set(OPTIONS.values()) <= set(VALUES)
