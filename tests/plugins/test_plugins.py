"""A package from elsewhere brings an effect, a check and an instrument through entry points; a broken one brings
nothing, and says so in a line."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from pypdf import PdfReader

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "tests" / "plugins" / "example"
SPEC = """
name = "with-insulation"
kind = "apa"
title = "APA, insulation alone"
[checks.insulation.limits.insulation_ohm]
lower = 1e9
unit = "ohm"
rule = "simple"
source = "house rule"
[checks.insulation.uncertainty.insulation_ohm]
U_percent = 5.0
source = "data sheet of the megohmmeter"
"""
BENCH = """
name = "bench"
[instruments.megger]
driver = "megohmmeter"
measures = ["insulation"]
model = "MO-1"
serial = "7"
settings = {{ file = "{file}" }}
"""


def installed(site: Path, entries: dict[str, dict[str, str]], name: str = "accept-plugin-example") -> None:
    """The package's code, and the metadata that an installer would write beside it."""
    shutil.copytree(EXAMPLE / "accept_plugin_example", site / "accept_plugin_example", dirs_exist_ok=True)
    info = site / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    groups = [f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in named.items()) for group, named in entries.items()]
    (info / "entry_points.txt").write_text("\n".join(groups))
    code = sorted(p.relative_to(site).as_posix() for p in site.rglob("*.py"))
    (info / "RECORD").write_text("".join(f"{p},,\n" for p in code))


def declared() -> dict[str, dict[str, str]]:
    return tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]["entry-points"]


def python(site: Path, *args: object) -> subprocess.CompletedProcess[str]:
    env = os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{site}", "ACCEPT_HOME": str(site / "home")}
    words = [sys.executable, *map(str, args)]
    return subprocess.run(words, env=env, capture_output=True, text=True, timeout=120, cwd=site, check=False)


@pytest.fixture
def site(tmp_path: Path) -> Path:
    installed(tmp_path, declared())
    return tmp_path


def a_unit(folder: Path, serial: str, ohm: float) -> Path:
    unit = folder / serial
    unit.mkdir()
    (unit / "unit.toml").write_text(f'serial = "{serial}"\nkind = "apa"\n[insulation]\ninsulation_ohm = {ohm}\n')
    (folder / "spec.toml").write_text(SPEC)
    return unit


def test_its_check_is_judged(site: Path) -> None:
    units = [a_unit(site, "GOOD", 4.2e9), a_unit(site, "BAD", 4.2e6)]
    done = python(site, "-m", "accept", "batch", *units, "--spec", "spec.toml", "--out", "out", "--no-certificates")
    assert done.returncode == 3, done.stderr
    judged = {u["serial"]: u["findings"] for u in json.loads((site / "out" / "results.json").read_text())["units"]}
    said = {serial: [(f["quantity"], f["verdict"]) for f in findings] for serial, findings in judged.items()}
    assert said == {"GOOD": [("insulation_ohm", "pass")], "BAD": [("insulation_ohm", "fail")]}


def test_its_instrument_measures(site: Path) -> None:
    (site / "reading.txt").write_text("4.2e9\n")
    (site / "bench.toml").write_text(BENCH.format(file=site / "reading.txt"))
    done = python(site, "-m", "accept", "hw", "test", "--bench", "bench.toml")
    assert done.returncode == 0, done.stderr
    assert "4200000000.0000 ohm" in done.stdout
    in_workflow = """
from pathlib import Path
from accept.workflow.instruments.hardware import BenchInstruments
from accept.workflow.instruments.port import reading
from specs.bench import load_bench
port = BenchInstruments(load_bench(Path("bench.toml"))).serving("insulation", "insulation_ohm", None)
print(reading(port, "ohm").value)
"""
    assert python(site, "-c", in_workflow).stdout == "4200000000.0\n"


def test_its_effect_is_named(site: Path) -> None:
    found = python(
        site,
        "-c",
        """
import numpy as np
from dataclasses import replace
from checks.gap import run
from tests.checks.gap.shared.gap_cases import inputs
case = inputs(5, without=("channel_lowpass_de",))  # the name that the library has for the same filter
def filtered(d):
    slow = np.ones(d.H.shape, dtype=complex)
    slow[:, d.channels.index("de")] = 1 / (1 + 1j * d.f / 1500.0)
    return replace(d, H=d.H * slow)
result = run(replace(case, A=filtered(case.A), B=filtered(case.B)), lambda words: None)
print(result.verdict, *(n.effect for n in result.named), result.named[0].parameters["f_Hz"].value)
from accept.cli.main import app
app(["model", "effects"])
""",
    )
    first, _, listed = found.stdout.partition("\n")
    verdict, effect, f_Hz = first.split()
    assert (verdict, effect) == ("explained", "encoder_lowpass"), found.stderr
    assert float(f_Hz) == pytest.approx(1500.0, rel=0.01)  # ten times its interval: 0.1 %
    assert "encoder_lowpass (f_Hz): " in listed
    assert "misalignment (dx_um, dy_um): " in listed


BROKEN = {
    "does not import": ("accept.checks", "accept_plugin_example.nothing:CHECK", "ModuleNotFoundError"),
    "is no check": ("accept.checks", "accept_plugin_example.encoder_lowpass:EFFECT", "is a Effect, expected a Check"),
    "takes a name": ("accept.checks", "checks.acceptance.stroke:CHECK", "one check per quantity"),
    "is no effect": ("accept.effects", "accept_plugin_example.insulation:CHECK", "is a Check, expected an Effect"),
    "replaces an effect": ("accept.effects", "checks.gap.effects.piezo.creep:EFFECT", "the name 'creep' is taken"),
    "is no driver": ("accept.instruments", "accept_plugin_example.insulation:CHECK", "is a Check, expected a Driver"),
}


def test_a_broken_one_is_said_in_a_line_and_judges_nothing(tmp_path: Path) -> None:
    for k, (group, value, _) in enumerate(BROKEN.values()):
        installed(tmp_path, {group: {"bad": value}}, f"bad-plugin-{k}")
    unit = a_unit(tmp_path, "U", 4.2e9)
    load = "import checks.acceptance, checks.gap.effects, hw.instruments; from specs import plugins; "
    said = python(tmp_path, "-c", load + "print(*plugins.PROBLEMS, sep='\\n')").stdout.splitlines()
    assert len(said) == len(BROKEN)
    for k, (fault, (_, _, words)) in enumerate(BROKEN.items()):
        (line,) = [one for one in said if one.startswith(f"plug-in 'bad' of bad-plugin-{k} 1.0")]
        assert words in line, fault
    done = python(tmp_path, "-m", "accept", "batch", unit, "--spec", "spec.toml", "--out", "out", "--no-certificates")
    assert done.returncode == 6
    assert "unknown check" in done.stderr
    assert "bad-plugin-0" in done.stderr
    assert "Traceback" not in done.stderr


def test_what_a_plugin_brings_is_part_of_the_codes_hash(site: Path) -> None:
    words = "from accept.base.version import code_sha256; print(code_sha256())"
    first = python(site, "-c", words).stdout
    with (site / "accept_plugin_example" / "insulation.py").open("a") as file:
        file.write("# another\n")
    assert python(site, "-c", words).stdout != first


def editable(place: Path, site: Path) -> Path:
    """The package as `pip install -e` leaves it: a path beside the metadata, whose list has no file of the code."""
    installed(site, declared())
    code = shutil.move(site / "accept_plugin_example", place / "accept_plugin_example")
    (site / "example.pth").write_text(f"{place}\n")
    (site / "accept_plugin_example-1.0.dist-info" / "RECORD").write_text("example.pth,,\n")
    return Path(code)


@pytest.mark.parametrize("listing", ["of an editable install", "none"])
def test_the_hash_of_the_code_covers_what_is_imported(tmp_path: Path, listing: str) -> None:
    """Red before: neither list has the modules, and the hash stayed the same."""
    (site := tmp_path / "site").mkdir()
    (place := tmp_path / "source").mkdir()
    code = editable(place, site)
    if listing == "none":
        (site / "accept_plugin_example-1.0.dist-info" / "RECORD").unlink()
    env = os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{site}{os.pathsep}{place}"}

    def version() -> str:
        words = [sys.executable, "-m", "accept", "--version"]
        return subprocess.run(words, env=env, capture_output=True, text=True, check=True, cwd=tmp_path).stdout

    first, helper = version(), place / "shared_formulas" / "formula.py"
    assert "with accept-plugin-example 1.0, code " in first
    module = next(code.rglob("*.py"))
    module.write_text(module.read_text() + "import numpy, shared_formulas.formula\n")
    helper.parent.mkdir()
    helper.write_text("DENSITY = 7800.0\n")
    before = version()
    assert before != first
    helper.write_text("DENSITY = 7801.0\n")  # beside the package: no list has it, and a verdict may change with it
    assert version() != before


def test_without_plug_ins_the_hash_is_that_of_the_program(tmp_path: Path) -> None:
    digest = hashlib.sha256()
    packages = ("accept", "hw", "checks", "specs")
    files = (p for package in packages for p in (ROOT / package).rglob("*") if p.suffix in {".py", ".toml"})
    for path in sorted(files):
        digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    (site := tmp_path / "site").mkdir()
    assert f"code {digest.hexdigest()[:12]}\n" in python(site, "-m", "accept", "--version").stdout


def test_a_plug_in_without_a_file_is_left_out(tmp_path: Path) -> None:
    """From an archive: it could be changed without a trace in the hash."""
    installed(tmp_path, declared())
    archive = shutil.make_archive(str(tmp_path / "code"), "zip", tmp_path, "accept_plugin_example")
    shutil.rmtree(tmp_path / "accept_plugin_example")
    (tmp_path / "accept_plugin_example-1.0.dist-info" / "RECORD").unlink()
    env = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path), archive])}
    words = [
        sys.executable,
        "-c",
        "from checks.acceptance import CHECKS; from specs.plugins import PROBLEMS; print(*PROBLEMS, *CHECKS)",
    ]
    done = subprocess.run(words, env=env, capture_output=True, text=True, check=True, cwd=tmp_path.parent)
    assert "is found, so nothing would tell whether it was changed" in done.stdout
    assert not done.stdout.endswith("insulation\n")


def test_a_certificate_and_its_verification_name_the_plug_ins(site: Path) -> None:
    unit = a_unit(site, "GOOD", 4.2e9)
    secret = {"ACCEPT_PASSPHRASE": "secretsecret", "ACCEPT_CA_PASSPHRASE": "authorityauthority"}
    env = os.environ | secret | {"PYTHONPATH": f"{ROOT}{os.pathsep}{site}", "ACCEPT_HOME": str(site / "home")}

    def accept(*words: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "accept", *map(str, words)]
        return subprocess.run(command, env=env, capture_output=True, text=True, cwd=site, check=False)

    assert accept("keys", "init", "--technician", "Test Technician").returncode == 0
    made = accept("report", unit, "--spec", "spec.toml", "--out", "a.pdf")
    assert (site / "a.pdf").exists(), made.stderr
    page = "".join(one.extract_text() for one in PdfReader(site / "a.pdf").pages)
    assert "with accept-plugin-example 1.0 (" in page
    assert "plug-ins here: accept " in accept("verify", "a.pdf").stderr
