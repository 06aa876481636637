"""The package: its name, its version, what is in it, how it installs, and what happens beside modules of others."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

from specs.distribution import NAME, install
from tests.shared.source_trees import tree

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
VERSIONS = ("3.11", "3.12", "3.13", "3.14")


def interpreters() -> dict[str, Path]:
    """Return the interpreters of this computer by their version. A shim of pyenv starts no version that is not chosen:
    behind it they lie in folders of their own."""
    found = {}
    for version in VERSIONS:
        if path := shutil.which(f"python{version}"):
            behind = sorted(Path(path).parents[1].glob(f"versions/{version}.*/bin/python{version}"))
            found[version] = behind[-1] if behind else Path(path)
    return found


INTERPRETERS = interpreters()


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


class Environment:
    """A new virtual environment, with a home of its own."""

    def __init__(self, python: Path, folder: Path) -> None:
        self.place, self.folder = folder / "env", folder
        made = run(python, "-m", "venv", self.place, cwd=folder)
        if made.returncode:
            pytest.skip(f"{python} cannot make an environment: {made.stderr}")

    def run(self, program: str, *words: object, code: int = 0, cwd: Path | None = None) -> str:
        """Run one of its programs, and return what it printed."""
        home = {"HOME": str(self.folder), "ACCEPT_HOME": str(self.folder / "home")}
        home |= {"PATH": f"{self.place / 'bin'}:{os.environ['PATH']}"}
        done = run(self.place / "bin" / program, *words, cwd=cwd or self.folder, **home)
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr

    def install(self, *words: object) -> None:
        self.run("python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *words)


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("sdist")
    code = f"from hatchling.build import build_sdist; print(build_sdist({str(out)!r}))"
    done = run(sys.executable, "-c", code, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return out / done.stdout.split()[-1]


@pytest.mark.soak
@pytest.mark.parametrize("version", INTERPRETERS)
def test_a_clean_environment_of_each_interpreter(wheel, sdist, version, tmp_path):
    """Installed from the wheel by its name: the demo, an extra, a plug-in, modules of the user's own beside it; then
    the same from the sdist."""
    env = Environment(INTERPRETERS[version], tmp_path)
    env.install(f"{NAME}[site] @ {wheel.as_uri()}")
    assert env.run("python", "--version").startswith(f"Python {version}.")
    env.run("accept", "demo", "--out", tmp_path / "demo")
    assert len(list((tmp_path / "demo" / "certificates").glob("*.pdf"))) == 8
    unit = tmp_path / "A-1"
    env.run("accept", "simulate", "unit", "--kind", "apa", "--serial", "A-1", "--seed", "3", "--out", unit)
    env.run("accept", "batch", unit, "--out", tmp_path / "out", "--no-certificates")
    env.run("accept", "site", "--out", tmp_path / "page")  # exit 6 without its extra
    env.install("hatchling", "editables")
    env.install("--no-build-isolation", "--no-deps", ROOT / "tests" / "plugins" / "example")
    assert "encoder_lowpass" in env.run("accept", "model", "effects")
    beside = tmp_path / "beside"
    beside.mkdir()
    for name in ("checks.py", "hw.py"):
        (beside / name).write_text("")
    for words in (("accept", "--version"), ("python", "-m", "accept", "--version")):
        assert env.run(*words, cwd=beside).startswith(f"accept {PROJECT['version']}")
    (beside / "script.py").write_text("import accept\naccept.judge\n")
    assert str(beside / "checks.py") in env.run("python", "script.py", cwd=beside, code=1).splitlines()[-1]
    env.install("--no-build-isolation", "--no-deps", "--force-reinstall", sdist)
    assert env.run("accept", "--version").startswith(f"accept {PROJECT['version']}")
    assert "frame" in env.run("accept", "model", "list")  # its data came with it


RECIPE = ROOT / "docs/how-to/worker.Containerfile"


def test_the_recipe_of_a_worker():
    """It copies what the wheel is built of, installs by a lock that has Dask, and starts a worker with its options."""
    recipe = RECIPE.read_text(encoding="utf-8")
    copied = re.findall(r"^COPY (.*) \S+$", recipe, re.MULTILINE)
    needed = {"accept", "hw", "checks", "specs", "pyproject.toml", PROJECT["readme"], *PROJECT["license-files"]}
    assert needed < {word for line in copied for word in line.split()}
    (lock,) = re.findall(r"^RUN pip install .*--require-hashes -r (\S+)$", recipe, re.MULTILINE)
    pinned, tested = (
        dict(re.findall(r"^([\w.-]+)==(\S+)", (ROOT / name).read_text(), re.MULTILINE))
        for name in (lock, "requirements-dev.lock")
    )
    assert {re.split(r"[>=<]", one)[0] for one in PROJECT["optional-dependencies"]["cluster"]} < set(pinned)
    assert pinned.items() <= tested.items()
    entry = json.loads(re.findall(r"^ENTRYPOINT (.*)$", recipe, re.MULTILINE)[0])
    assert entry[:2] == ["dask", "worker"]
    assert entry[entry.index("--host") + 1] == "127.0.0.1"
    worker = pytest.importorskip("distributed.cli.dask_worker").main
    known = {name for option in worker.params for name in (*option.opts, *option.secondary_opts)}
    assert {word for word in entry if word.startswith("--")} <= known


@pytest.mark.soak
def test_a_worker_by_its_recipe_judges_a_unit(tmp_path):
    """The recipe's own lines in a new environment, and a worker as it starts one."""
    recipe = RECIPE.read_text(encoding="utf-8")
    (version,) = re.findall(r"python:(3\.\d+)-", recipe)
    env = Environment(INTERPRETERS.get(version, Path(sys.executable)), tmp_path)
    source = tmp_path / "source"
    source.mkdir()
    for word in (word for line in re.findall(r"^COPY (.*) \S+$", recipe, re.MULTILINE) for word in line.split()):
        copy = shutil.copytree if (ROOT / word).is_dir() else shutil.copy
        copy(ROOT / word, source / word)
    for line in re.findall(r"^RUN (pip .*)$", recipe, re.MULTILINE):
        env.run(*line.split(), cwd=source)
    env.run(
        "accept",
        "simulate",
        "unit",
        "--kind",
        "apa",
        "--serial",
        "A-1",
        "--seed",
        "3",
        "--out",
        tmp_path / "units" / "A-1",
    )
    entry = json.loads(re.findall(r"^ENTRYPOINT (.*)$", recipe, re.MULTILINE)[0])
    place = tmp_path / "scheduler.json"
    programs = [
        ["dask", "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", place]
    ]
    programs.append([*entry, "--scheduler-file", place])
    own = os.environ | {"HOME": str(tmp_path)}
    started = [
        subprocess.Popen([env.place / "bin" / p[0], *map(str, p[1:])], cwd=tmp_path, env=own, stderr=subprocess.DEVNULL)
        for p in programs
    ]
    try:
        deadline = time.monotonic() + 120.0
        while not place.exists():
            assert time.monotonic() < deadline
            time.sleep(0.1)
        address = json.loads(place.read_text())["address"]
        words = ("batch", tmp_path / "units", "--out", tmp_path / "out", "--no-certificates", "--cluster", address)
        assert "A-1" in env.run("accept", *words)
    finally:
        for program in reversed(started):
            program.terminate()
            program.wait(60.0)


def test_workers_of_this_machine_listen_on_it_alone(monkeypatch):
    dask_workers = pytest.importorskip("accept.base.cluster.dask_workers")

    class Started(Exception):
        pass

    def start(**given: object) -> None:
        raise Started(given)

    monkeypatch.setattr(dask_workers, "LocalCluster", start)
    with pytest.raises(Started) as found, dask_workers._local_workers():
        pass
    given = found.value.args[0]
    assert given["host"] == "127.0.0.1"
    assert given["dashboard_address"] == "127.0.0.1:0"


PAGE = ROOT / "docs/reference/environment.md"
READ_BY_LIBRARIES = {"NO_COLOR"}  # rich and Textual


def is_of_os(node: ast.expr, name: str) -> bool:
    """Return whether an expression is `os.NAME`."""
    return isinstance(node, ast.Attribute) and node.attr == name and ast.unparse(node.value) == "os"


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
                asked += [name] if is_of_os(place, "environ") else []
            case ast.Call(func=function, args=[name, *_]) if is_of_os(function, "getenv"):
                asked.append(name)
            case ast.Subscript(value=place, slice=name) if is_of_os(place, "environ"):
                asked.append(name)
            case ast.Compare(left=name, comparators=[place]) if is_of_os(place, "environ"):
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
    asking = (path for path, text in zip(sources, texts, strict=True) if re.search("environ|getenv|envvar", text))
    used |= {name for path in asking for name in variables(tree(path))}
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
