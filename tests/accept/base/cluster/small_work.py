"""Work for the workers of a cluster that loads in no time: each of them imports the module that its work stands in."""

import hashlib
import os
import signal
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np


def half(number: int) -> float:
    return number / (number - 3)


def process_of(number: int) -> int:
    time.sleep(0.05)
    return os.getpid()


def fatal_31(number: int) -> int:
    if number == 31:
        os.kill(os.getpid(), signal.SIGKILL)
    return -number


def grab(gigabytes: float) -> int:
    return int(np.empty(int(gigabytes * 1e9 / 8)).size)


def digest(folder: Path, model: Path, out: Path | None, without: Sequence[str] = ()) -> dict[str, Any]:
    """A workflow for the blind test: hashes of what it is handed, and a crash where an effect is left out."""
    if without:
        raise ValueError(f"cannot do without {', '.join(without)}")
    found = {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.iterdir())}
    return {"verdict": "no_missing_effect", "named": [], "files": found, "model": model.read_text()}
