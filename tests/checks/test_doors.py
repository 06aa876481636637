"""The doors of rooms: few names, each there, none hidden by a file of its name; their pages run."""

import ast
import textwrap
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

import numpy as np
import pytest

from accept.base.home import home
from accept.certificate.trust import keys
from accept.certificate.trust.authority import TECHNICIAN
from accept.gap.analyse_unit import GapAnalysis
from accept.gap.unit_responses import Responses
from accept.judging import judge_unit
from accept.models.model_file import open_model, open_model_file
from accept.simulate.hammer_records import FS, ShellMode, hammer_record
from accept.store import open_store
from accept.store.payloads import UnitRefused
from accept.units import unit_folder
from checks.declare import Measured
from checks.fitting import Dataset
from checks.fitting.dataset import simulated
from checks.gap import Inputs, run
from checks.gap.structures import LinearModel
from checks.model import Model, time_simulation
from checks.record import Record
from specs import shown
from specs.bench import load_bench
from specs.model import load_model
from specs.spec import load

ROOT = Path(__file__).parents[2]
MOST_AT_A_DOOR, MOST_IN_ALL = 25, {"checks": 150, "hw": 40}
MOST_OF = {"accept.certificate": 40, "accept.store": 26}  # of a store 25 are asked for
WITHOUT_A_PAGE = ("hw.instruments", "hw.recorders", "hw.records", "hw.simulated")  # theirs need a bench


def simulated_records(model: Model, channels: tuple[str, ...], seed: int, bins: int = 60) -> Dataset:
    f = np.geomspace(10.0, 1000.0, bins)
    H = model.frf(f, channels=channels)
    cov = (1e-3 * np.abs(H[:, :, None])) ** 2 * np.eye(len(channels))
    return simulated(f, H, channels, cov.astype(complex), np.random.default_rng(seed))


def for_acceptance() -> dict[str, Any]:
    t = np.arange(2000) / 1e3
    record = Record(t, {"Va": np.sin(300 * t), "de": 1e-6 * np.sin(300 * t)}, {"Va": "V", "de": "m"})
    values = {"sensor_uF": Measured(5.1), "actuator_uF": Measured(9.8)}
    return {"values": values, "spec": load("apa-basic"), "record": record}


def for_consistency() -> dict[str, Any]:
    return {"findings": [], "known": {}}


def for_misalignment() -> dict[str, Any]:
    model = replace(open_model("strut"), damping="modal")
    first, second = (simulated_records(model, ("de", "da"), seed, 800) for seed in (1, 2))
    return {"model": model, "first": first, "second": second, "np": np}


def for_fitting() -> dict[str, Any]:
    model = open_model("apa-2dof")
    first, second = (simulated_records(model, model.channels, seed) for seed in (1, 2))
    rng = np.random.default_rng(5)
    t, Va = np.arange(40_000) / 1e4, rng.standard_normal(40_000)
    channels = {"Va": Va} | time_simulation(model, t.size, 1e4)(Va)
    low = Record(t, channels, {"Va": "V", "Vs": "V", "de": "m", "da": "m"})
    return {"model": model, "first": first, "second": second, "low": low, "high": low}


def for_gap() -> dict[str, Any]:
    model = open_model("apa-2dof")
    first, second = (simulated_records(model, model.channels, seed) for seed in (1, 2))
    return {"model": model, "first": first, "second": second}


def for_model() -> dict[str, Any]:
    return {"f": np.geomspace(20.0, 700.0, 30), "Va": np.sin(np.arange(500)), "load_model": load_model}


def for_signals() -> dict[str, Any]:
    force, angle = hammer_record([ShellMode(280.0, 0.008, 3e-7)], np.random.default_rng(2))
    hits = Record(np.arange(force.size) / FS, {"Track1": force, "Track2": angle}, {"Track1": "N", "Track2": "rad"})
    return {"record": for_fitting()["low"], "hammer_records": [hits]}


def for_population() -> dict[str, Any]:
    model = open_model("apa-2dof")
    units = {f"U-{i}": simulated_records(model, model.channels, i) for i in range(3)}
    return {"model": model, "measured": units}


def for_structures() -> dict[str, Any]:
    M, K = np.diag([2.0, 1.0]), 1e5 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    tip = np.array([0.0, 1.0])
    drawn = LinearModel("frame", M, 1e-4 * K, K, tip, {"tip": tip}, {"tip": {"x": tip}})
    f = np.geomspace(5.0, 100.0, 60)
    H = drawn.frf(f)
    cov = (1e-3 * np.abs(H[:, :, None])) ** 2 + 0j
    first, second = (simulated(f, H, ("tip",), cov, np.random.default_rng(seed)) for seed in (1, 2))
    return {"M": M, "C": 1e-4 * K, "K": K, "tip": tip, "first": first, "second": second}


def for_judging() -> dict[str, Any]:
    folder = Path("A-1")
    folder.mkdir()
    (folder / "unit.toml").write_text(
        'serial = "A-1"\nkind = "apa"\n[capacitance]\nsensor_uF = 5.1\nactuator_uF = 9.8\n'
    )
    return {"unit": unit_folder.read(folder)}


def for_units() -> dict[str, Any]:
    for_judging()
    Path("A-1").rename("units")
    return {"Path": Path}


def for_reservations() -> dict[str, Any]:
    unit = for_judging()["unit"]
    return {"unit": unit, "record": judge_unit(unit, load("apa-basic")), "store": open_store()}


def for_store() -> dict[str, Any]:
    return {"serial": "A-1", "payload": UnitRefused("units/A-1", "unit.toml is missing")}


def for_certificate() -> dict[str, Any]:
    keys.init(home(), "correct horse", "Ann")
    unit = for_judging()["unit"]
    spec = load("apa-basic")
    return {
        "result": judge_unit(unit, spec),
        "spec": spec,
        "folder": unit.path,
        "home": home(),
        "path": home() / "A-1.pdf",
        "credential": keys.unlock(home(), TECHNICIAN, "correct horse"),
        "store": open_store(),
    }


def for_trust() -> dict[str, Any]:
    offline = 'driver = "offline"\nmodel = "X"\nmeasures = ["stroke"]\n'
    Path("bench.toml").write_text(f'name = "B1"\n[instruments.tip]\n{offline}')
    spec, day = load("apa-basic"), date(2026, 1, 2)
    return {
        "home": home(),
        "spec": spec,
        "bench": load_bench("bench.toml"),
        "day": day,
        "store": open_store("sqlite://"),
    }


def for_gap_of_units() -> dict[str, Any]:
    """The records of a unit are read by the tests of the gap itself: here they are simulated."""
    given = for_gap()
    measured = Responses("A-1", "apa", given["first"], given["second"], 350.0)
    inputs = Inputs(model=given["model"], A=measured.first, B=measured.second, fs=10_000.0)
    done = GapAnalysis(run(inputs, lambda _: None), measured, open_model_file("apa-2dof"), inputs)
    return {"unit": "A-1", "analyse": lambda *_, **__: done, "responses": lambda _: measured}


def for_fleet() -> dict[str, Any]:
    given = open_model_file("apa-2dof")
    pairs = ([simulated_records(given.model, given.model.channels, seed) for seed in (i, i + 9)] for i in range(3))
    measured = [Responses(f"U-{i}", "apa", *pair, 350.0) for i, pair in enumerate(pairs)]
    return {"store": open_store("sqlite://"), "given": given, "measured": measured, "path": Path("batch.toml")}


PAGES: dict[str, Callable[[], dict[str, Any]]] = {
    "accept.certificate": for_certificate,
    "accept.certificate.trust": for_trust,
    "accept.fleet": for_fleet,
    "accept.gap": for_gap_of_units,
    "accept.judging": for_judging,
    "accept.judging.reservations": for_reservations,
    "accept.store": for_store,
    "accept.units": for_units,
    "checks.acceptance": for_acceptance,
    "checks.consistency": for_consistency,
    "checks.misalignment": for_misalignment,
    "checks.fitting": for_fitting,
    "checks.gap": for_gap,
    "checks.model": for_model,
    "checks.population": for_population,
    "checks.signals": for_signals,
    "checks.gap.structures": for_structures,
}


def names_of(room: str) -> set[str]:
    own = ast.parse(Path(str(import_module(room).__file__)).read_text(encoding="utf-8"))
    defined = {n.name for n in own.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}
    defined |= {t.id for n in own.body if isinstance(n, ast.Assign) for t in n.targets if isinstance(t, ast.Name)}
    return {name for name in defined | shown(room).keys() if not name.startswith("_")}


@pytest.mark.parametrize("room", [*PAGES, *WITHOUT_A_PAGE])
def test_a_door_shows_few_names_and_each_is_there(room: str) -> None:
    names = names_of(room)
    assert len(names) <= MOST_OF.get(room, MOST_AT_A_DOOR)
    door = import_module(room)
    assert all(getattr(door, name) is not None for name in names)
    assert not names & {m.name for m in iter_modules(door.__path__)}, "a file of this name would hide it once imported"
    with pytest.raises(AttributeError, match=f"'{room}' has no attribute 'bell'"):
        _ = door.bell


@pytest.mark.parametrize("room", PAGES)
def test_the_page_of_a_door_runs(room: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The indented lines of its docstring, with all names of the door."""
    monkeypatch.chdir(tmp_path)
    page = str(import_module(room).__doc__).partition("\n\n")[2]
    code = "\n".join(line for line in page.splitlines() if line.startswith("    ") or not line)
    assert code.strip()
    names = {name: getattr(import_module(room), name) for name in names_of(room)}
    exec(textwrap.dedent(code), names | PAGES[room]())


@pytest.mark.parametrize("house", MOST_IN_ALL)
def test_a_house_is_entered_by_few_names(house: str) -> None:
    """Of modules and doors, counted with imports in functions."""
    entered = {
        (node.module, alias.name)
        for other in ("accept", "hw", "checks")
        if other != house
        for path in (ROOT / other).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_bytes()))
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == house
        for alias in node.names
    }
    assert len(entered) <= MOST_IN_ALL[house], sorted(entered)
