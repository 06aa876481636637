"""The roots of every error that a person can cause or mend: its text states fault and remedy, at bounded length."""

from collections.abc import Sequence
from pathlib import Path

MOST_PROBLEMS = 10  # named of a file; the others are counted
MOST_LETTERS = 8000  # of a message
MOST_OF_PROBLEM = 500  # of the letters, which the value in the file may be


class AcceptError(Exception):
    """An unusable input, file, setting or instrument. A fault of the program is not an AcceptError."""

    def __str__(self) -> str:
        return _shortened(super().__str__(), MOST_LETTERS)


class ProblemsError(AcceptError, ValueError):
    """The problems of a file, each with file, key and fault: the first few, and how many others."""

    between = "\n"

    def __init__(self, path: str | Path, problems: Sequence[str]) -> None:
        self.path, self.problems = path, problems
        shown = [_shortened(problem, MOST_OF_PROBLEM) for problem in problems[:MOST_PROBLEMS]]
        if more := len(problems) - len(shown):
            shown.append(f"and {more} more problems")
        super().__init__(self.between.join(f"{path}: {problem}" for problem in shown))


def _shortened(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[:most]} ... ({len(text) - most} more characters)"
