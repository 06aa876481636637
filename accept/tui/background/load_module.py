"""Imports in threads, one after the other: modules of a library that import each other fail when two threads begin at
different ends."""

import threading
from importlib import import_module
from types import ModuleType

_ONE_AT_A_TIME = threading.Lock()


def load_module(name: str) -> ModuleType:
    """Return a module that takes long to import; called in a thread."""
    with _ONE_AT_A_TIME:
        return import_module(name)
