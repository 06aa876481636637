"""Print the page of statements from the tests: what each file says, and whether that is used or refused."""

import contextlib
import os
import sys
from collections import defaultdict
from pathlib import Path

import pytest

from tests.statements.case import STATEMENTS

HEAD = """# What a file says of itself

Written by `python -m tests.statements` from its tests. Each file is made by another program's library or by bytes from
the public description of its format, and put to the public commands. *Used*: the number is right, by a known truth.
*Refused*: exit code 6, or no result in a unit folder, with a reason that names the statement. *Open*: neither yet.
"""
MEANING = {
    "start": "when the samples of a channel begin",
    "increment": "time or frequency from sample to sample",
    "unit": "units of values and axes",
    "scale": "raw numbers to values; decimal and thousands marks",
    "label": "which column, channel or variable is what",
    "kind": "kind of function: record, response, spectrum, coherence",
    "quality": "coherence, variance, lost or impossible values",
    "layout": "encoding, separators, lines before the names",
}


KINDS = ("used", "used and refused", "refused", "open")


class Rows:
    """Collect the rows of the page while the tests run."""

    def __init__(self) -> None:
        self.rows: dict[str, tuple[str, str, str, str]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        said = dict(report.user_properties)
        if report.when == "call":
            self.failed = report.failed
        if report.when == "teardown" and "row" in said:
            form, statement, text, test = said["row"]
            self.rows[test] = (form, statement, text, "open" if self.failed else said["outcome"])


def page(rows: dict[str, tuple[str, str, str, str]]) -> str:
    """Return the page: how many of each format and statement, then every file with its test."""
    forms: dict[str, list[tuple[str, str, str, str]]] = defaultdict(list)
    for test, (form, statement, text, outcome) in rows.items():
        forms[form].append((statement, text, outcome, test))
    lines = [HEAD, *(f"- {statement}: {MEANING[statement]}" for statement in STATEMENTS), ""]
    lines += ["| format | " + " | ".join(STATEMENTS) + " |", "|---" * (len(STATEMENTS) + 1) + "|"]
    for form, listed in forms.items():
        counts = []
        for statement in STATEMENTS:
            outcomes = [outcome for s, _, outcome, _ in listed if s == statement]
            counts.append(", ".join(f"{outcomes.count(kind)} {kind}" for kind in KINDS if kind in outcomes) or "-")
        lines.append(f"| {form} | " + " | ".join(counts) + " |")
    for form, listed in forms.items():
        lines += ["", f"## {form}", "", "| statement | what the file says | outcome | test |", "|---|---|---|---|"]
        for statement, text, outcome, test in sorted(listed, key=lambda row: STATEMENTS.index(row[0])):
            lines.append(f"| {statement} | {text} | {outcome} | `{test}` |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run the tests and print the page."""
    os.environ["ACCEPT_STATEMENTS"] = "renewed"  # the page is written, so no test is held against it
    rows = Rows()
    folder = Path(__file__).parent
    with contextlib.redirect_stdout(sys.stderr):
        pytest.main(["-p", "no:cacheprovider", "-n", "0", "-q", "--tb=line", str(folder)], plugins=[rows])
    print(page(rows.rows), end="")


if __name__ == "__main__":
    main()
