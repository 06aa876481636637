"""Imports point down, the commands start light, and the contracts bite."""

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.shared.reach import lines_behind
from tests.shared.source_trees import nodes

ROOT = Path(__file__).parent.parent
HEAVY = ("numpy", "scipy", "pandas", "textual", "reportlab", "matplotlib", "sqlalchemy", "pydantic", "pyhanko")


def python(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def test_help_imports_nothing_heavy() -> None:
    code = f"""
import sys
sys.argv = ["accept", "--help"]
from accept.cli.main import main
try:
    main()
except SystemExit as e:
    assert e.code == 0
loaded = [m for m in {HEAVY} if m in sys.modules]
sys.exit("loaded: " + ", ".join(loaded) if loaded else 0)
"""
    done = python(code)
    assert done.returncode == 0, done.stderr
    assert "batch" in done.stdout


def test_a_batch_of_typed_values_loads_no_more_than_it_needs(tmp_path: Path, bench_home: Path) -> None:
    """Tables, pictures, the search for what is missing and scipy wait until somebody asks for them."""
    unit = tmp_path / "T-1"
    unit.mkdir()
    (unit / "unit.toml").write_text('serial = "T-1"\nkind = "apa"\n[capacitance]\nsensor_uF = 5.1\nactuator_uF = 9.8\n')
    words = ["accept", "batch", str(unit), "--spec", "apa-basic", "--out", str(tmp_path / "out"), "--no-certificates"]
    heavy = ("pandas", "matplotlib", "reportlab", "scipy", "checks.gap.effects", "checks.acceptance.misalignment")
    code = f"""
import sys
sys.argv = {words}
from accept.cli.main import main
try:
    main()
except SystemExit as e:
    assert e.code == 4, e.code
loaded = [m for m in {heavy} if m in sys.modules]
sys.exit("loaded: " + ", ".join(loaded) if loaded else 0)
"""
    done = python(code)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "results.csv").exists()


def test_verifying_loads_no_analysis() -> None:
    """What a certificate needs is loaded when its unit is judged again: the search for what is missing never is."""
    heavy = ("scipy", "matplotlib", "pandas", "checks.gap.workflow", "checks.gap.effects", "checks.model.model")
    done = python(f"import sys, accept.commands.trust.verify; print([m for m in {heavy} if m in sys.modules])")
    assert done.stdout == "[]\n", done.stderr


# Packages that load slowly, and the files that load them when they are called: pictures of a drive, simulated records.
LATE = {
    "scipy.signal": {"checks/signals/drive/excitation_panels.py", "checks/model/time/partial_fractions.py"},
    "scipy.ndimage": set(),
}


@pytest.mark.parametrize("package", LATE)
def test_judging_and_verifying_do_without_it(package: str) -> None:
    """One takes as long to load as an APA to judge; `checks.signals.spectral.recursion` has what is needed of them."""
    sources = (
        p
        for room in ("checks", "accept/judging", "accept/units", "accept/certificate")
        for p in (ROOT / room).rglob("*.py")
    )
    users = {p.relative_to(ROOT).as_posix() for p in sources if f"{package} import" in p.read_text(encoding="utf-8")}
    assert users == LATE[package]


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()", "--no-cache"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=_env(folder))


def _env(folder: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200"}


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("copy")
    for package in ("accept", "hw", "checks", "specs"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def test_contracts_hold(copy: Path) -> None:
    done = lint(copy)
    assert done.returncode == 0, done.stdout + done.stderr


REACH = {  # lines of `accept` behind a screen (`python -m tests.shared.reach`) and 3 %; a screen may hold 12,000
    "step": 11_900,
    "steps": 10_900,
    "gap": 9_300,
    "start": 9_100,
    "summary": 10_100,  # with pictures of the unit on a large terminal
}


@pytest.mark.parametrize("screen", REACH)
def test_what_stands_behind_a_screen_does_not_grow(screen: str) -> None:
    assert lines_behind(f"accept.tui.screens.{screen}") <= REACH[screen]


@pytest.mark.parametrize(
    ("start", "most"), [("accept.batch.pipeline", 7000), ("accept.certificate.verify.verification", 6000)]
)
def test_what_stands_behind_a_module_can_be_held_in_the_head(start: str, most: int) -> None:
    """Behind the doors that it enters too."""
    assert lines_behind(start, opened=True) <= most


WRONG = [
    ("checks.verdict", "accept.base.exit_codes", "imports point down only"),
    ("specs.units", "checks.record", "imports point down only"),
    ("hw", "accept.base.home", "imports point down only"),
    ("checks.record", "reportlab", "checks and specs know no screen"),
    ("accept.certificate.contents.content", "accept.certificate.trust.keys", "inside accept.certificate"),
]


def test_a_wrong_import_breaks_a_contract(copy: Path) -> None:
    """All at once: each is reported under its contract, by its line."""
    before = {}
    for module, wanted, _ in WRONG:
        path = copy / module.replace(".", "/")
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        before[path] = path.read_text()
        path.write_text(f"{before[path]}\nimport {wanted}\n")
    try:
        done = lint(copy)
    finally:
        for path, text in before.items():
            path.write_text(text)
    assert done.returncode != 0
    summary, _, reports = done.stdout.partition("Broken contracts")
    for module, wanted, contract in WRONG:
        assert re.search(rf"^{contract}.* BROKEN$", summary, re.MULTILINE), contract
        assert f"{module} -> {wanted} (" in reports


IMPURE = {"print", "open", "now", "time", "time_ns", "monotonic", "perf_counter", "default_rng"}


def test_checks_neither_print_nor_read_the_clock_nor_open_files() -> None:
    """checks are pure functions: the same data judged twice give the same findings."""
    for path in (ROOT / "checks").rglob("*.py"):
        for node in nodes(path):
            if isinstance(node, ast.Call):
                called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
                seeded = called == "default_rng" and node.args
                assert called not in IMPURE or seeded, f"{path}:{node.lineno} calls {called}"


@pytest.mark.parametrize("package", ["accept", "hw", "checks", "specs", "validation", "benchmarks", "tests", "docs"])
def test_no_folder_holds_more_than_twenty_names(package: str) -> None:
    """What a reader takes in at one look; more than that wants rooms. Pictures of screens are named by their tests,
    members of the library of effects by what they are."""
    full = {}
    for folder in [ROOT / package, *(p for p in (ROOT / package).rglob("*") if p.is_dir() and p.name != "__pycache__")]:
        names = [p.name for p in folder.iterdir() if not p.name.startswith((".", "__pycache__"))]
        if len(names) > 20 and not {"__snapshots__", "effects"} & set(folder.parts):
            full[str(folder.relative_to(ROOT))] = len(names)
    assert full == {}


def test_no_folder_and_a_room_in_it_import_each_other() -> None:
    """The contract compares folders that stand beside each other; this one a folder's own files with its rooms. The
    names that a door shows are no imports: each is loaded when it is first used."""
    imports = set()
    for package in ("accept", "hw", "checks", "specs"):
        for path in (ROOT / package).rglob("*.py"):
            here = ".".join(path.parent.relative_to(ROOT).parts)
            doors = [n for n in nodes(path) if isinstance(n, ast.If) and "__getattr__ = door(" in ast.unparse(n.orelse)]
            shown = {id(n) for door in doors for n in door.body}
            for node in nodes(path):
                if isinstance(node, ast.ImportFrom) and node.module and id(node) not in shown:
                    # `from folder import name`: a module of that folder, or what its `__init__` hands on
                    names = [f"{node.module}.{a.name}" for a in node.names]
                    files = [ROOT / f"{name.replace('.', '/')}.py" for name in (node.module, *names)]
                    imports |= {(here, ".".join(f.parent.relative_to(ROOT).parts)) for f in files if f.is_file()}
    assert {(a, b) for a, b in imports if a != b and (b, a) in imports and b.startswith(f"{a}.")} == set()


def test_no_class_name_stands_for_two_things():
    places: dict[str, list[str]] = {}
    for package in ("accept", "hw", "checks", "specs"):
        for path in sorted((ROOT / package).rglob("*.py")):
            for node in nodes(path):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    places.setdefault(node.name, []).append(str(path.relative_to(ROOT)))
    assert {name: where for name, where in places.items() if len(where) > 1} == {}
