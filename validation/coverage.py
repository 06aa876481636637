"""What the disagreement in the likelihood is worth: coverage of the stated 95 % intervals with and without it, on the
same units.

    python -m validation.coverage OUT [--units 16] [--seed N]

Units on benches that were not learned, each with one effect of its own: the built-in kind of model cannot explain all
of such a record. Every unit is analysed twice: as the program does it, and with noise and tolerance as the only errors
of the last fit. Counted are the units in which an effect was named, rightly, beside something that is left. OUT keeps
an answer for each unit, so that a run that was stopped goes on.
"""

import argparse
import json
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

from accept.gap.analyse_unit import run_gap
from checks.gap.decision import build_result
from validation.cases import Case
from validation.model_files import write_model
from validation.scoring.scores import share
from validation.sets import SETS, draw_set

SEED = 20261208
# what the bench does not add to by itself, so that the truth of a named value is that of the unit
EFFECTS = (
    "sensor_highpass",
    "crosstalk",
    "encoder_bracket_mode",
    "bench_mode",
    "joint_axial_compliance",
    "misalignment",
)
SET = replace(SETS["laboratory-unlearned"], shares={"one": 1.0}, effects=EFFECTS)
WAYS = ("with", "without")


@contextmanager
def noise_alone() -> Iterator[None]:
    """Let the last fit take noise and tolerance for all that a model may leave."""
    with patch.object(build_result, "with_disagreement", lambda data, _: data):
        yield


def intervals(gap: Mapping[str, Any], case: Case) -> dict[str, bool] | None:
    """Return parameter -> whether its interval holds the truth, of the effect that is hidden; None if it is not named
    beside something that is left."""
    if gap["verdict"] != "partly_explained":
        return None
    ((effect, true),) = case.effects.items()
    named = {n["effect"]: n["parameters"] for n in gap["named"]}
    if effect not in named:
        return None
    return {p: named[effect][p]["ci95"][0] <= v <= named[effect][p]["ci95"][1] for p, v in true.items()}


def analysed(case: Case, model: Path) -> dict[str, dict[str, bool] | None]:
    """Return way -> the intervals of a unit."""
    with tempfile.TemporaryDirectory(prefix="coverage-") as parent:
        folder = case.write(Path(parent))
        both = {"with": intervals(run_gap(folder, model), case)}
        with noise_alone():
            both["without"] = intervals(run_gap(folder, model), case)
    return both


def report(answers: Sequence[Mapping[str, Mapping[str, bool] | None]]) -> str:
    """Return the shares of intervals that hold, over the units that were named both ways."""
    both = [a for a in answers if all(a[way] is not None for way in WAYS)]
    lines = [f"{len(answers)} units, {len(both)} named beside something that is left"]
    for way in WAYS:
        hits = [hit for a in both for hit in (a[way] or {}).values()]
        score = share(f"intervals that hold, {way} disagreement", hits, "", lambda _: True)
        lines.append(f"{score.name}: {score.value:.3f} of {score.n} [{score.lo:.3f}, {score.hi:.3f}]")
    return "\n".join(lines)


def main() -> None:
    """Run, print a line for each unit, then the shares."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--units", type=int, default=16)
    parser.add_argument("--seed", type=int, default=SEED)
    wanted = parser.parse_args()
    model, answers = write_model(SET, wanted.out / "model"), []
    cases = [c for batch in draw_set("laboratory-unlearned", wanted.seed, wanted.units, of=SET) for c in batch.judge]
    for case in cases:
        place = wanted.out / f"{case.serial}.json"
        if not place.exists():
            place.write_text(json.dumps(analysed(case, model)))
        answers.append(json.loads(place.read_text()))
        print(f"{case.serial}: {', '.join(case.effects)}: {answers[-1]}", flush=True)
    print(report(answers))


if __name__ == "__main__":
    main()
