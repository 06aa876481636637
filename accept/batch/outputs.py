"""The files of a batch for scripts: results.json, results.csv, junit.xml."""

import csv
import io
import json
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Any

from accept.base.documents.results import ListedUnit
from accept.base.version import version
from accept.gap import one_line

COLUMNS: Mapping[str, type] = {  # each as finding, unit or `findings` have it under this name
    "serial": str, "kind": str, "unit_verdict": str, "check": str, "quantity": str, "value": float, "unit": str,
    "U": float, "lower": float, "upper": float, "rule": str, "verdict": str, "p_false_accept": float, "required": bool,
    "reason": str, "gap": str, "attempt": int, "time": datetime, "operator": str, "simulated": bool,
}  # fmt: skip
JUNIT_HEAD = b"<?xml version='1.0' encoding='utf-8'?>\n<testsuites name=\"accept\">\n"
JUNIT_END = b"</testsuites>\n"


def results_json(specs: list[dict[str, str]], refused: list[dict[str, str]], **found: Any) -> bytes:
    """Return the document scripts rely on. `spec` is the first spec used; with units of both kinds, `specs` has all.
    found: units; of more than it lists how many have which verdict, and the data sets."""
    head = {"accept_version": version(), "spec": specs[0] if specs else None, "specs": specs}
    # sorted: a record taken from the store and one just judged are then the same bytes
    document = head | {"refused": refused} | found
    return json.dumps(document, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def findings(unit: ListedUnit, judgement: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return one row per finding of a unit, by columns `COLUMNS`; unit and judgement are in each row."""
    gap = None if unit.gap is None else one_line(unit.gap)
    of_unit = {**vars(unit), **judgement, "unit_verdict": unit.verdict, "gap": gap}
    rows = (of_unit | vars(finding) for finding in unit.findings)
    return [{name: row[name] for name in COLUMNS} for row in rows]


def csv_rows(findings: Iterable[Mapping[str, Any]], header: bool = False) -> bytes:
    """Return a row per finding, below a header if wanted; an unknown value is empty."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator=os.linesep)
    if header:
        writer.writerow(COLUMNS)
    writer.writerows(map(_cell, row.values()) for row in findings)
    return out.getvalue().encode()


def _cell(value: Any) -> Any:
    """Return a value as a cell: a text that a spreadsheet would take for a formula gets an apostrophe in front, and
    control characters that would move the cursor are removed."""
    if not isinstance(value, str):
        return value
    text = _clean(value)
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t") else text


def junit_unit(unit: ListedUnit) -> bytes:
    """Return a unit's suite, a case per finding and per nonconformance: fail and conditional are failures, no result is
    an error, and so is what holds the unit a failure. The answer of the gap workflow is the suite's output and does not
    change it."""
    return _element(_suite(unit))


def junit_refused(refused: list[dict[str, str]]) -> bytes:
    """Return a suite with an error for each refused folder."""
    suites = []
    for row in refused:
        suite = ET.Element("testsuite", name=_clean(row["path"]), tests="1", failures="0", errors="1")
        case = ET.SubElement(suite, "testcase", classname="unit", name="unit.toml")
        ET.SubElement(case, "error", type="refused", message=_clean(row["reason"]))
        suites.append(_element(suite))
    return b"".join(suites)


def _element(suite: ET.Element) -> bytes:
    ET.indent(suite, level=1)
    text: bytes = ET.tostring(suite, encoding="utf-8")
    return b"  " + text + b"\n"


def _suite(unit: ListedUnit) -> ET.Element:
    cases = [(f.check, f.quantity, str(f.verdict), f.reason or "") for f in unit.findings]
    cases += [("unit", "nonconformance", "held", words) for words in unit.nonconformances]
    failures = sum(verdict in {"fail", "conditional", "held"} for _, _, verdict, _ in cases)
    errors = sum(verdict == "no_result" for _, _, verdict, _ in cases)
    counts = {"tests": len(cases), "failures": failures, "errors": errors}
    suite = ET.Element("testsuite", {"name": unit.serial} | {k: str(v) for k, v in counts.items()})
    if unit.simulated:
        properties = ET.SubElement(suite, "properties")
        ET.SubElement(properties, "property", name="simulated", value="true")
    for check, quantity, verdict, reason in cases:
        case = ET.SubElement(suite, "testcase", classname=check, name=quantity)
        if verdict != "pass":
            tag = "error" if verdict == "no_result" else "failure"
            ET.SubElement(case, tag, type=verdict, message=_clean(reason))
    if unit.gap is not None:
        ET.SubElement(suite, "system-out").text = _clean(one_line(unit.gap))
    return suite


def _clean(text: str) -> str:
    """Return text with a question mark for each control character, which XML 1.0 does not allow; a damaged file's name
    or message may hold some."""
    return "".join(c if c in "\t\n" or (c.isprintable() and c <= "\U0010ffff") else "?" for c in text)
