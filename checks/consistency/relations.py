"""Two measurements of one thing by different instruments: the range of their ratio on a sound unit, correctly measured.

The bands are wide because a piezo stack answers differently to a small and a large voltage, at 1 kHz and at 0.4 Hz, at
once and after a second; within them nothing is reported. Beyond them, and beyond the expanded uncertainties, a record
is of another unit, a scale, an amplifier or a payload differs from its statement, or a stack is damaged. An open
circuit that is softer than a closed one is found by the check of the stiffness itself."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from checks.quantity import Quantity
from specs.bench import AMPLIFIER_GAIN, STACK_V, STATIC_HZ

Known = Mapping[str, Quantity]
"""Measured quantities of a unit by name, those with a value only."""


@dataclass(frozen=True)
class Relation:
    """Plausible range of a ratio: one over other, times `scale`, within lo to hi. one, other: quantities; sections: of
    `unit.toml`, whose data they come from; spared: quantities of these read by themselves; needs: of `scale`."""

    title: str
    one: str
    other: str
    sections: tuple[str, str]
    lo: float
    hi: float
    why: str
    scale: Callable[[Known], float] = lambda _: 1.0
    needs: tuple[str, ...] = ()
    spared: tuple[str, ...] = ()

    def ratio(self, known: Known) -> tuple[float, float] | None:
        """Return the ratio and its expanded uncertainty; None if a quantity was not measured. An unstated uncertainty
        counts as 0: the band is wide."""
        if any(name not in known for name in (self.one, self.other, *self.needs)):
            return None
        one, other = known[self.one], known[self.other]
        if other.value == 0.0:
            return None
        value = one.value / other.value * self.scale(known)
        return value, abs(value) * math.hypot(*(_relative_U(q) for q in (one, other)))

    def is_contradicted(self, known: Known) -> bool:
        """Return whether the two cannot both be right."""
        found = self.ratio(known)
        return found is not None and not self.lo - found[1] <= found[0] <= self.hi + found[1]


def _relative_U(quantity: Quantity) -> float:
    U = quantity.U if quantity.U is not None and math.isfinite(quantity.U) else 0.0
    return U / abs(quantity.value) if quantity.value else 0.0


def _static(known: Known) -> float:
    """Return the factor from a gain over 10 to 20 Hz to the static gain: that band is on the flank of the resonance."""
    f = known["axial_resonance_Hz"].value
    lo, hi = STATIC_HZ
    return 1.0 - (hi**3 - lo**3) / (hi - lo) / 3 / f**2


PAYLOAD = Relation(
    title="Stiffness by resonance and payload, over that by the added mass",
    one="k_resonance_N_per_um",
    other="k_closed_N_per_um",
    sections=("frf", "stiffness"),
    lo=0.9,
    hi=1.15,
    why="what moves of the unit itself adds 1 percent to the payload, creep takes 1 to 2 percent a decade of time off "
    "the stiffness, a large load a few more ([STB] 3.1.7, 3.2.1)",
)

RELATIONS = (
    Relation(
        title="Capacitance by the high-pass corner, over the LCR meter's",
        one="sensor_capacitance_implied_uF",
        other="sensor_uF",
        sections=("sensor_highpass", "capacitance"),
        lo=0.85,
        hi=1.35,
        why="[STB] 2.2, 3.1.9: 4.9 to 5.1 uF at 1 kHz, about 5 at the corner of 0.4 Hz; the permittivity of soft PZT "
        "grows by a few percent a decade towards low frequencies, and with the voltage ([DAMJANOVIC98])",
        spared=("actuator_uF",),
    ),
    Relation(
        title="Static gain of the frequency response, over the slope of the largest loop",
        one="gain_de_um_per_V",
        other="hysteresis_gain_um_per_V",
        sections=("frf", "hysteresis"),
        lo=0.55,
        hi=1.2,
        why="small signals move less than large ones, by up to a third ([STB] 4.2; Rayleigh's law, [BERTOTTI98])",
        scale=_static,
        needs=("axial_resonance_Hz",),
    ),
    Relation(
        title="Static gain of the frequency response, over that of the whole stroke",
        one="gain_de_um_per_V",
        other="stroke_um",
        sections=("frf", "stroke"),
        lo=0.55,
        hi=1.15,
        why="two of three stacks behind an amplifier of 20: 28.6 um per V by the stroke, 17.5 to 26.7 by small signals "
        "([STB] 2.3, 4.2)",
        # gain of two stacks [um per V at the DAC] over the stroke of three stacks [um] over their whole range
        scale=lambda known: _static(known) / AMPLIFIER_GAIN / (2 / 3) * (STACK_V[1] - STACK_V[0]),
        needs=("axial_resonance_Hz",),
    ),
    PAYLOAD,
)
