"""Simulated struts for tests of `accept gap` and of what batch makes of it: short records of the built-in model."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from accept.gap import analyse_unit
from accept.models.model_file import open_model
from accept.simulate import SimulatedUnit, UnitRequest, simulate, write
from checks.gap.decision.result import Result

HIGHPASS = ("sensor_highpass", {"f_Hz": 4.0})
SECONDS = 10.5  # the checks of a spec ask for 10


def make_strut(
    folder: Path, serial: str, *effects: tuple[str, Mapping[str, float]], seed: int = 1, repeats: bool = True
) -> Path:
    """A unit folder with these effects hidden in it."""
    hidden = tuple((name, tuple(parameters.items())) for name, parameters in effects)
    return write(_simulated(serial, hidden, seed, repeats), folder)


@cache
def highpass_answer() -> Result:
    """What the search says of a strut with a high-pass, once for all tests of a process that only read it."""
    with TemporaryDirectory() as place:
        return analyse_unit.analyse(make_strut(Path(place) / "X-1", "X-1", HIGHPASS), "strut").result


@cache  # many tests begin with one and the same strut
def _simulated(
    serial: str, effects: tuple[tuple[str, tuple[tuple[str, float], ...]], ...], seed: int, repeats: bool
) -> SimulatedUnit:
    model, hidden = open_model("strut"), tuple((name, dict(parameters)) for name, parameters in effects)
    order = UnitRequest(serial, "strut", model, seed, hidden, repeats=repeats, low_s=SECONDS, high_s=SECONDS)
    return simulate(order)
