"""What the disagreement in the likelihood is worth: coverage of the stated 95 % intervals with and without it, on the
same units.

    python -m validation.studies.coverage OUT [--units 60] [--seed N] [--benches]

Each unit hides one effect of the library and, in turn, one of the linear kinds that the library does not have: the
model cannot explain all of such a record. With --benches the second is what a bench adds that was not learned. Counted
are the units in which the effect is named beside something that is left. The last fit of each is made twice from the
same search: as the program does it, and with noise and tolerance as the only errors. OUT keeps an answer for each unit,
so that a run that was stopped goes on.
"""

import json
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from accept.gap.analyse_unit import analyse
from checks.fitting import Fit
from checks.gap import Result, workflow
from checks.gap.decision import build_result
from checks.gap.decision.result import PARTLY
from validation.cases import Case
from validation.model_files import write_model
from validation.outsiders import OUTSIDERS
from validation.scoring.scores import share
from validation.sets import SETS, draw_set
from validation.shell import require_matrices
from validation.studies.arguments import parser_of

SEED = 20270201
# what neither a bench nor an outsider adds to by itself, so that the truth of a named value is that of the unit
EFFECTS = (
    "sensor_highpass",
    "crosstalk",
    "encoder_bracket_mode",
    "bench_mode",
    "joint_axial_compliance",
    "misalignment",
)
# kinds by which the model is wrong in every record alike, and that no name of EFFECTS would mean
BESIDE = (
    "losses_of_one_channel",
    "echo",
    "resonant_cable",
    "two_close_modes",
    "tuned_mass_on_payload",
    "tilting_payload",
    "moving_average",
    "resonant_amplifier",
)
ONE = {"one": 1.0}
OUTSIDE = replace(SETS["outsiders"], shares=ONE, effects=EFFECTS)
ON_BENCHES = replace(SETS["laboratory-unlearned"], shares=ONE, effects=EFFECTS)
WAYS = ("with", "without")
U_FACTOR = 1.96  # half-width of a 95 % interval over its standard deviation

Intervals = dict[str, tuple[float, float, float]]  # parameter -> lower end, upper end, truth
Answer = Mapping[str, Mapping[str, Sequence[float]]]  # way -> parameter -> the same; empty if the unit does not count


@contextmanager
def noise_alone() -> Iterator[None]:
    """Let the last fit take noise and tolerance for all that a model may leave."""
    with patch.object(build_result, "with_disagreement", lambda data, _: data):
        yield


def draw(seed: int, units: int, benches: bool) -> list[Case]:
    """Return the units: with an outsider each, or on benches that were not learned."""
    name, it = ("laboratory-unlearned", ON_BENCHES) if benches else ("outsiders", OUTSIDE)
    cases = [case for batch in draw_set(name, seed, units, of=it) for case in batch.judge]
    if benches:
        return cases
    kinds = [BESIDE[k % len(BESIDE)] for k in range(units)]
    draws = [OUTSIDERS[kind].draw(np.random.default_rng([seed, k])) for k, kind in enumerate(kinds)]
    return [replace(case, outside={kind: p}) for case, kind, p in zip(cases, kinds, draws, strict=True)]


def intervals(fit: Fit, case: Case) -> Intervals:
    """Return the interval of each parameter of the hidden effect, with its truth."""
    ((effect, true),) = case.effects.items()
    return {p: (*fit.interval(f"{effect}.{p}"), v) for p, v in true.items()}


def analysed(case: Case, model: Path) -> dict[str, Intervals]:
    """Return way -> the intervals of a unit; empty if the hidden effect is not named beside something that is left."""
    calls: list[tuple[tuple[Any, ...], Result]] = []

    def recorded(*arguments: Any) -> Result:
        result = build_result.build_result(*arguments)
        calls.append((arguments, result))
        return result

    with tempfile.TemporaryDirectory(prefix="coverage-") as parent, patch.object(workflow, "build_result", recorded):
        result = analyse(case.write(Path(parent)), model).result
    if result.verdict != PARTLY or not set(case.effects) & {n.effect for n in result.named}:
        return {}
    (arguments,) = (given for given, made in calls if made is result)
    with noise_alone():
        without = build_result.build_result(*arguments)
    return {"with": intervals(result.fit, case), "without": intervals(without.fit, case)}


def report(answers: Sequence[Answer]) -> str:
    """Return the share of intervals that hold the truth, and the RMS error in stated standard deviations, both ways."""
    both = [a for a in answers if a]
    lines = [f"{len(answers)} units, {len(both)} named beside something that is left"]
    for way in WAYS:
        stated = [each for a in both for each in a[way].values()]
        score = share(way, [lo <= true <= hi for lo, hi, true in stated], "", lambda _: True)
        z = [(true - (lo + hi) / 2) / ((hi - lo) / 2) * U_FACTOR for lo, hi, true in stated]
        lines.append(
            f"intervals that hold, {way} disagreement: {score.value:.3f} of {score.n} [{score.lo:.3f}, {score.hi:.3f}]"
            f"; RMS error {np.sqrt(np.mean(np.square(z))) if z else np.nan:.2f} sd"
        )
    if both:
        widths = [
            (w[1] - w[0]) / (o[1] - o[0]) for a in both for w, o in zip(*(a[k].values() for k in WAYS), strict=True)
        ]
        lines.append(f"width with over width without: median {np.median(widths):.2f}, largest {max(widths):.2f}")
    return "\n".join(lines)


def main() -> None:
    """Run, print a line for each unit, then the shares."""
    parser = parser_of(__doc__, 60, SEED)
    parser.add_argument("out", type=Path)
    parser.add_argument("--benches", action="store_true", help="beside what a bench adds that was not learned")
    wanted = parser.parse_args()
    require_matrices()
    model, answers = write_model(OUTSIDE, wanted.out / "model"), []
    for case in draw(wanted.seed, wanted.units, wanted.benches):
        place = wanted.out / f"{case.serial}.json"
        if not place.exists():
            place.write_text(json.dumps(analysed(case, model)))
        answers.append(json.loads(place.read_text()))
        print(f"{case.serial}: {', '.join((*case.effects, *case.outside))}: {answers[-1]}", flush=True)
    print(report(answers))


if __name__ == "__main__":
    main()
