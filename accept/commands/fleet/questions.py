"""`accept history`, `list` and `yield`."""

from collections.abc import Collection, Hashable, Mapping
from math import isnan
from typing import Annotated, Any

import pandas as pd
from typer import Argument, Option

from accept.commands.answer import Answer, Remark, command, picture
from accept.commands.fleet.answers import chosen, files, is_chosen, left_out, named, rows, telling
from accept.commands.fleet.options import By, JudgementFilter, ListOptions, Outputs
from accept.commands.options import Plot
from accept.fleet import history as histories
from accept.fleet import yields
from accept.fleet.errors import FleetError
from accept.fleet.measurements import COLUMNS, attempts, digits, held, latest, measurements
from accept.judging.reservations import standing
from accept.pictures.labels import label_and_name, label_of
from accept.store import open_store
from accept.store.decisions import words_of
from checks.rounding import rounded

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


@command
def history(
    serial: Annotated[str, Argument(help="Serial of a unit.")], *, plot: Plot = None, outputs: Outputs
) -> Answer:
    """Show every attempt of a unit. Its values with U, and what changed by more than the uncertainties allow."""
    with open_store() as store:
        frame, decided = measurements(store, serial), standing(store, serial, {}).decided
    if frame.empty:
        raise FleetError(f"no judgement of a unit '{serial}' in the store; `accept list` shows all serials")
    changed = histories.changes(frame)
    tries = attempts(frame)
    shown = named(tries)[
        ["attempt", "time", "operator", "bench", "spec", "unit_verdict", "simulated", "causes", "voided"]
    ]
    columns = ["attempt", "quantity", "value", "U", "unit", "verdict", "change", "En", "changed"]
    values = telling(_to_the_digits_of_U(changed[columns]), "change", "En", "changed")
    title, formats = "values, with their expanded uncertainty U (k = 2)", {"En": "{:.2f}", "change": "{:+.3g}"}
    moved = (
        f"attempt {row.attempt}: {label_and_name(str(row.quantity))} changed by {row.change:+.3g} "
        f"{row.unit}, {row.En:.1f} times what both uncertainties allow"
        for row in changed[changed["changed"].eq(True)].itertuples()
    )
    panels = histories.panels(changed)
    return Answer(
        rows(telling(shown, "bench", "simulated", "voided"), serial),
        *map(words_of, decided),
        rows(values, title, formats),
        *moved,
        *files(outputs, changed),
        picture(plot, lambda: panels, columns=2, announced=True) if panels else None,
    )


def _to_the_digits_of_U(frame: pd.DataFrame) -> pd.DataFrame:
    pairs = [digits(value, U) for value, U in zip(frame["value"], frame["U"], strict=True)]
    return frame.assign(value=[value for value, _ in pairs], U=[U for _, U in pairs])


@command
def units(wanted: ListOptions, choice: JudgementFilter, outputs: Outputs) -> Answer:
    """List the units in the store. With their last verdict and what stopped them."""
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
    listed = tries[[*SHOWN_OF_A_UNIT, "typed"]]
    title = f"{len(listed)} of {judged['seq'].nunique()} judgements" if every else f"{len(listed)} units"
    one_spec = (
        ["spec"] if listed["spec"].astype(str).eq(listed["kind"].astype(str)).all() else []
    )  # the built-in one of each kind: said already
    shown = telling(named(listed), "bench", "conceded", "simulated").drop(columns=[*one_spec, "causes", "typed"])
    more = f"the last {SHOWN} are shown; --csv FILE or --json FILE has all {len(listed)}"
    return Answer(rows(shown.tail(SHOWN), title), Remark(more if len(listed) > SHOWN else ""), *files(outputs, listed))


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


@command
def first_pass(
    *,
    by: Annotated[By, Option(help="Groups.")] = By.MONTH,
    choice: JudgementFilter,
    plot: Plot = None,
    outputs: Outputs,
) -> Answer:
    """Show the first-pass yield. With its interval, and the causes that stopped the others, the most frequent first."""
    frame = _stored_rows(columns={*yields.COLUMNS, *({by.value} - yields.PERIODS.keys())})
    asked = is_chosen(frame, choice)
    table, causes = yields.yields(frame, by.value, asked), yields.pareto(frame, asked)
    remarks = left_out(frame[asked])
    if table.empty:
        none = FleetError("no unit was judged for the first time in this period; re-tests are no first attempts")
        return Answer(*remarks, error=none)
    shown = table if table["conceded"].any() else table.drop(columns="conceded")
    shares = dict.fromkeys(("first_pass", "lo", "hi"), "{:.1%}")
    stops = rows(causes, "what stopped units at their first attempt", {"share": "{:.1%}"})
    return Answer(
        *remarks,
        rows(shown, "first-pass yield, with its 95 % interval", shares),
        stops if len(causes) else "every unit passed at its first attempt",
        *files(outputs, table),
        picture(plot, lambda: yields.panels(table, causes, by.value), columns=2, announced=True),
    )
