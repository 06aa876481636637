"""CITATION.cff: the fields of the Citation File Format 1.2.0, and that it speaks of this package."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from validation.data.fetch import COMMIT

ROOT = Path(__file__).parent.parent
# of the schema: what a file must have, and all that it may have; an author is a person or an entity
NEEDED = {"cff-version", "message", "title", "authors"}
ALLOWED = NEEDED | {
    "abstract", "commit", "contact", "date-released", "doi", "identifiers", "keywords", "license", "license-url",
    "preferred-citation", "references", "repository", "repository-artifact", "repository-code",
    "type", "url", "version",
}  # fmt: skip
PERSON, ENTITY = {"family-names", "given-names"}, {"name"}


@pytest.fixture(scope="module")
def cited() -> dict[str, Any]:
    return dict(yaml.safe_load((ROOT / "CITATION.cff").read_text()))


def test_fields_are_those_of_the_format(cited: dict[str, Any]) -> None:
    assert NEEDED <= cited.keys() <= ALLOWED
    assert cited["cff-version"] == "1.2.0"
    assert cited["type"] in ("software", "dataset")
    assert all(isinstance(word, str) for word in cited["keywords"])
    for each in (cited, *cited["references"]):
        assert each["title"]
        assert each["authors"]
        assert all(author.keys() in (PERSON, ENTITY) for author in each["authors"])
    assert all({"type", "title", "authors"} <= each.keys() for each in cited["references"])


def test_it_cites_this_package_as_it_is(cited: dict[str, Any]) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert cited["title"].partition(":")[0] == project["name"]
    assert str(cited["version"]) == project["version"]
    assert cited["license"] == project["license"]


def test_the_matrices_are_cited_by_the_commit_that_is_fetched(cited: dict[str, Any]) -> None:
    assert [each["commit"] for each in cited["references"] if "commit" in each] == [COMMIT]
