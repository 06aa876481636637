"""Slow records: loops under slow sines of growing amplitude distinguish hysteresis from creep, and show a drive that
bends.

The opening of a loop relative to its height is  creep's share (alike at every amplitude) + hysteresis' share. By
Rayleigh's law ([BERTOTTI98] 2.3) plays of density c open a loop of amplitude A by c A^2 / 2 and reach 2 A + c A^2 from
peak to peak. At the part x of the largest amplitude the latter's share is therefore  w x / (1 - 2 w (1 - x))  with w at
the largest one: in proportion to the amplitude while loops are narrow. Both by weighted least squares.

Not every loop that opens with the amplitude is a hysteresis of the drive. In Rayleigh's law the same density of plays
opens the loop and makes it steeper: if it opens by w of its height, the slope grows by 2 w between no amplitude and
this one. A guide that sticks and slips opens its loops until it slips and less beyond, so their openings lie on no
straight line over the amplitude; while it still sticks they do, but the loop hardly gets steeper.
"""

from dataclasses import dataclass

import numpy as np

from checks.acceptance.hysteresis import Loop, loop_of
from checks.arrays import Array
from checks.cause import NoResult
from checks.gap.modelling.thresholds import Thresholds
from checks.model.learned_bench import LearnedBench
from checks.record import Record
from checks.signals.slow.loops import ScalarEstimate, last_cycles

SPREAD = 1e-4  # of the height: what the model of a loop itself may be wrong by
MANY = 2  # amplitudes at least
ROUNDS = 8  # of Gauss and Newton: the openings are nearly straight over both shares
WIDEST = 0.45  # share of the height, where Rayleigh's loops would be half as wide as they are high
BEYOND_NOISE = 6.0  # standard uncertainties
CURVE = 2  # order of a polynomial that tells a curve from a line
CURVED = 0.35  # of the rise, between proportional and squared parts of an opening: ceramics keep to a tenth at mid-way
COUPLED = 0.5  # of the steepening that Rayleigh's law expects: that of ceramics differs; sticking friction has none
DRIFT = 0.02  # of a gain, between the first amplitude and the last: no bench holds it better than by some percent


@dataclass(frozen=True, eq=False)
class Slow:
    """The loops of slow sines. grows, constant: shares of the opening at the largest amplitude; loops: what they were
    found from; p_fit: chance of the scatter about both; bends: relative departure of the middle line from a straight
    one, largest amplitude less smallest; f_Hz: of the sines; channel: of the motion."""

    grows: ScalarEstimate
    constant: ScalarEstimate
    loops: tuple[Loop, ...]
    bends: ScalarEstimate
    f_Hz: float
    channel: str

    @property
    def model(self) -> Array:
        """Return the opening (L,) of every loop by the two shares."""
        a = np.array([p.amplitude for p in self.loops])
        return np.asarray(self.constant.value + rayleigh(self.grows.value, a / a.max())[0])

    @property
    def is_of_drive(self) -> bool:
        """Return whether the loops open and get steeper with the amplitude as those of a hysteresis of the drive do."""
        x = np.array([p.amplitude for p in self.loops]) / max(p.amplitude for p in self.loops)
        opening = np.array([p.width.value for p in self.loops])
        slope = np.array([float(p.drive @ p.response) / float(p.drive @ p.drive) for p in self.loops])
        if np.any(opening >= 0.5) or np.any(slope == 0.0):
            return False
        # Errors of a loop count in its height, so weights are the amplitudes. w / (1 - 2 w) is straight in Rayleigh's
        # law, and so is one over the slope.
        if x.size > CURVE:
            squared, straight, _ = np.polyfit(x, opening / (1.0 - 2.0 * opening), CURVE, w=x)
            if abs(squared) > CURVED * abs(straight + squared):
                return False
        per_amplitude, at_rest = np.polyfit(x, 1.0 / slope, 1, w=x)
        steeper, expected = -float(per_amplitude / at_rest), 2.0 * self.grows.value
        return abs(steeper - expected) < COUPLED * expected + DRIFT

    def opens(self, table: Thresholds) -> bool:
        """Return whether the loops open with the amplitude beyond noise, for whatever reason."""
        return self.grows.value > table.loop_width and self.grows.value > BEYOND_NOISE * self.grows.u

    def is_bent(self, table: Thresholds) -> bool:
        """Return whether the static curve between drive and displacement bends enough to be reported."""
        return abs(self.bends.value) > max(table.bend, 6.0 * self.bends.u)


def slow_record(record: Record, channel: str, bench: LearnedBench | None = None) -> Slow | None:
    """Analyse the record of slow sines (channels Va and `channel`); None if it holds too few loops. bench: its lag at
    their frequency opens every loop alike, and is taken off."""
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
    constant, grows, cov = _shares(a / a.max(), w, u)
    f_Hz = record.fs / float(np.median([c.stop - c.start for c in cycles]))
    sd = np.sqrt(np.diag(cov))
    of_bench = _opened_by(bench, f_Hz, channel)
    return Slow(
        ScalarEstimate(float(grows), float(sd[1])),
        ScalarEstimate(float(constant) - of_bench.value, float(np.hypot(sd[0], of_bench.u))),
        loops,
        _bend(loops),
        f_Hz,
        channel,
    )


def _opened_by(bench: LearnedBench | None, f_Hz: float, channel: str) -> ScalarEstimate:
    """Return the opening of a loop, relative to its height, by what a learned bench does to a channel."""
    if bench is None:
        return ScalarEstimate(0.0, 0.0)
    f = np.array([f_Hz])
    factor = np.broadcast_to(bench.at(f, channel), 1)[0]
    return ScalarEstimate(-float(np.sin(np.angle(factor))), float(bench.tolerance_at(f, (channel,))[0, 0]))


def rayleigh(width: float, x: Array) -> tuple[Array, Array]:
    """Return the opening (L,) relative to the height of loops at the part x (L,) of the largest amplitude, whose own is
    `width`, and its derivative by that."""
    bent = 1.0 - 2.0 * width * (1.0 - x)
    return width * x / bent, x / bent**2


def _shares(x: Array, opening: Array, u: Array) -> tuple[float, float, Array]:
    """Return the constant share, the one that grows and their covariance (2, 2), from openings (L,) with u (L,)."""
    constant, grows = 0.0, 0.0
    for _ in range(ROUNDS):
        of_drive, slope = rayleigh(grows, x)
        design = np.column_stack([np.ones(x.size), slope]) / u[:, None]
        cov = np.linalg.inv(design.T @ design)
        step = cov @ design.T @ ((opening - constant - of_drive) / u)
        constant, grows = constant + float(step[0]), float(np.clip(grows + step[1], -WIDEST, WIDEST))
    return constant, grows, np.asarray(cov)


def _bend(loops: tuple[Loop, ...]) -> ScalarEstimate:
    """Return the cubic term of the response's middle line over the linear one, at the largest amplitude of the drive:
    how much the slope changes over the loop."""
    largest = loops[-1]
    v = largest.drive / largest.amplitude
    basis = np.column_stack([np.ones(v.size), v, v**2, v**3])
    x, rest, *_ = np.linalg.lstsq(basis, largest.response, rcond=None)
    scatter = float(np.sqrt(rest[0] / (v.size - 4))) if rest.size else 0.0
    u = scatter * float(np.sqrt(np.linalg.inv(basis.T @ basis)[3, 3]))
    return ScalarEstimate(float(x[3] / x[1]), max(abs(u / x[1]), SPREAD))
