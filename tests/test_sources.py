"""What texts name is there: every key that code, specs and pages cite has an entry, every cited section exists, and
an error that a docstring tells a caller to expect is one that can be caught."""

import ast
import builtins
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from checks.gap import EFFECTS
from specs.spec import builtin, load
from tests.shared.source_trees import nodes

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PLACES = ("accept", "hw", "checks", "specs", "validation", "benchmarks", "tests", "docs")
KEY = re.compile(r"(?<![\w\])])\[([A-Z][A-Z0-9][A-Z0-9-]+)\](?!\()")  # not a link
# [STB] 3.1.7, 3.1.8 and 3.2.1 - the sections that follow a key directly.
NUMBER = r"\d+(?:\.\d+)*"
NO_QUANTITY = r"(?![\d.]*(?:-\d|\s*%|\s*(?:Hz|um|uF|s|V|N|kg)\b))"  # "[STB] 3.1.7, 5 s later" cites one section
CITED = re.compile(rf"\[(STB|GAP|DESIGN)\]\s+({NUMBER})((?:(?:,| and| to)\s+{NUMBER}{NO_QUANTITY})*)")
ENTRY = re.compile(r"^\| \[([A-Z][A-Z0-9][A-Z0-9-]+)\] \| (.+) \|$", re.MULTILINE)


@cache
def words_of(path: Path) -> str:
    """What a file says to a reader: of a module its strings and comments, of a page all but commands and code."""
    text = path.read_text()
    if path.suffix == ".md":
        return re.sub(r"^```.*?^```|`[^`\n]*`", "", text, flags=re.MULTILINE | re.DOTALL)
    if path.suffix != ".py":
        return text
    kinds = {tokenize.STRING, tokenize.COMMENT, getattr(tokenize, "FSTRING_MIDDLE", -1)}
    return "\n".join(t.string for t in tokenize.generate_tokens(io.StringIO(text).readline) if t.type in kinds)


def files() -> Iterator[Path]:
    for place in PLACES:
        for suffix in ("py", "toml", "md"):
            yield from sorted((ROOT / place).rglob(f"*.{suffix}"))
    yield from sorted(ROOT.glob("*.md"))


@cache
def entries() -> dict[str, str]:
    return dict(ENTRY.findall((DOCS / "reference" / "references.md").read_text()))


@cache
def sections() -> dict[str, set[str]]:
    """Section numbers by key."""
    contents = (DOCS / "reference" / "references.md").read_text().split("## Contents of [STB]")[1]
    numbered = {"GAP": "gap-analysis.md", "DESIGN": "contracts.md"}
    found = {k: re.findall(r"^## (\d+)\. ", (DOCS / "decisions" / p).read_text(), re.M) for k, p in numbered.items()}
    return {k: set(v) for k, v in found.items()} | {"STB": set(re.findall(r"^\| ([\d.]+) \|", contents, re.MULTILINE))}


def unresolved(text: str) -> list[str]:
    """Keys without an entry, and sections that a cited source does not have."""
    known, numbers = entries(), sections()
    wrong = [f"[{key}]" for key in KEY.findall(text) if key not in known]
    for key, first, more in CITED.findall(text):
        cited = [first, *re.findall(NUMBER, more)]
        wrong += [f"[{key}] {n}" for n in cited if n not in numbers[key]]
    return wrong


def test_every_source_resolves() -> None:
    wrong = {str(p.relative_to(ROOT)): bad for p in files() if p != Path(__file__) and (bad := unresolved(words_of(p)))}
    assert not wrong


def test_every_entry_is_cited() -> None:
    cited = {key for p in files() if p.name != "references.md" for key in KEY.findall(words_of(p))}
    assert set(entries()) <= cited


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("as in [NOBODY99] 3", ["[NOBODY99]"]),
        ("[STB] 3.1.7, 3.1.8 and 9.9 say", ["[STB] 9.9"]),
        ("[GAP] 14", ["[GAP] 14"]),
        ("[DESIGN] 6 and [GAP] 0 to 13 and [PS12] 99.9; f [Hz], table[ROWS]", []),
    ],
)
def test_what_does_not_resolve_is_seen(text: str, wrong: list[str]) -> None:
    assert unresolved(text) == wrong


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_every_effect_cites_its_sources_by_key(name: str) -> None:
    assert EFFECTS[name].sources
    assert all(KEY.match(source) for source in EFFECTS[name].sources), EFFECTS[name].sources


@pytest.mark.parametrize("name", sorted(builtin()))
def test_every_limit_of_a_built_in_spec_cites_a_source(name: str) -> None:
    limits = [limit for check in load(name).checks.values() for limit in check.limits.values()]
    assert [limit.source for limit in limits if not KEY.search(limit.source)] == []


PACKAGES = ("accept", "hw", "checks", "specs")
RAISES = re.compile(r"\bRaises? ([^.;]*)")
ERROR = re.compile(r"\b[A-Z][a-z]+(?:[A-Z][a-z0-9]+)+\b")
OF_LIBRARIES = {"InvalidSignature", "LinAlgError", "SerialException", "TimestampRequestError"}


@cache
def sources() -> list[Path]:
    return [p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py"))]


@cache
def classes() -> set[str]:
    own = {node.name for path in sources() for node in nodes(path) if isinstance(node, ast.ClassDef)}
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
        for path in sources()
        if path.is_relative_to(ROOT / package)
        for node in nodes(path)
        if isinstance(node, documented)
        for name in unknown(ast.get_docstring(node) or "")
    ]
    assert not found


def test_an_error_that_is_none_is_seen() -> None:
    assert list(unknown("Reads it. Raises RecordError, DossierError for a page.")) == ["DossierError"]
    assert list(unknown("Raises BenchDismissed.")) == ["BenchDismissed"]
    assert not list(unknown("Raises ValueError for NaN; OSError."))
