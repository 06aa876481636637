"""The bench: a base of granite that holds the bottom, a payload guided along z, perhaps a mode of the frame."""

from dataclasses import dataclass

from checks.arrays import Array, Complex


@dataclass(frozen=True)
class Bench:
    """payload [kg] including its half of the top joint; guide_damping [N s/m]; held: the payload is clamped too."""

    payload: float
    guide_damping: float
    held: bool = False


def suspension(f: Array, static: float, ratio: float, f_Hz: float, damping_ratio: float) -> Complex:
    """Return the contribution (F,) of a mode of the bench to both displacements: ratio g0 w^2 / (s^2 + 2 z w s + w^2).

    static: g0, the static gain of da [m/V] ([DESIGN] 6)."""
    x = 1j * f / f_Hz
    added: Complex = ratio * static / (x * x + 2.0 * damping_ratio * x + 1.0)
    return added
