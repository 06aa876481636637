"""Simulated struts for tests of `accept gap` and of what batch makes of it: short records of the built-in model."""

from collections.abc import Mapping
from pathlib import Path

from accept.models.model_file import open_model
from accept.simulate import UnitRequest, simulate, write

HIGHPASS = ("sensor_highpass", {"f_Hz": 4.0})
SECONDS = 10.5  # the checks of a spec ask for 10


def make_strut(
    folder: Path, serial: str, *effects: tuple[str, Mapping[str, float]], seed: int = 1, repeats: bool = True
) -> Path:
    """A unit folder with these effects hidden in it."""
    model = open_model("strut")
    order = UnitRequest(serial, "strut", model, seed, effects, repeats=repeats, low_s=SECONDS, high_s=SECONDS)
    return write(simulate(order), folder)
