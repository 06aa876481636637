"""The documentation site builds without a warning: no page or link is missing, every API page has its module."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.mark.skipif(find_spec("mkdocs") is None or find_spec("mkdocstrings") is None, reason="needs the extra `docs`")
def test_it_builds_without_a_warning(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    api = (tmp_path / "site" / "reference" / "api.html").read_text()
    assert all(name in api for name in ("analyse_gap", "open_model", "Check"))


def test_every_page_is_in_the_navigation() -> None:
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("nav:")[2]
    pages = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert not {page for page in pages if f": {page}" not in nav}


def test_the_page_of_commands_is_that_of_the_commands() -> None:
    from accept.cli.reference import reference

    assert (ROOT / "docs" / "reference" / "cli.md").read_text(encoding="utf-8") == reference()


def test_the_tutorial_page_is_the_notebook() -> None:
    page = tutorial_page()
    assert (ROOT / "docs" / "tutorial" / "tutorial-python.md").read_text(encoding="utf-8") == page


def tutorial_page() -> str:
    """The notebook's cells as a page of the site: ACCEPT_RENEW=1 writes it."""
    cells = json.loads((ROOT / "docs" / "tutorial" / "tutorial.ipynb").read_text(encoding="utf-8"))["cells"]
    parts = ["".join(c["source"]).rstrip("\n") for c in cells]
    shown = [p if c["cell_type"] == "markdown" else f"```python\n{p}\n```" for p, c in zip(parts, cells, strict=True)]
    head = (
        "The same as a notebook to run: [tutorial.ipynb](tutorial.ipynb). It is stored without outputs; "
        "`pip install nbconvert ipykernel`, then `jupyter nbconvert --to notebook --execute --inplace tutorial.ipynb` "
        "runs it in about a minute and keeps them."
    )
    page = "\n\n".join([shown[0], head, *shown[1:]]) + "\n"
    if os.environ.get("ACCEPT_RENEW"):
        (ROOT / "docs" / "tutorial" / "tutorial-python.md").write_text(page, encoding="utf-8")
    return page
