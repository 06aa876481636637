"""Plug-ins: objects that other packages declare under an entry point group ([project.entry-points]).

A plug-in that cannot be used is skipped and reported in one line; its name is then refused as unknown, so that no unit
is judged by a part of it. A plug-in adds and never replaces: names of the program stay its own.

The installed products are here too: the program's own and other packages'."""

import ast
import os
import re
import sys
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import walk_packages
from sysconfig import get_path
from typing import TYPE_CHECKING, Any

from specs import products as own_products
from specs.errors import AcceptError
from specs.products import Product

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints

CHECKS, EFFECTS, INSTRUMENTS = "accept.checks", "accept.effects", "accept.instruments"
RECORDERS, PRODUCTS = "accept.recorders", "accept.products"
_PROGRAM = ("accept", "hw", "checks", "specs")
GROUPS = (CHECKS, EFFECTS, INSTRUMENTS, RECORDERS, PRODUCTS)


@dataclass(frozen=True)
class Plugin:
    """One usable object: its name, the package that brings it, and the package's version."""

    name: str
    value: Any
    package: str
    version: str


USED: list[Plugin] = []
PROBLEMS: list[str] = []  # a line for every plug-in that was left out, to be shown by a command or screen


def plugins(group: str, problem: Callable[[Any], str], taken: Collection[str]) -> dict[str, Any]:
    """Return name -> object of every usable plug-in of a group, by its `name`.

    problem: returns an object's fault, "" without one; it may raise. taken: the program's own names."""
    found: dict[str, Any] = {}
    for entry in _entries(group):
        try:
            if not _sources(entry):
                raise ImportError(f"no file of {entry.module} is found, so nothing would tell whether it was changed")
            value = entry.load()
            words = problem(value)
            if not words and value.name in (*taken, *found):
                words = f"the name '{value.name}' is taken"
        except Exception as e:  # noqa: BLE001 - whatever a stranger's code does, the program goes on without it
            words = f"{type(e).__name__}: {e}"
        if words:
            PROBLEMS.append(f"plug-in {_origin(entry)} is left out: {' '.join(words.split())}")
            continue
        found[value.name] = value
        package, version = (entry.dist.name, entry.dist.version) if entry.dist else ("unknown", "?")
        USED.append(Plugin(value.name, value, package, version))
    return found


def listed(package: str) -> list[str]:
    """Return the full names of the modules in a package and its folders, in alphabetical order. The program's own
    objects are found so, those of other packages by entry points."""
    found = walk_packages(import_module(package).__path__, f"{package}.")
    return sorted(module.name for module in found if not module.ispkg)


def fill_by_names(
    table: dict[str, Any], package: str, attribute: str, group: str, problem: Callable[[Any], str]
) -> None:
    """Put into a table the objects called `attribute` of a package's modules, by each of their `names`, then those of
    other packages, which never replace one."""
    for module in listed(package):
        if (own := getattr(import_module(module), attribute, None)) is not None:
            table.update(dict.fromkeys(own.names, own))
    for other in plugins(group, problem, table).values():
        table.update({name: other for name in other.names if name not in table})


def packaged() -> list[tuple[str, bytes]]:
    """Return name and content of every file of the packages with plug-ins, except compiled ones: listed files, and
    imported ones, which an editable install does not list."""
    found: dict[Path, str] = {}
    for entry in _all_entries():
        listed_ones = entry.dist.files or () if entry.dist else ()
        found |= {Path(str(p.locate())).resolve(): str(p) for p in listed_ones if Path(str(p.locate())).is_file()}
    for entry in _all_entries():
        found = {path.resolve(): name for path, name in _sources(entry)} | found
    return sorted((name, path.read_bytes()) for path, name in found.items() if path.suffix != ".pyc")


def packages() -> list[str]:
    """Return name and version of every package with plug-ins, without characters that belong to neither."""
    told = {f"{e.dist.name} {e.dist.version}" if e.dist else e.module for e in _all_entries()}
    return sorted(re.sub(r"[^\w. -]", "_", one)[:60] for one in told)


def _all_entries() -> "list[EntryPoint]":
    return [entry for group in GROUPS for entry in _entries(group)]


def _sources(entry: "EntryPoint") -> list[tuple[Path, str]]:
    """Return path and name of every file of the package of a plug-in's module, and of what its files import that is not
    installed as a package of its own; nothing for one that is not in files."""
    waiting, found = [entry.module.partition(".")[0]], dict[str, list[tuple[Path, str]]]()
    while waiting:
        top = waiting.pop()
        found[top] = files = _files_of(top)
        for path in (path for path, _ in files if path.suffix == ".py"):
            waiting += [name for name in _imported(path) if name not in found and not _is_installed(name)]
    return [each for files in found.values() for each in files]


def _places(top: str) -> list[Path]:
    """Return the folders of a package, or the file of a module; nothing for one that is not in files."""
    try:
        spec = find_spec(top)
    except (ImportError, ValueError):
        return []
    if spec is None:
        return []
    return [Path(place) for place in spec.submodule_search_locations or (spec.origin or "",)]


def _files_of(top: str) -> list[tuple[Path, str]]:
    """Return path and name of every file of a package, or that of a module."""
    found = [(p, f"{top}/{p.relative_to(root).as_posix()}") for root in _places(top) for p in root.rglob("*")]
    found += [(place, place.name) for place in _places(top)]
    return [(path, name) for path, name in found if path.is_file()]


def _imported(path: Path) -> set[str]:
    """Return the packages that a file imports by name."""
    try:
        nodes = [*ast.walk(ast.parse(path.read_bytes()))]
    except (SyntaxError, ValueError):
        return set()
    names = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    names += [str(node.module) for node in nodes if isinstance(node, ast.ImportFrom) and not node.level]
    return {name.partition(".")[0] for name in names}


def _is_installed(top: str) -> bool:
    """Return whether a package comes with Python or this program, or lies where packages are installed."""
    if top in sys.stdlib_module_names or top in _PROGRAM:
        return True
    installed = [Path(get_path(name)).resolve() for name in ("purelib", "platlib")]
    return all(any(place.resolve().is_relative_to(each) for each in installed) for place in _places(top))


def _entries(group: str) -> "list[EntryPoint]":
    """Return the plug-ins of a group by name, without those in the working folder, which may contain data, unless
    PYTHONPATH names it."""
    named = {Path(p).resolve() for p in os.environ.get("PYTHONPATH", "").split(os.pathsep) if p}
    here = None if Path.cwd() in named else Path.cwd()
    found = sorted(_installed(tuple(sys.path))[group], key=lambda e: (e.name, e.value))
    return [e for e in found if not e.dist or Path(str(e.dist.locate_file(""))).resolve() != here]


@cache
def _installed(path: tuple[str, ...]) -> "dict[str, EntryPoints]":
    """Return the entry points of all packages on the path, by group. Cached: a search reads a file of every package."""
    del path
    from importlib.metadata import entry_points  # the first screen does not wait for what it loads

    found = entry_points()
    return {group: found.select(group=group) for group in GROUPS}


def _origin(entry: "EntryPoint") -> str:
    package = f" of {entry.dist.name} {entry.dist.version}" if entry.dist else ""
    return f"'{entry.name}'{package} ({entry.group}: {entry.value})"


PRODUCT_NAME = re.compile(r"[a-z][a-z0-9_-]{0,30}")  # is used in file names, tables and entry points
_PRODUCTS: dict[str, Product] = {}
_FILES = [import_module(name) for name in listed(own_products.__name__)]
BUILT_IN: Mapping[str, Product] = {file.PRODUCT.name: file.PRODUCT for file in _FILES if hasattr(file, "PRODUCT")}


class ProductError(AcceptError, ValueError):
    """A product that is not installed or not usable."""


def products() -> Mapping[str, Product]:
    """Return the installed products by name: the program's own, then those of other packages, which never replace one.
    Packages are searched once."""
    if not _PRODUCTS:
        _PRODUCTS.update(BUILT_IN)
        _PRODUCTS.update(plugins(PRODUCTS, product_problem, BUILT_IN))
    return _PRODUCTS


def product_named(name: str) -> Product:
    """Return an installed product. Raises ProductError naming those that are installed."""
    try:
        return products()[name]
    except KeyError:
        raise ProductError(f"no such product '{name}' (installed: {', '.join(products())})") from None


def add_product(product: Product) -> None:
    """Add a product that is not installed, until `remove_product`, to check it. Raises ProductError."""
    if problem := product_problem(product):
        raise ProductError(problem)
    if product.name in products():
        raise ProductError(f"the name '{product.name}' is taken (installed: {', '.join(products())})")
    _PRODUCTS[product.name] = product


def remove_product(name: str) -> None:
    """Remove a product that was added."""
    if name not in BUILT_IN:
        _PRODUCTS.pop(name, None)


def product_problem(product: Any) -> str:
    """Return the fault of a product of another package, "" if it is valid. Spec and model are read later."""
    if not isinstance(product, Product):
        return f"is a {type(product).__name__}, expected a Product"
    if not PRODUCT_NAME.fullmatch(product.name):
        return f"a product cannot be called '{product.name}': expected small letters, digits, '_' and '-'"
    if not (product.title and product.plural):
        return f"product '{product.name}' has no title or no plural"
    for what in (product.spec, product.model):
        if isinstance(what, Path) and not what.is_file():
            return f"product '{product.name}': {what} is not there"
    return ""
