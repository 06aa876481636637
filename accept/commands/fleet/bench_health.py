"""`accept rr` and `accept golden`: is the measurement itself sound."""

import datetime
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd
from typer import Argument, Option

from accept.base.console import say
from accept.base.documents.listings import GoldenList, GoldenListed, GoldensCompared, ReferenceListed
from accept.base.exit_codes import Exit
from accept.commands.answer import Answer, File, Remark, command, picture
from accept.commands.fleet.answers import chosen, files, rows
from accept.commands.fleet.options import ExpectedGolden, GaugeOptions, JudgementFilter, Outputs
from accept.commands.options import JsonAnswer, Plot, QaPassphrase
from accept.commands.trust.bench_keys import decision_signer, who_acts
from accept.fleet import gauge, golden, golden_chart
from accept.fleet.errors import FleetError
from accept.fleet.golden import check as check_goldens
from accept.fleet.measurements import counted, measurements, of_quantity
from accept.fleet.process_control.gauge_bias import CAPABLE
from accept.fleet.process_control.gauge_study import CATEGORIES
from accept.store import open_store


def _read(table: Path, columns: Sequence[str]) -> pd.DataFrame:
    """Read a table of readings and say what was not read as written."""
    frame = gauge.read_table(table, columns)
    for words in frame.attrs["remarks"]:
        say(words)
    return frame


AtTheBench = Annotated[str | None, Option(envvar="ACCEPT_OPERATOR", help="Who is at the bench.")]


@command
def gauge_study(
    wanted: GaugeOptions,
    choice: JudgementFilter,
    outputs: Outputs,
    table: Annotated[Path | None, Argument(help="CSV file with columns part, operator, value.")] = None,
    plot: Plot = None,
) -> Answer:
    """Evaluate a gauge study. Repeatability, reproducibility, U for a spec; exit 4 if conditional, 3 if not usable."""
    if (table is None) == (wanted.quantity is None):
        raise FleetError("name either a CSV table (part, operator, value) or --quantity for judgements in the store")
    if wanted.tolerance == 0.0:
        raise FleetError("--tolerance 0: the distance between the limits must be above zero")
    if table is not None:
        frame = _read(table, gauge.COLUMNS)
    else:
        with open_store() as store:
            frame = chosen(of_quantity(measurements(store), str(wanted.quantity)), choice)
        frame = frame[frame["study"] == wanted.study] if wanted.study else counted(frame)
        if frame.empty:
            raise FleetError(f"the store holds no judgement of a study '{wanted.study}'; [origin] study names it")
        frame = gauge.from_store(frame)
    found = gauge.study(frame)
    document = gauge.document(found, wanted.tolerance, frame)
    components = pd.DataFrame(document["components"])
    by_ranges = document["averages_and_ranges"]
    shown = components if by_ranges is None else components.assign(by_ranges=components["source"].map(by_ranges))
    percents = dict.fromkeys(("percent_of_study", "percent_of_variance", "percent_of_tolerance"), "{:.1f}")
    pooled = "not significant, pooled with the repeats" if found.pooled else "significant"
    of_tolerance = "" if wanted.tolerance is None else f", {document['percent_of_tolerance']:.1f} % of the tolerance"
    of = f"source = 'gauge study of {len(frame)} readings'"
    return Answer(
        rows(pd.DataFrame(document["table"]), "analysis of variance", dict.fromkeys(("F", "p"), "{:.4g}")),
        rows(shown, "gauge study, crossed: standard deviations with their 95 % intervals", percents),
        f"operators x parts: {pooled} (p = {found.table['interaction'].p:.3g})",
        f"distinct categories: {found.distinct_categories} ({CATEGORIES} or more are wanted)",
        f"gauge R&R: {found.percent_of_study:.1f} % of the study{of_tolerance}",
        f"for a spec: U = {document['U']:.3g} (k = 2, without calibration), {of}",
        *files(outputs, components, document),
        picture(plot, lambda: gauge.panels(frame, found), columns=2, announced=True),
        f"the measurement is {document['verdict']}: {document['decided_by']}",
        exit={"good": Exit.ACCEPTED, "conditional": Exit.INCOMPLETE}.get(document["verdict"], Exit.REJECTED),
    )


@command
def gauge_bias(
    table: Annotated[Path, Argument(help="CSV file with the column value: one part, in order.")],
    reference: Annotated[float, Option(help="Value of the part by its certificate.")],
    tolerance: Annotated[float | None, Option(help="Distance between the limits: gives Cg and Cgk.")] = None,
    plot: Plot = None,
    *,
    outputs: Outputs,
) -> Answer:
    """Evaluate repeated readings of one reference. Bias with its t test, Cg and Cgk; exit 3 if not capable."""
    frame = _read(table, ("value",))
    found = gauge.bias(frame, reference, tolerance)
    document = gauge.bias_document(found, reference, tolerance)
    b, capability = found.bias, None
    exit = Exit.INCOMPLETE if b.significant else Exit.ACCEPTED
    if found.Cg is not None and found.Cgk is not None:
        state, exit = ("capable", Exit.ACCEPTED) if found.capable else ("not capable", Exit.REJECTED)
        capability = f"Cg {found.Cg:.2f}, Cgk {found.Cgk:.2f} ({CAPABLE} or more are wanted): {state}"
    words = "significant" if b.significant else "not significant"
    return Answer(
        f"{found.n} readings: mean {found.mean:.6g}, repeatability {found.sigma:.4g} (1 sd)",
        f"bias {b.value:+.4g}, 95 % interval {b.lo:+.4g} to {b.hi:+.4g}: {words} (t {b.t:.3g}, p {b.p:.3g})",
        capability,
        *files(outputs, frame, document),
        picture(plot, lambda: gauge.bias_panels(frame, found, reference), columns=1, announced=True),
        exit=exit,
    )


@command
def gauge_linearity(
    table: Annotated[Path, Argument(help="CSV file with columns reference, value: several parts.")],
    plot: Plot = None,
    *,
    outputs: Outputs,
) -> Answer:
    """Evaluate readings of several references. The line of the bias over the range; exit 4 if it is significant."""
    frame = _read(table, ("reference", "value"))
    found = gauge.linearity(frame)
    document = gauge.linearity_document(found)
    listed = [{"reference": r["reference"], "bias": r["value"], "from": r["lo"], "to": r["hi"], "p": r["p"]}
            for r in document["references"]]  # fmt: skip
    biases = pd.DataFrame(listed)
    lines = (
        f"{name} {each.value:+.4g}, {each.lo:+.4g} to {each.hi:+.4g}: "
        f"{'significant' if each.significant else 'not significant'} (t {each.t:.4g})"
        for name, each in (("slope", found.slope), ("intercept", found.intercept))
    )
    return Answer(
        rows(biases, "mean bias of each reference, with its 95 % interval", {"p": "{:.3g}"}),
        *lines,
        f"R² {100.0 * found.r_squared:.1f} %, spread about the line {found.sigma:.4g} (1 sd)",
        *files(outputs, biases, document),
        picture(plot, lambda: gauge.linearity_panels(frame, found), columns=1, announced=True),
        exit=Exit.ACCEPTED if found.linear else Exit.INCOMPLETE,
    )


@command
def golden_name(
    serial: Annotated[str, Argument(help="Serial of a judged unit.")],
    expect: Annotated[ExpectedGolden, Option(help="What it must always be.")] = ExpectedGolden.ACCEPTED,
    last: Annotated[int, Option(min=1, help="How many of its last judgements give the reference.")] = 1,
    reason: Annotated[str, Option(help="Why the reference of a golden unit is changed.")] = "",
    operator: AtTheBench = None,
    passphrase_file: QaPassphrase = None,
) -> Answer:
    """Make a judged unit a golden one. Its values and uncertainties are fixed from then on; quality assurance signs
    every naming but the first one with its key."""
    with open_store() as store:
        signer = decision_signer(passphrase_file, reason)() if golden.needs_signature(store) else None
        who = who_acts(operator) if signer is None else ""
        golden.name_golden(store, serial, expect.value, who, reason, last, signer)
    return Answer(Remark(f"{serial} is a golden unit, expected {expect}"))


@command
def golden_list(json: JsonAnswer = None) -> Answer:
    """List the golden units with their references."""
    with open_store() as store:
        found, stopped = golden.goldens(store), golden.missed(store)
    listed = [
        GoldenListed(
            g.serial, g.expected, g.named.who, g.named.time,
            tuple(ReferenceListed(name, r.value, r.U, r.unit, r.n) for name, r in g.reference.items()),
        )
        for g in found.values()
    ]  # fmt: skip
    problems = None if stopped is None else {serial: tuple(each) for serial, each in stopped.items()}
    references = [
        {"serial": g.serial, "expected": g.expected, "quantity": name, "value": r.value, "U": r.U, "unit": r.unit,
         "n": r.n, "named by": g.named.by, "on": g.named.time[:10]}
        for g in found.values()
        for name, r in g.reference.items()
    ]  # fmt: skip
    formats = {"value": "{:.6g}", "U": "{:.2g}"}
    stops = (Remark(f"this bench is stopped: {serial}: {'; '.join(each)}") for serial, each in (problems or {}).items())
    return Answer(
        File(json, GoldenList(tuple(listed), problems)),
        rows(pd.DataFrame(references), "golden units", formats) if references else None,
        *stops,
        exit=Exit.ACCEPTED if stopped is None else Exit.REJECTED,
    )


@command
def golden_charts(
    serial: Annotated[str | None, Argument(help="Serial of a golden unit; all without it.")] = None,
    quantity: Annotated[str | None, Option(help="Only this quantity.")] = None,
    plot: Plot = None,
    *,
    outputs: Outputs,
) -> Answer:
    """Show the chart of each golden unit, with limits of its own repeatability. What was judged since its last good
    day; exit 4 at an alarm."""
    with open_store() as store:
        charts = golden_chart.golden_trends(store, serial, quantity)
        if not charts:
            asked = " ".join(word for word in (serial, quantity) if word) or "any"
            named = ", ".join(sorted(golden.goldens(store))) or "none"
            raise FleetError(f"no comparison of a golden unit ({asked}); golden units: {named}")
        rings = any(each.chart.alarms for each in charts)
        doubted = golden_chart.judged_in_doubt(measurements(store), charts) if rings else pd.DataFrame()
    documents = [golden_chart.document(each) for each in charts]
    shown = ("golden", "quantity", "bench", "n", "mean", "repeatability", "reference")
    table = pd.DataFrame([{name: d[name] for name in shown} | {"alarms": len(d["alarms"])} for d in documents])
    return Answer(
        rows(table, "golden units, repeatability of their own comparisons (1 sd)", {"repeatability": "{:.2g}"}),
        *(f"{'' if alarm['rings'] else 'to be watched: '}{alarm['words']}" for d in documents for alarm in d["alarms"]),
        *(Remark(f"{d['quantity']}: {d['findable']}") for d in documents),
        *(Remark(f"{d['golden']}, {d['quantity']}: {words}") for d in documents for words in d["cautions"]),
        rows(doubted, f"{doubted['serial'].nunique()} units judged since the last good day") if rings else None,
        *files(outputs, doubted, documents),
        picture(plot, lambda: [p for c in charts for p in golden_chart.golden_panels(c)], columns=2, announced=True),
        exit=Exit.INCOMPLETE if rings else Exit.ACCEPTED,
    )


@command
def golden_retire(
    serial: Annotated[str, Argument(help="Serial of a golden unit.")],
    reason: Annotated[str, Option(help="Why.")],
    passphrase_file: QaPassphrase = None,
) -> Answer:
    """Make a golden unit an ordinary one. Quality assurance signs the decision with its key."""
    signer = decision_signer(passphrase_file, reason)
    with open_store() as store:
        golden.retire(store, serial, reason, signer)
    return Answer(Remark(f"{serial} is not a golden unit any more"))


@command
def golden_check(
    hours: Annotated[float, Option(min=0.1, help="How long ago the shift began [h].")] = 12.0,
    operator: AtTheBench = None,
    json: JsonAnswer = None,
) -> Answer:
    """Compare golden units with their references. Exit 3 if one is missed: the bench then judges nothing."""
    since = datetime.datetime.now(datetime.UTC) - datetime.timedelta(hours=hours)
    with open_store() as store:
        found = check_goldens(store, since, who_acts(operator))
        charts = golden_chart.golden_trends(store)
    lines = (
        f"{each.serial}: not measured in the last {hours:g} hours" if not (each.measured or each.problems)
        else f"{each.serial}: {'; '.join(each.problems) or f'as before ({each.expected})'}"
        for each in found
    )  # fmt: skip
    missed = any(each.problems for each in found)
    words = "the bench judges nothing else until this is resolved: accept golden resolve --reason '...'"
    exit = Exit.ACCEPTED if all(each.measured for each in found) else Exit.INCOMPLETE
    return Answer(
        File(json, GoldensCompared(tuple(found))),
        *lines,
        Remark(words if missed else ""),
        *(Remark(f"chart of {each.words(alarm)}") for each in charts for alarm in each.chart.alarms),
        exit=Exit.REJECTED if missed else exit,
    )


@command
def golden_resolve(
    reason: Annotated[str, Option(help="What was wrong and what was done.")], passphrase_file: QaPassphrase = None
) -> Answer:
    """Let a stopped bench judge again. Quality assurance signs the decision with its key."""
    signer = decision_signer(passphrase_file, reason)
    with open_store() as store:
        golden.resolve(store, reason, signer)
    return Answer(Remark(f"resolved by {signer().person}; judge the golden units again before anything else"))
