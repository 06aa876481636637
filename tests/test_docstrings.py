"""Docstrings name what is there: an error that a caller is told to expect is one that can be caught."""

import ast
import builtins
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("accept", "hw", "checks", "specs")
RAISES = re.compile(r"\bRaises ([^.;]*)")
ERROR = re.compile(r"\b[A-Z][a-z]+(?:[A-Z][a-z0-9]+)+\b|\bRefused\b")
OF_LIBRARIES = {"InvalidSignature", "LinAlgError", "SerialException", "TimestampRequestError"}


@cache
def trees() -> dict[Path, ast.Module]:
    return {p: ast.parse(p.read_text()) for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py"))}


@cache
def classes() -> set[str]:
    own = {node.name for tree in trees().values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
    return own | set(dir(builtins)) | OF_LIBRARIES


def unknown(docstring: str) -> Iterator[str]:
    """Errors named after "Raises" that no package and no library has."""
    for said in RAISES.findall(docstring):
        yield from (name for name in ERROR.findall(said) if name not in classes())


@pytest.mark.parametrize("package", PACKAGES)
def test_every_error_that_a_docstring_names_exists(package: str) -> None:
    documented = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Module)
    found = [
        f"{path.relative_to(ROOT)}: {name}"
        for path, tree in trees().items()
        if path.is_relative_to(ROOT / package)
        for node in ast.walk(tree)
        if isinstance(node, documented)
        for name in unknown(ast.get_docstring(node) or "")
    ]
    assert not found


def test_an_error_that_is_none_is_seen() -> None:
    assert list(unknown("Reads it. Raises RecordError, DossierError for a page.")) == ["DossierError"]
    assert list(unknown("Raises Refused.")) == ["Refused"]
    assert not list(unknown("Raises ValueError for NaN; OSError."))
