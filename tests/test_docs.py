"""Every command that the documentation shows runs and prints what is shown; `...` stands for what may differ."""

import re
import shlex
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from accept.certificate.contents import statements
from accept.cli.main import app
from accept.commands.units.check_docs import all_checks
from accept.store import formats
from tests.accept.units.units import make_unit
from tests.soak import SOAK

ROOT = Path(__file__).parent.parent
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
BLOCK = re.compile(r"^```console\n(.*?)^```", re.MULTILINE | re.DOTALL)


def commands(page: Path) -> list[tuple[str, list[str]]]:
    """(command, lines shown below it) of every console block."""
    found: list[tuple[str, list[str]]] = []
    for block in BLOCK.findall(page.read_text()):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((line[2:], []))
            elif line.strip() and line.strip() != "...":
                found[-1][1].append(line.strip())
    return found


LONG = ("tutorial-gap.md",)  # its search over a hundred uncertain values takes half a minute, twice
# Outside the heavy lane the examples of the gap start from the model that their units are made of: a quicker search.
# The default model is that of tests/accept/commands/test_gap_cli.py.
SHORTER = [] if SOAK else ["--model", "strut"]


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=pytest.mark.soak if p.name in LONG else ()) for p in PAGES], ids=lambda p: p.name
)
def test_examples_run(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.chdir(tmp_path)
    make_unit(tmp_path / "UNIT", "U-01")
    make_unit(tmp_path / "units" / "a", "A-1")
    (tmp_path / "mine.toml").write_bytes((ROOT / "specs" / "apa-basic.toml").read_bytes())
    for command, shown in commands(page):
        words = shlex.split(command)
        if words[:2] == ["make", "demo"]:
            words = ["accept", "demo", "--out", "out/demo"]
        if words[0] != "accept":
            continue
        if words[1] == "gap":
            words += SHORTER
        if words[1:] == ["demo", "--out", "out/demo"]:
            done = request.getfixturevalue("demo_run")
        else:
            done = CliRunner().invoke(app, words[1:], env={"COLUMNS": "100"})
        assert done.exit_code in {0, 3, 4}, f"{command}: {done.output}"
        printed = [" ".join(line.split()) for line in done.output.splitlines()]
        for line in shown:
            wanted = re.compile(".*".join(re.escape(" ".join(part.split())) for part in line.split("...")))
            assert any(wanted.search(p) for p in printed), f"{command} does not print: {line}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
        assert (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_files_of_the_code_that_a_page_names_exist(page: Path) -> None:
    for named in re.findall(r"\b((?:accept|hw|checks|specs|tests|validation)/[\w/]+\.(?:py|toml))\b", page.read_text()):
        assert (ROOT / named).exists(), f"{page.name} names {named}"


def test_the_page_of_checks_is_what_the_checks_declare() -> None:
    """Renew it with: accept spec checks > docs/reference/checks.md"""
    assert (ROOT / "docs" / "reference" / "checks.md").read_text() == all_checks()


def test_the_page_of_formats_is_what_the_models_declare() -> None:
    """Renew it with: python -m accept.store.formats > docs/reference/formats.md"""
    assert (ROOT / "docs" / "reference" / "formats.md").read_text() == formats.page() + "\n"


def test_the_table_of_statements_is_that_of_the_code() -> None:
    page = (ROOT / "docs/explanation/what-a-certificate-proves.md").read_text("utf-8")
    assert statements.table() in page


def command_names(group: object = None, prefix: str = "accept") -> list[str]:
    """Every command of the command line, sub-commands as `accept spec list`."""
    group = group or typer.main.get_command(app)
    names: list[str] = []
    for name, command in group.commands.items():  # type: ignore[attr-defined]
        found = f"{prefix} {name}"
        names += command_names(command, found) if hasattr(command, "commands") else [found]
    return names


@pytest.mark.parametrize("command", command_names())
def test_every_command_is_documented(command: str) -> None:
    *group, last = command.split()
    text = "".join(page.read_text() for page in PAGES)
    listed = re.search(rf"{' '.join(group)} [^\n`]*`?[^\n]*\b{last}\b", text)  # as in `accept spec list`, `show`
    assert command in text or (len(group) > 1 and listed), f"no page shows {command}"
