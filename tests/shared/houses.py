"""The lanes of the houses: `make test HOUSE=checks/gap` runs the tests of that house, of the houses above it those that
show their doors, and what reads every file. `HOUSE=changed` takes the houses that differ from main, or from SINCE.

The table is in the order of the imports, from the top down. A test stands in it that a folder of the product and its
folder of tests are in it, so that no test is left out of every lane.
"""

import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
CHANGED, DOORS = "changed", "doors"  # words in place of houses
USED_BY_TESTS = ("validation",)  # makes the units of a clone without recorded ones
TEXT = ("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "README.md", "mkdocs.yml")


@dataclass(frozen=True)
class House:
    """tests: its own, folders or files; door: those of them that say most in least time. They run after a change of
    any house below, and in `make quick`."""

    tests: Sequence[str]
    door: Sequence[str] = ()


HOUSES: Mapping[str, House] = {
    "benchmarks": House([]),
    "docs": House([]),  # its tests are among those that read every file
    "validation": House(["tests/validation"]),
    "accept/cli": House(["tests/accept/commands", "tests/windows"], ["tests/accept/commands/test_wrong_orders.py"]),
    "accept/commands": House(["tests/accept/commands"]),
    "accept/tui": House(["tests/accept/tui"], ["tests/accept/tui/test_tui_keys.py"]),
    "accept/workflow": House(["tests/accept/workflow"], ["tests/accept/workflow/test_workflow.py"]),
    "accept/analysis": House(["tests/accept/analysis"], ["tests/accept/analysis/test_given_responses.py"]),
    "accept/batch": House(["tests/accept/batch"], ["tests/accept/batch/test_judged_once.py"]),
    "accept/certificate": House(["tests/accept/certificate"], ["tests/accept/certificate/test_certificate.py"]),
    "accept/fleet": House(["tests/accept/fleet"], ["tests/accept/fleet/test_selection.py"]),
    "accept/gap": House(["tests/accept/gap"], ["tests/accept/gap/test_gap_text_labels.py"]),
    "accept/simulate": House(["tests/accept/units/test_simulate.py"]),
    "accept/capture": House(
        [
            "tests/accept/units",
            "tests/accept/workflow/test_capture_log.py",
            "tests/accept/workflow/test_recording.py",
            "tests/accept/commands/test_rig.py",
        ]
    ),
    "accept/judging": House(["tests/accept/units", "tests/accept/batch"], ["tests/accept/units/test_origin.py"]),
    "accept/models": House(["tests/accept/commands/test_model_cli.py", "tests/accept/units"]),
    "accept/store": House(["tests/accept/store"], ["tests/accept/store/test_store_fold.py"]),
    "accept/units": House(["tests/accept/units", "tests/statements"], ["tests/accept/units/test_unit.py"]),
    "accept/base": House(
        ["tests/accept/base"],
        [
            "tests/accept/base/documents",
            "tests/accept/base/test_answer.py",
            "tests/accept/base/test_bounded.py",
            "tests/accept/base/test_runner.py",
            "tests/accept/base/test_without_secrets.py",
            "tests/accept/base/test_write_new.py",
        ],
    ),
    "accept/pictures": House(["tests/accept/pictures"], ["tests/accept/pictures/test_pictures.py"]),
    "accept": House(["tests/accept/test_api.py", "tests/windows"], ["tests/accept/test_api.py"]),
    "hw/recorders": House(["tests/hw/recorders"], ["tests/hw/recorders/test_recorders.py"]),
    "hw/simulated": House(["tests/hw"]),
    "hw/instruments": House(
        ["tests/hw/instruments", "tests/hw/apart", "tests/hw/peers"],
        [
            "tests/hw/instruments/test_heidenhain.py",
            "tests/hw/instruments/test_lcr800.py",
            "tests/hw/instruments/test_parsing.py",
        ],
    ),
    "hw/records": House(["tests/hw/records", "tests/statements"], ["tests/hw/records"]),
    "hw": House(["tests/hw"]),
    "checks/gap": House(["tests/checks/gap"], ["tests/checks/gap/test_gap_contract.py"]),
    "checks/consistency": House(["tests/checks/consistency"]),
    "checks/population": House(["tests/checks/population"]),
    "checks/acceptance": House(
        ["tests/checks/acceptance", "tests/plugins"],
        [
            "tests/checks/acceptance/test_flatness.py",
            "tests/checks/acceptance/test_stroke.py",
            "tests/checks/acceptance/test_verdict.py",
        ],
    ),
    "checks/misalignment": House(["tests/checks/misalignment"]),
    "checks/fitting": House(["tests/checks/fitting"], ["tests/checks/fitting/test_dataset.py"]),
    "checks/model": House(
        ["tests/checks/model"], ["tests/checks/model/test_beam.py", "tests/checks/model/test_model_2dof.py"]
    ),
    "checks/signals": House(["tests/checks/signals"], ["tests/checks/signals/test_frf.py"]),
    "checks": House(["tests/checks"]),
    "specs": House(["tests/specs", "tests/plugins"], ["tests/specs"]),
}


def house_of(path: str) -> str | None:
    """Return the innermost house that a file of the product lies in."""
    return max((h for h in HOUSES if path.startswith(f"{h}/")), key=len, default=None)


def changed(since: str) -> tuple[str, ...]:
    """Return the files that differ from a commit, those that git does not know yet included."""
    orders = (["diff", "--name-only", since, "--"], ["ls-files", "--others", "--exclude-standard"])
    said = (subprocess.run(["git", *o], cwd=ROOT, check=True, capture_output=True, text=True).stdout for o in orders)
    return tuple(file for text in said for file in text.splitlines())


def touched(files: Sequence[str]) -> list[str] | None:
    """Return the houses and the files of tests whose lane a change needs; None if it may concern every test."""
    found: list[str] = []
    for file in files:
        house = house_of(file)
        if house is not None and house not in USED_BY_TESTS:
            found.append(house)
        elif file.startswith("tests/"):
            of_tests = users(file)
            if of_tests is None:
                return None
            found.extend(of_tests)
        elif file not in TEXT:
            return None
    return list(dict.fromkeys(found))


def users(file: str) -> list[str] | None:
    """Return the files of tests that a change under tests concerns: itself, or those that import a helper, by other
    helpers too. None if all may."""
    texts = {p.relative_to(ROOT).as_posix(): p.read_text("utf-8") for p in (ROOT / "tests").rglob("*.py")}
    found, todo = [file], [file]
    while todo:
        if Path(helper := todo.pop()).name == "conftest.py" or helper.startswith("tests/shared/"):
            return None
        more = [user for user, text in texts.items() if user not in found and _imports(text, helper)]
        found, todo = found + more, todo + more
    return [f for f in found if f in texts and Path(f).name.startswith("test_")]


def _imports(text: str, file: str) -> bool:
    """Return whether the text of a module names another: after `from`, `import` or `-m`."""
    place, _, name = file.removesuffix(".py").replace("/", ".").rpartition(".")
    module, place = re.escape(f"{place}.{name}"), re.escape(place)
    return re.search(rf"\b{module}\b|^from {place} import (\([^)]*|.*)\b{name}\b", text, re.MULTILINE) is not None


def lane(names: Sequence[str]) -> list[str]:
    """Return what pytest is given for these houses and files of tests: their tests, the doors above, and the tests that
    read every file. `checks` is all of its rooms. Raises KeyError for what is neither."""
    order = list(HOUSES)
    houses = [h for name in names for h in order if h == name or h.startswith(f"{name}/")]
    files = [name for name in names if name.startswith("tests/")]
    for name in names:
        if not any(h == name or h.startswith(f"{name}/") for h in houses) and name not in files:
            raise KeyError(name)
    lowest = max(map(order.index, houses), default=0)
    own = [test for h in houses for test in HOUSES[h].tests]
    above = [test for h in order[:lowest] for test in HOUSES[h].door]
    return _outermost([*own, *files, *above, *every_file()])


def doors() -> list[str]:
    """Return the tests of every door."""
    return _outermost([test for house in HOUSES.values() for test in house.door])


def every_file() -> list[str]:
    return sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").glob("test_*.py"))


def _within(path: str, places: Sequence[str]) -> bool:
    return any(path == place or path.startswith(f"{place}/") for place in places)


def _outermost(paths: Sequence[str]) -> list[str]:
    """Return the paths that lie in none of the others, each once."""
    once = list(dict.fromkeys(paths))
    return [p for p in once if not _within(p, [q for q in once if q != p])]


def main(words: Sequence[str]) -> int:
    """Print what pytest is given; nothing, so that it runs all, if a change may concern every test."""
    if words[:1] == [DOORS]:
        print(*doors())
        return 0
    if words[:1] == [CHANGED]:
        names = touched(changed(words[1] if len(words) > 1 else "main"))
        print(*(lane(names) if names is not None else ()))
        print("lane:", "every test" if names is None else " ".join(names) or "nothing differs", file=sys.stderr)
        return 0
    try:
        print(*lane(words))
    except KeyError as error:
        print(f"no house {error}; there are: {' '.join(HOUSES)}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
