"""The blind test of elements: units that hide an element anywhere in the mechanics, or a filter, and what is said of
them; place, kind, values, false names, silence where nothing is hidden, and one experiment later.

    python -m validation.studies.sealed --units 20 --seed 7001 --out out/sealed                    # exact struts
    python -m validation.studies.sealed --units 20 --seed 7002 --out out/built --scatter 0.01      # as built
    python -m validation.studies.sealed --units 20 --seed 7003 --out out/laboratory --scatter 0.01 --learn 8

The hash of the truth is printed before anything is run. Finished units are kept, so that a stopped run goes on.
"""

import argparse
import hashlib
import json
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from accept.gap.analyse_unit import run_gap
from validation.bench import add_experiment
from validation.benches import Bench, draw_benches
from validation.cases import Case, draw_cases
from validation.challenge import learned
from validation.model_files import write_model
from validation.scoring.results_store import stamp
from validation.sets import BENCHES, DAMPING, Batch, Set
from validation.shell import draw_shell
from validation.studies.anywhere import Truth, draw_anywhere, right_places
from validation.studies.settling import asked, class_of, under

LEVEL = 0.95
SILENT = "no_missing_effect"
Row = Mapping[str, Any]


def interval(hits: int, n: int) -> tuple[float, float]:
    """Return the two-sided 95 % interval of a proportion (Clopper and Pearson)."""
    tail = (1 - LEVEL) / 2
    lo = stats.beta.ppf(tail, hits, n - hits + 1) if hits else 0.0
    hi = stats.beta.ppf(1 - tail, hits + 1, n - hits) if hits < n else 1.0
    return float(lo), float(hi)


def judged(truth: Truth, gap: Mapping[str, Any]) -> dict[str, Any]:
    """Return how an answer compares with the truth: its element at the right place, else its first."""
    found = gap.get("elements", [])
    right = [e for e in found if right_places(truth.places, e["places"])]
    names = [n["effect"] for n in gap.get("named", [])]
    alike = [n for n in names if n in truth.alike]
    said = [e for e in right if e["kind"] == truth.kind]
    inside = [lo <= truth.values[n] <= hi for e in said[:1] for n, (lo, hi) in _intervals(e) if n in truth.values]
    return {
        "verdict": gap["verdict"],
        "named": names,
        "false": [n for n in names if n not in truth.alike],
        "said": bool(found or names),
        "place": bool(right or alike),
        "class": len((right or found)[0]["places"]) if found else 1 if names else None,
        "kind": bool(said or alike),
        "inside": [bool(x) for x in inside],
        "sentences": [e["sentence"] for e in found],
        "notes": list(gap.get("notes", ())),
    }


def _intervals(element: Mapping[str, Any]) -> Iterable[tuple[str, tuple[float, float]]]:
    return ((name, p["ci95"]) for name, p in element["parameters"].items())


def run(case: Case, truth: Truth, model: Path, experiments: bool) -> dict[str, Any]:
    """Return the score of a unit's first answer, and of that after the experiment which it asks for if it leaves
    several explanations."""
    with tempfile.TemporaryDirectory(prefix="sealed-") as parent:
        folder, start = case.write(Path(parent)), time.process_time()
        first = run_gap(folder, model)
        row = judged(truth, first) | {"seconds": time.process_time() - start, "open": len(class_of(first)) > 1}
        if experiments and row["open"] and first["verdict"] != SILENT and (wanted := asked(first)) is not None:
            kind, line, value = wanted
            add_experiment(folder, under(case.world, kind, value), case.setting, case.seed + 1, kind, line)
            after = run_gap(folder, model)
            row |= {"experiment": kind, "after": judged(truth, after) | {"left": sorted(class_of(after))}}
    return row


def _learned(seed: int, scatter: float, number: int, base: Path, out: Path) -> tuple[Bench, Path]:
    """Return a bench, one of those that are drawn for laboratories, and the model that was learned on it."""
    rng = np.random.default_rng([seed, 5])
    bench = draw_benches(BENCHES, rng)[int(rng.integers(BENCHES))]
    cases = [
        replace(c, strut=replace(c.strut, built=draw_shell(rng, scatter, DAMPING)), bench=bench, learned=True)
        for c in draw_cases(number, [seed, 6], "L", {"none": 1.0})
    ]
    cases = [replace(c, setting=bench.record_with(replace(c.setting, seconds=10.0))) for c in cases]
    lesson = learned(Batch(f"sealed-{seed}", tuple(cases), ()), base, out / "learned")
    if lesson.error is not None:
        raise SystemExit(f"the bench is not learned: {lesson.error}")
    print(f"learned from {number} units in {lesson.seconds:.0f} s", flush=True)
    return bench, lesson.model


def table(rows: Sequence[Row]) -> list[str]:
    """Return the lines of the table: counts with 95 % intervals."""

    def share(name: str, hits: Sequence[bool]) -> str:
        k, n = sum(hits), len(hits)
        if not n:
            return f"{name}: none to count"
        lo, hi = interval(k, n)
        return f"{name}: {k} of {n} [{lo:.2f}, {hi:.2f}]"

    ran = [r for r in rows if "error" not in r]
    hiding, bare = ([r for r in ran if (r["hidden"] == "nothing") == empty] for empty in (False, True))
    said = [r for r in hiding if r["said"]]
    sizes = [r["class"] for r in said if r["place"]]
    after = [r for r in hiding if r["open"]] if any("after" in r for r in hiding) else []
    seconds = [r["seconds"] for r in ran] or [0.0]
    settled = [
        "after" in r and r["after"]["place"] and not r["after"]["false"] and len(r["after"]["left"]) == 1 for r in after
    ]
    return [
        share("errors", ["error" in r for r in rows]),
        share("units with a false name", [bool(r["false"]) for r in ran]),
        share("something is said, of what hides", [r["said"] for r in hiding]),
        share("something is seen (not 'nothing is missing')", [r["verdict"] != SILENT for r in hiding]),
        share("place in the class, of what hides", [r["place"] for r in hiding]),
        share("place in the class, of what is said", [r["place"] for r in said]),
        f"class where the place is right: median {np.median(sizes):g}, {sorted(sizes)}" if sizes else "no class",
        share("kind, of what hides", [r["kind"] for r in hiding]),
        share("kind, of what is said", [r["kind"] for r in said]),
        share("values inside their 95 %", [v for r in hiding for v in r["inside"]]),
        share("nothing hidden: nothing is missing", [r["verdict"] == SILENT and not r["said"] for r in bare]),
        share("one experiment later: one, and right", settled),
        share("one experiment later: a false name", [bool(r["after"]["false"]) for r in after if "after" in r]),
        f"seconds of one core: median {np.median(seconds):.0f}, worst {max(seconds):.0f}",
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="sealed", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--units", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first one to be run")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--scatter", type=float, default=0.0, help="1 sd of the modes' frequencies from unit to unit")
    parser.add_argument("--learn", type=int, default=0, help="units of a drawn bench to learn the model from")
    parser.add_argument("--experiments", action="store_true", help="one experiment where an answer asks for it")
    parser.add_argument("--out", type=Path, required=True)
    a = parser.parse_args(arguments)
    a.out.mkdir(parents=True, exist_ok=True)
    model, bench = write_model(Set(0, {}, a.scatter, a.scatter), a.out / "model"), None
    if a.learn:
        bench, model = _learned(a.seed, a.scatter, a.learn, model, a.out)
    units = list(draw_anywhere(a.units, a.seed, a.scatter, bench))
    truths = json.dumps([[name, case.serial, repr(truth)] for name, case, truth in units])
    sealed = hashlib.sha256(truths.encode()).hexdigest()
    print(f"truth sha256 {sealed}, code sha256 {stamp(sealed).code}", flush=True)
    rows: list[Row] = []
    for name, case, truth in units[a.first :]:
        kept = a.out / f"{case.serial}.json"
        if not kept.exists():
            try:
                row = run(case, truth, model, a.experiments)
            except Exception as e:  # noqa: BLE001 a crash is what this has to count
                row = {"error": f"{type(e).__name__}: {e}"}
            kept.write_text(json.dumps({"hidden": name, "truth": repr(truth), **row}, indent=1))
        rows.append(json.loads(kept.read_text()))
        print(case.serial, json.dumps({k: v for k, v in rows[-1].items() if k != "notes"}), flush=True)
    (a.out / "truth.json").write_text(truths)  # after the run
    print("\n".join(table(rows)), flush=True)


if __name__ == "__main__":
    main()
