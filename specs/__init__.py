"""Limits and nominal models as TOML, and the only code that reads them."""

import ast
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def door(room: str) -> Callable[[str], Any]:
    """Return the `__getattr__` of a room whose names are the imports under its `if TYPE_CHECKING`."""

    def load(name: str) -> Any:
        places = {} if name.startswith("__") else shown(room)
        if name not in places:
            raise AttributeError(f"module '{room}' has no attribute '{name}'; it offers {', '.join(sorted(places))}")
        value = getattr(import_module(places[name]), name)
        setattr(sys.modules[room], name, value)
        return value

    return load


@cache
def shown(room: str) -> dict[str, str]:
    """Return the names that a room shows and the module of each."""
    tree = ast.parse(Path(str(sys.modules[room].__file__)).read_bytes())
    types = next(n for n in tree.body if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")
    imports = [n for n in types.body if isinstance(n, ast.ImportFrom)]
    return {alias.name: str(n.module) for n in imports for alias in n.names}
