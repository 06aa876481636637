"""Reservations: what the bench's store knows against a unit and its folder does not show.

    held = Reservations.known(store, unit, record)  # copies, parts, nonconformances, earlier attempts, look-alikes
    record = held.apply(record)  # stated in the record; findings and verdict as they leave them, never better
    assert Reservations.stated(record) == held

    serial_doubt(store, unit.serial, unit)  # the question to the operator, None without one
    standing(store, unit.serial, unit.notes).open  # the nonconformances that hold it
    voids(store, unit.serial)  # attempts that quality assurance declared void

Quality assurance decides, each time with its key (`accept.store.decisions`): `decide` about nonconformances,
`settle_copies` where a recording belongs, `void` that an attempt does not count."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from accept.judging.reservations.copies import copies_of, same_recording, settle_copies, withhold_others
    from accept.judging.reservations.folder_name import serial_doubt, serial_question, tell_apart, unconfirmed
    from accept.judging.reservations.nonconformance import (
        RELEASING,
        concessions,
        decide,
        decided,
        open_nonconformances,
        standing,
    )
    from accept.judging.reservations.parts import part_doubts, parts_below
    from accept.judging.reservations.reread import rereadings
    from accept.judging.reservations.reservations import Reservations
    from accept.judging.reservations.superseded import Approval, measured_values
    from accept.judging.reservations.void_attempts import counted, void, voids
else:
    __getattr__ = door(__name__)
