"""Judging a unit by a spec. Nothing here asks the store.

    chosen = load_spec("apa-basic")  # a name or a file; `default_spec("apa")` is that of a product
    record = judge_unit(unit, spec_for(unit, {chosen.kind: chosen}))  # a `UnitRecord`: what results.json states of it
    record.findings  # values with their U against limits, by their decision rules; `record.verdict` follows

    contradictions(record, chosen)  # what does not follow from its own values: a stored verdict is never trusted

With a bench file the record states the calibrations behind it (`statement`). What the store knows against a unit is
added by `accept.judging.reservations`. What to do about findings is in `accept.judging.advice`."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from accept.judging.bench_errors import consistent, without_bench_errors
    from accept.judging.calibration import References, Statement, checked_calibration, same_calibration, statement
    from accept.judging.consistency import contradictions
    from accept.judging.inputs import input_doubts
    from accept.judging.judge import (
        check_spec,
        default_spec,
        default_specs,
        judge_unit,
        load_spec,
        serial_fits,
        spec_for,
        spec_warnings,
    )
    from accept.judging.samples import section_read_by
else:
    __getattr__ = door(__name__)
