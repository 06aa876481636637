"""Products: each file of this folder with a `PRODUCT`. Other packages bring theirs as `accept.products`."""

import re
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from specs import plugins
from specs.errors import AcceptError
from specs.products.product import Product

__all__ = [
    "BUILT_IN",
    "Product",
    "ProductError",
    "add_product",
    "product_named",
    "product_problem",
    "products",
    "remove_product",
]

NAME = re.compile(r"[a-z][a-z0-9_-]{0,30}")  # stands in file names, tables and entry points
_PRODUCTS: dict[str, Product] = {}


_FILES = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
BUILT_IN: Mapping[str, Product] = {file.PRODUCT.name: file.PRODUCT for file in _FILES if hasattr(file, "PRODUCT")}


class ProductError(AcceptError, ValueError):
    """A product that is not installed or not usable."""


def products() -> Mapping[str, Product]:
    """Return the installed products by name: the program's own, then those of other packages, which can add but never
    replace. Packages are asked once."""
    if not _PRODUCTS:
        _PRODUCTS.update(BUILT_IN)
        _PRODUCTS.update(plugins.plugins(plugins.PRODUCTS, product_problem, BUILT_IN))
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
    """Return what is wrong with a product of another package, "" if it is valid. Its spec and its model are read when
    they are used."""
    if not isinstance(product, Product):
        return f"is a {type(product).__name__}, expected a Product"
    if not NAME.fullmatch(product.name):
        return f"a product cannot be called '{product.name}': expected small letters, digits, '_' and '-'"
    if not (product.title and product.plural):
        return f"product '{product.name}' has no title or no plural"
    for what in (product.spec, product.model):
        if isinstance(what, Path) and not what.is_file():
            return f"product '{product.name}': {what} is not there"
    return ""
