"""Slow behaviour of the piezo stacks: hysteresis of the displacement, and creep ([STB] 2.3, 3.1.6, 3.1.7)."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array
from checks.errors import ModelError
from checks.model.time.partial_fractions import Fractions

PLAYS = 120


@dataclass(frozen=True)
class Rayleigh:
    """Rate-independent hysteresis: y = linear u + density times the sum of plays of all half-widths (Prandtl and
    Ishlinskii), so that loops open by parabolas, in proportion to the amplitude (Rayleigh's law: Bertotti, Hysteresis
    in Magnetism, 1998, 2.3). u starts at rest: no play is bent yet."""

    linear: float
    density: float

    def __call__(self, u: Array) -> Array:
        """Return the response (N,) to u (N,) about its first sample."""
        v = u - u[0]
        reach = float(np.ptp(v))
        if reach == 0.0 or self.density == 0.0:
            return np.asarray(self.linear * v)
        half_widths: Array = (np.arange(PLAYS, dtype=np.float64) + 0.5) * (reach / PLAYS)
        return np.asarray(self.linear * v + self.density * (reach / PLAYS) * _plays(v, half_widths))


def _plays(v: Array, half_widths: Array) -> Array:
    """Return the sum (N,) of plays from zero: each follows the drive at its half-width, from the side that pushes.

    Between turns the drive only rises or only falls, so a play is clipped against its state at the last turn."""
    turns = np.flatnonzero(np.diff(np.sign(np.diff(v))) != 0) + 1
    states = np.zeros((turns.size + 1, half_widths.size))
    for k, turn in enumerate(turns):
        states[k + 1] = np.clip(states[k], v[turn] - half_widths, v[turn] + half_widths)
    last = np.searchsorted(turns, np.arange(v.size), side="right")
    total = np.zeros(v.size)
    for r, state in zip(half_widths, states.T, strict=True):
        total += np.clip(state[last], v - r, v + r)
    return total


def loops_of(relative_width: float, amplitude: float) -> Rayleigh:
    """Return a hysteresis whose settled loop at this amplitude opens, at mid-drive, by relative_width of its peak to
    peak; of small drives the gain is one.

    Plays of density c open by c A^2 / 2 and reach 2 A + c A^2 from peak to peak. Raises ModelError outside 0..0.4."""
    if not 0.0 <= relative_width <= 0.4:
        raise ModelError(f"relative_width is {relative_width:g}; expected 0 to 0.4")
    return Rayleigh(1.0, 4.0 * relative_width / ((1.0 - 2.0 * relative_width) * amplitude))


def stroke_of(stroke: float, span: float, relative_width: float) -> Rayleigh:
    """Return a hysteresis that reaches `stroke` on the first rise over the span of the drive, and whose loops over that
    span then open by relative_width of their peak to peak.

    The first rise over S reaches a S + c S^2 / 2; the loop, of amplitude S / 2, opens by c S^2 / 8 and reaches
    a S + c S^2 / 4. Raises ModelError outside 0..0.4."""
    if not 0.0 <= relative_width <= 0.4:
        raise ModelError(f"relative_width is {relative_width:g}; expected 0 to 0.4")
    bent = 8.0 * relative_width * stroke / (1.0 + 2.0 * relative_width)  # c S^2
    return Rayleigh((stroke - bent / 2.0) / span, bent / span**2)


def creep(per_decade: float) -> Fractions:
    """Return creep as a path: the answer to a step grows by this share per decade of time, from 10 us to 1000 s.

    Two relaxations a decade, half of one at either end (the law in log time: [JG00]); the gain at once is one."""
    tau = np.logspace(-5.0, 3.0, 17)
    share = np.full(tau.size, 0.5 * per_decade)
    share[[0, -1]] /= 2.0
    return Fractions((-1.0 / tau).astype(np.complex128), (share / tau).astype(np.complex128), 1.0)
