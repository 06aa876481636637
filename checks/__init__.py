"""Evaluation of measurements: pure functions of arrays, in rooms that are entered by their doors.

    from checks.acceptance import CHECKS  # the acceptance checks, as declared with `checks.declare`
    from checks.consistency import check_consistency  # measurements that contradict each other
    from checks.signals import estimate_responses  # responses, resonances, excitations
    from checks.model import build_model  # the simulated unit on its bench
    from checks.fitting import fit_model  # parameters from responses
    from checks.misalignment import estimate_misalignment
    from checks.gap import run  # what the model lacks
    from checks.population import learn_population  # what the units of a batch have in common

Small modules beside the rooms are doors of their own: `declare`, `verdict`, `cause`, `quantity`, `record`, `picture`,
`rounding`, `errors`, `arrays`. A room loads what it shows when it is first used (PEP 562)."""

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
