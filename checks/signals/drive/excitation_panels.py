"""Pictures of an excitation: over time, and its spectrum."""

import numpy as np
from scipy import fft

from checks.picture import Band, Item, Line, Mark, Panel
from checks.signals.drive.excitation import Excitation

_COLUMNS = 2000  # of the time picture: more cannot be distinguished in print
_SEGMENT_s = 1.0  # of the spectrum that is drawn: lines 1 Hz apart
_TURNS = 10.0  # that a segment holds at least
_FLOOR = 1e-8  # of the largest density: below, it is only rounding and the window's skirt


def excitation_panels(excitation: Excitation) -> dict[str, Panel]:
    """Return the panels "time": voltage at the DAC; "spectrum": lines of a periodic signal, density of others."""
    return {"time": _time(excitation), "spectrum": _spectrum(excitation)}


def _time(e: Excitation) -> Panel:
    step = -(-e.Va.size // _COLUMNS)
    starts = np.arange(0, e.Va.size, step)
    t = e.t[starts]
    signal: list[Item] = [Line(t, e.Va[starts], role="data")]
    if step > 1:
        lo, hi = np.minimum.reduceat(e.Va, starts), np.maximum.reduceat(e.Va, starts)
        # If only a ramp runs, the band has no width: its edges are drawn too.
        signal = [Band(t, lo, hi, "lowest to highest", role="data"), Line(t, lo, role="data"), Line(t, hi, role="data")]
    marks = [Mark(float(e.t[k]), label=w, role="quiet") for k, w in ((e.start, "start"), (e.stop - 1, "end"))]
    return Panel(e.meaning.split(",")[0], "time [s]", "voltage at the DAC [V]", (*signal, *marks))


def _spectrum(e: Excitation) -> Panel:
    if e.period:
        x = e.proper[: e.period]
        f, amplitude = fft.rfftfreq(x.size, 1 / e.fs), 2.0 * np.abs(fft.rfft(x)) / x.size
        driven = amplitude > 1e-6 * amplitude.max()
        line = Line(f[driven], amplitude[driven], "lines", "points", "data")
        y_range = 0.3 * float(amplitude[driven].min()), 3.0 * float(amplitude.max())
        return Panel("One period", "frequency [Hz]", "amplitude [V]", (line,), x_log=True, y_log=True, y_range=y_range)
    from scipy.signal import welch  # loads slowly: only when wanted

    f, density = welch(e.proper, e.fs, nperseg=_segment(e), detrend=False)
    shown = np.where(density > _FLOOR * density.max(), density, np.nan)
    line = Line(f[1:], np.sqrt(shown[1:]), role="data")
    return Panel("Spectrum", "frequency [Hz]", "amplitude density [V/√Hz]", (line,), x_log=True, y_log=True)


def _segment(e: Excitation) -> int:
    """Return the number of samples of a segment of the spectrum, long enough to resolve a slow sine."""
    turns = np.count_nonzero(np.diff(np.signbit(e.proper))) / 2
    slow = _TURNS * e.proper.size / turns if turns else e.proper.size
    return int(min(max(round(_SEGMENT_s * e.fs), slow), e.proper.size))
