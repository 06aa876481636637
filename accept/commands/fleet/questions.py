"""`accept history`, `list`, `yield` and `trend`."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from math import isnan
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from accept.base.atomic_files import check_place, write_atomic
from accept.base.console import clear_errors, operator_name, say, stdout
from accept.base.exit_codes import Exit
from accept.commands.fleet.options import By, JudgementFilter, ListOptions, Outputs, TrendBy
from accept.commands.fleet.tables import check, show, telling, write, write_documents
from accept.commands.options import Operator, Plot
from accept.fleet import history as histories
from accept.fleet import trend as trends
from accept.fleet import yields
from accept.fleet.errors import FleetError
from accept.fleet.measurements import CHECKED, attempts, between, day, instrument_checks, latest, measurements
from accept.pictures.formats import format_of
from accept.pictures.labels import label_and_name, label_of
from accept.store import open_store
from checks.picture import Panel
from checks.process_control.control_chart import NELSON, Baseline
from checks.rounding import rounded, rounded_U

MOST_NAMED = 10  # void attempts in one line


def is_chosen(frame: pd.DataFrame, choice: JudgementFilter) -> pd.Series:
    """Return which rows are asked about. Raises FleetError if there are none."""
    rows = frame.index.isin(between(frame, day(choice.since), day(choice.until, last=True)).index)
    if choice.kind is not None:
        rows &= frame["kind"] == choice.kind
    if not rows.any():
        raise FleetError("the store holds no such judgement" if len(frame) else "no unit has been judged yet")
    return pd.Series(rows, index=frame.index)


def chosen(frame: pd.DataFrame, choice: JudgementFilter) -> pd.DataFrame:
    """Return the rows that are asked about. Raises FleetError if there are none."""
    return frame[is_chosen(frame, choice)]


def _stored(serial: str | None = None) -> pd.DataFrame:
    with open_store() as store:
        return measurements(store, serial)


@clear_errors
def history(
    serial: Annotated[str, typer.Argument(help="Serial of a unit.")], *, plot: Plot = None, outputs: Outputs
) -> Exit:
    """Show every attempt of a unit. Its values with U, and what changed by more than the uncertainties allow."""
    check(outputs)
    check_plot(plot)
    frame = _stored(serial)
    if frame.empty:
        raise FleetError(f"no judgement of a unit '{serial}' in the store; `accept list` shows all serials")
    changed = histories.changes(frame)
    tries = attempts(frame)
    shown = tries[["attempt", "time", "operator", "bench", "spec", "unit_verdict", "causes", "voided"]]
    show(telling(shown, "bench", "voided"), serial)
    columns = ["attempt", "quantity", "value", "U", "unit", "verdict", "change", "En", "changed"]
    shown = telling(_to_the_digits_of_U(changed[columns]), "change", "En", "changed")
    show(shown, "values, with their expanded uncertainty U (k = 2)", {"En": "{:.2f}", "change": "{:+.3g}"})
    for row in changed[changed["changed"].eq(True)].itertuples():
        stdout.print(
            f"attempt {row.attempt}: {label_and_name(str(row.quantity))} changed by {row.change:+.3g} "
            f"{row.unit}, {row.En:.1f} times what both uncertainties allow",
            soft_wrap=True,
        )
    write(outputs, changed)
    draw(plot, histories.panels(changed), columns=2)
    return Exit.ACCEPTED


def check_plot(plot: Path | None) -> None:
    """Raise OSError or PictureError, before the work, if a picture cannot be written."""
    if plot is not None:
        check_place(plot)
        format_of(plot)


def draw(plot: Path | None, panels: Sequence[Panel], columns: int) -> None:
    """Write pictures to a file if one is named. Raises OSError, PictureError."""
    if plot is None or not panels:
        return
    from accept.pictures.draw import picture  # loads matplotlib: only when wanted

    write_atomic(plot, picture(panels, format_of(plot), columns=min(columns, len(panels))))
    say(f"{plot}: written")


def _to_the_digits_of_U(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a frame with value and U as texts, "-" if one is missing."""

    def both(value: float, U: float) -> tuple[str, str]:
        known = not isnan(U) and U > 0.0
        return "-" if isnan(value) else rounded(value, U if known else None), rounded_U(U) if known else "-"

    pairs = [both(value, U) for value, U in zip(frame["value"], frame["U"], strict=True)]
    return frame.assign(value=[value for value, _ in pairs], U=[U for _, U in pairs])


@clear_errors
def units(wanted: ListOptions, choice: JudgementFilter, outputs: Outputs) -> Exit:
    """List the units in the store. With their last verdict and what stopped them."""
    check(outputs)
    frame, every = chosen(_stored(), choice), wanted.all_attempts
    judged = frame if every else latest(frame)
    tries = attempts(judged)
    verdict = "failed" if wanted.failed else wanted.verdict.value if wanted.verdict else None
    if verdict is not None:
        verdicts = {"failed": ("rejected", "conditional", "incomplete")}.get(verdict, (verdict,))
        tries = tries[tries["unit_verdict"].isin(verdicts)]
    if wanted.check is not None:
        tries = tries[tries["seq"].isin(_stopped_by(judged, wanted.check))]
    why = _why(judged)
    tries = tries.assign(why=[why.get(seq, "") for seq in tries["seq"]])
    rows = tries[["serial", "kind", "attempt", "time", "operator", "bench", "spec", "unit_verdict", "causes", "why"]]
    title = f"{len(rows)} of {judged['seq'].nunique()} judgements" if every else f"{len(rows)} units"
    one_spec = ["spec"] if rows["spec"].eq(rows["kind"]).all() else []  # the built-in one of each kind: said already
    show(telling(rows, "bench").drop(columns=[*one_spec, "causes"]), title)
    write(outputs, rows)
    return Exit.ACCEPTED


def _why(frame: pd.DataFrame) -> dict[int, str]:
    """Return the number of a judgement -> what did not pass: value, verdict, limits."""
    told: dict[int, list[str]] = {}
    for row in frame[frame["verdict"] != "pass"].to_dict("records"):
        told.setdefault(int(row["seq"]), []).append(_bad(row))
    return {seq: "; ".join(words) for seq, words in told.items()}


def _bad(row: Mapping[Hashable, Any]) -> str:
    label, verdict = label_of(row["quantity"]), row["verdict"].replace("_", " ")
    if isnan(row["value"]):
        return f"{label}: {verdict}"
    lower, upper = (None if isnan(row[bound]) else f"{row[bound]:.6g}" for bound in ("lower", "upper"))
    limits = f"{lower} to {upper}" if lower and upper else f"at least {lower}" if lower else f"at most {upper}"
    return f"{label} {rounded(row['value'], row['U'])} {row['unit']}: {verdict} ({limits})"


def _stopped_by(frame: pd.DataFrame, check: str) -> pd.Series:
    named = (frame["check"] == check) | (frame["quantity"] == check)
    if not named.any():
        held = ", ".join(sorted({*frame["check"], *frame["quantity"]}))
        raise FleetError(f"no judgement has a check or quantity '{check}'; there are: {held}")
    return frame.loc[named & (frame["verdict"] != "pass"), "seq"]


@clear_errors
def first_pass(
    *,
    by: Annotated[By, typer.Option(help="Groups.")] = By.MONTH,
    choice: JudgementFilter,
    plot: Plot = None,
    outputs: Outputs,
) -> Exit:
    """Show the first-pass yield. With its interval, and the causes that stopped the others, the most frequent first."""
    check(outputs)
    check_plot(plot)
    frame = _stored()
    asked = is_chosen(frame, choice)
    made = yields.yields(frame, by.value, asked)
    _say_voided(frame[asked])
    if made.empty:
        raise FleetError("no unit was judged for the first time in this period; re-tests are no first attempts")
    show(made, "first-pass yield, with its 95 % interval", dict.fromkeys(("first_pass", "lo", "hi"), "{:.1%}"))
    causes = yields.pareto(frame, asked)
    if len(causes):
        show(causes, "what stopped units at their first attempt", {"share": "{:.1%}"})
    else:
        stdout.print("every unit passed at its first attempt")
    write(outputs, made)
    draw(plot, yields.panels(made, causes, by.value), columns=2)
    return Exit.ACCEPTED


def _say_voided(frame: pd.DataFrame) -> None:
    """Say which attempts do not count: a yield without them is not that of all that was measured."""
    void = frame[frame["voided"] != ""].drop_duplicates("seq")
    if len(void):
        named = [f"{row['serial']} attempt {row['attempt']}" for row in void.to_dict("records")]
        more = f" and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
        say(f"{len(named)} attempts are void and not counted: {', '.join(named[:MOST_NAMED])}{more}")


@clear_errors
def trend(
    quantity: Annotated[str, typer.Argument(help="A quantity, such as stroke_um; check:lcr for the reference of lcr.")],
    *,
    by: Annotated[TrendBy, typer.Option(help="A chart for each of these.")] = TrendBy.ALL,
    baseline: Annotated[
        str | None,
        typer.Option(
            help="Days of a good process, 2026-10-01..2026-10-15: store it; later values are compared with it."
        ),
    ] = None,
    reason: Annotated[str, typer.Option(help="Why a baseline is revised.")] = "",
    operator: Operator = None,
    rules: Annotated[
        str | None, typer.Option(help="Nelson's rules asked for beside gross values and shifts, such as 2,3.")
    ] = None,
    choice: JudgementFilter,
    plot: Plot = None,
    outputs: Outputs,
) -> Exit:
    """Show a quantity over time. Control charts, alarms since the baseline, capability; exit 4 at an alarm."""
    check(outputs)
    check_plot(plot)
    with open_store() as store:
        of_instrument = quantity.startswith(CHECKED)
        frame = instrument_checks(store, quantity.removeprefix(CHECKED)) if of_instrument else measurements(store)
        if baseline is not None:
            for of in trends.trends(frame, quantity, by.value, chosen=is_chosen(frame, _within(baseline, choice))):
                stated = trends.set_baseline(store, of, by.value, reason, operator_name(operator))
                say(f"{of.name}: baseline of {stated.n} units, {stated.since} to {stated.until}, stored")
        known = trends.stored_baselines(store, quantity, by.value)
    _say_voided(frame[(frame["quantity"] == quantity) & is_chosen(frame, choice)])
    made = trends.trends(frame, quantity, by.value, known, _rules(rules), is_chosen(frame, choice))
    documents = [trends.summary(t) for t in made]
    show(pd.DataFrame(map(_row, documents)), f"{label_and_name(quantity)} [{made[0].unit}], first attempts")
    for each, document in zip(made, documents, strict=True):
        for alarm in document["alarms"]:
            stdout.print(f"{each.name}: {alarm['words']}", soft_wrap=True)
        for words in each.why:
            say(f"{each.name}: {words}")
        if each.chart is not None:
            say(f"{each.name}: {_basis(each, each.chart.baseline)}")
    write_documents(
        outputs, documents, pd.DataFrame([p | {"group": d["group"]} for d in documents for p in d["points"]])
    )
    draw(plot, [trends.panel(t) for t in made if len(t.rows)], columns=1)
    return Exit.INCOMPLETE if any(d["alarms"] for d in documents) else Exit.ACCEPTED


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
    """Return a group's line of the table: each index with its 95 % interval."""

    def index(name: str) -> str | None:
        value, lo, hi = (document[f"{name}{end}"] for end in ("", "_lo", "_hi"))
        return None if value is None else f"{value:.2f} ({lo:.2f} to {hi:.2f})"

    return {
        "group": document["group"],
        "units": document["n"],
        "mean": document["mean"],
        "sigma_within": document["sigma_within"],
        "sigma_overall": document["sigma_overall"],
        **{name: index(name) for name in ("Cpk", "Ppk")},
        "alarms": len(document["alarms"]),
    }


def _basis(each: trends.Trend, base: Baseline) -> str:
    """Return what the chart compares with, and how often it rings without a reason."""
    left_out = f", {base.left_out} gross left out" if base.left_out else ""
    stated = each.baseline.stated if each.baseline else None
    of = f"the baseline {stated.since} to {stated.until}" if stated else "the values themselves"
    scale = f", on the scale of the {each.scale}, on which they are normal" if each.scale else ""
    return (
        f"compared with {of} ({base.n} units{left_out}){scale}; "
        f"{100.0 * each.false_alarms:.1f} % of such charts ring in a process in control"
    )
