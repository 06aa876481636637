"""Simulated struts for tests of `accept gap` and of what batch makes of it: short records of the built-in model. They
stand for measured ones, without the mark of a simulated unit."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

from accept.models.model_file import open_model
from accept.simulate import SimulatedUnit, UnitRequest, simulate, write
from accept.units.unit_folder import UNIT_FILE

HIGHPASS = ("sensor_highpass", {"f_Hz": 4.0})
SECONDS = 10.5  # the checks of a spec ask for 10


def make_strut(
    folder: Path, serial: str, *effects: tuple[str, Mapping[str, float]], seed: int = 1, repeats: bool = True
) -> Path:
    """A unit folder with these effects hidden in it."""
    hidden = tuple((name, tuple(parameters.items())) for name, parameters in effects)
    return write(_simulated(serial, hidden, seed, repeats), folder)


@cache  # many tests begin with one and the same strut
def _simulated(
    serial: str, effects: tuple[tuple[str, tuple[tuple[str, float], ...]], ...], seed: int, repeats: bool
) -> SimulatedUnit:
    model, hidden = open_model("strut"), tuple((name, dict(parameters)) for name, parameters in effects)
    order = UnitRequest(serial, "strut", model, seed, hidden, repeats=repeats, low_s=SECONDS, high_s=SECONDS)
    made = simulate(order)
    text = made.files[UNIT_FILE].replace(b"simulated = true\n", b"")
    return replace(made, files={**made.files, UNIT_FILE: text})
