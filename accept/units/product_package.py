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
PYPROJECT = """\
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"

[project]
name = "accept-product-{dashed}"
version = "0.1.0"
description = "The product '{name}' for accept"
dependencies = ["{distribution}"]

[tool.hatch.build.targets.wheel]
packages = ["{module}"]

[project.entry-points."accept.products"]
{key} = "{module}:PRODUCT"

[project.entry-points."accept.checks"]
{key}_mass = "{module}.mass:CHECK"
"""
INIT = '''\
"""The product '{name}': its spec, its parts, and the checks that it brings."""

from pathlib import Path

from specs.products import Product

PRODUCT = Product(
    name="{name}",
    title="{title}",
    plural="{title} units",
    spec=Path(__file__).parent / "spec.toml",
    model=None,  # a built-in model or a file beside this one, if responses are to be explained
    parts={{}},  # part in unit.toml -> label, which the workflow asks for
    checks=("capacitance",),  # of the program, which its spec may ask for
)
'''
CHECK_FILE = '''\
"""The mass of a unit, weighed and typed: an example of a check of your own."""

from checks.acceptance.common.typed_value import typed_quantity
from checks.declare import Check, Form, Guide, Scalar, Values
from checks.quantity import Outcome
from specs.spec import CheckSpec

NAME = "{key}_mass_kg"


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """Return the mass [kg] with its stated uncertainty."""
    return Outcome((typed_quantity(values, spec, NAME),))


CHECK = Check(
    name="{key}_mass",
    title="Mass of the unit",
    kinds=("{name}",),
    forms=(Form("value", (Scalar(NAME, "mass", lo=0.0, hi=1000.0),)),),
    quantities={{NAME: "Mass"}},
    measure=measure,
    stated=(NAME,),
    guide=Guide("Weigh the unit without its cable."),
)
'''
SPEC = """\
name = "{name}"
kind = "{name}"
title = "{title}"

[checks.{key}_mass.limits.{key}_mass_kg]
lower = 0.9
upper = 1.1
unit = "kg"
rule = "guarded"
source = "example: write the drawing's number here"
assumed = true
[checks.{key}_mass.uncertainty.{key}_mass_kg]
U = 0.001
source = "example: the scale's certificate"
"""
UNIT = """\
serial = "{serial}-01"
kind = "{name}"
[{key}_mass]
{key}_mass_kg = 1.0
"""
README = """\
# Product '{name}' for accept

    pip install -e .
    accept product check {name}
    accept batch example --out out

- `{module}/__init__.py` declares the product, `{module}/spec.toml` its limits.
- `{module}/mass.py` is a check of its own; checks of the program stand in `checks` of the product.
- `example/` is a unit.
"""


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
    texts = {
        PROJECT_FILE: PYPROJECT,
        "README.md": README,
        f"{module}/__init__.py": INIT,
        f"{module}/mass.py": CHECK_FILE,
        f"{module}/spec.toml": SPEC,
        "example/unit.toml": UNIT,
    }
    return {file: text.format(**words) for file, text in texts.items()}


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
