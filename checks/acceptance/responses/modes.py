"""Resonances and the zero in the frequency responses of a unit, as quantities."""

import numpy as np

from checks.acceptance.common.typed_value import stated_contribution
from checks.acceptance.responses.rules import ResponseSettings
from checks.cause import Cause, NoResult, Reason, because
from checks.quantity import Contribution, Quantity
from checks.signals.spectral.frf import Frf
from checks.signals.spectral.poles import Transforms
from checks.signals.spectral.resonance import Resonance, find, find_beside
from checks.signals.spectral.zeros import Zero, find_zero
from specs.spec import CheckSpec

NARROW = 0.12  # of the resonance: the band of the fit
WIDE = 0.78, 1.36  # times the resonance: the band in which a second one is searched ([STB] 3.2.3: 95 and 105 Hz)
INNER = 0.02  # left at the ends of a band, so that a pole is seen from both sides
AROUND_ZERO = 0.2  # of the frequency where a zero is expected: the band in which it is searched
SPURIOUS = ("x_bending_Hz", "y_bending_Hz", "z_torsion_Hz")


def peak_Hz(frf: Frf, channel: str, f_lo: float, f_hi: float) -> float:
    """Return the frequency of the largest response of a band. Raises NoResult if the band was not measured."""
    part = frf.band(f_lo, f_hi)
    if part.f.size < 3 or not part.usable.any():
        raise NoResult(Cause.BAND_NOT_MEASURED, channel=channel, lo=f_lo, hi=f_hi)
    return float(part.f[np.argmax(np.abs(part.H[:, part.index(channel)]))])


def axial(low: Transforms, near_Hz: float, rules: ResponseSettings) -> tuple[Resonance, Resonance | None]:
    """Return the axial resonance of a record from all channels, next to near_Hz, and the second one if two poles fit
    better than one. Raises NoResult if no resonance is seen."""
    lo, hi = WIDE[0] * near_Hz, WIDE[1] * near_Hz
    inner = lo + INNER * near_Hz, hi - INNER * near_Hz
    try:
        first = main_mode(low, near_Hz)
        both = find_beside(low.window(lo, hi), first, *inner, rules.second_share)
    except ValueError as e:
        raise NoResult(Cause.CANNOT_ESTIMATE, record="low", detail=f"about {near_Hz:.4g} Hz: {e}") from e
    return (first, None) if both is None else both


def main_mode(low: Transforms, near_Hz: float) -> Resonance:
    """Return the resonance at near_Hz alone. Raises NoResult without a resonance, ValueError for an empty band."""
    lo, hi = (1 - NARROW) * near_Hz, (1 + NARROW) * near_Hz
    found = find(low.window(lo, hi), lo + INNER * near_Hz, hi - INNER * near_Hz)
    if found is None:
        raise NoResult(Cause.NO_RESONANCE, f_Hz=near_Hz)
    return found


def axial_resonance(first: Resonance, again: Resonance | None, spec: CheckSpec) -> Quantity:
    """Return axial_resonance_Hz; again: the resonance of the second realisation."""
    spread_Hz = None if again is None else abs(again.f_Hz - first.f_Hz) / 2
    return resonance_quantity("axial_resonance_Hz", first, spec, spread_Hz)


def axial_damping(first: Resonance, again: Resonance | None, spec: CheckSpec) -> Quantity:
    """Return axial_damping_percent. One record determines it to parts in a million; the spec states its
    repeatability."""
    spread = None if again is None else 50 * abs(again.damping_ratio - first.damping_ratio)
    budget = _budget(100 * first.u_damping, 100 * first.u_damping_model, spread)
    value = 100 * first.damping_ratio
    name = "axial_damping_percent"
    return Quantity.of(name, value, *budget, stated_contribution(spec, value, name))


def second_resonance(second: Resonance | None, spec: CheckSpec) -> Quantity:
    """Return second_resonance_Hz."""
    if second is None:
        return Quantity.missing("second_resonance_Hz", Cause.NO_SECOND_POLE)
    return resonance_quantity("second_resonance_Hz", second, spec)


def resonance_quantity(name: str, found: Resonance, spec: CheckSpec, repeat: float | None = None) -> Quantity:
    """Return the frequency of a resonance with its budget."""
    budget = _budget(found.u_Hz, found.u_Hz_model, repeat)
    return Quantity.of(name, found.f_Hz, *budget, stated_contribution(spec, found.f_Hz, name, "f_Hz"))


def _budget(u: float, u_model: float, repeat: float | None = None) -> list[Contribution | None]:
    return [
        Contribution("scatter of the response", u, "A"),
        Contribution("what surrounds the pole: polynomials of one order more", u_model),
        None if repeat is None else Contribution("second realisation, half the difference", repeat, "A"),
    ]


def vs_zero(low: Transforms, near_Hz: float) -> Zero | Reason:
    """Return the zero of Vs, or the reason why none was found."""
    try:
        found = find_zero(low.window((1 - AROUND_ZERO) * near_Hz, (1 + AROUND_ZERO) * near_Hz, "Vs"))
    except ValueError as e:
        return because(Cause.CANNOT_ESTIMATE, detail=f"Vs: {e}")
    return found or because(Cause.NO_ZERO, channel="Vs", f_Hz=near_Hz)


def zero_quantity(found: Zero, spec: CheckSpec) -> Quantity:
    """Return vs_zero_Hz; the note states its side of the imaginary axis and the coherence there."""
    note = f"{found.side} (damping {100 * found.damping_ratio:.2g} percent), coherence there {found.coherence:.2f}"
    budget = [
        Contribution("scatter of the response", found.u_Hz, "A"),
        Contribution("polynomial of one order more", found.u_Hz_model),
        stated_contribution(spec, found.f_Hz, "vs_zero_Hz", "f_Hz"),
    ]
    return Quantity.of("vs_zero_Hz", found.f_Hz, *budget, note=note)


def spurious(record: Transforms, near_Hz: float, within: float) -> Resonance | Reason:
    """Return the mode within a share of near_Hz, from all channels, or the reason why none is seen.

    A mode that no channel shows cannot be measured: on a strut whose encoder sits on the axis, de is blind to it too.
    """
    lo, hi = (1 - within) * near_Hz, (1 + within) * near_Hz
    try:
        found = find(record.window(lo - INNER * near_Hz, hi + INNER * near_Hz), lo, hi)
    except ValueError as e:
        return because(Cause.CANNOT_ESTIMATE, detail=f"{lo:.4g} to {hi:.4g} Hz: {e}")
    return found or because(Cause.NO_MODE, lo=lo, hi=hi)
