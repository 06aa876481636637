"""`accept history`, `list` and `yield`."""

from collections.abc import Collection, Hashable, Mapping
from math import isnan
from typing import Annotated, Any

import pandas as pd
import typer

from accept.base.console import clear_errors, say, stdout
from accept.base.exit_codes import Exit
from accept.commands.fleet.answers import (
    check,
    check_plot,
    chosen,
    draw,
    is_chosen,
    named,
    say_not_counted,
    show,
    telling,
    write,
)
from accept.commands.fleet.options import By, JudgementFilter, ListOptions, Outputs
from accept.commands.options import Plot
from accept.fleet import history as histories
from accept.fleet import yields
from accept.fleet.errors import FleetError
from accept.fleet.measurements import (
    COLUMNS,
    attempts,
    held,
    latest,
    measurements,
)
from accept.judging.nonconformance import standing, words_of
from accept.pictures.labels import label_and_name, label_of
from accept.store import open_store
from checks.rounding import rounded, rounded_U

SHOWN = 500  # units on the terminal; the files have all
SHOWN_OF_A_UNIT = (
    "serial", "kind", "attempt", "time", "operator", "bench", "spec", "unit_verdict", "conceded", "simulated", "causes",
    "why",
)  # fmt: skip
LISTED = {
    "seq", "serial", "kind", "attempt", "time", "measured", "operator", "bench", "spec", "unit_verdict", "check",
    "quantity", "value", "U", "unit", "lower", "upper", "verdict", "required", "voided", "conceded", "simulated",
    "typed",
}  # fmt: skip


def _stored_rows(serial: str | None = None, columns: Collection[str] = COLUMNS, brief: bool = False) -> pd.DataFrame:
    with open_store() as store:
        return measurements(store, serial, columns=columns, brief=brief)


@clear_errors
def history(
    serial: Annotated[str, typer.Argument(help="Serial of a unit.")], *, plot: Plot = None, outputs: Outputs
) -> Exit:
    """Show every attempt of a unit. Its values with U, and what changed by more than the uncertainties allow."""
    check(outputs)
    check_plot(plot)
    with open_store() as store:
        frame, decided = measurements(store, serial), standing(store, serial, {}).decided
    if frame.empty:
        raise FleetError(f"no judgement of a unit '{serial}' in the store; `accept list` shows all serials")
    changed = histories.changes(frame)
    tries = attempts(frame)
    shown = named(tries)[
        ["attempt", "time", "operator", "bench", "spec", "unit_verdict", "simulated", "causes", "voided"]
    ]
    show(telling(shown, "bench", "simulated", "voided"), serial)
    for given in decided:
        stdout.print(words_of(given), soft_wrap=True)
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


def _to_the_digits_of_U(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a frame with value and U as texts, "-" if one is missing."""

    def both(value: float, U: float) -> tuple[str, str]:
        has_U = not isnan(U) and U > 0.0
        return "-" if isnan(value) else rounded(value, U if has_U else None), rounded_U(U) if has_U else "-"

    pairs = [both(value, U) for value, U in zip(frame["value"], frame["U"], strict=True)]
    return frame.assign(value=[value for value, _ in pairs], U=[U for _, U in pairs])


@clear_errors
def units(wanted: ListOptions, choice: JudgementFilter, outputs: Outputs) -> Exit:
    """List the units in the store. With their last verdict and what stopped them."""
    check(outputs)
    frame, every = chosen(_stored_rows(columns=LISTED, brief=wanted.check is None), choice), wanted.all_attempts
    judged = frame if every else latest(frame)
    tries = attempts(judged)
    verdict = "failed" if wanted.failed else wanted.verdict.value if wanted.verdict else None
    if verdict is not None:
        verdicts = {"failed": ("rejected", "conditional", "incomplete")}.get(verdict, (verdict,))
        tries = tries[tries["unit_verdict"].isin(verdicts)]
    if wanted.check is not None:
        tries = tries[tries["seq"].isin(_stopped_by(judged, wanted.check))]
    why = _failures(judged)
    tries = tries.assign(why=[why.get(seq, "") for seq in tries["seq"]])
    rows = tries[[*SHOWN_OF_A_UNIT, "typed"]]
    title = f"{len(rows)} of {judged['seq'].nunique()} judgements" if every else f"{len(rows)} units"
    one_spec = (
        ["spec"] if rows["spec"].astype(str).eq(rows["kind"].astype(str)).all() else []
    )  # the built-in one of each kind: said already
    shown = telling(named(rows), "bench", "conceded", "simulated").drop(columns=[*one_spec, "causes", "typed"])
    show(shown.tail(SHOWN), title)
    if len(rows) > SHOWN:
        say(f"the last {SHOWN} are shown; --csv FILE or --json FILE has all {len(rows)}")
    write(outputs, rows)
    return Exit.ACCEPTED


def _failures(frame: pd.DataFrame) -> dict[int, str]:
    """Return the number of a judgement -> what did not pass: value, verdict, limits."""
    failures = {seq: ["held by a nonconformance"] for seq in held(frame)}
    for row in frame[frame["verdict"] != "pass"].to_dict("records"):
        failures.setdefault(int(row["seq"]), []).append(_failure_words(row))
    return {seq: "; ".join(words) for seq, words in failures.items()}


def _failure_words(row: Mapping[Hashable, Any]) -> str:
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
    frame = _stored_rows(columns={*yields.COLUMNS, *({by.value} - yields.PERIODS.keys())})
    asked = is_chosen(frame, choice)
    table = yields.yields(frame, by.value, asked)
    say_not_counted(frame[asked])
    if table.empty:
        raise FleetError("no unit was judged for the first time in this period; re-tests are no first attempts")
    shown = table if table["conceded"].any() else table.drop(columns="conceded")
    show(shown, "first-pass yield, with its 95 % interval", dict.fromkeys(("first_pass", "lo", "hi"), "{:.1%}"))
    causes = yields.pareto(frame, asked)
    if len(causes):
        show(causes, "what stopped units at their first attempt", {"share": "{:.1%}"})
    else:
        stdout.print("every unit passed at its first attempt")
    write(outputs, table)
    draw(plot, yields.panels(table, causes, by.value), columns=2)
    return Exit.ACCEPTED
