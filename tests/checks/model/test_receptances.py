"""Responses from the receptances of the free APA, against the same matrices solved at each frequency."""

from dataclasses import replace

import numpy as np
import pytest

from accept.models.model_file import open_model
from checks.errors import NotHeld
from checks.model.dynamics.complex_modes import direct_frf, modal
from checks.model.dynamics.derivatives import change_of_system, derivatives
from checks.model.dynamics.receptances import receptances
from checks.model.model import Model
from checks.model.structure.matrix_builder import System

F = np.geomspace(1.0, 4900.0, 300)
# Rigid modes answer by 1 / w^2, so digits are lost below the first mode: measured 6e-9, 2e-9, 1e-10.
ROUNDING = np.select([F < 2.0, F < 10.0], [6e-8, 2e-8], 2e-9)
PLACES = [
    {},
    {"misalignment.dx_um": 300.0, "misalignment.dy_um": -80.0, "apa.damping_ratio": 0.05},
    {"apa.sensor_stiffening": 0.4, "apa.actuator_stiffening": 0.2, "joint.kRx_Nm_per_rad": 9.0},
    {"apa.mode_stiffness_1": 0.7, "apa.mode_damping_2": 3.0, "encoder.head_mass_kg": 0.2, "joint.cR_Nm_s_per_rad": 0.1},
]


@pytest.fixture(scope="module")
def strut() -> Model:
    return open_model("strut-as-built")


def known(system: System) -> System:
    assert system.parts is not None
    return system


@pytest.mark.parametrize("changes", PLACES)
def test_responses(strut: Model, changes: dict[str, float]) -> None:
    system = known(strut.system(changes))
    found = receptances(system, 2.0 * np.pi * F)
    assert found is not None
    slow = direct_frf(system, F)
    assert (np.abs(found.frf(F) - slow) <= ROUNDING[:, None] * np.abs(slow)).all()
    np.testing.assert_allclose(found.static(), modal(system).static(), rtol=1e-11)


@pytest.mark.parametrize("changes", PLACES)
def test_derivatives_are_those_by_complex_modes(strut: Model, changes: dict[str, float]) -> None:
    """By the damping of the APA's modes and by an offset: in the APA, and in what is fastened to it."""
    system = known(strut.system(changes))
    s = 2j * np.pi * np.concatenate([[0.0], F])
    for name, h in (("apa.damping_ratio", 1e-4), ("misalignment.dx_um", 0.1)):
        at = {**strut.values, **changes}
        by = change_of_system(*(strut.system({**changes, name: at[name] + d}) for d in (h, -h)), h)
        quick = derivatives(system, [by], s)[0]
        slow = derivatives(replace(system, parts=None), [by], s)[0]
        # adjoint states carry the same round-off twice, beside the largest of the band
        assert (np.abs(quick - slow).max(axis=0) <= 1e-7 * np.abs(slow).max(axis=0)).all(), name


def test_only_where_the_parts_are_known(strut: Model) -> None:
    w = 2.0 * np.pi * F
    assert receptances(strut.system(), w) is not None
    assert receptances(strut.clamped().system(), w) is None, "a payload that is held ties coordinates"
    assert receptances(open_model("strut-2dof").system(), w) is None, "its APA has no modes of its own"


def test_at_rest_and_near_it_the_model_answers_as_exactly(strut: Model) -> None:
    """Where receptances would lose digits, and where there are none at all."""
    assert strut.damping == "full"
    f = np.array([0.0, 0.003, 0.1, 50.0])
    np.testing.assert_allclose(strut.frf(f), strut.direct(f), rtol=1e-9)
    names = ["joint.kz_N_per_um", "apa.damping_ratio"]
    assert np.isfinite(strut.jacobian(f, names)).all()
    alone = strut.jacobian(f[3:], names)
    np.testing.assert_allclose(strut.jacobian(f, names)[:, 3:], alone, rtol=1e-6, atol=1e-9 * np.abs(alone).max())


def test_what_is_not_held_is_said(strut: Model) -> None:
    loose = strut.system()
    loose = replace(loose, K=loose.K - 1.1 * np.linalg.eigvalsh(loose.K)[0] * np.eye(len(loose.K)))
    found = receptances(loose, 2.0 * np.pi * F)
    assert found is not None
    with pytest.raises(NotHeld, match="not held"):
        found.static()
