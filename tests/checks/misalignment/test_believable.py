"""A misalignment from what can be believed: bands, channels and axes that the rest does not need are left out."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from accept.analysis.misalignment import as_document
from accept.gap.unit_responses import responses
from accept.models.lookup_cache import table_for
from accept.models.model_file import AS_BUILT, as_weighed, open_model_file
from checks.cause import Cause
from checks.fitting import Dataset
from checks.misalignment.estimate import estimate_misalignment
from checks.misalignment.estimate_types import AxisOffset, MisalignmentEstimate
from checks.misalignment.gates import sensor_tells, unobservable
from checks.misalignment.table import MisalignmentTable
from checks.model import Model
from tests.accept.units.units import DATA
from tests.checks.model.units_model import needs_data
from tests.shared.recorded_units import RecordedUnits
from tests.soak import SOAK

BENCHES = DATA / "laboratory"
UNITS = sorted(p.parent.name for p in BENCHES.glob("*/unit.toml")) if SOAK else ["L-04", "M-04"]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, MisalignmentTable]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACCEPT_HOME", str(tmp_path_factory.mktemp("home")))
        model = open_model_file(AS_BUILT).model
        return model, table_for(model, lambda _: None, 11, 13, workers=1)


def measured(folder: Path) -> tuple[Model, Dataset, Dataset | None]:
    found = responses(folder)
    return as_weighed(open_model_file(AS_BUILT), found.serial, found.payload_kg).model, found.first, found.second


@needs_data
@pytest.mark.parametrize("serial", UNITS)
def test_a_bench_as_it_is(serial: str, built: tuple[Model, MisalignmentTable]) -> None:
    """Channels some microseconds apart and a guide that gives way above 400 Hz: without an answer before."""
    model, first, second = measured(BENCHES / serial)
    found = estimate_misalignment(model, first, built[1], second)
    assert found.reason is None
    true = json.loads((BENCHES / "truth.json").read_text())[serial]["effects"].get("misalignment", {})
    for axis in ("dx", "dy"):
        along = found.answer(axis)
        assert along is not None
        assert abs(along.value - true.get(f"{axis}_um", 0.0)) <= along.U
    assert any("left out" in note for note in found.notes)
    skew = json.loads((BENCHES / "truth.json").read_text())[serial]["bench"]["skew_us"]
    at, sds = found.fit.at["drive.skew_de_us"], found.fit.sds["drive.skew_de_us"]
    assert abs(at - (skew["de"] - skew["da"])) < 4.0 * sds + 1.0


def turned(data: Dataset) -> Dataset:
    """Vs reversed."""
    sign = np.array([-1.0 if c == "Vs" else 1.0 for c in data.channels])
    return replace(data, H=data.H * sign, cov=data.cov * np.outer(sign, sign))


def dead(data: Dataset) -> Dataset:
    size = np.array([1e-4 if c == "Vs" else 1.0 for c in data.channels])
    return replace(data, H=data.H * size, cov=data.cov * np.outer(size, size))


@pytest.mark.parametrize("spoil", [turned, dead])
def test_a_sensor_that_is_dead_or_reversed_is_not_needed(
    spoil, built: tuple[Model, MisalignmentTable], recorded_units: RecordedUnits
) -> None:
    model, first, second = measured(recorded_units.folder("S-01"))
    assert second is not None
    assert sensor_tells(first, model)
    assert not sensor_tells(spoil(first), model)
    found = estimate_misalignment(model, spoil(first), built[1], spoil(second))
    assert found.reason is None
    assert found.data.channels == ("de", "da")
    assert abs(found.dy.value) <= found.dy.U


@pytest.fixture(scope="module")
def sound(built: tuple[Model, MisalignmentTable], recorded_units: RecordedUnits) -> MisalignmentEstimate:
    model, first, second = measured(recorded_units.folder("S-01"))
    return estimate_misalignment(model, first, built[1], second)


@pytest.mark.parametrize(
    ("dx", "dy", "unknown"),
    [
        (AxisOffset(-59.0, 285.0), AxisOffset(149.7, 0.7), {"dx"}),  # an actuator whose modes do not show dx
        (AxisOffset(10.0, 20.0), AxisOffset(0.0, 700.0), {"dy"}),
        (AxisOffset(-59.0, 285.0), AxisOffset(0.0, 700.0), set()),  # neither is known: no result at all
        (
            AxisOffset(199.0, 30.0),
            AxisOffset(0.0, 4.0),
            set(),
        ),  # known, and perhaps beyond the table: what is fitted is doubtful
    ],
)
def test_an_axis_that_the_data_do_not_show(
    sound: MisalignmentEstimate, dx: AxisOffset, dy: AxisOffset, unknown: set[str]
) -> None:
    found = replace(sound, dx=dx, dy=dy)
    found = replace(found, unknown=unobservable(found))
    assert set(found.unknown) == unknown
    if unknown:
        document = as_document("X-1", found).to_json()
        assert document["verdict"] == "no_result"
        assert document["reason"]
        for axis in ("dx", "dy"):
            along = document[f"{axis}_um"]
            assert (along["value"] is None) == (along["U"] is None) == (axis in unknown)
        assert found.why is not None
        assert found.why.cause is Cause.TABLE_EDGE
