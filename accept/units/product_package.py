"""The package of a product: a skeleton to install, and the check of a finished package."""

import sys
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from checks.acceptance import CHECKS
from specs import plugins
from specs.distribution import NAME as DISTRIBUTION
from specs.errors import AcceptError
from specs.plugins import ProductError, add_product, product_problem, products, remove_product
from specs.products import Product
from specs.strict import SpecError, file_bytes, toml_of

PROJECT_FILE = "pyproject.toml"
TEMPLATES = Path(__file__).parent / "new_product"  # a file for each, with words in braces; {{ is a brace
FILES = (PROJECT_FILE, "README.md", "package/__init__.py", "package/mass.py", "package/spec.toml", "example/unit.toml")


def skeleton(name: str) -> dict[str, str]:
    """Return file -> text of the package of a new product. Raises ProductError for an invalid or installed name."""
    if name in products():
        raise ProductError(f"the name '{name}' is taken (installed: {', '.join(products())})")
    key = name.replace("-", "_")
    module = f"accept_product_{key}"
    words = {
        "name": name, "key": key, "dashed": name.replace("_", "-"), "module": module, "distribution": DISTRIBUTION,
        "title": name.replace("_", " ").replace("-", " ").capitalize(), "serial": key.upper().replace("_", "-"),
    }  # fmt: skip
    if problem := product_problem(Product(name, words["title"], name, "apa")):
        raise ProductError(problem)
    texts = {file: (TEMPLATES / f"{file}.txt").read_text(encoding="utf-8").format(**words) for file in FILES}
    return {file.replace("package/", f"{module}/"): text for file, text in texts.items()}


@contextmanager
def from_folder(folder: Path) -> Iterator[Product]:
    """Yield the product of a package in a folder, usable as if it was installed, with the checks that the package
    brings. Its code is run. Raises ProductError, SpecError."""
    path = folder / PROJECT_FILE
    named = _entry_points(path)
    declared = named.get(plugins.PRODUCTS, {})
    if len(declared) != 1:
        raise ProductError(f'{path}: expected one entry point in [project.entry-points."{plugins.PRODUCTS}"]')
    sys.path.insert(0, str(folder.resolve()))
    added: list[str] = []  # names of checks; they and the product are forgotten at the end
    product: Product | None = None
    try:
        for entry in named.get(plugins.CHECKS, {}).values():
            check = _loaded(path, entry)
            if problem := CHECKS.problem(check):
                raise ProductError(f"{path}: {entry}: {problem}")
            if check.name in CHECKS:
                raise ProductError(f"{path}: {entry}: the name '{check.name}' is taken")
            CHECKS.add({check.name: check})
            added.append(check.name)
        (entry,) = declared.values()
        found = _loaded(path, entry)
        if problem := product_problem(found):
            raise ProductError(f"{path}: {entry}: {problem}")
        add_product(found)
        product = found
        yield product
    finally:
        CHECKS.remove(added)
        if product is not None:
            remove_product(product.name)
        sys.path.remove(str(folder.resolve()))


def _entry_points(path: Path) -> Mapping[str, Mapping[str, str]]:
    try:
        found = toml_of(file_bytes(path)).get("project", {}).get("entry-points", {})
    except (ValueError, tomllib.TOMLDecodeError) as e:
        raise e if isinstance(e, AcceptError) else SpecError(str(path), [str(e)]) from e
    if not isinstance(found, dict) or not all(isinstance(group, dict) for group in found.values()):
        raise ProductError(f"{path}: [project.entry-points] is not a section of sections")
    return found


def _loaded(path: Path, entry: str) -> Any:
    """Return the object of an entry point. Raises ProductError for any error of foreign code."""
    module, _, name = str(entry).partition(":")
    try:
        return getattr(import_module(module), name)
    except Exception as e:
        raise ProductError(f"{path}: {entry}: {' '.join(f'{type(e).__name__}: {e}'.split())}") from e
