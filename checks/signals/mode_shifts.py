"""Modes at other frequencies in a second record of the same unit: a change of frequency, not of gain."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array
from checks.record import Record
from checks.signals.spectral.poles import Transforms
from checks.signals.spectral.resonance import Resonance, find

# [Hz] of the axial mode, and of the strut's own that the encoder sees
MODE_BANDS_Hz = ((60.0, 140.0), (140.0, 235.0), (235.0, 330.0))
LEAST, SURE = 5e-4, 6.0  # shift, and standard uncertainties, from which on it is reported
FARTHEST = 0.03  # more is another mode
ALIKE = 1.5  # ratio of damping and of amplitude within which two resonances are one mode


@dataclass(frozen=True)
class ModeShift:
    """A mode at f_Hz in one record and at `to_Hz` in another one."""

    f_Hz: float
    to_Hz: float

    @classmethod
    def between(
        cls, first: Record, second: Record, channel: str, f: Array, up_to_Hz: float, drive: str = "Va"
    ) -> "tuple[ModeShift, ...]":
        """Return the modes of a channel that moved from one record to another: the strongest of each band, if it is the
        same mode in both and its frequencies differ beyond their uncertainties. f: frequencies [Hz] at which the
        records differ; other bands, and those that end above up_to_Hz, are not looked at."""
        bands = [(lo, hi) for lo, hi in MODE_BANDS_Hz if hi <= up_to_Hz and ((f >= lo) & (f <= hi)).any()]
        both = [Transforms.of(record, drive, (channel,)) for record in (first, second)] if bands else []
        found = []
        for lo, hi in bands:
            a, b = (find(each.window(lo, hi, channel), lo, hi) for each in both)
            if a is not None and b is not None and _moved(a, b):
                found.append(cls(a.f_Hz, b.f_Hz))
        return tuple(found)

    @property
    def relative(self) -> float:
        return self.to_Hz / self.f_Hz - 1.0


def _moved(a: Resonance, b: Resonance) -> bool:
    shift = b.f_Hz / a.f_Hz - 1.0
    u = float(np.hypot(np.hypot(a.u_Hz, a.u_Hz_model), np.hypot(b.u_Hz, b.u_Hz_model))) / a.f_Hz
    ratios = a.damping_ratio / b.damping_ratio, float(a.amplitude[0] / b.amplitude[0])
    return max(LEAST, SURE * u) < abs(shift) < FARTHEST and all(1.0 / ALIKE < r < ALIKE for r in ratios)
