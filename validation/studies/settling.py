"""Whether one experiment settles what a first answer leaves open: hidden element, first answer, the experiment that it
asks for as the independent generator simulates it, second answer.

    python -m validation.studies.settling --out out/settling --units 24 --seed 7

Counts, of all units with an element whose first answer leaves more than one explanation: what the second says. A truth
that is refuted, and a library name, are errors; a class that holds the truth and is smaller is progress.
"""

import argparse
import json
import re
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from accept.gap.analyse_unit import run_gap
from validation.bench import World, add_experiment
from validation.cases import Case
from validation.model_files import write_model
from validation.rational import highpass
from validation.sets import Set
from validation.strut import Attached
from validation.studies.anywhere import right_places
from validation.studies.elements import DRAWN, Truth, draw_cases

ENTRY = re.compile(r'kind = "([^"]+)"(?:, (\w+) = ([\d.e+-]+))?')
SENSOR_F = 5.1e-6
VS = 2
SIDE_M = 30e-3
ALONG_THE_AXIS = ("bellows", "resonator")


def under(world: World, kind: str, value: float) -> World:
    """Return the world under an experiment, from the words of its request only."""
    strut = world.strut
    if kind == "added_mass":
        return replace(world, strut=replace(strut, payload=strut.payload + value))
    if kind == "other_resistor":
        corner = 1.0 / (2 * np.pi * value * SENSOR_F)
        closed = 0.0 if corner > 1e3 else strut.stiffening
        filters = (*world.filters, ((VS,), highpass(corner)))
        return replace(world, strut=replace(strut, stiffening=closed), filters=filters)
    if kind == "own_return":
        return replace(world, crosstalk=0.0)
    if kind.startswith("removed_from_"):
        place = kind.removeprefix("removed_from_").removesuffix("_interface")
        return replace(world, strut=replace(strut, attached=tuple(e for e in strut.attached if e.place != place)))
    if found := re.fullmatch(r"mass_on_(top|bottom)_interface([+-])([xy])", kind):
        place, sign, axis = found.groups()
        lever = SIDE_M if sign == "+" else -SIDE_M
        at = (lever, 0.0) if axis == "x" else (0.0, lever)
        mass = tuple(Attached(place, d, at=at, m=value) for d in range(3))
        return replace(world, strut=replace(strut, attached=(*strut.attached, *mass)))
    raise ValueError(f"no experiment '{kind}'")


def asked(gap: Mapping[str, Any]) -> tuple[str, str, float] | None:
    """Return the experiment that an answer asks for: kind, line of unit.toml, value; None for one without an entry."""
    for entry in (*gap.get("elements", ()), *gap["ambiguous"]):
        if found := ENTRY.search(entry["experiment"]):
            kind, key, value = found.groups()
            return kind, f"{key} = {value}" if key else "", float(value or 0.0)
    return None


def class_of(gap: Mapping[str, Any]) -> set[str]:
    """Return what an answer leaves: parts of elements, and names that explain the records as well or are given."""
    left = {f"{p['part']} against {p['against']}" for e in gap.get("elements", ()) for p in e["places"]}
    for e in gap.get("elements", ()):
        left |= set(filter(None, e["sentence"].partition(" Explained as well by ")[2].removesuffix(".").split(", ")))
    return left | {n for a in gap["ambiguous"] for n in a["effects"]} | {n["effect"] for n in gap["named"]}


def holds(gap: Mapping[str, Any], truth: Truth) -> bool:
    """Return whether the truth is in the class of an answer."""
    return any(right_places(truth.places, e["places"]) for e in gap.get("elements", ()))


def outcome(first: Mapping[str, Any], second: Mapping[str, Any], truth: Truth) -> str:
    """Return the line of the table for a unit whose first answer leaves several explanations."""
    before, after = class_of(first), class_of(second)
    if second["named"]:
        return "false name"
    if not holds(first, truth):
        return "wrong class withdrawn" if not after else "wrong class stays"
    if not holds(second, truth):
        return "truth refuted"
    right = {f"{part} against {against}" for part, against in truth.places}
    if len(after) == 1 or after <= right:
        return "one and right"
    return "smaller, holds the truth" if after < before or len(after) < len(before) else "as large as before"


def draw(number: int, seed: int, scatter: float) -> list[tuple[str, Case, Truth]]:
    """Return units in which something pulls or hangs along the axis, so that a first answer leaves its place open; two
    at the payload, two at the top interface, in turns."""
    drawn = [each for each in draw_cases(number * len(DRAWN), seed, scatter) if each[0] in ALONG_THE_AXIS][:number]
    return [_at_top(*each) if k // 2 % 2 else each for k, each in enumerate(drawn)]


def _at_top(name: str, case: Case, truth: Truth) -> tuple[str, Case, Truth]:
    attached = (replace(case.strut.attached[0], place="top"),)
    case = replace(case, strut=replace(case.strut, attached=attached))
    return name, case, replace(truth, places=(("top interface", "ground"),))


def settle(case: Case, truth: Truth, model: Path, seed: int, rounds: int) -> dict[str, Any]:
    """Return the answers of a unit, the experiments between them, and what became of it after each."""
    start = time.process_time()
    with tempfile.TemporaryDirectory(prefix="settling-") as parent:
        folder = case.write(Path(parent))
        answers, done, said = [run_gap(folder, model)], [], []
        while len(done) < rounds and answers[-1].get("elements") and len(class_of(answers[-1])) > 1:
            if (wanted := asked(answers[-1])) is None or wanted in done:
                said.append("nothing proposed")
                break
            kind, line, value = wanted
            add_experiment(folder, under(case.world, kind, value), case.setting, seed + len(done), kind, line)
            done.append(wanted)
            answers.append(run_gap(folder, model))
            said.append(outcome(answers[0], answers[-1], truth))
    first = answers[0]
    found = "truth in the class" if holds(first, truth) else "truth not in it"
    said = said or [f"not several: {first['verdict']}, {found if first.get('elements') else 'nothing found'}"]
    return {"outcomes": said, "experiments": done, "seconds": time.process_time() - start, "answers": answers}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="settling", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--units", type=int, default=16)
    parser.add_argument("--first", type=int, default=0, help="number of the first one to be run")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--scatter", type=float, default=0.0, help="1 sd of the modes' frequencies from unit to unit")
    parser.add_argument("--experiments", type=int, default=2, help="most for one unit, one after the other")
    parser.add_argument("--out", type=Path, default=Path("out/settling"))
    a = parser.parse_args(arguments)
    a.out.mkdir(parents=True, exist_ok=True)
    model = write_model(Set(0, {}, a.scatter, a.scatter), a.out / "model")
    counts: Counter[str] = Counter()
    for k, (name, case, truth) in list(enumerate(draw(a.units, a.seed, a.scatter)))[a.first :]:
        try:
            done = settle(case, truth, model, 1000 * a.seed + 10 * k, a.experiments)
        except Exception as e:  # noqa: BLE001 a crash is what this has to count
            done = {"outcomes": [f"{type(e).__name__}: {e}"], "experiments": [], "answers": [], "seconds": 0.0}
        (a.out / f"{case.serial}.json").write_text(json.dumps([name, repr(truth), done], indent=1))
        counts[f"after one experiment: {done['outcomes'][0]}"] += 1
        counts[f"in the end: {done['outcomes'][-1]}"] += 1
        classes = " -> ".join(str(sorted(class_of(gap))) for gap in done["answers"])
        kinds = [kind for kind, _, _ in done["experiments"]]
        print(case.serial, name, truth.places[0][0], done["outcomes"], kinds, classes, f"{done['seconds']:.0f} s")
        print(*(f"  {what}: {number}" for what, number in sorted(counts.items())), sep="\n", flush=True)


if __name__ == "__main__":
    main()
