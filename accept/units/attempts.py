"""Folders of the workflow's attempts, below the folder of the serial, each with its `unit.toml`."""

import re
from pathlib import Path

_NAME = re.compile(r"attempt-(\d+)")


def attempt_folder(number: int) -> str:
    """Return the name of the folder of an attempt."""
    return f"attempt-{number}"


def attempt_number(folder: str) -> int | None:
    """Return the number of the attempt whose folder has this name, None for another folder."""
    found = _NAME.fullmatch(folder)
    return None if found is None else int(found[1])


def last_attempt(unit: Path, file: str) -> Path | None:
    """Return the folder of the last attempt of a unit that holds a file, None without any."""
    numbers = {attempt_number(path.parent.name): path.parent for path in unit.glob(f"*/{file}")}
    last = max((number for number in numbers if number is not None), default=None)
    return None if last is None else numbers[last]
