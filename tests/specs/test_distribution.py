"""The package: its name, its version, what is in it, how it installs, and what happens beside modules of others."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

from specs.distribution import NAME, install

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
INTERPRETERS = [path for version in ("3.11", "3.12", "3.13", "3.14") if (path := shutil.which(f"python{version}"))]


def run(*words: object, cwd: Path, **env: str) -> subprocess.CompletedProcess[str]:
    own = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONSAFEPATH")}
    return subprocess.run(
        [str(w) for w in words], cwd=cwd, env=own | env, capture_output=True, text=True, check=False, timeout=900
    )


def test_the_name_and_the_version_stand_once():
    """The program says the name of its own distribution; a stranger's is called `accept`."""
    assert PROJECT["name"] == NAME == metadata.metadata(NAME)["Name"]
    newest = re.search(r"^## (\S+?),? ", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest is not None
    assert PROJECT["version"] == newest.group(1)
    named = "pip install 'accept["
    texts = [p for folder in ("accept", "hw", "checks", "specs", "docs") for p in (ROOT / folder).rglob("*")]
    assert [p for p in texts if p.suffix in (".py", ".md") and named in p.read_text()] == []
    assert all(install(extra).startswith(f"pip install '{NAME}[") for extra in PROJECT["optional-dependencies"])


def test_requirements_are_ranges_and_the_lock_has_the_pins():
    assert [r for r in PROJECT["dependencies"] if "==" in r] == []
    assert re.search(r"^textual==[\d.]+ \\$", (ROOT / "requirements.lock").read_text(), re.MULTILINE)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("dist")
    code = f"from hatchling.build import build_wheel; print(build_wheel({str(out)!r}))"
    done = run(sys.executable, "-c", code, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return out / done.stdout.split()[-1]


def test_the_wheel_holds_the_program_and_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as opened:
        names = opened.namelist()
        (entry,) = [n for n in names if n.endswith("entry_points.txt")]
        assert "accept = accept.cli.main:main" in opened.read(entry).decode()
    tops = {name.split("/")[0] for name in names}
    assert {t for t in tops if not t.endswith(".dist-info")} == {"accept", "hw", "checks", "specs"}
    assert {"specs/apa.toml", "specs/strut.toml", "accept/py.typed"} <= set(names)


@pytest.mark.parametrize("stranger", ["checks.py", "hw.py", "specs/__init__.py"])
def test_a_users_own_module_in_the_way_is_not_imported_or_named_in_one_line(tmp_path, stranger):
    (tmp_path / stranger).parent.mkdir(exist_ok=True)
    (tmp_path / stranger).write_text("x = 1\n")
    (tmp_path / "script.py").write_text("import accept\naccept.judge\n")
    started = run(sys.executable, "-m", "accept", "--version", cwd=tmp_path)
    assert started.returncode == 0, started.stderr  # nothing but the program is imported from the working folder
    script = run(sys.executable, "script.py", cwd=tmp_path)
    assert str(tmp_path / stranger) in script.stderr.splitlines()[-1]
    command = run(Path(sys.executable).with_name("accept"), "--version", cwd=tmp_path)
    assert command.returncode == 0, command.stderr


@pytest.mark.soak
@pytest.mark.parametrize("python", INTERPRETERS)
def test_a_clean_environment_of_each_interpreter(wheel, python, tmp_path):
    """Installed from the wheel by its name: the demo, an extra, a plug-in, and a module of the user's own beside it."""
    place = tmp_path / "env"
    if run(python, "-m", "venv", place, cwd=tmp_path).returncode:
        pytest.skip(f"{python} cannot make an environment")
    own = place / "bin" / "python"
    pip = (own, "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    done = run(*pip, f"{NAME}[site] @ {wheel.as_uri()}", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    home = {"HOME": str(tmp_path), "ACCEPT_HOME": str(tmp_path / "home")}
    demo = run(place / "bin" / "accept", "demo", "--out", tmp_path / "demo", cwd=tmp_path, **home)
    assert demo.returncode == 0, demo.stderr
    assert len(list((tmp_path / "demo" / "certificates").glob("*.pdf"))) == 8
    site = run(place / "bin" / "accept", "site", "--out", tmp_path / "page", cwd=tmp_path, **home)
    assert "pip install" not in site.stderr
    done = run(*pip, "hatchling", cwd=tmp_path)
    done = run(*pip, "--no-build-isolation", "--no-deps", ROOT / "tests" / "plugins" / "example", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    listed = run(place / "bin" / "accept", "model", "effects", cwd=tmp_path, **home)
    assert "encoder_lowpass" in listed.stdout
    (tmp_path / "checks.py").write_text("")
    assert run(own, "-m", "accept", "--version", cwd=tmp_path).returncode == 6
    assert run(place / "bin" / "accept", "--version", cwd=tmp_path).stdout.startswith(f"accept {PROJECT['version']}")


PAGE = ROOT / "docs/reference/environment.md"
READ_BY_LIBRARIES = {"NO_COLOR"}  # rich and Textual


def variables(tree: ast.Module) -> set[str]:
    """Return the names of environment variables that a module asks for, as far as they stand in it."""
    known: dict[str, set[str]] = {}
    for node in ast.walk(tree):
        values: list[tuple[ast.expr, ast.expr]] = []
        if isinstance(node, ast.Assign):
            target = node.targets[0]
            pair = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
            values = list(zip(target.elts, node.value.elts, strict=False)) if pair else [(target, node.value)]
        elif isinstance(node, ast.For) and isinstance(node.iter, ast.Tuple):
            values = [(node.target, value) for value in node.iter.elts]
        for target, value in values:
            if isinstance(target, ast.Name) and isinstance(value, ast.Constant):
                known.setdefault(target.id, set()).add(str(value.value))
    asked: list[ast.expr] = []
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Attribute(value=place, attr="get" | "setdefault" | "pop"), args=[name, *_]):
                asked += [name] if ast.unparse(place) == "os.environ" else []
            case ast.Call(func=function, args=[name, *_]) if ast.unparse(function) == "os.getenv":
                asked.append(name)
            case ast.Subscript(value=place, slice=name) if ast.unparse(place) == "os.environ":
                asked.append(name)
            case ast.Compare(left=name, comparators=[place]) if ast.unparse(place) == "os.environ":
                asked.append(name)
            case ast.keyword(arg="envvar", value=name):
                asked.append(name)
    found: set[str] = set()
    for name in asked:
        found |= {str(name.value)} if isinstance(name, ast.Constant) else known.get(ast.unparse(name), set())
    return found


def test_every_environment_variable_is_on_its_page():
    """As the code asks for them, and as it names its own; without those of the tests."""
    sources = [p for folder in ("accept", "hw", "checks", "specs") for p in (ROOT / folder).rglob("*.py")]
    texts = [p.read_text(encoding="utf-8") for p in sources]
    used = {name for text in texts for name in re.findall(r"\bACCEPT_[A-Z_]+\b", text)} - {"ACCEPT_SOAK"}
    used |= {name for text in texts for name in variables(ast.parse(text))}
    rows = [line.split("|")[1] for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| `")]
    told = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert used == told - READ_BY_LIBRARIES


@pytest.mark.parametrize("code", [
    "os.environ.get('X')", "os.environ['X']", "'X' in os.environ", "os.getenv('X')",
    "V, W = 'X', 'Y'; os.environ.get(V)",
    "typer.Option(envvar='X')", "for v in ('X',): os.environ.setdefault(v, '1')",
])  # fmt: skip
def test_a_variable_is_found_however_it_is_asked_for(code):
    assert variables(ast.parse(code)) == {"X"}
