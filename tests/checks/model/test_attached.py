"""Elements attached to a strut: their matrices, their receptances and their derivatives are one thing."""

from dataclasses import replace

import numpy as np
import pytest

from accept.models.model_file import open_model
from checks.errors import ModelError
from checks.model.model import Model

F = np.geomspace(5.0, 700.0, 60)
S = 2j * np.pi * F
HELD = {"element.top_interface.z.spring_N_per_um": 0.27, "element.top_interface.z.point_y_mm": -18.0}
HUNG = {
    "element.payload.z.hung_kg": 0.06,
    "element.payload.z.hung_Hz": 62.0,
    "element.payload.z.hung_damping_ratio": 0.03,
}
DAMPED = {"element.sensor_stack.x.damper_N_s_per_m": 100.0}
CABLE = {"element.head.y.hung_kg": 0.04, "element.head.y.hung_Hz": 230.0, "element.head.y.hung_damping_ratio": 0.03}


@pytest.fixture(params=["strut", "strut-as-built"])
def strut(request: pytest.FixtureRequest) -> Model:
    return open_model(request.param)


@pytest.mark.parametrize(
    ("values", "place", "direction", "point", "z"),
    [
        (HELD, "top_interface", "z", (0.0, -18e-3), 0.27e6 + 0.0 * S),
        (DAMPED, "sensor_stack", "x", (0.0, 0.0), 100.0 * S),
        (HUNG, "payload", "z", (0.0, 0.0), None),
    ],
)
def test_receptances_give_the_response_with_an_element(
    strut: Model, values: dict[str, float], place: str, direction: str, point: tuple[float, float], z: np.ndarray | None
) -> None:
    if z is None:  # of a mass that hangs: in series with its spring
        w, mass = 2 * np.pi * 62.0, 0.06
        link = mass * (w * w + 2 * 0.03 * w * S)
        z = link * mass * S**2 / (link + mass * S**2)
    reach, own = strut.place_receptances(F).along(place, direction, point)
    bare, held = strut.frf(F), strut.with_elements(values).frf(F)
    predicted = bare + reach * (z / (1 + z * own))[:, None]
    assert np.abs(held - bare).max() > 1e-3 * np.abs(bare).max()
    # 1e-7 of the change: round-off of the receptances where the strut is stiff
    assert np.abs(held - predicted).max() < 1e-7 * np.abs(held - bare).max()


@pytest.mark.parametrize("values", [HELD, HUNG, DAMPED, CABLE])
@pytest.mark.parametrize("damping", ["full", "modal"])
def test_derivatives_by_the_values_of_an_element(strut: Model, values: dict[str, float], damping: str) -> None:
    model = replace(strut.with_elements(values), damping=damping)
    found = model.jacobian(F, list(values))
    for slope, (name, value) in zip(found, values.items(), strict=True):
        h = 1e-4 * abs(value)
        above, below = (model.frf(F, {name: value + d}) for d in (h, -h))
        # 2e-3: the difference's own error, of small changes on a large response
        np.testing.assert_allclose(slope, (above - below) / (2 * h), atol=2e-3 * np.abs(slope).max(), rtol=0)


def test_parts_and_matrices_give_one_response(strut: Model) -> None:
    model = strut.with_elements(HELD | CABLE | HUNG)
    np.testing.assert_allclose(model.frf(F), model.direct(F), rtol=1e-7)


def test_without_elements_the_model_is_as_it_was(strut: Model) -> None:
    assert np.array_equal(strut.with_elements(HELD).with_elements({}).frf(F), strut.frf(F))
    with pytest.raises(ModelError, match="hung_Hz is -1"):
        strut.with_elements({"element.payload.z.hung_Hz": -1.0})
