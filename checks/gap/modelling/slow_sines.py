"""Slow records: loops under slow sines of growing amplitude distinguish hysteresis from creep, and show a drive that
bends.

The opening of a loop relative to its height is  creep's share (alike at every amplitude) + hysteresis' share (in
proportion to it: Rayleigh; [BERTOTTI98] 2.3). Both by weighted least squares.
"""

from dataclasses import dataclass

import numpy as np

from checks.acceptance.hysteresis import Loop, loop_of
from checks.arrays import Array
from checks.cause import NoResult
from checks.gap.modelling.thresholds import Thresholds
from checks.record import Record
from checks.signals.slow.cycles import last_cycles
from checks.signals.slow.loops import ScalarEstimate

SPREAD = 1e-4  # of the height: what the model of a loop itself may be wrong by
MANY = 2  # amplitudes at least


@dataclass(frozen=True, eq=False)
class Slow:
    """grows, constant: shares of the opening at the largest amplitude; loops: what they were found from; p_fit: chance
    of the scatter about both; bends: relative departure of the middle line from a straight one, largest amplitude less
    smallest; f_Hz: of the sines."""

    grows: ScalarEstimate
    constant: ScalarEstimate
    loops: tuple[Loop, ...]
    bends: ScalarEstimate
    f_Hz: float

    @property
    def model(self) -> Array:
        """Return the opening (L,) of every loop by the two shares."""
        a = np.array([p.amplitude for p in self.loops])
        return np.asarray(self.constant.value + self.grows.value * a / a.max())

    def is_bent(self, table: Thresholds) -> bool:
        """Return whether the static curve between drive and displacement bends enough to be reported."""
        return abs(self.bends.value) > max(table.bend, 6.0 * self.bends.u)


def slow_record(record: Record, channel: str = "de") -> Slow | None:
    """Analyse the record of slow sines (channels Va and `channel`); None if it holds too few loops."""
    cycles = last_cycles(record["Va"])
    if len(cycles) < MANY:
        return None
    try:
        loops = tuple(loop_of(record["Va"][c.samples], record[channel][c.samples], c, channel) for c in cycles)
    except NoResult:
        return None
    a = np.array([p.amplitude for p in loops])
    w = np.array([p.width.value for p in loops])
    u = np.hypot(np.array([p.width.u for p in loops]), SPREAD)
    design = np.column_stack([np.ones(a.size), a / a.max()]) / u[:, None]
    cov = np.linalg.inv(design.T @ design)
    f_Hz = record.fs / float(np.median([c.stop - c.start for c in cycles]))
    constant, grows = cov @ design.T @ (w / u)
    sd = np.sqrt(np.diag(cov))
    return Slow(
        ScalarEstimate(float(grows), float(sd[1])),
        ScalarEstimate(float(constant), float(sd[0])),
        loops,
        _bend(loops),
        f_Hz,
    )


def _bend(loops: tuple[Loop, ...]) -> ScalarEstimate:
    """Return the third harmonic's share of the response's middle line at the largest amplitude, beside that of the
    smallest."""
    largest = loops[-1]
    v = largest.drive / largest.amplitude
    basis = np.column_stack([np.ones(v.size), v, v**2, v**3])
    x, rest, *_ = np.linalg.lstsq(basis, largest.response, rcond=None)
    scatter = float(np.sqrt(rest[0] / (v.size - 4))) if rest.size else 0.0
    u = scatter * float(np.sqrt(np.linalg.inv(basis.T @ basis)[3, 3]))
    return ScalarEstimate(float(x[3] / x[1]), max(abs(u / x[1]), SPREAD))
