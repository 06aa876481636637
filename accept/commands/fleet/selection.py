"""`accept rejudge` and `accept match`."""

import sys
from typing import Annotated

import pandas as pd
from typer import Option

from accept.base.cluster.connect import connected
from accept.base.console import say
from accept.base.exit_codes import Exit
from accept.base.plain_text import listed
from accept.commands.answer import Answer, Remark, command
from accept.commands.fleet.answers import files, golden_left_out, rows
from accept.commands.fleet.options import MatchOptions, Outputs
from accept.commands.options import ClusterAt
from accept.fleet import judged_again, matched_sets
from accept.fleet.measurements import GOLDEN, day, measurements
from accept.judging import load_spec
from accept.pictures.labels import label_and_name
from accept.store import open_store
from specs.plugins import ProductError, product_named
from specs.spec import Spec

SHOWN = 500  # flips on the terminal; the files have all


@command
def rejudge(
    spec: Annotated[list[str], Option("--spec", help="Built-in spec or TOML file; one of each kind.")],
    *,
    records: Annotated[bool, Option("--records", help="Measure unit folders again where unchanged.")] = False,
    cluster: ClusterAt = None,
    outputs: Outputs,
) -> Answer:
    """Judge the whole store by another spec. Which verdicts flip and why; stores nothing, touches no certificate."""
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
    flipped = pd.DataFrame(sorted(flips), columns=["serial", "was", "now", "why", "judged_from"])
    shown = rows(flipped.head(SHOWN), f"{len(flips)} of {judged} units change their verdict")
    more = f"the first {SHOWN} are shown; --csv FILE or --json FILE has all {len(flips)}"
    by_values = (
        f"{len(not_measured)} of {judged} units were not measured again, but compared by their stored values: "
        f"their folders are gone, cannot be read or no longer hold what was judged ({listed(sorted(not_measured), 10)})"
    )
    limits_only = "stored values were compared with the new limits; changed settings of a check need --records"
    return Answer(
        shown if flips else f"none of {judged} units changes its verdict",
        Remark(more if len(flips) > SHOWN else ""),
        Remark(by_values if not_measured else ""),
        Remark("" if records else limits_only),
        *files(outputs, flipped),
        exit=Exit.INCOMPLETE if worse else Exit.ACCEPTED,
    )


def _changes_words(unit: judged_again.JudgedAgain) -> str:
    return "; ".join(
        f"{label_and_name(name)}: {was.replace('_', ' ')} -> {now.replace('_', ' ')}"
        for name, (was, now, _) in unit.findings.items()
    )


@command
def match(wanted: MatchOptions, outputs: Outputs) -> Answer:
    """Find units that fit together. Sets whose quantities lie closest, in units of their uncertainty; proven best."""
    kind, size, sets = wanted.kind, wanted.n, wanted.sets
    product = product_named(kind)
    by = wanted.by or product.matched_by
    if not by:
        raise ProductError(f"product '{kind}' does not say by which quantities sets are matched: name them with --by")
    with open_store() as store:
        frame = measurements(store, columns=matched_sets.COLUMNS)
    if wanted.without:
        frame = frame[~frame["serial"].isin(list(matched_sets.serials_in(wanted.without)))]
    days = day(wanted.since), day(wanted.until, last=True)
    these = matched_sets.serials_in(wanted.units) if wanted.units else None
    units = matched_sets.pool(frame, kind, by, matched_sets.Chosen(these, wanted.lot, days))
    if words := golden_left_out(frame[frame[GOLDEN] & (frame["kind"] == kind)]):
        say(words)
    for why, serials in units.left_out.items():
        say(f"left out, {why}: {listed(serials, 10)}")
    found = matched_sets.choose(units, size, sets)
    chosen = pd.DataFrame(
        {"set": number, "serial": units.serials[i], **dict(zip(units.quantities, units.values[i], strict=True))}
        for number, members in enumerate(found.sets, 1)
        for i in members
    )
    each = f"{sets} sets of {size}" if sets > 1 else str(size)
    stated = zip(units.quantities, units.U, units.units, strict=True)
    widths = (
        f"set {number}: widths add up to {cost:.3g} times U; {matched_sets.advice(units, members, cost)}"
        for number, (members, cost) in enumerate(zip(found.sets, found.costs, strict=True), 1)
    )
    bound = f"no choice can cost less than {found.bound:.3g}" if found.bound > 0 else "how much better is not known"
    stopped = f"stopped after the time limit: a better choice may exist; {bound}"
    return Answer(
        rows(chosen, f"{each} of {len(units.serials)} accepted {product.plural}"),
        f"median U (k = 2): {', '.join(f'{q} {U:.2g} {unit}' for q, U, unit in stated)}",
        *widths,
        Remark("" if found.proven else stopped),
        *files(outputs, chosen),
        exit=Exit.ACCEPTED if found.proven else Exit.INCOMPLETE,
    )
