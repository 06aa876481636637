"""The tests, with the linear algebra of one thread that the product has: `accept` says so, and must be imported before
numpy is, which sorted imports of a test put first. With two threads a test took up to eight times the processor."""

import sys

NUMPY_WAS_FIRST = "numpy" in sys.modules

import accept  # noqa: E402, F401
