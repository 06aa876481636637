"""The files of a batch for scripts: results.json, results.csv, junit.xml."""

import csv
import io
import json
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from typing import Any

from accept.base.version import version
from accept.gap.text import one_line

COLUMNS = [
    "serial", "kind", "unit_verdict", "check", "quantity", "value", "unit", "U", "lower", "upper", "rule", "verdict",
    "p_false_accept", "required", "reason", "gap", "attempt", "time", "operator",
    "simulated",
]  # fmt: skip
JUNIT_HEAD = b"<?xml version='1.0' encoding='utf-8'?>\n<testsuites name=\"accept\">\n"
JUNIT_END = b"</testsuites>\n"


def results_json(specs: list[dict[str, str]], units: list[dict[str, Any]], refused: list[dict[str, str]]) -> bytes:
    """Return the document scripts rely on. `spec` is the first spec used; with units of both kinds, `specs` has all."""
    spec = specs[0] if specs else None
    document = {"accept_version": version(), "spec": spec, "specs": specs, "units": units, "refused": refused}
    # sorted: an entry taken from the store and one just judged are then the same bytes
    return json.dumps(document, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def findings(entry: Mapping[str, Any], judgement: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return one row per finding of a unit's entry, by columns `COLUMNS`; unit and judgement are in each row."""
    known = {"serial": entry["serial"], "kind": entry["kind"], "unit_verdict": entry["verdict"], **judgement}
    known["simulated"] = bool(entry.get("simulated"))
    gap = {"gap": one_line(entry["gap"])} if "gap" in entry else {}
    return [known | gap | finding for finding in entry["findings"]]


def counts_json(
    specs: list[dict[str, str]], verdicts: dict[str, int], refused: list[dict[str, str]], datasets: dict[str, str]
) -> bytes:
    """Return results.json for more units than it lists: how many have which verdict, and the data sets."""
    head = {"accept_version": version(), "spec": specs[0] if specs else None, "specs": specs}
    document = head | {"verdicts": verdicts, "datasets": datasets, "refused": refused}
    return json.dumps(document, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def csv_rows(findings: Iterable[Mapping[str, Any]], header: bool = False) -> bytes:
    """Return a row per finding, below a header if wanted; an unknown value is empty."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator=os.linesep)
    if header:
        writer.writerow(COLUMNS)
    writer.writerows([_cell(row.get(name)) for name in COLUMNS] for row in findings)
    return out.getvalue().encode()


def _cell(value: Any) -> Any:
    """Return a value as a cell: a text that a spreadsheet would take for a formula gets an apostrophe in front, and
    control characters that would move the cursor are removed."""
    if not isinstance(value, str):
        return value
    text = _clean(value)
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t") else text


def junit_unit(unit: dict[str, Any]) -> bytes:
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


def _suite(unit: dict[str, Any]) -> ET.Element:
    held = {"check": "unit", "quantity": "nonconformance", "verdict": "held"}
    findings = [*unit["findings"], *(held | {"reason": words} for words in unit.get("nonconformances", ()))]
    failures = sum(f["verdict"] in {"fail", "conditional", "held"} for f in findings)
    errors = sum(f["verdict"] == "no_result" for f in findings)
    counts = {"tests": len(findings), "failures": failures, "errors": errors}
    suite = ET.Element("testsuite", {"name": unit["serial"]} | {k: str(v) for k, v in counts.items()})
    if unit.get("simulated"):
        properties = ET.SubElement(suite, "properties")
        ET.SubElement(properties, "property", name="simulated", value="true")
    for finding in findings:
        case = ET.SubElement(suite, "testcase", classname=finding["check"], name=finding["quantity"])
        if finding["verdict"] != "pass":
            tag = "error" if finding["verdict"] == "no_result" else "failure"
            ET.SubElement(case, tag, type=finding["verdict"], message=_clean(finding["reason"] or ""))
    if "gap" in unit:
        ET.SubElement(suite, "system-out").text = _clean(one_line(unit["gap"]))
    return suite


def _clean(text: str) -> str:
    """Return text with a question mark for each control character, which XML 1.0 does not allow; a damaged file's name
    or message may hold some."""
    return "".join(c if c in "\t\n" or (c.isprintable() and c <= "\U0010ffff") else "?" for c in text)
