"""Costly results that tests only read: made once for a whole run, by the test process that needs them first."""

import io
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest
from filelock import FileLock

from checks.gap import EFFECTS
from checks.gap.modelling.effect import Effect

T = TypeVar("T")


def _effect(name: str) -> Effect:
    return EFFECTS[name]


class _Pickler(pickle.Pickler):
    """Keeps effects of the library by name: they hold functions, and there is one of each."""

    def reducer_override(self, obj: object) -> object:
        if isinstance(obj, Effect) and EFFECTS.get(obj.name) is obj:
            return _effect, (obj.name,)
        return NotImplemented


def once(folders: pytest.TempPathFactory, name: str, make: Callable[[Path], T]) -> T:
    """Return what `make` gives of an empty folder, which stays: all processes of a run share it and the answer, so
    nothing may be written there. What is returned is pickled."""
    base = folders.getbasetemp()
    shared = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "once"
    shared.mkdir(exist_ok=True)
    place, answer = shared / name, shared / f"{name}.pickle"
    with FileLock(shared / f"{name}.lock"):
        if not answer.exists():
            place.mkdir()
            packed = io.BytesIO()
            _Pickler(packed).dump(make(place))
            answer.write_bytes(packed.getvalue())
    return pickle.loads(answer.read_bytes())
