"""`accept trend`: control charts of a quantity."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Annotated, Any

import pandas as pd
from typer import Argument, Option

from accept.base.console import say
from accept.base.exit_codes import Exit
from accept.base.names import shown_name
from accept.commands.answer import Answer, Remark, command, picture
from accept.commands.fleet.answers import files, is_chosen, left_out, rows
from accept.commands.fleet.options import JudgementFilter, Outputs, TrendBy
from accept.commands.options import Operator, Plot, QaPassphrase
from accept.commands.trust.bench_keys import signer_kept_here, who_acts
from accept.fleet import trend as trends
from accept.fleet.errors import FleetError
from accept.fleet.golden_chart import golden_trends, in_doubt
from accept.fleet.measurements import CHECKED, instrument_checks, measurements
from accept.fleet.process_control.control_chart import NELSON, Baseline
from accept.pictures.labels import label_and_name
from accept.store import open_store

STAGE = ("group", "spec", "since", "until", "n", "lower", "upper", "Cpk", "Ppk")


@command
def trend(
    quantity: Annotated[str, Argument(help="A quantity, such as stroke_um; check:lcr for the reference of lcr.")],
    *,
    by: Annotated[TrendBy, Option(help="A chart for each of these.")] = TrendBy.ALL,
    baseline: Annotated[
        str | None,
        Option(help="Days of a good process, 2026-10-01..2026-10-15: store it; later values are compared with it."),
    ] = None,
    reason: Annotated[str, Option(help="Why a baseline is revised.")] = "",
    operator: Operator = None,
    passphrase_file: QaPassphrase = None,
    rules: Annotated[
        str | None, Option(help="Nelson's rules asked for beside gross values and shifts, such as 2,3.")
    ] = None,
    choice: JudgementFilter,
    plot: Plot = None,
    outputs: Outputs,
) -> Answer:
    """Show a quantity over time. Control charts, alarms since the baseline, capability; exit 4 at an alarm."""
    with open_store() as store:
        of_instrument = quantity.startswith(CHECKED)
        frame = instrument_checks(store, quantity.removeprefix(CHECKED)) if of_instrument else measurements(store)
        if baseline is not None:
            signer = signer_kept_here(passphrase_file, reason)
            who = who_acts(operator) if signer is None else signer.person
            for of in trends.trends(frame, quantity, by.value, chosen=is_chosen(frame, _within(baseline, choice))):
                stated = trends.set_baseline(store, of, by.value, reason, who, signer)
                say(f"{of.name}: baseline of {stated.n} units, {stated.since} to {stated.until}, stored")
        baselines = trends.stored_baselines(store, quantity, by.value)
        frame = frame.assign(**{trends.DOUBT: in_doubt(frame, golden_trends(store, quantity=quantity))})
    for words in left_out(frame[(frame["quantity"] == quantity) & is_chosen(frame, choice)]):
        say(words)
    charts = trends.trends(frame, quantity, by.value, baselines, _rules(rules), is_chosen(frame, choice))
    documents = [trends.summary(t, points=outputs.json is not None or outputs.csv is not None) for t in charts]
    points = pd.DataFrame([p | {"group": d["group"]} for d in documents for p in d["points"]])
    drawn = [t for t in charts if len(t.rows)]
    stages = [{"group": d["group"], **s, **_indices(s["capability"])} for d in documents for s in d["stages"]]
    return Answer(
        rows(pd.DataFrame(map(_row, documents)), f"{label_and_name(quantity)} [{charts[0].unit}], first attempts"),
        rows(pd.DataFrame(stages, columns=STAGE), "capability by revision of the limits") if stages else None,
        *(line for pair in zip(charts, documents, strict=True) for line in _lines(*pair)),
        *files(outputs, points, documents),
        picture(plot, lambda: [each for t in drawn for each in trends.chart_panels(t)], columns=1, announced=True)
        if drawn
        else None,
        exit=Exit.INCOMPLETE if any(d["alarms"] for d in documents) else Exit.ACCEPTED,
    )


def _lines(each: trends.Trend, document: Mapping[str, Any]) -> Iterator[str]:
    for alarm in document["alarms"]:
        yield f"{each.name}: {'' if alarm['rings'] else 'to be watched: '}{alarm['words']}"
    yield from (Remark(f"{each.name}: {words}") for words in each.why)
    doubts = each.rows[trends.DOUBT].value_counts(sort=False).drop("", errors="ignore")
    yield from (
        Remark(f"{each.name}: {n} units {words}; accept golden chart lists them") for words, n in doubts.items()
    )
    if each.chart is not None:
        yield Remark(f"{each.name}: {_basis(each, each.chart.baseline)}")
        if None not in each.findable:
            own, ring = (f"{size:.2g} {each.unit}" for size in each.findable)
            yield Remark(
                f"{each.name}: a shift of half of these units is found in nine of ten such charts from {own} on, and "
                f"rings from {ring} on: that is as rare for all charts of a page, what is to be watched for this one"
            )


def _within(days: str, choice: JudgementFilter) -> JudgementFilter:
    """Return the choice narrowed to the days of a baseline. Raises FleetError for anything but two days."""
    since, dots, until = days.partition("..")
    if not dots:
        raise FleetError(f"--baseline {days}: expected two days, 2026-10-01..2026-10-15")
    return replace(choice, since=since, until=until)


def _rules(text: str | None) -> list[int]:
    """Return the numbers of Nelson's rules. Raises FleetError for anything else."""
    try:
        rules = [int(word) for word in text.split(",")] if text else []
    except ValueError:
        rules = [0]
    if wrong := [rule for rule in rules if rule not in NELSON]:
        known = "; ".join(f"{number}: {words}" for number, words in NELSON.items())
        raise FleetError(f"--rules {text}: expected numbers such as 2,3 ({known}); got {wrong[0]}")
    return rules


def _row(document: Mapping[str, Any]) -> dict[str, object]:
    spreads = {name: document[name] for name in ("mean", "sigma_within", "sigma_overall")}
    return {
        "group": document["group"],
        "units": document["n"],
        **spreads,
        **_indices(document),
        "alarms": len(document["alarms"]),
    }


def _indices(document: Mapping[str, Any] | None) -> dict[str, str | None]:
    """Return Cpk and Ppk with their intervals, None for those that are not known."""
    known = document or dict.fromkeys(("Cpk", "Ppk"))
    return {
        name: f"{value:.2f} ({known[f'{name}_lo']:.2f} to {known[f'{name}_hi']:.2f})"
        if (value := known[name]) is not None
        else None
        for name in ("Cpk", "Ppk")
    }


def _basis(each: trends.Trend, base: Baseline) -> str:
    """Return the reference of the chart, and the rate of its false alarms."""
    left_out = f", {base.left_out} gross left out" if base.left_out else ""
    of, stored = "the values themselves", each.baseline
    if stored is not None:
        who = shown_name(stored.who, stored.stated.typed)
        by = f"set by {who}, {stored.problem}" if stored.problem else f"set and signed by {who}"
        of = f"the baseline {stored.stated.since} to {stored.stated.until}, {by}"
    scale = f", on the scale of the {each.scale}, on which they are most nearly normal" if each.scale else ""
    return (
        f"compared with {of} ({base.n} units{left_out}){scale}; "
        f"{100.0 * each.false_alarms:.1f} % of such charts have such an alarm in a process in control"
    )
