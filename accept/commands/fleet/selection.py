"""`accept rejudge` and `accept match`."""

import sys
from collections.abc import Sequence
from typing import Annotated

import pandas as pd
import typer

from accept.base.cluster.connect import connected
from accept.base.console import clear_errors, say, stdout
from accept.base.exit_codes import Exit
from accept.commands.fleet.answers import check, show, write
from accept.commands.fleet.options import MatchOptions, Outputs
from accept.commands.options import ClusterAt
from accept.fleet import judged_again, matched_sets
from accept.fleet.measurements import GOLDEN, measurements
from accept.judging.golden import not_counted
from accept.judging.judge_unit import load_spec
from accept.pictures.labels import label_and_name
from accept.store import open_store
from specs.plugins import ProductError, product_named
from specs.spec import Spec

NAMED = 10  # serials in a sentence
SHOWN = 500  # flips on the terminal; the files have all


@clear_errors
def rejudge(
    spec: Annotated[list[str], typer.Option("--spec", help="Built-in spec or TOML file; one of each kind.")],
    *,
    records: Annotated[bool, typer.Option("--records", help="Measure unit folders again where unchanged.")] = False,
    cluster: ClusterAt = None,
    outputs: Outputs,
) -> Exit:
    """Judge the whole store by another spec. Which verdicts flip and why; stores nothing, touches no certificate."""
    check(outputs)
    loaded: dict[str, Spec] = {each.kind: each for each in map(load_spec, spec)}
    judged, worse, flips = 0, False, []
    not_measured: list[str] = []
    with connected(cluster, say) as workers, open_store() as store:
        for unit in judged_again.judged_again(store, loaded, records, workers):
            judged += 1
            worse = worse or unit.worse
            if records and unit.basis == judged_again.VALUES:
                not_measured.append(unit.serial)
            if unit.flipped:  # what does not change is not held
                flips.append((unit.serial, unit.was, unit.now, sys.intern(_changes_words(unit)), unit.basis))
    rows = pd.DataFrame(sorted(flips), columns=["serial", "was", "now", "why", "judged_from"])
    if flips:
        show(rows.head(SHOWN), f"{len(flips)} of {judged} units change their verdict")
    else:
        stdout.print(f"none of {judged} units changes its verdict")
    if len(flips) > SHOWN:
        say(f"the first {SHOWN} are shown; --csv FILE or --json FILE has all {len(flips)}")
    if not_measured:
        say(
            f"{len(not_measured)} of {judged} units were not measured again, but compared by their stored values: "
            f"their folders are gone, cannot be read or no longer hold what was judged ({_named(sorted(not_measured))})"
        )
    if not records:
        say("stored values were compared with the new limits; changed settings of a check need --records")
    write(outputs, rows)
    return Exit.INCOMPLETE if worse else Exit.ACCEPTED


def _named(serials: Sequence[str]) -> str:
    return ", ".join(serials[:NAMED]) + (f" and {len(serials) - NAMED} more" if len(serials) > NAMED else "")


def _changes_words(unit: judged_again.JudgedAgain) -> str:
    return "; ".join(
        f"{label_and_name(name)}: {was.replace('_', ' ')} -> {now.replace('_', ' ')}"
        for name, (was, now, _) in unit.findings.items()
    )


@clear_errors
def match(wanted: MatchOptions, outputs: Outputs) -> Exit:
    """Find units that fit together. Sets whose quantities lie closest, in units of their uncertainty; proven best."""
    check(outputs)
    kind, size, sets = wanted.kind, wanted.n, wanted.sets
    product = product_named(kind)
    by = wanted.by or product.matched_by
    if not by:
        raise ProductError(f"product '{kind}' does not say by which quantities sets are matched: name them with --by")
    with open_store() as store:
        frame = measurements(store, columns=matched_sets.COLUMNS)
    units = matched_sets.pool(frame, kind, by)
    of_golden = frame[frame[GOLDEN] & (frame["kind"] == kind)]
    if words := not_counted(of_golden["seq"].nunique(), of_golden["serial"]):
        say(words)
    for why, serials in units.left_out.items():
        say(f"left out, {why}: {_named(serials)}")
    found = matched_sets.choose(units, size, sets)
    rows = []
    for number, members in enumerate(found.sets, 1):
        for i in members:
            values = dict(zip(units.quantities, units.values[i], strict=True))
            rows.append({"set": number, "serial": units.serials[i], **values})
    frame = pd.DataFrame(rows)
    each = f"{sets} sets of {size}" if sets > 1 else str(size)
    show(frame, f"{each} of {len(units.serials)} accepted {product.plural}")
    told = zip(units.quantities, units.U, units.units, strict=True)
    stdout.print(f"median U (k = 2): {', '.join(f'{q} {U:.2g} {unit}' for q, U, unit in told)}", soft_wrap=True)
    for number, (members, cost) in enumerate(zip(found.sets, found.costs, strict=True), 1):
        stdout.print(
            f"set {number}: widths add up to {cost:.3g} times U; {matched_sets.advice(units, members, cost)}",
            soft_wrap=True,
        )
    if not found.proven:
        bound = f"no choice can cost less than {found.bound:.3g}" if found.bound > 0 else "how much better is not known"
        say(f"stopped after the time limit: a better choice may exist; {bound}")
    write(outputs, frame)
    return Exit.ACCEPTED if found.proven else Exit.INCOMPLETE
