"""The acceptance bench for piezo struts. In a script or a notebook:

    import accept

    unit = accept.read_unit("units/S-02")
    print(accept.judge(unit).verdict)
    accept.plot(accept.estimate_misalignment(unit)).save("map.png")

The names below are stable; `docs/reference/api.md` describes them. Each is imported when it is first used.
"""

import os
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

# The checks multiply small matrices: a linear algebra library that starts threads for each product loses more time than
# it gains, all the more with a worker per core. Must stand before numpy is imported; values that are set already stay.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

if TYPE_CHECKING:
    from accept.analysis.api import (
        AcceptError,
        NoResult,
        Plot,
        analyse_gap,
        dataset,
        estimate_misalignment,
        fit_model,
        frequency_response,
        hammer_response,
        judge,
        open_model,
        plot,
        read_record,
        read_response,
        read_unit,
        responses,
        save_ss,
        simulate_unit,
        to_control,
        to_ss,
    )


def _strangers() -> str:
    """Return, in one line, which foreign module is imported in place of one of the program's, "" for none.

    `checks`, `hw` and `specs` are common names: a `checks.py` beside a script comes before the installed package.
    """
    root = Path(__file__).resolve().parents[1]
    for name in ("checks", "hw", "specs"):
        found = find_spec(name)
        places = [] if found is None else [Path(p).resolve() for p in found.submodule_search_locations or ()]
        if root / name not in places:
            where = "nowhere" if found is None else str(found.origin or ", ".join(map(str, places)))
            return (
                f"accept needs its own package '{name}' ({root / name}), but Python finds {where} first: rename that, "
                "start from another folder, or install accept in an environment of its own"
            )
    return ""


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("accept.base.version").version()
    if problem := _strangers():
        raise ImportError(problem)
    specs = import_module("specs")
    return sorted(specs.shown(__name__)) if name == "__all__" else specs.door(__name__)(name)


def __dir__() -> list[str]:
    own = (name for name in globals() if name.startswith("__"))
    return sorted({*__getattr__("__all__"), *own, "__version__"})
