"""The data of the page as one JSON document: judgements, their findings, trends and gap answers."""

import json
import os
from collections.abc import Collection, Mapping, Sequence
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from accept.base.names import shown_name
from accept.fleet.errors import FleetError
from accept.fleet.findings_file import NOT_STATED, bench_of, findings
from accept.fleet.golden_chart import GoldenTrend, golden_trends, in_doubt
from accept.fleet.measurements import (
    CONCEDED,
    GOLDEN,
    VOIDED,
    counted,
    digits,
    first_attempts,
    in_order_of_measurement,
    is_between,
    measurements,
)
from accept.fleet.process_control.control_chart import Alarm
from accept.fleet.reading_alarms import unlike_values
from accept.fleet.rings import OF_A_PAGE
from accept.fleet.trend import stored_baselines, summary, trends
from accept.fleet.yields import cause_label, stops
from accept.judging.reservations import voids
from accept.pictures.labels import label_of
from accept.pictures.words import pretty
from accept.store import Event, Store, fold, touched
from accept.store.decisions import stated_words, words_of
from accept.store.payloads import (
    AttemptVoided,
    CertificateSigned,
    CertificateWritten,
    GoldenMissed,
    GoldenNamed,
    GoldenResolved,
    GoldenRetired,
    InstrumentChecked,
    NonconformanceDecided,
    Payload,
    UnitJudged,
)
from checks.picture import Line, Panel
from checks.verdict import Finding
from specs.spec import listed_name

FINDING = ("check", "quantity", "value", "U", "lower", "upper", "verdict", "reason")
SHOWN = ("first", "shown", "shown_U")  # beside them: of a first attempt; value and U in the digits that U allows
TREND_BY = ("all", "bench", "lot")
DAY_S = 86_400.0
MOST = 2000  # judgements of a page: it opens in a second, and is written in two
OF_FIRST = (
    "seq", "serial", "attempt", "quantity", "verdict", "reason", "required", "study", "held_by", VOIDED, CONCEDED,
    "unit_verdict", "simulated", GOLDEN,
)  # fmt: skip
SHOWN_POINTS = 400  # of a curve: a page holds those of many units


def document(
    store: Store,
    curves: Mapping[str, Sequence[Mapping[str, Any]]],
    out: Path | None = None,
    last: int = MOST,
    since: date | None = None,
    until: date | None = None,
) -> dict[str, Any]:
    """Return judgements: a row per judgement in the order of the store, its findings as lists in the order of `FINDING`
    and `SHOWN`; quantities: name -> unit as people write it; labels: name -> words; trends: quantity -> column ->
    what `accept trend` states; goldens: quantity -> alarms of the charts of golden units; golden_notes: what those can
    find; rings: the chance that the page rings without a cause, how many alarms of all and of golden units do, how many
    are to be watched, how many of groups ring, and those of golden units that do; curves: title ->
    [{serial, x, y}] with the axes' labels; of: how many judgements the store holds; golden: how many of those shown are
    of golden units; head: its last event; made: when. out: folder of the page, from which certificates are linked.
    last: how many judgements are shown, the last ones. since, until: only what was measured on these days, alarms too;
    `happenings` of these days. Raises StoreError, FleetError."""
    head = store.head().seq
    numbers, tries, names = (values for values, _ in findings(store, ("seq", "attempt", "typed")).values())
    after = int(numbers[-last - 1]) if numbers.size > last else 0
    attempts = dict(zip(numbers[-last:].tolist(), tries[-last:].tolist(), strict=True))
    typed = dict(zip(numbers[-last:].tolist(), names[-last:].tolist(), strict=True))
    frame = measurements(store, after=after)
    within = is_between(frame, since, until)
    shown, golden = ({*frame[of]["seq"].tolist()} for of in (within, frame[GOLDEN]))
    first, begun, stopped = _first_attempts(store, set(frame["serial"].unique()), after)
    moments, void = _moments(frame), voids(store)
    goldens = golden_trends(store)
    why = in_doubt(frame, goldens)[~frame[GOLDEN]]
    doubts = why[why != ""].groupby(frame["seq"]).agg(lambda words: sorted(set(words))).to_dict()
    certificates = _certificates(store, out, set(frame["serial"].unique()))
    judgements: list[dict[str, Any]] = []
    units: dict[str, str] = {}
    for event in store.events(what=UnitJudged.KIND, after=after):
        result = UnitJudged.of(event).result
        if event.seq not in attempts or not (since is until is None or event.seq in shown):
            continue  # judged since this page was begun, or measured on other days
        units |= {f.quantity: "" if f.unit == "1" else pretty(f.unit) for f in result.findings}
        judgements.append(
            {
                "serial": event.subject,
                "time": event.time[:19],
                "operator": event.who,
                "by": shown_name(event.who, bool(typed[event.seq])),
                "bench": bench_of(result),
                "kind": result.kind,
                "attempt": attempts[event.seq],
                "verdict": VOIDED if event.seq in void else str(result.verdict),
                "voided": void[event.seq].words if event.seq in void else "",
                "at": moments.get(event.seq, event.time[:19]),
                "lot": result.origin.get("lot", NOT_STATED),
                "simulated": result.simulated,
                "golden": event.seq in golden,
                "first": event.seq in begun,
                "passed": event.seq in begun and event.subject not in stopped,
                "stop": stopped.get(event.subject) if event.seq in begun else None,
                "certificate": certificates.get((event.subject, attempts[event.seq])),
                "spec": listed_name(event.spec),
                "findings": [_row(finding, (event.seq, finding.quantity) in first) for finding in result.findings],
                "notes": result.notes,
                "doubt": doubts.get(event.seq, []),
                "held": result.nonconformances,
                "dispositions": stated_words(result.dispositions),
                "gap": _gap(result.gap),
            }
        )
    alarms = ((g, alarm, doubt) for g in goldens for alarm, doubt in zip(g.chart.alarms, g.doubts, strict=True))
    off = [(g.quantity, g.words(a), a.rings) for g, a, doubt in alarms if doubt.is_between(since, until)]
    unlike = unlike_values(frame[within])
    charts = {name: _trends(frame, store, name, within, unlike) for name in units}
    labels = {name: label_of(name) for name in units}
    return {
        "finding": (*FINDING, *SHOWN),
        "trends": charts,
        "goldens": {name: [words for of, words, _ in off if of == name] for name in units},
        "golden_notes": {name: [g.reach for g in goldens if g.quantity == name] for name in units},
        "rings": _rings(charts, off),
        "happenings": happenings(store, since or date.min, until or date.max, charts, goldens),
        "days": [each and each.isoformat() for each in (since, until)],
        "quantities": units,
        "labels": labels,
        "judgements": judgements,
        "curves": dict(curves),
        "of": int(numbers.size),
        "golden": len(shown & golden),
        "head": head,
        "made": f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
    }


def _first_attempts(
    store: Store, serials: Collection[str], after: int
) -> tuple[set[tuple[int, str]], set[int], dict[str, list[Any]]]:
    """Return, of these units: judgement and quantity of each first attempt behind an event; the units' first
    judgements; and of each that did not pass at its first attempt what stopped it, the verdict and what else did."""
    history = measurements(store, columns=OF_FIRST)
    history = history[history["serial"].isin(serials)]
    firsts = first_attempts(history)
    firsts = firsts[firsts["seq"] > after]
    begun = set(counted(history).drop_duplicates("serial")["seq"])
    rows = stops(history).to_dict("records") if begun else []
    stopped = {row["serial"]: [cause_label(row["quantity"]), row["verdict"], row["also"]] for row in rows}
    return set(zip(firsts["seq"].tolist(), firsts["quantity"].tolist(), strict=True)), begun, stopped


def _moments(frame: pd.DataFrame) -> dict[int, str]:
    """Return number of a judgement -> its position on the axis of time: its day of measurement, and within the day in
    order of measurement, evenly."""
    ordered = in_order_of_measurement(frame).drop_duplicates("seq")
    within = ordered.groupby("day").cumcount() / ordered.groupby("day")["seq"].transform("size")
    at = ordered["day"] + pd.to_timedelta(within * DAY_S, unit="s")
    return dict(zip(ordered["seq"].tolist(), at.dt.strftime("%Y-%m-%dT%H:%M:%S").tolist(), strict=True))


def _rings(
    charts: Mapping[str, Mapping[str, Sequence[Mapping[str, Any]]]], off: Sequence[tuple[str, str, bool]]
) -> dict[str, Any]:
    """Return how many alarms ring and how many are to be watched. charts: quantity -> column -> groups; off: quantity,
    words and whether it rings of each alarm of a golden unit."""
    found = [
        (by, a["rings"]) for of in charts.values() for by, groups in of.items() for g in groups for a in g["alarms"]
    ]
    of_all = [*(rings for by, rings in found if by == "all"), *(rings for *_, rings in off)]
    return {
        "chance": OF_A_PAGE,
        "alarms": sum(of_all),
        "watched": len(of_all) - sum(of_all),
        "of_groups": sum(rings for by, rings in found if by != "all"),
        "goldens": [words for _, words, rings in off if rings],
    }


def _trends(
    frame: pd.DataFrame,
    store: Store,
    name: str,
    within: "pd.Series[bool]",
    unlike: Mapping[str, Mapping[str, Alarm]],
) -> dict[str, list[dict[str, Any]]]:
    """Return column -> limits, mean, alarms in words and indices of each group, as `accept trend` states them."""
    found = {}
    for by in TREND_BY:
        if by != "all" and (frame[by] == NOT_STATED).all():
            continue
        try:
            charts = trends(frame, name, by, stored_baselines(store, name, by), (), within, unlike)
        except FleetError:
            continue
        keys = ("group", "n", "limits", "baseline", "alarms", "cautions", "Cpk", "Ppk", "findable")
        found[by] = [{key: each[key] for key in keys} for each in (summary(t, points=False) for t in charts)]
    return found


def _certificates(store: Store, out: Path | None, serials: Collection[str]) -> dict[tuple[str, int], str]:
    found = {}
    kinds = (CertificateWritten.KIND, CertificateSigned.KIND)
    for serial in {event.subject for kind in kinds for event in store.events(what=kind)} & set(serials):
        unit = fold(store.events(serial))
        for attempt, path in unit.certificates.values() if unit else ():
            if Path(path).is_file():
                found[(serial, attempt)] = _link(Path(path), out)
    return found


def _link(path: Path, out: Path | None) -> str:
    """Return a link relative to the page's folder, so that both can be moved together; else an absolute one."""
    try:
        return "./" + quote(Path(os.path.relpath(path, out)).as_posix()) if out else path.as_uri()
    except ValueError:  # another drive
        return path.as_uri()


def _row(finding: Finding, first: bool) -> list[Any]:
    columns = {name: getattr(finding, name) for name in FINDING}
    if isinstance(finding.reason, str):
        columns["reason"] = pretty(finding.reason)
    return [*columns.values(), first, *digits(finding.value, finding.U)]


def _gap(answer: Mapping[str, Any] | None) -> dict[str, Any] | None:
    if answer is None:
        return None
    named = [str(n["effect"]) for n in answer.get("named") or ()]
    return {"verdict": answer.get("verdict"), "named": named}


def curves(panels: Mapping[str, Mapping[str, Panel]]) -> dict[str, list[dict[str, Any]]]:
    """Return measured curves by the title of their picture. panels: serial -> name -> picture."""
    found: dict[str, list[dict[str, Any]]] = {}
    for serial, pictures in panels.items():
        for panel in pictures.values():
            lines = [item for item in panel.items if isinstance(item, Line) and item.role in ("data", "auto")]
            if lines:
                found.setdefault(panel.title, []).append(_curve(serial, panel, lines[0]))
    return {title: rows for title, rows in found.items() if len(rows) > 1}


def _curve(serial: str, panel: Panel, line: Line) -> dict[str, Any]:
    step = max(1, line.x.size // SHOWN_POINTS)
    x, y = np.asarray(line.x)[::step], np.asarray(line.y)[::step]
    good = np.isfinite(x) & np.isfinite(y)
    return {
        "serial": serial,
        "x": [float(f"{v:.6g}") for v in x[good]],
        "y": [float(f"{v:.6g}") for v in y[good]],
        "x_label": pretty(panel.x_label),
        "y_label": pretty(panel.y_label),
        "x_log": panel.x_log,
        "y_log": panel.y_log,
    }


def script(content: Mapping[str, Any]) -> str:
    """Return the document as a script that only assigns it: no text of a unit can end the script or begin another."""
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return "window.FLEET=" + text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026") + ";\n"


_GOLDEN = "golden unit"
KINDS: dict[type[Payload], str] = {
    GoldenNamed: _GOLDEN, GoldenRetired: _GOLDEN, GoldenMissed: _GOLDEN, GoldenResolved: _GOLDEN,
    NonconformanceDecided: "decision", AttemptVoided: "void attempt", InstrumentChecked: "recall",
}  # fmt: skip
ALARM, WATCHED = "alarm", "to be watched"  # what rings (`accept.fleet.rings`), and what its own chart alone finds rare
_Row = dict[str, str]


def happenings(
    store: Store,
    since: date,
    until: date,
    trends: Mapping[str, Mapping[str, Sequence[Any]]],
    goldens: Sequence[GoldenTrend],
) -> list[_Row]:
    """Return a row of day, kind, unit, person and words for each, by day. trends: as the page has them; goldens: charts
    of golden units, of which those count that were off on these days. Raises StoreError."""
    days = since.isoformat(), until.isoformat()
    rows = [
        _alarm(alarm["rings"], alarm["since"], alarm["first"], alarm["words"])
        for groups in trends.values()
        for group in groups.get("all", ())
        for alarm in group["alarms"]
        if days[0] <= alarm["since"] <= days[1]
    ]
    for each in goldens:
        for alarm, doubt in zip(each.chart.alarms, each.doubts, strict=True):
            if doubt.is_between(since, until):
                begun = max(days[0], f"{each.rows['day'].iloc[alarm.first]:%Y-%m-%d}")
                rows.append(_alarm(alarm.rings, begun, each.serial, f"golden unit {each.words(alarm)}"))
    for what, kind in KINDS.items():
        for event in (e for e in store.events(what=what.KIND) if days[0] <= e.time[:10] <= days[1]):
            unit, words = _told(payload := what.of(event), event, store)
            who = shown_name(event.who, payload.typed)
            if words:
                rows.append({"day": event.time[:10], "kind": kind, "unit": unit, "who": who, "words": words})
    return sorted(rows, key=lambda row: row["day"])


def _alarm(rings: bool, day: str, unit: str, words: str) -> _Row:
    return {"day": day, "kind": ALARM if rings else WATCHED, "unit": unit, "who": "", "words": words}


def _told(payload: Payload, event: Event, store: Store) -> tuple[str, str]:
    """Return unit and words of an event, "" for an instrument that was right."""
    match payload:
        case GoldenNamed(expect=expected, reason=reason):
            return event.subject, f"named, expected {expected}{f': {reason}' if reason else ''}"
        case GoldenRetired(reason=reason):
            return event.subject, f"retired: {reason}"
        case GoldenMissed(serials=serials, reasons=reasons):
            words = "; ".join(line for each in reasons.values() for line in each)
            return ", ".join(serials), f"the bench was stopped: {words}"
        case GoldenResolved(reason=reason):
            return event.subject, f"the bench may judge again: {reason}"
        case NonconformanceDecided():
            return event.subject, words_of(payload)
        case AttemptVoided(attempt=attempt):
            return event.subject, f"attempt {attempt}: {payload.words}"
        case InstrumentChecked(passed=False, instrument=name, serial=serial):
            missed = f"{payload.what} read as {payload.value:g} {payload.unit}, E_n {payload.E_n:.2g}; "
            unknown = "which units it touched is not known: it states no serial number"
            return serial or name, missed + (_touched_since(store, event, serial) if serial else unknown)
    return "", ""


def _touched_since(store: Store, missed: Event, serial: str) -> str:
    """Return how many units the instrument touched between the day on which it was last right and this event."""
    checks = ((e, InstrumentChecked.of(e)) for e in store.events(what=InstrumentChecked.KIND) if e.seq < missed.seq)
    good = [event.time[:10] for event, check in checks if check.passed and check.serial == serial]
    since = max(good, default=date.min.isoformat())
    before = (event for event in store.events() if event.seq < missed.seq)
    units = {touch.unit for touch in touched(before, serial, date.fromisoformat(since))}
    when = f"since {since}, when it was last right" if good else "ever, as it was never right before"
    return f"{len(units)} units were touched by {serial} {when}"
