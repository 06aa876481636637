"""Requirements of a channel: finite, varying, inside the range of its converter, on a uniform time base.

Nothing is repaired: a channel that fails is refused in words."""

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.cause import Cause, because
from checks.errors import RecordError
from hw.records.contents.variable import Variable

# Largest distance of a time stamp from the uniform grid, in sampling periods. The analysis takes the grid for the
# time: at a fifth of the sampling frequency 0.05 is 0.06 rad. A time vector stored in single precision strays by 0.04
# at 128 s and 10 kHz; a lost or repeated sample by at least 0.5.
JITTER = 0.05
# Slowest rate of times without a unit. Records of the stroke are the slowest, triangles of 10 s that need 20 values a
# second to be followed; responses are estimated up to some kHz, and even 100 kHz taken for ms give 100 Hz.
SLOWEST_Hz = 20.0
# Fastest rate of times without a unit: converters of the bench run to some 200 kHz. The slowest record in days of a
# calendar, taken for seconds, has 1.7 MHz.
FASTEST_Hz = 1.5e6
# No channel of the bench, in SI, comes near; a flipped exponent bit does, and its square would overflow later.
PLAUSIBLE = 1e9
PLAUSIBLE_TIME = 1e19  # clocks count from 1970, some in ns
# Converters of the bench are ±10 V (±10.24 V with overrange); 1 % is left for gain and offset correction.
CONVERTER_V = (9.9, 10.3)
# Full-scale samples in a row. Two neighbours at the same largest code happen at the crest of an unclipped sine.
CLIPPED_RUN = 3


def loaded(file: str, channel: str, v: Variable) -> Array:
    """Return (N,) data of a variable that must be a vector of real numbers. Raises RecordError."""
    who = f"{file}: channel '{channel}'" + (f" ('{v.name}' in the file)" if v.name != channel else "")
    if v.load is None:
        raise RecordError(f"{who} is of kind {v.kind}, expected real numbers")
    if v.size == 0:
        raise RecordError(f"{who} is empty")
    if not v.is_vector:
        raise RecordError(f"{who} is {' x '.join(map(str, v.shape))}, expected one dimension")
    return v.load()


def vet_time(file: str, t: Array, min_samples: int) -> None:
    """Raise RecordError unless t (N,) [s] is long enough, finite and uniform to `JITTER` of its period."""
    if t.size < min_samples:
        raise RecordError(f"{file}: has {t.size} samples, at least {min_samples} are needed")
    _vet_numbers(file, "t", t, t, PLAUSIBLE_TIME)
    grid, step = np.linspace(t[0], t[-1], t.size, retstep=True)
    if step > 0 and np.abs(t - grid).max() <= JITTER * step:
        return
    steps = np.diff(t)
    usual = float(np.median(steps))
    off = np.flatnonzero(~(np.abs(steps - usual) <= JITTER * abs(usual)))
    if usual <= 0 or not off.size:
        how = "does not run forward" if usual <= 0 else "drifts away from a uniform grid"
        raise RecordError(f"{file}: time 't' {how} (median step {usual:.6g} s), expected uniform steps")
    i = int(off[0])
    how = "stands still" if steps[i] == 0 else "runs backwards" if steps[i] < 0 else "is not uniform"
    raise RecordError(
        f"{file}: time 't' {how} from sample {i} to {i + 1}: {t[i]:.9g} s to {t[i + 1]:.9g} s, "
        f"expected a step of {usual:.6g} s ± {JITTER:.0%} ({off.size} such steps)"
    )


def vet_rate(file: str, source: str, step: float, in_seconds: bool) -> None:
    """Raise RecordError if times without a unit give a sampling rate at which nothing is measured here."""
    if not in_seconds and step * SLOWEST_Hz > 1.0 + JITTER:
        guess = "ms" if step < 1e3 / SLOWEST_Hz else "us" if step < 1e6 / SLOWEST_Hz else "ns"
        raise RecordError(
            f"{file}: its time '{source}' has no unit; in s its sampling rate would be {1.0 / step:.3g} Hz, and the "
            f"slowest records have {SLOWEST_Hz:g} Hz: is the time in {guess}? Name it with its unit, such as "
            f"'t [{guess}]', of a slow record 't [s]'"
        )
    if not in_seconds and step * FASTEST_Hz < 1.0:
        raise RecordError(
            f"{file}: its time '{source}' has no unit; in s its sampling rate would be {1.0 / step:.3g} Hz, and the "
            f"fastest records have {FASTEST_Hz:.3g} Hz: is the time in days, as dates of a calendar are? Write it in "
            "seconds, 86400 of them a day, and name it 't [s]'"
        )


def vet_step(file: str, name: str, values: Array) -> float:
    """Return the sampling time [s] that a scalar holds; a CSV column repeats it in every row. Raises RecordError."""
    step = float(values[0])
    if not (values == step).all() or not 1.0 / PLAUSIBLE < step < PLAUSIBLE:
        raise RecordError(f"{file}: '{name}' holds {values[:3]}, expected one sampling time in seconds")
    return step


def vet_channel(file: str, name: str, unit: str, x: Array, t: Array) -> None:
    """Raise RecordError unless x (N,) in `unit` is finite, plausible, not constant and not clipped."""
    who = f"{file}: channel '{name}'"
    if x.size != t.size:
        raise RecordError(f"{who} has {x.size} samples, the time has {t.size}")
    lo, hi = _vet_numbers(file, name, x, t, PLAUSIBLE)
    if lo == hi:
        raise RecordError(because(Cause.CHANNEL_CONSTANT, file=file, channel=name, value=lo, unit=f" {unit}"))
    if unit == "V":
        _vet_range(file, name, x, t, lo, hi)


def _vet_numbers(file: str, channel: str, x: Array, t: Array, largest: float) -> tuple[float, float]:
    lo, hi = float(x.min()), float(x.max())  # NaN goes through both
    if -largest <= lo and hi <= largest:
        return lo, hi
    wrong = np.flatnonzero(~np.isfinite(x))
    if wrong.size:
        at = str(x[wrong[0]]), _at(wrong, t)
        raise RecordError(because(Cause.SAMPLES_NOT_FINITE, file=file, channel=channel, value=at[0], where=at[1]))
    wrong = np.flatnonzero(np.abs(x) > largest)
    value, where = float(x[wrong[0]]), _at(wrong, t)
    raise RecordError(
        because(Cause.SAMPLES_TOO_LARGE, file=file, channel=channel, value=value, where=where, most=largest)
    )


def _at(samples: NDArray[np.intp], t: Array) -> str:
    i = int(samples[0])
    when = f" (t = {t[i]:.6g} s)" if np.isfinite(t[i]) else ""
    return f"at sample {i}{when}, {samples.size} of {t.size} samples"


def _vet_range(file: str, channel: str, x: Array, t: Array, lo: float, hi: float) -> None:
    """Refuse a voltage that stays at its own extreme, sample by sample the same, at the end of a converter's range.

    Away from the ends of the range a plateau is a signal: a stroke record waits at -20 V and at 150 V. At the end of
    the range a crest so flat cannot be distinguished from a clipped one."""
    for extreme in (lo, hi):
        if CONVERTER_V[0] <= abs(extreme) <= CONVERTER_V[1]:
            start, run = _longest_run(x == extreme)
            if run >= CLIPPED_RUN:
                end = "largest" if extreme == hi else "smallest"
                where = f" V, the end of the converter's range, from sample {start} (t = {t[start]:.6g} s)"
                raise RecordError(
                    because(
                        Cause.CHANNEL_CLIPPED,
                        file=file,
                        channel=channel,
                        count=run,
                        end=end,
                        value=extreme,
                        where=where,
                    )
                )


def _longest_run(there: NDArray[np.bool_]) -> tuple[int, int]:
    """Return start and length of the longest run of True."""
    edges = np.flatnonzero(np.diff(there, prepend=False, append=False))
    lengths = edges[1::2] - edges[::2]
    best = int(np.argmax(lengths))
    return int(edges[2 * best]), int(lengths[best])
