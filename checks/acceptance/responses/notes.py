"""Notes on the records besides the two bands; they do not enter a verdict."""

import numpy as np

from checks.acceptance.responses.modes import peak_Hz
from checks.cause import NoResult
from checks.record import Record, motion_of
from checks.signals.spectral.frf import Frf, h1_record

BARE = "Vs", "da"  # channels to compare without an encoder
LIKE = 0.95  # coherence of both, where responses with and without the encoder are compared


def first_record(record: Record, f_Hz: float) -> str:
    """Return a note on the resonance in the first, small record ([STB] 3.1.1)."""
    try:
        motion = motion_of(record.channels)
        frf = h1_record(record, "Va", (motion,))
        at = peak_Hz(frf, motion, 0.5 * f_Hz, 1.5 * f_Hz)
    except (ValueError, NoResult) as e:
        return f"first record: {e}"
    return f"first record: largest response at {at:.4g} Hz (bins of {frf.f[1]:.2g} Hz)"


def difference_without_encoder(whole: Frf, without: Frf) -> str:
    """Return the median difference of the responses with and without the encoder ([STB] 5.1: very close)."""
    words = []
    for channel in BARE:
        a, b = whole.select(channel), without.select(channel)
        n = min(a.f.size, b.f.size)
        both = (a.coherence[:n, 0] > LIKE) & (b.coherence[:n, 0] > LIKE) & np.isclose(a.f[:n], b.f[:n])
        if both.any():
            apart = np.median(np.abs(a.H[:n, 0][both] / b.H[:n, 0][both] - 1))
            words.append(f"{channel} by {100 * apart:.2g} percent")
    return f"encoder fixed or not, the responses differ: {', '.join(words)} (median)" if words else "nothing compared"
