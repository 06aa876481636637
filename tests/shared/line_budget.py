"""Lines of each house beside its budget in pyproject.toml: `make lint` prints them and fails on a house that is above.
A budget is raised by a line in a review, with the reason beside it."""

import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def lines_of(house: str) -> int:
    """Return the physical lines of all Python files of a folder."""
    return sum(path.read_bytes().count(b"\n") for path in (ROOT / house).rglob("*.py"))


def main() -> int:
    budgets = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["line_budget"]
    above = 0
    for house, budget in budgets.items():
        lines = lines_of(house)
        above += lines > budget
        print(f"{house:24} {lines:6} lines of {budget:6}{'  ABOVE ITS BUDGET' if lines > budget else ''}")
    return 1 if above else 0


if __name__ == "__main__":
    sys.exit(main())
