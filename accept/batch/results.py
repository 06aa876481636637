"""The result files of a batch, written unit by unit: memory stays flat however many there are.

Up to WHOLE units `results.json` holds all of them. Beyond, it holds the counts and names the data sets instead: a
script that asks for its key `units` fails then; an empty list would pass for "nothing was judged".
"""

import csv
import io
import json
import os
import shutil
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from datetime import datetime
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from accept.base.atomic_files import write_atomic, writing_atomic
from accept.base.documents.results import ListedUnit
from accept.base.version import version
from accept.gap import one_line
from specs.distribution import install
from specs.errors import AcceptError

if TYPE_CHECKING:
    import pyarrow as pa

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
    return _element(suite)


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


def _clean(text: str) -> str:
    """Return text with a question mark for each control character, which XML 1.0 does not allow."""
    return "".join(c if c in "\t\n" or (c.isprintable() and c <= "\U0010ffff") else "?" for c in text)


WHOLE = 2000  # units that results.json lists
AT_ONCE = 2000  # units of one part of a data set
FINDINGS, UNITS = "findings.parquet", "units.parquet"
OF_UNIT = ("serial", "kind", "verdict", "certificate")  # columns of units.parquet that its entry has


class ResultsError(AcceptError, RuntimeError):
    """The results cannot be written; the text says why and what to do."""


def check_room(units: int, dataset: bool) -> None:
    """Raise ResultsError, before the work, if the data sets are needed and cannot be written."""
    if units <= WHOLE and not dataset:
        return
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as e:
        words = f"{units} units" if units > WHOLE else "results of a cluster"
        raise ResultsError(f"{words}: are written as Parquet, which needs {install('cluster')} ({e})") from e


class Results:
    """Open while a batch's units are added, in order of serial. units: all of them, if they are few."""

    def __init__(self, out: Path, whole: bool, dataset: bool) -> None:
        self.units: list[ListedUnit] = []
        self._out, self._whole = out, whole
        self._dataset = dataset or not whole
        self._rows: list[dict[str, Any]] = []  # of the next part of each data set
        self._rows_of_units: list[dict[str, Any]] = []
        self._parts = 0
        self._open = ExitStack()

    def __enter__(self) -> "Results":
        self._out.mkdir(parents=True, exist_ok=True)
        self._csv: IO[bytes] = self._open.enter_context(writing_atomic(self._out / "results.csv"))
        self._junit: IO[bytes] = self._open.enter_context(writing_atomic(self._out / "junit.xml"))
        self._csv.write(csv_rows((), header=True))
        self._junit.write(JUNIT_HEAD)
        for name in (FINDINGS, UNITS):
            shutil.rmtree(self._part(name), ignore_errors=True)
        return self

    def __exit__(self, *raised: Any) -> None:
        self._open.__exit__(*raised)

    def add(self, unit: ListedUnit, *, attempt: int, time: str, operator: str) -> None:
        """Add a unit, and of its judgement: which attempt of the serial, when (UTC, ISO 8601), by whom."""
        judgement = {"attempt": attempt, "time": time, "operator": operator}
        rows = findings(unit, judgement)
        self._csv.write(csv_rows(rows))
        self._junit.write(junit_unit(unit))
        if self._whole:
            self.units.append(unit)
        if self._dataset:
            self._rows += rows
            entry = unit.to_json()
            text = json.dumps(entry, sort_keys=True, ensure_ascii=False)
            self._rows_of_units.append({name: entry[name] for name in OF_UNIT} | judgement | {"entry": text})
            if len(self._rows_of_units) == AT_ONCE:
                self._put()

    def finish(self, specs: list[dict[str, str]], refused: list[dict[str, str]], verdicts: Mapping[str, int]) -> None:
        """Write the remaining files, and results.json last, so that the others are there with it."""
        if self._dataset and (self._rows_of_units or not self._parts):
            self._put()
        self._junit.write(junit_refused(refused) + JUNIT_END)
        self._open.close()
        self._replace_datasets()
        found: dict[str, Any] = {"units": [unit.to_json() for unit in self.units]}
        if not self._whole:
            found = {"verdicts": dict(verdicts), "datasets": {"findings": FINDINGS, "units": UNITS}}
        write_atomic(self._out / "results.json", results_json(specs, refused, **found))

    def _put(self) -> None:
        self._write_part(FINDINGS, _findings(self._rows))
        self._write_part(UNITS, _units(self._rows_of_units))
        self._parts += 1
        self._rows.clear()
        self._rows_of_units.clear()

    def _part(self, name: str) -> Path:
        return self._out / f".{name}.part"

    def _write_part(self, name: str, table: "pa.Table") -> None:
        from pyarrow import parquet

        place = self._part(name)
        place.mkdir(exist_ok=True)
        parquet.write_table(table, place / f"part-{self._parts:05d}.parquet")

    def _replace_datasets(self) -> None:
        """Replace the data sets of an earlier batch: they never stand beside results of this one."""
        for name in (FINDINGS, UNITS):
            shutil.rmtree(self._out / name, ignore_errors=True)
            if self._dataset:
                self._part(name).rename(self._out / name)


def _findings(rows: Sequence[Mapping[str, Any]]) -> "pa.Table":
    import pandas as pd
    import pyarrow as pa

    frame = pd.DataFrame(rows, columns=list(COLUMNS))
    timed = frame.assign(time=frame["time"].map(datetime.fromisoformat))
    schema = pa.schema([(name, _kind(of)) for name, of in COLUMNS.items()])
    return pa.Table.from_pandas(timed, schema=schema, preserve_index=False)


def _units(rows: Sequence[Mapping[str, Any]]) -> "pa.Table":
    """Return a row per unit: serial, kind, verdict, certificate, attempt, time and operator, and its entry as JSON."""
    import pyarrow as pa

    timed = [{**row, "time": datetime.fromisoformat(row["time"])} for row in rows]
    names = (*OF_UNIT, "attempt", "time", "operator", "entry")
    return pa.Table.from_pylist(timed, pa.schema([(name, _kind(COLUMNS.get(name, str))) for name in names]))


def _kind(of: type) -> "pa.DataType":
    import pyarrow as pa

    kinds = {float: pa.float64(), bool: pa.bool_(), int: pa.int64(), datetime: pa.timestamp("us", tz="UTC")}
    return kinds.get(of, pa.string())
