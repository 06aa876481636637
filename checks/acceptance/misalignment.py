"""Misalignment of the APA from the joints' axis, from the ratio of encoder to interferometer ([STB] 6.2).

It reads the records of the frequency responses. A coarse table of a model's ratio gives the starts, and a joint fit of
misalignment, uncertain parameters and drive gives dx, dy and their uncertainty. Data or a model that do not carry an
answer give no result: missing bands, reversed channels, a model that does not explain the responses, an answer at the
edge."""

from functools import lru_cache

import numpy as np

from checks.acceptance import frf
from checks.acceptance.responses.rules import dead_channels, record_faults
from checks.cause import Cause, NoResult, together
from checks.declare import Check, Guide, Measured, Setting, Values
from checks.errors import ModelError, RecordError
from checks.fitting.calibrate import quicker
from checks.fitting.dataset import Dataset
from checks.misalignment.estimate import CHANNEL_SETS, estimate_misalignment, with_payload
from checks.misalignment.estimate_types import MisalignmentEstimate
from checks.misalignment.panels import misalignment_panels
from checks.misalignment.table import MisalignmentTable, grid, table_frequencies
from checks.model.model import Model
from checks.quantity import COVERAGE_FACTOR, Contribution, Outcome, Quantity
from checks.record import Record
from specs.spec import CheckSpec

PLACES = 9, 13  # along dx and dy: the basins of the fit are as wide as a step of these
DIGITS = 2  # of um: far below U, far above what another processor's rounding does


def measure(values: Values, _: CheckSpec) -> Outcome:
    """Return dx_um and dy_um with U. Raises NoResult without records or model, or if no model can be compared with
    them."""
    model = values.get("model")
    if not isinstance(model, Model):
        raise NoResult(Cause.MODEL_NOT_SET)
    records = {k: v for k, v in values.items() if isinstance(v, Record) and k in frf.BANDS}
    faults = [
        reason.within(key, record.name)
        for key, record in records.items()
        for reason in dead_channels(record) or record_faults(record)
    ]
    if faults:
        raise NoResult(together(faults))
    data = _dataset(values, "low", "high")
    if data is None:
        raise NoResult(Cause.NOT_MEASURED, record=" and ".join(k for k in ("low", "high") if k not in values))
    try:
        found = estimate_misalignment(
            _with_payload(model, values), data, _coarse_table(model), _dataset(values, "low_repeat", "high_repeat")
        )
    except ModelError as e:
        raise NoResult(Cause.MODEL_UNUSABLE, model=model.name, detail=str(e)) from e
    quantities = (_quantity("dx_um", "dx", found), _quantity("dy_um", "dy", found))
    notes = [] if found.reason is not None else [f"dx, dy: {found.meaning}"]
    if found.repeat is None:
        notes.append("one realisation only: the model was judged on the data that it was fitted to")
    return Outcome(quantities, (*notes, *found.notes, *found.data.notes), misalignment_panels(found))


def _with_payload(model: Model, values: Values) -> Model:
    """Return the model with the payload that was weighed, if it was."""
    given: Measured | None = values.get("payload_kg")
    if given is None:
        return model
    return with_payload(model, given.value, None if given.U is None else given.U / COVERAGE_FACTOR)


def _dataset(values: Values, low: str, high: str) -> Dataset | None:
    """Return the responses of one realisation, None if a band was not recorded. Raises RecordError."""
    below, above = values.get(low), values.get(high)
    if not (isinstance(below, Record) and isinstance(above, Record)):
        return None
    merge: Measured | None = values.get("merge_Hz")
    merge_Hz, name = frf.MERGE_HZ if merge is None else merge.value, f"{low}, {high}"
    most, least = CHANNEL_SETS
    try:
        return Dataset.from_records(below, above, merge_Hz, channels=most, name=name)
    except RecordError:
        return Dataset.from_records(below, above, merge_Hz, channels=least, name=name)


@lru_cache(4)  # a third of a second, and a batch judges many units by one model
def _coarse_table(model: Model) -> MisalignmentTable:
    """Return a small table of the model, with real modes: a third of the time, and close enough for a start."""
    quick, f, (dx, dy) = quicker(model), table_frequencies(), grid(model, *PLACES)
    return MisalignmentTable(
        dx, dy, f, np.array([MisalignmentTable.row(quick, float(x), dy, f) for x in dx]), model.name
    )


def _quantity(name: str, axis: str, found: MisalignmentEstimate) -> Quantity:
    along = found.answer(axis)
    if along is None:
        return Quantity.missing(name, found.reason or found.unknown[axis])
    source = f"fit of {found.model.name}: noise, its tolerance, its uncertain parameters"
    u = round(along.U, DIGITS) / COVERAGE_FACTOR
    return Quantity.of(name, round(along.value, DIGITS), Contribution(source, u))


CHECK = Check(
    name="misalignment",
    title="Misalignment from the joints' axis",
    short="Misalignment",
    kinds=("strut",),
    forms=frf.CHECK.forms,
    quantities={"dx_um": "Misalignment dx", "dy_um": "Misalignment dy"},
    measure=measure,
    settings=(Setting("model", "strut-as-built", "built-in model or TOML file of the strut to compare with"),),
    section=frf.CHECK.name,
    model="model",
    failed="loosen the joints, align the APA on its axis, and record the responses again",
    guide=Guide(
        "This step needs no new measurement. It compares the ratio of encoder to interferometer in the frequency "
        "responses with the model and estimates how far the APA is off the axis of the joints. It takes some seconds.",
    ),
)
