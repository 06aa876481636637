"""Methods side by side on the same reduced sets: `python -m validation.studies.compare OUT [--method NAME ...]`.

The truth is sealed before anything is run, and its hash printed. Every answer is a file below OUT, so that a run that
was stopped goes on; files of another version are refused. Methods are tuned on seeds in `DEVELOPMENT_SEEDS` only.
"""

import json
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from validation.cases import Case, seal
from validation.methods.call import METHODS, method_of
from validation.model_files import write_model
from validation.run_cases import talk
from validation.scoring.results_store import Store, stamp
from validation.scoring.scores import Outcome, covered, right, rms, wilson
from validation.sets import SETS, Set, draw_set
from validation.shell import require_matrices
from validation.studies.arguments import mixed_in_words, parser_of

SEED = 20261123
UNITS = 8  # of each set
AS_RECORDED = {"gap": "validation.studies.ablation:recorded"}  # so that the ablation need not run it again
MISALIGNED = replace(SETS["scatter-1"], shares={"one": 1.0}, effects=("misalignment",))
# name -> (set whose name seeds it, what it is, share of `UNITS`)
SAMPLE: Mapping[str, tuple[str, Set, float]] = {
    "exact": ("exact", SETS["exact"], 1.0),
    "scatter-1": ("scatter-1", SETS["scatter-1"], 1.0),
    "outsiders": ("outsiders", SETS["outsiders"], 1.0),
    "misaligned": ("scatter-1", MISALIGNED, 0.5),
    "bench": ("laboratory-unlearned", SETS["laboratory-unlearned"], 1.0),
}


def drawn(seed: int, units: int) -> dict[str, list[Case]]:
    """Return the units of every set of the sample."""
    out = {}
    for name, (own, it, part) in SAMPLE.items():
        number = max(round(part * units), 1)
        cases = [c for batch in draw_set(own, seed, number, of=it) for c in batch.judge]
        out[name] = [replace(c, serial=f"{name}-{k:03d}") for k, c in enumerate(cases)]
    return out


def answers(
    cases: Mapping[str, Sequence[Case]], methods: Mapping[str, str], out: Path, models: Mapping[str, Path] | None = None
) -> dict[str, dict[str, list[Outcome]]]:
    """Return method -> set -> outcomes; each unit is recorded once for all methods. models: files by set, by default
    those that the sets state."""
    truth, sealed = seal([c for each in cases.values() for c in each])
    talk(f"truth sha256 {sealed}")
    kept = {name: Store(out / name, stamp(sealed)) for name in methods}
    found: dict[str, dict[str, list[Outcome]]] = {m: {s: [] for s in cases} for m in methods}
    known = json.loads(truth)
    for name, each in cases.items():
        model = (models or {}).get(name) or write_model(SAMPLE[name][1], out / "models" / name)
        for case in each:
            made = _answered(case, known[case.serial], model, methods, kept)
            for method, outcome in made:
                found[method][name].append(outcome)
    return found


def _answered(
    case: Case, truth: Mapping[str, Any], model: Path, methods: Mapping[str, str], kept: Mapping[str, Store]
) -> Iterator[tuple[str, Outcome]]:
    """Yield the outcome of every method on a unit."""
    done = {m: o for m in methods for o in kept[m].finished({case.serial: case.seed}).values()}
    with tempfile.TemporaryDirectory(prefix="compare-") as parent:
        folder = case.write(Path(parent)) if len(done) < len(methods) else Path(parent)
        for name, text in methods.items():
            if name not in done:
                begin = time.process_time()
                try:
                    gap, error = json.loads(json.dumps(method_of(text)(folder, model))), None
                except Exception as e:  # noqa: BLE001 a crash of the method is what this has to count
                    gap, error = {}, f"{type(e).__name__}: {e}"
                done[name] = Outcome(case.serial, truth, gap, time.process_time() - begin, error)
                kept[name].keep(case.serial, case.seed, done[name])
                was = "+".join((*truth["effects"], *truth["outside"])) or "nothing"
                talk(f"{case.serial} {name}: {error or '+'.join(done[name].named) or done[name].verdict}, was {was}")
            yield name, done[name]


def table(found: Mapping[str, Mapping[str, Sequence[Outcome]]]) -> str:
    """Return the comparison as a table: a row for each score, a column for each method."""
    rows: dict[str, list[str]] = {}
    for by_set in found.values():
        for label, text in _scores(by_set):
            rows.setdefault(label, []).append(text)
    lines = [f"| score | {' | '.join(found)} |", f"|---|{'---|' * len(found)}"]
    return "\n".join([*lines, *(f"| {label} | {' | '.join(texts)} |" for label, texts in rows.items())])


def _scores(by_set: Mapping[str, Sequence[Outcome]]) -> Iterator[tuple[str, str]]:
    every = [o for outcomes in by_set.values() for o in outcomes]
    for name, outcomes in by_set.items():
        yield f"`{name}`: units with a false name", counted([bool(o.false_names) for o in outcomes])
    yield "all: units with a false name", counted([bool(o.false_names) for o in every])
    one = [o for o in every if o.kind == "one"]
    yield "one effect: named, nothing else", counted([o.named == list(o.true) for o in one])
    yield "one effect: in a class of several", counted([any(s > 1 for s in o.sizes(next(iter(o.true)))) for o in one])
    yield "two effects: both named", counted([set(o.named) == o.true for o in every if o.kind == "two"])
    yield (
        "nothing hidden: nothing is missing",
        counted([o.verdict == "no_missing_effect" for o in every if o.kind == "none"]),
    )
    hits = [h for _, said, true in right(every) for h in covered(said, true)]
    yield "95 % intervals of right names that hold", counted(hits)
    for axis in ("dx_um", "dy_um"):
        off = [
            said[axis]["value"] - true[axis]
            for effect, said, true in right(every)
            if effect == "misalignment" and axis in said
        ]
        label = f"misalignment named: RMS error of {axis.removesuffix('_um')}, um"
        yield label, f"{rms(off):.1f} ({len(off)} units)" if off else "never named"
    yield "errors", counted([o.error is not None and not o.refused for o in every])


def counted(hits: Sequence[bool]) -> str:
    """Return hits of n with the interval of their share."""
    lo, hi = wilson(sum(hits), len(hits))
    return f"{sum(hits)} of {len(hits)} [{lo:.2f}, {hi:.2f}]"


def main() -> None:
    """Run the methods and print the table."""
    parser = parser_of(__doc__, UNITS, SEED)
    parser.add_argument("out", type=Path)
    parser.add_argument("--method", action="append", help=f"{', '.join(METHODS)}, module:function or a command")
    a = parser.parse_args()
    require_matrices()
    methods = {name: AS_RECORDED.get(name, name) for name in a.method or METHODS}
    with mixed_in_words():
        print(table(answers(drawn(a.seed, a.units), methods, a.out)))


if __name__ == "__main__":
    main()
