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
from validation.studies.elements import Truth, draw_cases

ENTRY = re.compile(r'kind = "([^"]+)"(?:, (\w+) = ([\d.e+-]+))?')
SENSOR_F = 5.1e-6
VS = 2
SIDE_M = 30e-3
NAMES = ("holder", "bellows", "resonator", "cable", "loose joint")


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
    places = {(p["part"], p["against"]) for e in gap.get("elements", ()) for p in e["places"]}
    return bool(places & set(truth.places))


def outcome(first: Mapping[str, Any], second: Mapping[str, Any] | None, truth: Truth) -> str:
    """Return the line of the table for a unit whose first answer leaves several explanations."""
    if second is None:
        return "nothing proposed"
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


def settle(case: Case, truth: Truth, model: Path, seed: int) -> dict[str, Any]:
    """Return both answers of a unit, the experiment between them, and what became of it."""
    start = time.process_time()
    with tempfile.TemporaryDirectory(prefix="settling-") as parent:
        folder = case.write(Path(parent))
        first, second, done = run_gap(folder, model), None, None
        several = len(class_of(first)) > 1 and bool(first.get("elements"))
        if several and (done := asked(first)) is not None:
            kind, line, value = done
            add_experiment(folder, under(case.world, kind, value), case.setting, seed, kind, line)
            second = run_gap(folder, model)
    said = outcome(first, second, truth) if several else f"not several: {first['verdict']}"
    return {"outcome": said, "experiment": done, "seconds": time.process_time() - start} | {
        "first": first,
        "second": second,
    }


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="settling", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--units", type=int, default=16, help="drawn; those of other kinds are passed over")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--scatter", type=float, default=0.0, help="1 sd of the modes' frequencies from unit to unit")
    parser.add_argument("--kinds", nargs="*", default=NAMES, help=f"of hidden elements: {', '.join(NAMES)}")
    parser.add_argument("--out", type=Path, default=Path("out/settling"))
    a = parser.parse_args(arguments)
    a.out.mkdir(parents=True, exist_ok=True)
    model = write_model(Set(0, {}, a.scatter, a.scatter), a.out / "model")
    counts: Counter[str] = Counter()
    for k, (name, case, truth) in enumerate(draw_cases(a.units, a.seed, a.scatter)):
        if name not in a.kinds:
            continue
        try:
            done = settle(case, truth, model, a.seed + 1000 + k)
        except Exception as e:  # noqa: BLE001 a crash is what this has to count
            done = {"outcome": f"{type(e).__name__}: {e}"}
        (a.out / f"{case.serial}.json").write_text(json.dumps([name, repr(truth), done], indent=1))
        counts[done["outcome"]] += 1
        classes = [sorted(class_of(done[key])) for key in ("first", "second") if done.get(key)]
        print(case.serial, name, done["outcome"], done.get("experiment"), *classes, f"{done.get('seconds', 0):.0f} s")
        print(*(f"  {what}: {number}" for what, number in counts.most_common()), sep="\n", flush=True)


if __name__ == "__main__":
    main()
