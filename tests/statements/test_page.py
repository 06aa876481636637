"""The page of statements is that of its tests. (Each test holds its own row against the page, in its fixture.)"""

import importlib
import re

from tests.statements.case import PAGE

ROW = re.compile(r"^\| (\w+) \| (.*) \| ([\w ]+) \| `(test_\w+)\.py::(test_\w+)(\[.*\])?` \|$", re.MULTILINE)


def test_every_row_has_its_test() -> None:
    rows = ROW.findall(PAGE.read_text(encoding="utf-8"))
    assert len(rows) > 300
    for statement, text, _, module, name, _ in rows:
        cell = getattr(importlib.import_module(f"tests.statements.{module}"), name).cell
        assert cell[1] == statement
        before, _, after = cell[2].partition("{id}")
        assert text.startswith(before), name
        assert text.endswith(after), name


def test_every_file_is_used_or_refused() -> None:
    rows = ROW.findall(PAGE.read_text(encoding="utf-8"))
    assert not [f"{module}.py::{name}{case}" for _, _, outcome, module, name, case in rows if outcome == "open"]
