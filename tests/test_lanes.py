"""The heavy lane and the lanes of the houses: no proof is lost by being named wrongly, what is changed brings its
proofs back, and what stands above a house that is changed is asked whether it still stands."""

import os
import tomllib
from pathlib import Path

import pytest

import tests
from tests import soak
from tests.shared import houses
from tests.shared.houses import HOUSES, doors, every_file, house_of, lane, touched
from tests.soak import HEAVY, ROOT, is_heavy, runs, unknown

FILE = "tests/accept/store/test_store_kill.py"
KILLED = f"{FILE}::test_killed_at_every_point[new store]"


def test_linear_algebra_has_the_one_thread_of_the_product() -> None:
    assert not tests.NUMPY_WAS_FIRST
    assert all(f"{name}_NUM_THREADS" in os.environ for name in ("OPENBLAS", "OMP", "MKL"))  # whoever set them


def test_files_and_folders_are_there() -> None:
    for file, heavy in HEAVY.items():
        assert (ROOT / file).is_file()
        assert [place for place in heavy.proves if not (ROOT / place).exists()] == []


def test_what_proves_the_same_as_a_removed_test_is_there() -> None:
    rows = [
        line.split("|")[1:3]
        for line in (ROOT / "tests/shared/removed_tests.md").read_text().splitlines()
        if "::" in line
    ]
    assert rows
    for _, proof in rows:
        file, name = proof.strip().strip("`").split("::")
        assert f"def {name}(" in (ROOT / "tests" / file).read_text(encoding="utf-8")


def test_parameters_in_brackets_leave_the_others() -> None:
    assert is_heavy(KILLED)
    assert not is_heavy(f"{FILE}::test_killed_at_every_point[existing store]")
    assert is_heavy(f"{FILE}::test_killed_at_random_moments")


def test_an_entry_without_a_test_is_told() -> None:
    assert f"{FILE}::test_killed_at_random_moments" in unknown([KILLED])
    assert KILLED not in unknown([KILLED])


@pytest.mark.parametrize(
    ("changed", "wanted"), [("accept/store/chain.py", True), (FILE, True), ("accept/stores.py", False)]
)
def test_what_is_changed_brings_its_proofs_back(changed: str, wanted: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(soak, "SOAK", False)
    monkeypatch.setattr(soak, "_changed", lambda: (changed,))
    assert runs(KILLED) is wanted


def test_every_folder_of_product_and_tests_is_in_a_lane() -> None:
    rooms = [f"{top}/{p.name}" for top in ("accept", "checks", "hw") for p in (ROOT / top).iterdir() if holds_python(p)]
    assert [room for room in rooms if room not in HOUSES] == []
    places = [place for house in HOUSES.values() for place in (*house.tests, *house.door)]
    assert [place for place in places if not (ROOT / place).exists()] == []
    files = [path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py")]
    assert [f for f in files if f not in every_file() and not houses._within(f, places)] == []


def holds_python(folder: Path) -> bool:
    return folder.is_dir() and any(folder.glob("*.py"))


def test_every_door_is_one_of_its_own_tests() -> None:
    assert [(h, d) for h, house in HOUSES.items() for d in house.door if not houses._within(d, house.tests)] == []


def test_houses_stand_in_the_order_of_the_imports() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    for contract in (c for c in contracts if c["type"] == "layers"):
        ranks = {
            room.strip().replace(".", "/"): rank
            for rank, layer in enumerate(contract["layers"])
            for room in layer.split("|")
        }
        order = [ranks[house] for house in HOUSES if house in ranks]
        assert order == sorted(order), contract["name"]


def test_a_lane_has_its_own_tests_and_the_doors_above_alone() -> None:
    found = lane(["accept/batch"])
    assert {"tests/accept/batch", "tests/accept/workflow/test_workflow.py", *every_file()} <= {*found}
    assert not {"tests/accept/certificate/test_certificate.py", "tests/hw/records"} & {*found}
    assert {"tests/checks/gap", "tests/checks/signals", "tests/checks"} & {*lane(["checks"])} == {"tests/checks"}


def test_a_house_that_is_not_there_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert houses.main(["check"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "no house 'check'; there are: " in said.err


@pytest.mark.parametrize(
    ("file", "wanted"),
    [
        ("checks/gap/search/places.py", ["checks/gap"]),
        ("checks/verdict.py", ["checks"]),
        ("tests/accept/store/test_store.py", ["tests/accept/store/test_store.py"]),
        ("tests/accept/store/gone/test_of_old.py", []),
        ("tests/test_citation.py", ["tests/test_citation.py"]),
        ("README.md", []),
        ("docs/how-to/gap.md", ["docs"]),
        ("tests/shared/once.py", None),
        ("tests/conftest.py", None),
        ("tests/accept/gap/conftest.py", None),
        ("tests/checks/gap/shared/gap_units.py", None),  # by tests/shared/gap_run.py
        ("validation/strut.py", None),
        ("requirements.lock", None),
        ("Makefile", None),
    ],
)
def test_what_differs_finds_its_lane(file: str, wanted: list[str] | None) -> None:
    assert touched([file]) == wanted


def test_a_helper_concerns_those_who_import_it_by_other_helpers_too() -> None:
    directly = touched(["tests/accept/certificate/verify/hostile_files.py"])
    assert directly is not None
    assert {*directly} == {
        "tests/accept/certificate/verify/test_hostile_files.py",
        "tests/accept/base/test_watchdog.py",
    }
    by_another = touched(["tests/checks/signals/hammer_plant.py"])
    assert by_another is not None
    assert {"tests/checks/signals/test_hammer.py", "tests/accept/commands/test_hammer_cli.py"} <= {*by_another}


def test_no_file_is_too_deep_or_too_high_for_its_house() -> None:
    assert (house_of("hw/instruments/fault.py"), house_of("hw/link.py")) == ("hw/instruments", "hw")
    assert house_of("hwx/link.py") is None


def test_the_quick_lane_is_the_doors() -> None:
    assert {"tests/specs", "tests/accept/base/test_runner.py", "tests/checks/signals/test_frf.py"} <= {*doors()}
