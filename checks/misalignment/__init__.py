"""Misalignment of the APA between its joints, from the responses of encoder and interferometer.

    plain, dx, dy, f = MisalignmentTable.axes(model, 5, 7)  # places [um] and frequencies [Hz] of the model's table
    R = np.array([MisalignmentTable.row(plain, x, dy, f) for x in dx])  # de / da
    table = MisalignmentTable(dx, dy, f, R, plain.name)

    found = estimate_misalignment(with_payload(model, 5.76), first, table, second)  # two realisations
    found.reason  # why there is no answer, or None
    found.dx.value, found.dx.U  # [um]
    misalignment_panels(found)

A table of 41 x 41 places takes seconds: store it."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from checks.misalignment.estimate import CHANNEL_SETS, estimate_misalignment, with_payload
    from checks.misalignment.estimate_types import MisalignmentEstimate
    from checks.misalignment.panels import misalignment_panels
    from checks.misalignment.table import MisalignmentTable, table_limits_um
else:
    __getattr__ = door(__name__)
