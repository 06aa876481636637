"""The acceptance checks: one file each, one line here."""

from checks.acceptance import (
    capacitance,
    flatness,
    hysteresis,
    misalignment,
    sensor_highpass,
    spurious_modes,
    stiffness,
    stroke,
)
from checks.acceptance.responses import check as frf
from checks.declare import Check

CHECKS: dict[str, Check] = {
    check.name: check
    for check in (
        flatness.CHECK,
        capacitance.CHECK,
        stroke.CHECK,
        stiffness.CHECK,
        hysteresis.CHECK,
        sensor_highpass.CHECK,
        spurious_modes.CHECK,
        frf.CHECK,
        misalignment.CHECK,
    )
}
