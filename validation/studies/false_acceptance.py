"""How often a strut about a limit of its misalignment is accepted and lies outside, against what was stated of it:
`python -m validation.studies.false_acceptance --struts 400`. Struts as built, modes scattered by 0.5, 1, 2 % in turns,
recorded and handed over as folders; finished ones are kept, so that a stopped run can be continued.

Of every strut and axis the answer v with U states a probability of being outside: that of a normal distribution about
v with U / 2. In each class of that probability as many should be outside. A guarded limit accepts |v| + U <= limit.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from accept.analysis.misalignment import as_document, estimate_unit
from accept.units.unit_folder import read
from checks.cause import NoResult
from validation.cases import Case
from validation.model_files import write_model
from validation.scoring.scores import wilson
from validation.scoring.scores_as_built import LIMITS_UM, inside
from validation.sets import SETS, draw_set
from validation.shell import PUBLIC

SCATTERS = (0.005, 0.01, 0.02)
STATED = 0.01  # of the model file, at least: who built them does not know better
SEED = 20261123
CLASSES = (0.0, 0.001, 0.02, 0.1, 0.3, 0.7, 0.9, 1.0)  # of the stated probability


@dataclass(frozen=True)
class Answer:
    """The answer for one strut: scatter of its modes, and along each axis the truth, the value and its U [um]; without
    a result the reason instead."""

    serial: str
    scatter: float
    true: dict[str, float]
    value: dict[str, float | None]
    U: dict[str, float | None]
    reason: str | None

    def stated(self, axis: str) -> float:
        """Return the stated probability of being outside."""
        return 1.0 - inside(self.value[axis], self.U[axis], LIMITS_UM[axis])

    def outside(self, axis: str) -> bool:
        return abs(self.true[axis]) > LIMITS_UM[axis]

    def accepted(self, axis: str) -> bool:
        return abs(self.value[axis] or 0.0) + (self.U[axis] or 0.0) <= LIMITS_UM[axis]


def drawn(struts: int, seed: int) -> Iterator[tuple[float, Case]]:
    """Yield struts about the limits, a third with each scatter."""
    for k, scatter in enumerate(SCATTERS):
        number = struts // len(SCATTERS) + (k < struts % len(SCATTERS))
        (batch,) = draw_set("limit", seed + k, number, of=replace(SETS["limit"], frequency=scatter))
        yield from ((scatter, case) for case in batch.judge)


def asked(scatter: float, case: Case, model: Path, kept: Path) -> Answer:
    """Return the answer of `accept misalign` for a strut, which is kept in a file of its own."""
    if kept.exists():
        return Answer(**json.loads(kept.read_text()))
    with tempfile.TemporaryDirectory(prefix="struts-") as parent:
        folder = read(case.write(Path(parent)))
        try:
            said = as_document(case.serial, estimate_unit(folder, str(model)))
        except NoResult as e:
            said = as_document(case.serial, e.reason)
    value, U = ({a: said[a][of] for a in LIMITS_UM} for of in ("value", "U"))
    true = {a: float(case.effects["misalignment"][a]) for a in LIMITS_UM}
    answer = Answer(case.serial, scatter, true, value, U, said["reason"])
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.write_text(json.dumps(asdict(answer)))
    return answer


def table(answers: Sequence[Answer]) -> str:
    """Return a table of stated and observed probabilities in classes of the stated one, of the acceptances by a guarded
    limit and of the coverage of the intervals."""
    given = [a for a in answers if a.reason is None]
    rows = [(a.stated(axis), a.outside(axis)) for a in given for axis in LIMITS_UM]
    lines = [f"{len(given)} of {len(answers)} struts answered", "stated P(outside)   axes  mean stated  outside  95 %"]
    for i, (lo, hi) in enumerate(pairwise(CLASSES)):
        inside_class = [(p, o) for p, o in rows if lo <= p < hi or (p == hi and i == len(CLASSES) - 2)]
        lines.append(f"{lo:5.3f} .. {hi:5.3f}      {_counted(inside_class)}")
    accepted = [(a.stated(axis), a.outside(axis)) for a in given for axis in LIMITS_UM if a.accepted(axis)]
    lines.append(f"guarded: accepted   {_counted(accepted)}")
    for scatter in SCATTERS:
        of = [a for a in given if a.scatter == scatter]
        for axis in LIMITS_UM:
            hits = sum(abs(float(a.value[axis] or 0.0) - a.true[axis]) <= float(a.U[axis] or 0.0) for a in of)
            lo, hi = wilson(hits, len(of))
            lines.append(f"scatter {100 * scatter:g} %, {axis}: within U {hits} of {len(of)} [{lo:.3f}, {hi:.3f}]")
    return "\n".join(lines)


def _counted(rows: Sequence[tuple[float, bool]]) -> str:
    n, k = len(rows), sum(outside for _, outside in rows)
    mean = sum(p for p, _ in rows) / n if n else 0.0
    lo, hi = wilson(k, n)
    return f"{n:5d}  {mean:11.4f}  {k:7d}  [{lo:.3f}, {hi:.3f}]"


def main() -> int:
    parser = argparse.ArgumentParser(prog="false_acceptance", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--struts", type=int, default=400)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("out/false_acceptance"))
    a = parser.parse_args()
    if not PUBLIC.exists():
        print(f"skipped: {PUBLIC} is not there; python -m validation.data.fetch", file=sys.stderr)
        return 0
    models = {
        scatter: write_model(replace(SETS["limit"], stated=max(scatter, STATED)), a.out / f"{scatter:g}")
        for scatter in SCATTERS
    }
    answers: list[Answer] = []
    with ProcessPoolExecutor(a.workers, mp_context=get_context("spawn")) as pool:
        jobs: list[Any] = [
            pool.submit(asked, scatter, case, models[scatter], a.out / f"{scatter:g}" / f"{case.serial}.json")
            for scatter, case in drawn(a.struts, a.seed)
        ]
        for n, job in enumerate(jobs, 1):
            answers.append(job.result())
            print(f"{n}/{len(jobs)} {answers[-1].serial}", file=sys.stderr, flush=True)
    said = table(answers)
    print(said)
    (a.out / "table.txt").write_text(said + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
