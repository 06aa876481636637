"""Lines of `accept` that stand behind a module: `python -m tests.shared.reach [MODULE...]` counts them.

Counted are its own lines and those of everything it imports, and of what that imports: imports in functions and for
types too. A room that has a door is closed: who imports its names has to know the door's page and no more, unless the
module itself lies in the room. `accept` alone is counted: hw, checks and specs are entered by their doors."""

import ast
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.shared.source_trees import nodes

ROOT = Path(__file__).parents[2]
HOUSE = "accept"
SCREENS = tuple(f"accept.tui.screens.{name}" for name in ("step", "steps", "gap", "start", "summary"))
WATCHED = (*SCREENS, "accept.certificate.verify.verification", "accept.batch.pipeline")


def file_of(module: str) -> Path | None:
    """Return the file of a module or of a folder's `__init__`, None for what is neither."""
    path = ROOT / module.replace(".", "/")
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)


def is_door(file: Path) -> bool:
    return file.name == "__init__.py" and "= door(__name__)" in file.read_text(encoding="utf-8")


def imports(file: Path) -> Iterator[str]:
    """Yield the modules that a file imports, anywhere in it."""
    for node in nodes(file):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:  # `from folder import name`: a module of that folder, or a name in it
                whole = f"{node.module}.{alias.name}"
                yield whole if file_of(whole) else node.module


def behind(start: str, opened: bool = False) -> dict[str, Path]:
    """Return a module and all that stands behind it, with their files. opened: behind the doors too."""
    found, left = dict[str, Path](), [start]
    while left:
        module = left.pop()
        file = file_of(module)
        if module in found or file is None or module.split(".")[0] != HOUSE:
            continue
        found[module] = file
        if opened or not is_door(file) or start.startswith(f"{module}."):
            left.extend(imports(file))
    return found


def lines_behind(start: str, opened: bool = False) -> int:
    return sum(file.read_bytes().count(b"\n") for file in behind(start, opened).values())


def main(modules: Sequence[str]) -> None:
    for module in modules or WATCHED:
        opened = lines_behind(module, opened=True)
        print(f"{module:42} {lines_behind(module):6} lines in {len(behind(module)):3} modules, doors opened {opened:6}")


if __name__ == "__main__":
    main(sys.argv[1:])
