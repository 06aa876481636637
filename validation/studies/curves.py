"""False names against the evidence that a name needs, and for priors that are twice too narrow or too wide.

    python -m validation.studies.curves OUT [--units N] [--seed N]

The curve over the threshold comes from one run with a low one: a name counts from the evidence that it has. (A search
with a higher threshold also looks elsewhere; that part is left out.) Priors are changed in the model file: every `sd`
and the scatter of the modes by the same factor.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

from accept.gap import analyse_unit
from checks.gap import workflow
from checks.gap.modelling.thresholds import THRESHOLDS
from validation.cases import Case
from validation.methods.call import Method
from validation.model_files import text_for
from validation.scoring.scores import Outcome
from validation.shell import require_matrices
from validation.studies.arguments import parser_of
from validation.studies.compare import AS_RECORDED, SAMPLE, SEED, UNITS, answers, counted, drawn

LOW = 4.0
CURVE = (LOW, 8.0, THRESHOLDS.delta_lnL, 25.0, 50.0, 100.0, 200.0)
FACTORS = (0.5, 1.0, 2.0)
SD = re.compile(r"((?:sd|frequency|damping) = )([0-9.e+-]+)")


def at_threshold(text: str) -> Method:
    """Return the method with another threshold of evidence."""
    table = replace(THRESHOLDS, delta_lnL=float(text))

    def run(folder: Path, model: Path, *, without: Sequence[str] = ()) -> Mapping[str, Any]:
        with patch.object(analyse_unit, "run", partial(workflow.run, table=table)):
            return analyse_unit.run_gap(folder, model, without=without)

    return run


def above(outcome: Outcome, evidence: float) -> Outcome:
    """Return an outcome with the names that have at least so much evidence; those that need none stay."""
    kept = [n for n in outcome.gap.get("named", ()) if _evidence(n) >= evidence]
    return replace(outcome, gap={**outcome.gap, "named": kept})


def _evidence(named: Mapping[str, Any]) -> float:
    value = named["evidence"]["delta_lnL"]
    return float("inf") if value is None else float(value)


def with_priors(text: str, factor: float) -> str:
    """Return a model file with every prior so much wider."""
    return SD.sub(lambda m: f"{m[1]}{float(m[2]) * factor:.6g}", text)


def false_names(outcomes: Mapping[str, Sequence[Outcome]]) -> list[str]:
    """Return the cells of a row: units with a false name by set, and the hidden effects that are named."""
    every = [o for each in outcomes.values() for o in each]
    named = [effect in o.named for o in every for effect in o.true]
    return [*(counted([bool(o.false_names) for o in each]) for each in outcomes.values()), counted(named)]


def curve(cases: Mapping[str, Sequence[Case]], out: Path) -> str:
    """Return false names by set against the threshold of evidence, as a table."""
    low = answers(cases, {"low": f"validation.studies.curves:at_threshold@{LOW:g}"}, out)["low"]
    rows = [(f"{x:g}", {name: [above(o, x) for o in each] for name, each in low.items()}) for x in CURVE]
    return _table("evidence", cases, rows)


def priors(cases: Mapping[str, Sequence[Case]], out: Path) -> str:
    """Return false names by set for priors of other widths, as a table."""
    rows = []
    for factor in FACTORS:
        if factor == 1.0:
            rows.append(("1", answers(cases, AS_RECORDED, out)["gap"]))
            continue
        models = {name: out / "models" / f"{name}-{factor:g}.toml" for name in cases}
        for name, path in models.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(with_priors(text_for(SAMPLE[name][1]), factor))
        name = f"priors-{factor:g}"
        rows.append((f"{factor:g}", answers(cases, {name: "gap"}, out, models)[name]))
    return _table("priors times", cases, rows)


def _table(first: str, sets: Mapping[str, object], rows: Sequence[tuple[str, Mapping[str, Sequence[Outcome]]]]) -> str:
    head = [first, *(f"`{name}`: false name" for name in sets), "hidden effects named"]
    lines = [head, ["---"] * len(head), *([label, *false_names(outcomes)] for label, outcomes in rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def main() -> None:
    """Run, then print both tables."""
    parser = parser_of(__doc__, UNITS, SEED)
    parser.add_argument("out", type=Path)
    a = parser.parse_args()
    require_matrices()
    cases = drawn(a.seed, a.units)
    print(priors(cases, a.out), curve(cases, a.out), sep="\n\n")


if __name__ == "__main__":
    main()
