"""The words that must not come back (docs/decisions/style.md), in every sentence of the program and on every page."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WORDS = (
    r"\bis no (?!\w*(longer|more|less)\b)(number|unit|file|list|name|range|text|record|certificate|head|regular)",
    r"\bheld against\b",
    r"\bstand-ins?\b",
    r"\b(without a|has no) name\b",
    r"\btold apart\b",
    r"\bpolarity turned\b",
    r"\b(Vs|de|da|drive) is turned\b",
    r"\bstill to give\b",
    r"\bstored as event\b",
    r"\bhands off\b",
    r"\bleave the bench alone\b",
    r"\banew\b",
    r"\bnone to use\b",
    r"\bbears? on no verdict\b",
    r"\blook at (the|that|its) (plug|channel|gauge)\b",
)
FORBIDDEN = re.compile("|".join(WORDS), re.IGNORECASE)
PAGES = [p for p in sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]) if p.name != "style.md"]


def strings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """(line, text) of every string that is no docstring."""
    docstrings = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield node.lineno, node.value


@pytest.mark.parametrize("package", ["accept", "checks", "hw", "specs"])
def test_no_sentence_of_the_program_uses_them(package: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text}"
        for path in sorted((ROOT / package).rglob("*.py"))
        for line, text in strings(ast.parse(path.read_text()))
        if FORBIDDEN.search(text)
    ]
    assert not found


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_no_page_uses_them(page: Path) -> None:
    lines = enumerate(page.read_text().splitlines(), 1)
    assert not [f"{n}: {line}" for n, line in lines if FORBIDDEN.search(line)]


@pytest.mark.parametrize(
    ("sentence", "wrong"),
    [
        ("'abc' is no number", True),
        ("'abc' is not a number", False),
        ("this is no longer used", False),
        ("compared with the model", False),
        ("The responses are held against the model", True),
        ("Vs is turned", True),
    ],
)
def test_the_test_sees_them(sentence: str, wrong: bool) -> None:
    assert bool(FORBIDDEN.search(sentence)) == wrong


PRINTS = {  # what prints by itself: the one escaping, a log that cannot be written, what the program itself consists of
    "accept/base/console.py",
    "accept/base/fault_log.py",
    "accept/cli/main.py",
    "accept/cli/reference.py",
    "accept/commands/units/spec.py",
}


@pytest.mark.parametrize("package", ["accept", "checks", "hw", "specs"])
def test_words_reach_the_terminal_by_one_way(package: str) -> None:
    """`say`, `tell` and the console escape what they are given; a bare `print` shows a name's control characters."""
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in sorted((ROOT / package).rglob("*.py"))
        if path.relative_to(ROOT).as_posix() not in PRINTS
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("print", "typer.echo", "sys.stdout.write")
    ]
    assert not found
