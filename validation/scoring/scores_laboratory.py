"""Scores of the sets on benches as laboratories have them, each against its target: names, silence about what is
outside the library, intervals, misalignment, time and memory of one core.

Pure functions of the truth and the answers. What is missing or an error counts against the workflow, never for it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import nan

from scipy import stats

from validation.scoring.scores import (
    OPEN,
    Lesson,
    Outcome,
    Outcomes,
    Score,
    covered,
    least,
    middle,
    most,
    of_kind,
    right,
    share,
)
from validation.scoring.scores_as_built import LIMITS_UM, acceptances, answered_um, error_um

UPPER = 0.95  # of the one-sided limit beside every number of false names
COVERS = (0.90, 0.99)
WITHIN_U = 0.93
MEDIAN_S, WORST_S, LEARN_S = 10.0, 40.0, 180.0
# what the bench adds to itself: their true size on a bench that is not learned is that of both together
OF_THE_BENCH = ("loop_delay", "amplifier_bandwidth", "encoder_scale")


@dataclass(frozen=True)
class Target:
    """Least shares: nothing hidden -> nothing is missing, one effect named exactly, misalignment answered; most false
    names. nan: no target."""

    nothing: float
    one: float
    answered: float
    false: float
    outsider: float = 0.98


TARGETS: Mapping[str, Target] = {
    "laboratory": Target(0.95, 0.90, 0.95, 0.01),
    "laboratory-unlearned": Target(nan, 0.75, 0.75, 0.02),
    "struts": Target(0.80, 0.75, nan, 0.02),
    "outsiders": Target(nan, nan, nan, 0.02),
}


def scores_of(name: str, outcomes: Outcomes, lessons: Sequence[Lesson]) -> list[Score]:
    """Return the scores of a set on benches, or of outsiders alone."""
    target = TARGETS[name]
    failed = [o.error is not None and not o.refused for o in outcomes]
    false = [bool(o.false_names) for o in outcomes]
    return [
        share("errors", failed, "0 %", most(0.0)),
        share("refused", [o.refused for o in outcomes], "", least(0.0)),
        *_of_kinds(name, target, outcomes),
        share("a false name, all cases", false, f"<= {target.false:.0%}", most(target.false)),
        *_intervals(name, outcomes),
        *_misalignment(target, outcomes),
        *_costs(outcomes, lessons),
    ]


def _of_kinds(name: str, target: Target, outcomes: Outcomes) -> Iterator[Score]:
    nothing, one, outsider = (of_kind(outcomes, kind) for kind in ("none", "one", "outsider"))
    if nothing:
        hits = [o.verdict == "no_missing_effect" for o in nothing]
        yield _at_least("nothing hidden: nothing is missing", hits, target.nothing)
    if nothing and name == "laboratory-unlearned":
        yield share("nothing hidden: the bench's names, or where", [honest(o) for o in nothing], "", least(0.0))
    if one:
        yield _at_least("one effect: named exactly", [exact(o) for o in one], target.one)
        first = [set(o.named) >= o.true for o in one]
        yield share("one effect: among the names", first, "", least(0.0))
        yield share("one effect: in a class", [bool(o.sizes(next(iter(o.true)))) for o in one], "", least(0.0))
    if outsider:
        silent = [not o.false_names and (o.error is None or o.refused) for o in outsider]
        yield _at_least("outsider: no false name", silent, target.outsider)
        seen = [o.refused or o.verdict in (*OPEN, "explained") for o in outsider]
        yield share("outsider: something is seen, or refused", seen, "", least(0.0))
        alike = [o for o in outsider if o.truth["alike"]]
        named = [bool(set(o.named) & set(o.truth["alike"])) for o in alike]
        yield share("outsider that a name means: so named", named, "", least(0.0))


def _at_least(name: str, hits: Sequence[bool], limit: float) -> Score:
    if limit != limit:  # no target
        return share(name, hits, "", least(0.0))
    return share(name, hits, f">= {limit:.0%}", least(limit))


def exact(o: Outcome) -> bool:
    """Return whether the effect is named and nothing else is but what is true of the bench."""
    return set(o.named) - set(o.truth["alike"]) == o.true


def honest(o: Outcome) -> bool:
    """Return whether a sound unit on a bench that is not learned got names of that bench only, and where they do not
    explain everything, the band."""
    if o.error is not None or o.false_names:
        return False
    return o.verdict in ("no_missing_effect", "explained", "ambiguous") or bool(o.gap.get("where"))


def _intervals(name: str, outcomes: Outcomes) -> Iterator[Score]:
    """Yield the share of intervals that hold the truth, of what was named correctly."""
    without = OF_THE_BENCH if name == "laboratory-unlearned" else ()
    hits = [h for effect, said, true in right(outcomes) if effect not in without for h in covered(said, true)]
    if any(o.true for o in outcomes):
        yield share("95 % intervals of what is named cover", hits, "90 .. 99 %", lambda v: COVERS[0] <= v <= COVERS[1])


def _misalignment(target: Target, outcomes: Outcomes) -> Iterator[Score]:
    """Yield the scores of `accept misalign` on every unit that hides nothing else."""
    asked = [o for o in outcomes if o.misalign is not None]
    if not asked:
        return
    answers = [[answered_um(o, axis) is not None for axis in LIMITS_UM] for o in asked]
    yield _at_least("misalignment: dx and dy answered", [all(both) for both in answers], target.answered)
    yield share("misalignment: dx or dy answered", [any(both) for both in answers], "", least(0.0))
    inside = [
        abs(error_um(o, axis)) <= float(o.misalign[axis]["U"])
        for o in asked
        for axis in LIMITS_UM
        if o.misalign and answered_um(o, axis) is not None
    ]
    yield share("misalignment: inside U, of the answers", inside, f">= {WITHIN_U:.0%}", least(WITHIN_U))
    wrong = [outside for _, outside in acceptances(asked)]
    yield share("misalignment: accepted, and outside a limit", wrong, "0", most(0.0))


def _costs(outcomes: Outcomes, lessons: Sequence[Lesson]) -> Iterator[Score]:
    """Yield seconds of one core and memory of analysis, misalignment and learning."""
    ran = [o for o in outcomes if not (o.error or "").startswith("NotLearned")]
    for what, pairs in (
        ("gap", [(o.seconds, o.memory_MB) for o in ran]),
        ("misalign", [(o.misalign_seconds, o.misalign_memory_MB) for o in ran if o.misalign is not None]),
    ):
        if pairs:
            seconds = [nan if s is None else s for s, _ in pairs]
            yield middle(f"{what}: seconds of one core, median", seconds, f"<= {MEDIAN_S:g} s", most(MEDIAN_S))
            yield middle(f"{what}: seconds of one core, worst", seconds, f"<= {WORST_S:g} s", most(WORST_S), max)
            memory = [m for _, m in pairs if m is not None]
            yield middle(f"{what}: memory in MB, worst", memory, "", least(0.0), max)
    if lessons:
        yield share("learned benches", [e.error is None for e in lessons], "100 %", least(1.0))
        seconds = [e.seconds for e in lessons]
        yield middle("learn: seconds of one core, median", seconds, "", least(0.0))
        yield middle("learn: seconds of one core, worst", seconds, f"<= {LEARN_S:g} s", most(LEARN_S), max)
        yield middle("learn: memory in MB, worst", [e.memory_MB for e in lessons], "", least(0.0), max)


def upper_limit(hits: int, n: int) -> float:
    """Return the one-sided upper limit of a proportion (Clopper and Pearson): so many hits or fewer would still occur
    in one of twenty such runs."""
    return 1.0 if hits == n else float(stats.beta.ppf(UPPER, hits + 1, n - hits))


def false_names_by_kind(outcomes: Outcomes) -> list[tuple[str, int, int, float]]:
    """Return units with a false name, all units and the upper limit: of every kind, then of all."""
    kinds = sorted({o.kind for o in outcomes})
    groups = [(kind, of_kind(outcomes, kind)) for kind in kinds] + [("all", list(outcomes))]
    counted = [(kind, sum(bool(o.false_names) for o in group), len(group)) for kind, group in groups]
    return [(kind, k, n, upper_limit(k, n)) for kind, k, n in counted]
