"""The demo's strut: simulated from the built-in model with an effect hidden in it, the same every time."""

from accept.models.model_file import open_model
from accept.simulate.order import SHORT_S, UnitRequest
from accept.simulate.unit import SimulatedUnit, simulate

SERIAL = "SIM-STRUT-01"
MODEL = "strut"  # it is simulated from, and explained by: what is hidden is not in it


def demo_strut() -> SimulatedUnit:
    """A strut whose APA sits beside the axis of its joints; short records, so that the demo is quick."""
    misaligned = ("misalignment", {"dx_um": 0.0, "dy_um": -170.0})
    return simulate(
        UnitRequest(
            SERIAL,
            "strut",
            open_model(MODEL),
            seed=1,
            effects=(misaligned,),
            repeats=False,
            low_s=SHORT_S,
            high_s=SHORT_S,
        )
    )
