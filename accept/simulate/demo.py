"""The demo's struts: a small batch, simulated from the built-in model, with common deviations of the supplier and
individual ones; the last has a hidden effect. The random numbers are the same every time."""

from accept.models.model_file import open_model
from accept.simulate.unit import SimulatedUnit, simulate
from accept.simulate.unit_request import SHORT_S, UnitRequest, drawn

MODEL = "strut"  # the model that they are simulated from, without their common part
COMMON = {  # joints softer along and stiffer across, a weaker actuator: none of it in the model file
    "joint.kz_N_per_um": 76.0,
    "joint.kRx_Nm_per_rad": 5.4,
    "joint.kRy_Nm_per_rad": 5.4,
    "constants.ga_N_per_V": -27.0,
}
EARLIER = ("SIM-STRUT-01", "SIM-STRUT-02", "SIM-STRUT-03")  # the batch is learned from it
SERIAL = "SIM-STRUT-04"
HIDDEN = ("misalignment", {"dx_um": 0.0, "dy_um": -170.0})


def earlier_struts() -> list[SimulatedUnit]:
    """Return the struts to learn the model from; with short records, so that the demo is quick."""
    return [_strut(serial) for serial in EARLIER]


def demo_strut() -> SimulatedUnit:
    """Return the one that is judged: its APA sits beside the axis of its joints."""
    return _strut(SERIAL, HIDDEN)


def _strut(serial: str, *effects: tuple[str, dict[str, float]]) -> SimulatedUnit:
    seed = int(serial[-2:])
    model = drawn(open_model(MODEL).with_values(COMMON), seed)
    request = UnitRequest(serial, "strut", model, seed, effects, repeats=False, low_s=SHORT_S, high_s=SHORT_S)
    return simulate(request)
