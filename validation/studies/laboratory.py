"""Benches as they are: every unit of two benches judged with a bench that was learned without it.

    python -m validation.studies.laboratory ../shared/data/laboratory OUT [--units L-01,L-04]

For each unit the other units of its bench (by the letter of the serial) are learned from, as `accept model learn` does;
then the unit is analysed and its misalignment estimated with that model. OUT/laboratory.json has the answers beside
`truth.json`, times of one core and memory; OUT/SERIAL/ the learned models, so that a run that was stopped goes on.
"""

import argparse
import json
import resource
import time
from pathlib import Path
from typing import Any

from accept.analysis.misalignment import as_document, estimate_or_reason
from accept.fleet.population.bench import latencies
from accept.fleet.population.learn import learn, measured_units
from accept.fleet.population.report import document, write_population
from accept.gap.analyse_unit import run_gap
from accept.models.model_file import open_model_file
from accept.units.unit_folder import read
from validation.model_files import write_model
from validation.sets import SETS

HIDES_NOTHING = "no_missing_effect"


def learned_without(data: Path, serial: str, out: Path) -> tuple[Path, dict[str, Any]]:
    """Learn from the other units of a unit's bench; return the model's file and what was learned."""
    place, said = out / serial / "population.toml", out / serial / "learned.json"
    if not said.exists():
        mates = sorted(p for p in data.glob(f"{serial[0]}-*") if p.name != serial)
        given = open_model_file(write_model(SETS["scatter-1"], out / "start"))
        begun = time.process_time()
        found = learn(measured_units(mates, given), given, lambda _: None)
        place.parent.mkdir(parents=True, exist_ok=True)
        write_population(place, found)
        answer = document(found) | {
            "seconds": time.process_time() - begun,
            "latency_us": {c: [tau, U] for c, (tau, U, _) in latencies(found).items()},
        }
        said.write_text(json.dumps(answer, indent=1))
    return place, json.loads(said.read_text())


def answered(data: Path, serial: str, out: Path) -> dict[str, Any]:
    """Return the answer for a unit with the bench that was learned without it."""
    model, learned = learned_without(data, serial, out)
    begun = time.process_time()
    gap = run_gap(data / serial, model)
    of_gap = time.process_time()
    found = as_document(serial, estimate_or_reason(read(data / serial), str(model), workers=1))
    along = {"dx_um": found.dx_um, "dy_um": found.dy_um}
    misaligned = {k: {"value": a.value, "U": a.U} for k, a in along.items()} | {"reason": found.reason}
    return {
        "serial": serial,
        "learned_from": [u["serial"] for u in learned["units"] if u["belongs"]],
        "learned_seconds": learned["seconds"],
        "latency_us": learned["latency_us"],
        "verdict": gap["verdict"],
        "named": [{k: n[k] for k in ("effect", "parameters", "evidence")} for n in gap["named"]],
        "ambiguous": [a["effects"] for a in gap["ambiguous"]],
        "G": {"before": gap["gap_before"]["channels"], "after": gap["gap_after"]["channels"]},
        "misalignment": misaligned,
        "gap_seconds": of_gap - begun,
        "misalign_seconds": time.process_time() - of_gap,
        "memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def compared(answer: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    """Return whether the answer is right."""
    hidden = truth["effects"]
    names = [n["effect"] for n in answer["named"]]
    offset = hidden.get("misalignment", {"dx_um": 0.0, "dy_um": 0.0})
    inside = None
    if answer["misalignment"]["reason"] is None:
        along = (answer["misalignment"][k] for k in ("dx_um", "dy_um"))
        inside = [bool(abs(a["value"] - offset[k]) <= a["U"]) for k, a in zip(("dx_um", "dy_um"), along, strict=True)]
    right = sorted(names) == sorted(hidden) if hidden else answer["verdict"] == HIDES_NOTHING
    false = sorted(set(names) - set(hidden))
    return {"hidden": sorted(hidden), "right": right, "false_names": false, "offset_um": offset, "inside_U": inside}


def main() -> None:
    """Run, print a line for each unit, write the answers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--units", default="")
    wanted = parser.parse_args()
    truth = json.loads((wanted.data / "truth.json").read_text())
    answers = []
    for serial in wanted.units.split(",") if wanted.units else sorted(truth):
        answer = answered(wanted.data, serial, wanted.out)
        answer |= compared(answer, truth[serial])
        answers.append(answer)
        G = {c: round(g, 2) for c, g in answer["G"]["after"].items()}
        took = "learned {learned_seconds:.0f} s, gap {gap_seconds:.0f} s, misalign {misalign_seconds:.0f} s"
        print(f"{serial}: {answer['verdict']}, named {[n['effect'] for n in answer['named']]}, G {G}")
        print(f"    hidden {answer['hidden']}, right {answer['right']}; {took.format(**answer)}")
        print(f"    {answer['misalignment']}, inside U {answer['inside_U']} of {answer['offset_um']}", flush=True)
        (wanted.out / "laboratory.json").write_text(json.dumps(answers, indent=1))


if __name__ == "__main__":
    main()
