"""No process that the program starts is given a passphrase: every start in the product goes through one door."""

import ast
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from accept.base import child_processes
from accept.base.child_processes import environment, process_pool
from accept.cli.main import app

ROOT = Path(__file__).parents[3]
DOOR = Path(child_processes.__file__)
STARTS = {
    *("Popen", "run", "call", "check_call", "check_output", "getoutput", "getstatusoutput"),
    *("create_subprocess_exec", "create_subprocess_shell", "subprocess_exec", "subprocess_shell"),
    *("system", "popen", "fork", "forkpty", "posix_spawn", "posix_spawnp", "startfile"),
    *(f"{word}{how}" for word in ("exec", "spawn") for how in ("l", "le", "lp", "lpe", "v", "ve", "vp", "vpe")),
    *("ProcessPoolExecutor", "Pool", "get_context", "LocalCluster", "Nanny"),
}
MODULES = ("subprocess.", "asyncio.", "os.", "pty.", "multiprocessing.", "concurrent.futures.", "distributed.")
SECRETS = {
    "ACCEPT_PASSPHRASE": "a", "ACCEPT_QA_PASSPHRASE": "b", "ACCEPT_STORE_URL": "postgresql://u:c@h/d",
    "PGPASSWORD": "d", "AWS_SECRET_ACCESS_KEY": "e", "AZURE_STORAGE_CONNECTION_STRING": "f", "GITHUB_TOKEN": "g",
}  # fmt: skip


def starts(tree: ast.Module) -> Iterator[tuple[int, bool]]:
    """Yield (line, whether its environment is protected) of every start of a process."""
    names: dict[str, str] = {}  # here -> module.name, as imported
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names.update({(a.asname or a.name.split(".")[0]): a.name.split(".")[0] for a in node.names})
        if isinstance(node, ast.ImportFrom):
            names.update({(a.asname or a.name): f"{node.module}.{a.name}" for a in node.names})
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Subscript | ast.Attribute | ast.Name):
            value = node.value.value if isinstance(node.value, ast.Subscript) else node.value
            names.update({t.id: ast.unparse(value) for t in node.targets if isinstance(t, ast.Name)})
    shielded = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.With) and any(ast.unparse(item.context_expr) == "protected()" for item in node.items)
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            first, *rest = ast.unparse(node.func).split(".")
            module, _, name = ".".join([names.get(first, first), *rest]).rpartition(".")
            asked = name in STARTS and f"{module}.{name}" != "asyncio.run"
            if asked and f"{module}.".startswith(MODULES):
                given = [ast.unparse(k.value) for k in node.keywords if k.arg == "env"]
                yield node.lineno, id(node) in shielded or any(words.startswith("environment(") for words in given)


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("import subprocess\nsubprocess.run(['x'], env=os.environ)", [False]),
        ("import subprocess\nsubprocess.run(['x'], env=environment())", [True]),
        ("from subprocess import Popen as P\nP(['x'])", [False]),
        ("import subprocess\nProcess = subprocess.Popen[bytes]\nProcess(['x'])", [False]),
        ("import asyncio\nwith protected():\n    asyncio.create_subprocess_exec('x')", [True]),
        ("import asyncio\nasyncio.run(main())", []),
        ("import re\nre.compile('x')", []),
    ],
)
def test_a_start_is_seen(code: str, found: list[bool]) -> None:
    assert [safe for _, safe in starts(ast.parse(code))] == found


def test_every_start_in_the_product_goes_through_the_door() -> None:
    seen, open_ones = 0, []
    for path in (p for package in ("accept", "checks", "hw", "specs") for p in (ROOT / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if STARTS.isdisjoint(re.findall(r"\w+", text)):  # whatever it is called here, it is imported by its name
            continue
        for line, safe in starts(ast.parse(text)):
            seen += 1
            if not safe and path != DOOR:
                open_ones.append(f"{path.relative_to(ROOT)}:{line}")
    assert open_ones == []
    assert seen >= 4


def test_a_computing_child_has_no_secret(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SECRETS.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("ACCEPT_HOME", "/somewhere")
    assert not SECRETS.keys() & environment().keys()
    assert environment()["ACCEPT_HOME"] == "/somewhere"
    with process_pool(1) as pool:
        assert [name for name in SECRETS if pool.submit(os.getenv, name).result() is not None] == []
    assert os.environ["PGPASSWORD"] == "d"


def test_a_worker_of_a_cluster_has_no_secret(monkeypatch: pytest.MonkeyPatch) -> None:
    """It runs what the scheduler sends."""
    pytest.importorskip("distributed")
    given: list[dict[str, str]] = []

    def run(command: list[str], env: dict[str, str]) -> subprocess.CompletedProcess[bytes]:
        given.append(env)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(subprocess, "run", run)
    for name, value in SECRETS.items():
        monkeypatch.setenv(name, value)
    assert CliRunner().invoke(app, ["worker", "tcp://127.0.0.1:8786"]).exit_code == 0
    assert not SECRETS.keys() & given[0].keys()
    assert given[0]["PYTHONSAFEPATH"] == "1"
