"""What each gate before a name is worth: the search with one gate left out at a time.

    python -m validation.studies.ablation OUT [--units N] [--seed N]

First every unit is analysed as it is, and of every effect that the search wants to name it is kept which gates fail. A
gate changes an answer only if it is the only one that fails for some effect; only such units are analysed once more
without it. Gates are the table in `checks.gap.decision.gates`; besides, what withdraws names afterwards: names that
widen a channel's gap, and names that others imitate; and all gates at once.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

from accept.gap.analyse_unit import run_gap
from checks.gap.decision import build_result, gates, never_worse
from checks.gap.decision.evidence import NameEvidence
from validation.cases import Case
from validation.methods.call import Method
from validation.scoring.scores import Outcome
from validation.shell import require_matrices
from validation.studies.arguments import mixed_in_words, parser_of
from validation.studies.compare import AS_RECORDED, SEED, UNITS, answers, counted, drawn

NEVER_WORSE, RIVALS, EVERY = "never_worse", "rivals", "every gate"
RIVALS_OF = ("indistinguishable", "rivals_by")
TOGETHER = (NEVER_WORSE, RIVALS, EVERY)
GATES = tuple(g.name for g in gates.GATES)


@contextmanager
def left_out(name: str) -> Iterator[None]:
    """Leave out a gate of that name. Raises KeyError for an unknown name."""
    with ExitStack() as stack:
        if name == NEVER_WORSE:
            stack.enter_context(patch.object(never_worse, "gap_increased", lambda *_, **__: []))
        elif name == RIVALS:
            for rule in RIVALS_OF:
                stack.enter_context(patch.object(build_result, rule, lambda *_: ()))
            stack.enter_context(patch.object(gates, "_compare_rivals", lambda *_: ([], ())))
        elif name in (*GATES, EVERY):
            rest = tuple(g for g in gates.GATES if name not in (g.name, EVERY))
            stack.enter_context(patch.object(gates, "GATES", rest))
        else:
            raise KeyError(f"no gate '{name}': expected one of {', '.join((*GATES, *TOGETHER))}")
        yield


def without(name: str) -> Method:
    """Return the method without a gate."""

    def run(folder: Path, model: Path, *, without: Sequence[str] = ()) -> Mapping[str, Any]:
        with left_out(name):
            return run_gap(folder, model, without=without)

    return run


def recorded(folder: Path, model: Path, *, without: Sequence[str] = ()) -> Mapping[str, Any]:
    """Return the answer of the method with a key more, "alone": what kept a name back that is given without it."""
    alone: set[str] = set()
    reasons_of, withdraw_harmful = gates.failed_reasons, never_worse.withdraw_harmful

    def noted(evidence: NameEvidence) -> tuple[str, ...]:
        failed = [g.name for g in gates.gates_of(evidence) if not g.test(evidence)]
        alone.update(failed if len(failed) == 1 else (), [EVERY] if failed else ())
        return reasons_of(evidence)

    def withdraw(candidates: Any, full: Any, claims: Any) -> Any:
        made = withdraw_harmful(candidates, full, claims)
        alone.update([NEVER_WORSE] if gates.accepted(made[0]) != gates.accepted(claims) else ())
        return made

    with (
        patch.object(gates, "failed_reasons", noted),
        patch.object(build_result, "withdraw_harmful", withdraw),
    ):
        gap = run_gap(folder, model, without=without)
    alone.update([RIVALS] if gap["ambiguous"] else ())
    return {**gap, "alone": sorted(alone)}


def ablated(cases: Mapping[str, Sequence[Case]], out: Path) -> dict[str, dict[str, list[Outcome]]]:
    """Return gate -> set -> outcomes without it, and under "" the outcomes of the method as it is."""
    base = answers(cases, AS_RECORDED, out)["gap"]
    found = {"": base}
    for name in (*GATES, *TOGETHER):
        kept_back = {o.serial for each in base.values() for o in each if name in o.gap.get("alone", ())}
        asked = {s: [c for c in each if c.serial in kept_back] for s, each in cases.items()}
        again = answers(asked, {name: f"validation.studies.ablation:without@{name}"}, out / "without")[name]
        other = {o.serial: o for each in again.values() for o in each}
        found[name] = {s: [other.get(o.serial, o) for o in each] for s, each in base.items()}
    return found


def table(found: Mapping[str, Mapping[str, Sequence[Outcome]]]) -> str:
    """Return a row for each gate: units with a false name and hidden effects that are named, without it."""
    lines = ["| left out | units that change | units with a false name | hidden effects named |", "|---|---|---|---|"]
    base = [o for each in found[""].values() for o in each]
    for name, by_set in found.items():
        every = [o for each in by_set.values() for o in each]
        changed = sum(a.named != b.named for a, b in zip(base, every, strict=True))
        named = [effect in o.named for o in every for effect in o.true]
        label = f"`{name}`" if name else "nothing"
        lines.append(f"| {label} | {changed} | {counted([bool(o.false_names) for o in every])} | {counted(named)} |")
    return "\n".join(lines)


def main() -> None:
    """Run, then print the table."""
    parser = parser_of(__doc__, UNITS, SEED)
    parser.add_argument("out", type=Path)
    a = parser.parse_args()
    require_matrices()
    with mixed_in_words():
        print(table(ablated(drawn(a.seed, a.units), a.out)))


if __name__ == "__main__":
    main()
