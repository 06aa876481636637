"""What calibration stands behind a unit's findings: without a valid one a finding is conditional at best.

The statement is plain data that travels in the result, so that a certificate can be judged again without the bench
file.
"""

import datetime
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, because, together
from checks.verdict import Finding, Verdict
from specs.bench import BenchFile

Statement = Mapping[str, Any]
"""bench: name of the bench file; sha256: of its bytes; on: the day of judging, ISO; instruments: a row per check and
instrument that serves it: check, name, model, serial, certificate, calibrated, due, commissioned (in words; None: no
program reads it), and, once held against a unit, measured (the day that counts: when it was measured where the unit
tells, else of judging) and problem (None: valid)."""


def statement(
    bench: BenchFile, checks: Iterable[str], on: datetime.date, commissioned: Mapping[str, str] | None = None
) -> Statement:
    """What the bench file says about the instruments behind these checks. on: the day of judging. commissioned: by
    instrument, what is known of its commissioning."""
    rows = [
        {
            "check": check,
            "name": name,
            "model": entry.model,
            "serial": entry.serial,
            "certificate": entry.calibration.certificate if entry.calibration else None,
            "calibrated": _iso(entry.calibration.calibrated if entry.calibration else None),
            "due": _iso(entry.calibration.due if entry.calibration else None),
            "commissioned": (commissioned or {}).get(name),
        }
        for check in checks
        for name, entry in bench.instruments.items()
        if check in entry.measures
    ]
    return {"bench": bench.name, "sha256": bench.sha256, "on": on.isoformat(), "instruments": rows}


def checked(given: Statement, measured: Mapping[str, datetime.date]) -> Statement:
    """A statement held against a unit: the day that counts and the problem of every row, found anew from its dates.

    measured : check -> day on which the unit was measured. Raises ValueError, KeyError or TypeError for no statement.
    """
    today = datetime.date.fromisoformat(given["on"])
    rows = []
    for row in given["instruments"]:
        day = measured.get(row["check"], today)
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
    return None


def _iso(day: datetime.date | None) -> str | None:
    return None if day is None else day.isoformat()


def problems(given: Statement, checks: Iterable[str]) -> dict[str, str]:
    """Check -> why its calibration does not hold. A check without any instrument in the bench file is one of them."""
    found = {}
    for check in checks:
        rows = [row for row in given["instruments"] if row["check"] in (check, CHECKS[check].reads)]
        bad = [row["problem"] for row in rows if row["problem"]]
        if not rows:
            bad = ["the bench file names no instrument for it: its calibration is unknown"]
        if bad:
            found[check] = "; ".join(bad)
    return found


def downgraded(findings: Sequence[Finding], wrong: Mapping[str, str]) -> list[Finding]:
    """Findings with every pass of a check whose calibration does not hold made conditional, and the reason added to
    all that have a value."""
    return [weakened(f, because(Cause.CALIBRATION, detail=wrong[f.check])) if f.check in wrong else f for f in findings]


def weakened(finding: Finding, why: Reason) -> Finding:
    """A finding that passes on a condition only, and says why; one without a result as it is."""
    if finding.verdict is Verdict.NO_RESULT:
        return finding
    cause = together([*([] if finding.cause is None else [finding.cause]), why])
    verdict = Verdict.CONDITIONAL if finding.verdict is Verdict.PASS else finding.verdict
    return replace(finding, verdict=verdict, reason=str(cause), cause=cause)


def notes(given: Statement) -> list[str]:
    """A line for the certificate per instrument."""
    lines = []
    for row in given["instruments"]:
        who = " ".join(word for word in (row["model"], row["serial"]) if word) or "no serial number"
        words = row["problem"] or f"certificate {row['certificate']}, valid to {row['due']}"
        proven = f"; {row['commissioned']}" if row.get("commissioned") else ""
        lines.append(f"{row['check']}: {row['name']} ({who}): {words}{proven}")
    return lines


def same(one: Statement | None, other: Statement | None) -> bool:
    """Whether two statements say the same, but for the day on which they were made."""
    if one is None or other is None:
        return one is other
    return _timeless(one) == _timeless(other)


def _timeless(given: Statement) -> Statement:
    rows = [{**row, "measured": ""} for row in given["instruments"]]
    return {**given, "on": "", "instruments": rows}
