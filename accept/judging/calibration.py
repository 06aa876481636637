"""The calibration of the instruments behind a unit's findings: without a valid one a finding is conditional at best.

The statement is plain data that travels in the result, so that a certificate can be judged again without the bench
file.
"""

import datetime
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, because
from specs.bench import BenchFile
from specs.spec import CheckSpec

References = Mapping[str, Sequence[tuple[str, float]]]  # instrument -> day and E_n of each comparison, in order
Statement = Mapping[str, Any]
"""bench: name of the bench file; sha256: of its bytes; on: the day of judging, ISO; instruments: a row per check and
instrument that serves it: check, name, model, serial, certificate, calibrated, due, commissioned (in words; None: no
program reads it), commissioning (what its technician signed of it), issuer (of the certificate, if it is stated) and,
once held against a unit, measured (the day that counts: when it was measured where the unit tells, else of judging) and
problem (None: valid). If the spec asks for a daily reference: reference_days, and reference, the day and E_n of the
last comparison before the measurement (None: there was none). channels: sources of channels in the rig's records;
values: section -> number beside its records, as it is at this bench."""


def statement(
    bench: BenchFile,
    checks: Mapping[str, CheckSpec],
    on: datetime.date,
    commissioned: Mapping[str, Mapping[str, Any]] | None = None,
    references: References | None = None,
) -> Statement:
    """Return what the bench file states about the instruments behind these checks. on: the day of judging.
    commissioned: by instrument, the keys of its row on its commissioning."""
    rows = [
        {
            "check": check,
            "name": name,
            "model": entry.model,
            "serial": entry.serial,
            "certificate": entry.calibration.certificate if entry.calibration else None,
            "calibrated": _iso(entry.calibration.calibrated if entry.calibration else None),
            "due": _iso(entry.calibration.due if entry.calibration else None),
            **(commissioned or {}).get(name, {"commissioned": None}),
            **({"issuer": entry.calibration.issuer} if entry.calibration and entry.calibration.issuer else {}),
            **_asked_reference(asked, (references or {}).get(name, ())),
        }
        for check, asked in checks.items()
        for name, entry in bench.equipment.items()
        if check in entry.measures
    ]
    sources = bench.rig.channels if bench.rig else {}
    channels = {name: source.model_dump(exclude_defaults=True) for name, source in sources.items()}
    stated = {"bench": bench.name, "sha256": bench.sha256, "on": on.isoformat(), "instruments": rows}
    return stated | {key: told for key, told in (("channels", channels), ("values", bench.values)) if told}


def _asked_reference(asked: CheckSpec, comparisons: Sequence[tuple[str, float]]) -> dict[str, Any]:
    if asked.reference_days is None:
        return {}
    known = [{"day": day, "E_n": E_n} for day, E_n in comparisons]
    return {"reference_days": asked.reference_days, "references": known}


def _with_reference(row: Mapping[str, Any], day: datetime.date) -> dict[str, Any]:
    """Return a row with the last comparison on or before the day of the measurement in place of all of them."""
    if "references" not in row:
        return dict(row)
    before = [one for one in row["references"] if one["day"] <= day.isoformat()]
    rest = {key: value for key, value in row.items() if key != "references"}
    return rest | {"reference": before[-1] if before else None}


def checked_calibration(given: Statement, measured: Mapping[str, datetime.date]) -> Statement:
    """Return a statement compared with a unit: the day that counts and each row's problem, derived again from dates.

    measured : check -> day on which the unit was measured. Raises ValueError, KeyError or TypeError if the data are not
    a statement.
    """
    today = datetime.date.fromisoformat(given["on"])
    rows = []
    for row in given["instruments"]:
        day = measured.get(row["check"], today)
        row = _with_reference(row, day)
        rows.append({**row, "measured": day.isoformat(), "problem": _problem(row, day, today)})
    return {**given, "instruments": rows}


def _problem(row: Mapping[str, Any], day: datetime.date, today: datetime.date) -> str | None:
    who = f"{row['name']}{' ' + row['serial'] if row['serial'] else ''}"
    if row["due"] is None or not row["certificate"]:
        return f"the calibration of {who} is unknown"
    if not row["serial"]:
        return f"{who} has no serial number in the bench file, so no calibration is its own"
    if day > today:
        return f"it was measured on {day}, after the day of judging"
    if day > datetime.date.fromisoformat(row["due"]):
        return f"the calibration of {who} ({row['certificate']}) expired on {row['due']}, it was measured on {day}"
    if row["calibrated"] and day < datetime.date.fromisoformat(row["calibrated"]):
        return f"{who} was calibrated on {row['calibrated']} ({row['certificate']}), after it measured on {day}"
    return None if row.get("reference_days") is None else _reference_problem(row, who, day)


def _reference_problem(row: Mapping[str, Any], who: str, day: datetime.date) -> str | None:
    """Return why the last comparison with the reference does not cover what was measured on a day, None if it does."""
    last, most = row.get("reference"), int(row["reference_days"])
    if last is None:
        return f"{who} was never compared with its reference before it measured on {day}"
    if (day - datetime.date.fromisoformat(last["day"])).days > most:
        words = f"the spec allows {most} day{'s' * (most != 1)}"
        return f"{who} was last compared with its reference on {last['day']}, it measured on {day}; {words}"
    if not abs(float(last["E_n"])) <= 1.0:
        return f"{who} missed its reference on {last['day']} (E_n = {float(last['E_n']):.2g})"
    return None


def _iso(day: datetime.date | None) -> str | None:
    return None if day is None else day.isoformat()


def problems(given: Statement, checks: Iterable[str]) -> dict[str, Reason]:
    """Return check -> why its calibration does not hold. One without any instrument in the bench file is included."""
    found = {}
    for check in checks:
        rows = [row for row in given["instruments"] if row["check"] in (check, CHECKS[check].reads)]
        bad = [row["problem"] for row in rows if row["problem"]]
        if not rows:
            bad = ["the bench file names no instrument for it: its calibration is unknown"]
        if bad:
            found[check] = because(Cause.CALIBRATION, detail="; ".join(bad))
    return found


def without_reference(given: Statement | None, checks: Mapping[str, CheckSpec]) -> dict[str, Reason]:
    """Return check -> why the comparison with a reference that its spec asks for is not stated. What is asked stands in
    the spec, not in the statement: one that says nothing of it, or no statement at all, never passes."""
    found = {}
    for check, asked in checks.items():
        if asked.reference_days is None:
            continue
        rows = [row for row in (given or {}).get("instruments", ()) if row["check"] in (check, CHECKS[check].reads)]
        most = [row.get("reference_days") for row in rows]
        if not rows or any(days is None or days > asked.reference_days for days in most):
            days = f"{asked.reference_days} day{'s' * (asked.reference_days != 1)}"
            why = "no bench file was given" if given is None else "the bench file has no such comparison for it"
            words = f"the spec asks for a comparison with the reference within {days}, and {why}"
            found[check] = because(Cause.CALIBRATION, detail=words)
    return found


def notes(given: Statement) -> list[str]:
    """Return a line for the certificate per instrument."""
    lines = []
    for row in given["instruments"]:
        who = " ".join(word for word in (row["model"], row["serial"]) if word) or "no serial number"
        issuer = f" of {row['issuer']}" if row.get("issuer") else ""
        words = row["problem"] or f"certificate {row['certificate']}{issuer}, valid to {row['due']}"
        proven = f"; {row['commissioned']}" if row.get("commissioned") else ""
        lines.append(f"{row['check']}: {row['name']} ({who}): {words}{proven}")
    return lines


def same_calibration(one: Statement | None, other: Statement | None) -> bool:
    """Return whether two statements are equal apart from the day on which they were made."""
    if one is None or other is None:
        return one is other
    return _timeless(one) == _timeless(other)


def _timeless(given: Statement) -> Statement:
    rows = [{**row, "measured": "", "reference": None} for row in given["instruments"]]
    return {**given, "on": "", "instruments": rows}
