"""The report of a blind test as text: a table for each set, the details behind it, a summary of all sets."""

from collections.abc import Mapping, Sequence

from validation.scoring import scores_laboratory
from validation.scoring.scores import (
    Lesson,
    Outcome,
    Outcomes,
    Score,
    confusion,
    controls,
    details,
    most,
    power,
    scores,
    share,
)
from validation.scoring.scores_as_built import acceptances, scores_of, time_of_all
from validation.sets import SETS


def report_of_set(name: str, outcomes: Outcomes, removed: Outcomes, lessons: Sequence[Lesson] = ()) -> tuple[str, bool]:
    """Return the report of a set, and whether every target is met. removed: outcomes of the controls, which only the
    exact set has; lessons: what came of learning."""
    if SETS[name].benches is not None:
        rows = scores_laboratory.scores_of(name, outcomes, lessons)
    else:
        rows = scores_of(name, [o for o in outcomes if o.kind != "weak"])
    if name == "exact":
        rows = [*scores(outcomes), *rows]
    parts = [f"Set {name}", _table(rows)]
    judged = list(rows)
    if removed:
        judged += controls(outcomes, removed)
        parts += ["Controls", _table(controls(outcomes, removed))]
    if lessons:
        parts += ["Learned benches", *_lessons(lessons)]
    parts += ["In detail", _table(details(outcomes))]
    parts += ["Truth, and what was said first", *_confusion(outcomes)]
    if any(o.kind == "weak" for o in outcomes):
        parts += ["Seen, against detectability", *_power(outcomes)]
    failures = [f"  {o.serial}: {o.error}" for o in (*outcomes, *removed) if o.error]
    wrong = [f"  {o.serial}: {', '.join(o.false_names)}, was {was(o)}" for o in outcomes if o.false_names]
    if SETS[name].benches is not None:
        parts += ["Units with a false name, by kind, upper limit of 95 %", *_limits(outcomes)]
    parts += ["False names", *(wrong or ["  none"]), "Errors and refusals", *(failures or ["  none"])]
    return "\n".join(parts), all(s.met for s in judged if s.target)


def summary(sets: Mapping[str, Outcomes]) -> tuple[str, bool]:
    """Return the summary of all sets: false names, wrong acceptances by the stated probability, time."""
    every = [o for outcomes in sets.values() for o in outcomes]
    rows = [
        share("a false name, all sets", [bool(o.false_names) for o in every], "<= 3 %", most(0.03)),
        *time_of_all(every),
    ]
    text = [f"All sets: {len(every)} units of {', '.join(sets)}", _table(rows)]
    text += ["Accepted by the limits of dx and dy: stated against observed chance of being outside", *_risks(every)]
    return "\n".join(text), all(s.met for s in rows if s.target)


def _risks(outcomes: Outcomes) -> list[str]:
    accepted = acceptances(outcomes)
    if not accepted:
        return ["  none was accepted"]
    stated, wrong = sum(p for p, _ in accepted), sum(w for _, w in accepted)
    return [f"  {len(accepted)} accepted, {stated:.2f} outside by what was stated, {wrong} outside in truth"]


def _lessons(lessons: Sequence[Lesson]) -> list[str]:
    return [
        f"  {e.batch}: {e.error or 'learned'} from {e.units} units, {e.seconds:.0f} s of one core, {e.memory_MB:.0f} MB"
        for e in lessons
    ]


def _limits(outcomes: Outcomes) -> list[str]:
    rows = scores_laboratory.false_names_by_kind(outcomes)
    return [f"  {kind:10} {hits:3d} of {n:3d}, at most {limit:.1%}" for kind, hits, n, limit in rows]


def was(o: Outcome) -> str:
    return "+".join((*o.truth["effects"], *o.truth["outside"])) or "nothing"


def _table(rows: Sequence[Score]) -> str:
    lines = [f"{'score':50} {'value':>8} {'n':>4}  {'interval':19} {'target':16} "]
    for s in rows:
        verdict = ("met" if s.met else ("NOT MET" if s.n else "NOT MEASURED")) if s.target else ""
        lines.append(f"{s.name:50} {s.value:8.3f} {s.n:4d}  {s.lo:8.3f} ..{s.hi:8.3f} {s.target:16} {verdict}")
    return "\n".join(lines)


def _confusion(outcomes: Sequence[Outcome]) -> list[str]:
    return [
        f"  {truth:26} " + ", ".join(f"{said} {n}" for said, n in row.most_common())
        for truth, row in confusion(outcomes).items()
    ]


def _power(outcomes: Sequence[Outcome]) -> list[str]:
    return [
        f"  {lo:9.0f} ..{hi:9.0f} sd: {s.value:6.1%} of {s.n} ({s.lo:.1%} .. {s.hi:.1%})"
        for lo, hi, s in power(outcomes)
    ]
