"""A product is a package that a stranger can install: written by a command, checked by another, and a unit of it goes
from its folder to a certificate that verifies."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from accept.cli.main import app
from specs.plugins import BUILT_IN, ProductError, product_named, product_problem
from specs.products import Product

ROOT = Path(__file__).parents[2]
NAME = "lever_2"
INSTALLED = "installed: apa, strut"


def accept(site: Path, *words: object) -> subprocess.CompletedProcess[str]:
    env = os.environ | {
        "PYTHONPATH": f"{ROOT}{os.pathsep}{site}",
        "ACCEPT_HOME": str(site / "home"),
        "ACCEPT_PASSPHRASE": "correct horse",
    }
    run = [sys.executable, "-m", "accept", *map(str, words)]
    return subprocess.run(run, env=env, capture_output=True, text=True, timeout=180, cwd=site, check=False)


def installed(package: Path, site: Path) -> None:
    """What an installer does: the module beside the others, and the metadata with its entry points."""
    project = tomllib.loads((package / "pyproject.toml").read_text())["project"]
    module = project["name"].replace("-", "_")
    shutil.copytree(package / module, site / module, dirs_exist_ok=True)
    info = site / f"{module}-{project['version']}.dist-info"
    info.mkdir(exist_ok=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = [f"[{g}]\n" + "".join(f"{k} = {v}\n" for k, v in e.items()) for g, e in project["entry-points"].items()]
    (info / "entry_points.txt").write_text("\n".join(groups))
    files = sorted(p.relative_to(site).as_posix() for p in (site / module).rglob("*") if p.is_file())
    (info / "RECORD").write_text("".join(f"{file},,\n" for file in files))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """The commands in this process, for what asks no entry points of a new environment."""
    monkeypatch.chdir(tmp_path)

    def run(*words: object) -> Result:
        for module in [name for name in sys.modules if name.startswith("accept_product_")]:
            del sys.modules[module]  # as a program that starts
        done = CliRunner().invoke(app, [str(word) for word in words])
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exc_info
        return done

    return run


@pytest.fixture
def package(tmp_path: Path, here: Callable[..., Result]) -> Path:
    done = here("product", "new", NAME, "--out", "package")
    assert done.exit_code == 0, done.stderr
    return tmp_path / "package"


@pytest.mark.slow
def test_a_unit_of_an_installed_product_goes_from_its_folder_to_a_certificate(tmp_path: Path, package: Path) -> None:
    installed(package, tmp_path)
    listed = json.loads(accept(tmp_path, "product", "list", "--json", "-").stdout)["products"]
    assert [(p["name"], p["package"]) for p in listed] == [
        ("apa", "built-in"),
        ("strut", "built-in"),
        ("strut-plates", "built-in"),
        (NAME, "accept-product-lever-2 0.1.0"),
    ]
    assert accept(tmp_path, "product", "check", NAME).returncode == 0
    judged = accept(tmp_path, "batch", "package/example", "--out", "out")
    assert judged.returncode == 0, judged.stderr
    (unit,) = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
    assert (unit["kind"], unit["verdict"]) == (NAME, "accepted")
    assert [(f["quantity"], f["verdict"]) for f in unit["findings"]] == [("lever_2_mass_kg", "pass")]
    verified = accept(tmp_path, "verify", tmp_path / "out" / unit["certificate"])
    assert verified.returncode == 0, verified.stdout + verified.stderr
    (tmp_path / "package" / "example" / "unit.toml").write_text(
        f'serial = "HEAVY"\nkind = "{NAME}"\n[lever_2_mass]\nlever_2_mass_kg = 1.3\n'
    )
    assert accept(tmp_path, "batch", "package/example", "--out", "out").returncode == 3


def test_it_is_asked_for_at_the_bench(tmp_path: Path, package: Path) -> None:
    init = package / "accept_product_lever_2" / "__init__.py"
    init.write_text(init.read_text().replace("parts={}", 'parts={"pivot": "Serial number of the pivot"}'))
    installed(package, tmp_path)
    words = (
        "from accept.workflow.dialogue import start; from accept.workflow.open_bench import open_bench; "
        "from specs.plugins import products; "
        "print(*products()); print(start.parts_of('lever_2'), start.parts_of('apa')); "
        "print([s.name for s in __import__('accept.workflow.steps.plan', fromlist=['x'])"
        ".steps_of(open_bench().specs['lever_2'])])"
    )
    env = os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "ACCEPT_HOME": str(tmp_path / "home")}
    done = subprocess.run([sys.executable, "-c", words], env=env, capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout.splitlines() == [
        "apa strut strut-plates lever_2",
        "('pivot',) ()",
        "['lever_2_mass']",
    ], done.stderr


def test_a_package_is_checked_before_it_is_installed(package: Path, here: Callable[..., Result]) -> None:
    assert here("product", "check", "package").exit_code == 0
    spec = package / "accept_product_lever_2" / "spec.toml"
    good = spec.read_text()
    for broken, words in (
        (good.replace('kind = "lever_2"', 'kind = "apa"'), "is a check of lever_2, not of apa"),
        (good.replace("lower = 0.9", "lower = 1.9"), "is not below upper"),
        (good.replace("checks.lever_2_mass", "checks.weight"), "unknown check"),
    ):
        spec.write_text(broken)
        done = here("product", "check", "package")
        assert done.exit_code == 6
        assert words in done.stderr
        assert "Traceback" not in done.stderr
    spec.write_text(good)
    (package / "accept_product_lever_2" / "__init__.py").write_text("PRODUCT = 1 / 0\n")
    done = here("product", "check", "package")
    assert (done.exit_code, "ZeroDivisionError" in done.stderr, "Traceback" in done.stderr) == (6, True, False)


def test_an_installed_product_whose_spec_is_broken_stops_no_other(tmp_path: Path, package: Path) -> None:
    spec = package / "accept_product_lever_2" / "spec.toml"
    spec.write_text(spec.read_text() + "[checks.nothing]\n")
    installed(package, tmp_path)
    unit = tmp_path / "unit"
    unit.mkdir()
    (unit / "unit.toml").write_text('serial = "A-1"\nkind = "apa"\n[capacitance]\nsensor_uF = 5.0\nactuator_uF = 9.9\n')
    done = accept(tmp_path, "batch", "unit", "--out", "out", "--no-certificates")
    assert done.returncode == 4, done.stderr  # judged: incomplete
    assert "product 'lever_2' is left out" in done.stderr


@pytest.mark.parametrize("where", ["unit", "spec", "list", "match", "simulate", "check"])
def test_every_error_names_the_installed_products(tmp_path: Path, here: Callable[..., Result], where: str) -> None:
    (tmp_path / "unit.toml").write_text('serial = "A"\nkind = "bridge"\n')
    (tmp_path / "spec.toml").write_text(
        'name = "s"\nkind = "bridge"\ntitle = "t"\n[checks.capacitance.limits.sensor_uF]\n'
        'lower = 1.0\nunit = "uF"\nrule = "simple"\nsource = "s"\n'
    )
    words = {
        "unit": ("batch", ".", "--out", "out"),
        "spec": ("spec", "validate", "spec.toml"),
        "list": ("list", "--kind", "bridge"),
        "match": ("match", "--kind", "bridge"),
        "simulate": ("simulate", "unit", "--kind", "bridge", "--serial", "X", "--out", "x"),
        "check": ("product", "check", "bridge"),
    }[where]
    done = here(*words)
    assert done.exit_code in (2, 6)
    said = " ".join(done.stderr.replace("│", " ").split())
    assert "bridge" in said
    assert "apa, strut" in said
    if where != "simulate":
        assert INSTALLED in said


@pytest.mark.parametrize("name", ["apa", "../x", "Lever", "", "a b"])
def test_a_name_that_cannot_be(tmp_path: Path, here: Callable[..., Result], name: str) -> None:
    assert here("product", "new", name, "--out", "package").exit_code == 6
    assert not (tmp_path / "package").exists()


def test_nothing_is_written_over(package: Path, here: Callable[..., Result]) -> None:
    before = (package / "README.md").read_text()
    (package / "README.md").write_text("mine")
    assert here("product", "new", NAME, "--out", "package").exit_code == 6
    assert (package / "README.md").read_text() == "mine" != before


def test_products_are_declared_once_and_looked_up() -> None:
    assert set(BUILT_IN) == {"apa", "strut", "strut-plates"}
    assert product_named("strut").parts.keys() == {"apa", "joint_bottom", "joint_top", "encoder"}
    with pytest.raises(ProductError, match=INSTALLED):
        product_named("bridge")
    assert "expected a Product" in product_problem({"name": "x"})
    assert "is not there" in product_problem(Product("x", "X", "Xs", Path("/nowhere/spec.toml")))
