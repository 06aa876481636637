"""The demo's strut: simulated from the built-in model, the same every time."""

from accept.model_file import open_model
from accept.simulate.order import Order
from accept.simulate.unit import SimulatedUnit, simulate

SERIAL = "SIM-STRUT-01"
RECORD_S = 10.5  # the spec asks for 10 s


def demo_strut() -> SimulatedUnit:
    """A good strut, a little misaligned; short records, so that the demo is quick."""
    misaligned = ("misalignment", {"dx_um": 15.0, "dy_um": -40.0})
    return simulate(
        Order(
            SERIAL,
            "strut",
            open_model("strut"),
            seed=1,
            effects=(misaligned,),
            repeats=False,
            low_s=RECORD_S,
            high_s=RECORD_S,
        )
    )
