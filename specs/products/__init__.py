"""Products of the program: each file with a `PRODUCT`. `specs.plugins` has the installed ones."""

from specs.products.product import Product

__all__ = ["Product"]
