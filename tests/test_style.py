"""The words that must not come back (docs/decisions/style.md), in every sentence of the program and on every page."""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.shared.source_trees import nodes

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


def strings(path: Path) -> Iterator[tuple[int, str]]:
    """(line, text) of every string that is no docstring."""
    docstrings = {id(n.value) for n in nodes(path) if isinstance(n, ast.Expr)}
    for node in nodes(path):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield node.lineno, node.value


@pytest.mark.parametrize("package", ["accept", "checks", "hw", "specs"])
def test_no_sentence_of_the_program_uses_them(package: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text}"
        for path in sorted((ROOT / package).rglob("*.py"))
        for line, text in strings(path)
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
    "accept/base/verbose.py",
    "accept/cli/main.py",
    "accept/cli/reference.py",
    "accept/store/formats.py",
}


# Docstrings and comments: "if" for a condition, a subject that a reader can see.
DIALECT = re.compile(
    r"\bwhere (there|it|one|that) is\b|\bis none\b|\bof (one|it) alone\b|\b(nobody|somebody)\b|\bwhoever\b|\bsays of\b",
    re.IGNORECASE,
)


def sentences(path: Path) -> Iterator[tuple[int, str]]:
    """(line, text) of every docstring and of every block of comments, on one line each."""
    text = path.read_text(encoding="utf-8")
    for node in nodes(path):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.lineno, " ".join(node.value.value.split())
    block: list[tuple[int, str]] = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type != tokenize.COMMENT:
            continue
        alone = token.line.lstrip().startswith("#")  # not behind code
        if block and not (alone and token.start[0] == block[-1][0] + 1):
            yield block[0][0], " ".join(words for _, words in block)
            block = []
        block.append((token.start[0], token.string.lstrip("# ")))
    if block:
        yield block[0][0], " ".join(words for _, words in block)


def folders() -> list[str]:
    """Every folder with code, as `accept/batch`."""
    places = {p.parent for top in ("accept", "checks", "hw", "specs") for p in (ROOT / top).rglob("*.py")}
    return sorted(p.relative_to(ROOT).as_posix() for p in places)


@pytest.mark.parametrize("folder", folders())
def test_no_docstring_and_no_comment_speaks_dialect(folder: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text}"
        for path in sorted((ROOT / folder).glob("*.py"))
        for line, text in sentences(path)
        if DIALECT.search(text)
    ]
    assert not found


def test_the_guide_for_contributors_speaks_none() -> None:
    lines = enumerate((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").splitlines(), 1)
    assert not [f"{n}: {line}" for n, line in lines if DIALECT.search(line) or FORBIDDEN.search(line)]


def test_comments_over_two_lines_are_read_as_one(tmp_path: Path) -> None:
    """A pattern over a line's end is seen, in docstrings and in comments."""
    code = tmp_path / "a.py"
    code.write_text('"""Where there\n is an end."""\n\n# It says\n# of others\nx = 1  # alone\n')
    assert [bool(DIALECT.search(text)) for _, text in sentences(code)] == [True, True, False]


@pytest.mark.parametrize("package", ["accept", "checks", "hw", "specs"])
def test_words_reach_the_terminal_by_one_way(package: str) -> None:
    """`say`, `tell` and the console escape what they are given; a bare `print` shows a name's control characters."""
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in sorted((ROOT / package).rglob("*.py"))
        if path.relative_to(ROOT).as_posix() not in PRINTS
        for node in nodes(path)
        if isinstance(node, ast.Call)
        if getattr(node.func, "attr", getattr(node.func, "id", "")) in ("print", "echo", "write")
        if ast.unparse(node.func) in ("print", "typer.echo", "sys.stdout.write")
    ]
    assert not found
