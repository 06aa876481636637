"""Interpolation error of an encoder within each of its signal periods, found in the records of a response and removed.

The two signals of an encoder are not quite equal, so the reading x is off by c cos(2 pi x / p) + s sin(2 pi x / p) with
the signal period p, and by its harmonics ([HEYDEMANN81]). For a small motion that is a gain of 1 + 2 pi s / p, for a
large one it is noise: a response is off by percents in one band and not in the other.

It repeats over position and not over time, unlike any other effect. The search: the residual that the drive does not
explain, by local polynomials over the spectrum, weighted by its own power; its transform over position; c and s by
least squares if a line stands out, with cosine and sine reduced by the part that the drive explains."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.fft

from checks.arrays import Array, Complex
from checks.record import Record
from checks.signals.spectral.unexplained import DrivePart, blocks, power

PERIODS_M = (0.3e-6, 6e-6)  # of scales that are read by interpolation
WHOLE = 5.0  # periods within the motion, at least: a curve of few bends is the strut's
STANDS_OUT = 10.0  # times the median over all periods: chance makes it once in 1e30 records
LINES = 3  # the period and two of its harmonics
CELL_M = 10e-9  # of position, in which the residual is added up
ENCODER, DRIVE = "de", "Va"  # the channels of the reading and of its cause
LONGEST_M = 10e-3  # of a motion: no strut goes as far, so such a record is not used
FINE = 8  # places within the resolution over 1 / period
ROUNDS = 4  # each weighs by the residual of the last one
ZEROED = 50.0  # of the sum of squares in standard deviations: chance makes it once in 1e10 records


@dataclass(frozen=True)
class PeriodicError:
    """Periodic error of a reading x [m]: cosine_m cos(2 pi x / period_m) + sine_m sin(2 pi x / period_m)."""

    period_m: float
    cosine_m: float = 0.0
    sine_m: float = 0.0

    @property
    def amplitude_m(self) -> float:
        return float(np.hypot(self.cosine_m, self.sine_m))


Errors = tuple[PeriodicError, ...]


@dataclass(frozen=True, eq=False)
class _Residual:
    """Part of a reading that the drive does not explain. x (n,) reading [m]; drive: the explained part; E (B, BINS) the
    residual of the reading."""

    x: Array
    drive: DrivePart
    E: Complex

    @classmethod
    def of(cls, record: Record) -> "_Residual | None":
        """Return the unexplained part of the reading; None if it is absent, too short, or moves as no strut does."""
        if ENCODER not in record.channels or DRIVE not in record.channels:
            return None
        x = record[ENCODER]
        part = DrivePart.of(record[DRIVE]) if np.ptp(x) < LONGEST_M else None
        return None if part is None else cls(x[: part.n], part, part.left(x))

    def period(self, known: Errors) -> float | None:
        """Return the period of the strongest line over position that is not yet known, None if no line stands out."""
        E = self._less(known)
        weighed = self.drive.in_time(E / power(E)[:, None])
        cells = np.rint(self.x / CELL_M).astype(np.intp)
        over = np.bincount(cells - cells.min(), weighed)
        n = scipy.fft.next_fast_len(FINE * over.size, real=True)
        k = scipy.fft.rfftfreq(n, CELL_M)
        longest = min(PERIODS_M[1], over.size * CELL_M / WHOLE)
        band = (k >= 1.0 / longest) & (k <= 1.0 / PERIODS_M[0])
        if not band.any():
            return None
        size = np.abs(scipy.fft.rfft(over, n))
        top = int(np.argmax(np.where(band, size, 0.0)))
        stands_out = size[top] > STANDS_OUT * float(np.median(size[band]))
        return float(1.0 / (k[top] + _parabola_offset(size, top) * k[1])) if stands_out else None

    def fitted(self, errors: Errors) -> Errors:
        """Return the errors with the periods, cosines and sines that explain most."""
        for turn in range(ROUNDS):
            root = np.sqrt(power(self._less(errors)))[:, None]
            place = self.x - _error(self.x, errors)
            columns = [_waves(place, errors), *([_slopes(place, errors)] if turn else [])]
            R = np.array([(self.drive.off(blocks(column)) / root).ravel() for column in np.concatenate(columns)])
            y = (self.E / root).ravel()
            unit = np.maximum(np.linalg.norm(R, axis=1), 1e-300)  # of a size and of a period
            R /= unit[:, None]
            found = np.linalg.lstsq((np.conj(R) @ R.T).real, (np.conj(R) @ y).real, rcond=None)[0] / unit
            sizes, away = found[: 2 * len(errors)].reshape(-1, 2), found[2 * len(errors) :]
            errors = tuple(PeriodicError(e.period_m, *size) for e, size in zip(errors, sizes.tolist(), strict=True))
            errors = self._with_moved_periods(errors, away) if turn else errors
        return errors

    def _with_moved_periods(self, errors: Errors, away: Array) -> Errors:
        """Return errors with each inverse period raised by `away` (L,) [1/m], up to the motion's resolution."""
        most = 0.5 / np.ptp(self.x)
        steps = np.clip(away, -most, most).tolist()
        return tuple(replace(e, period_m=1.0 / (1.0 / e.period_m + d)) for e, d in zip(errors, steps, strict=True))

    def cost(self, errors: Errors) -> float:
        """Return the sum of squares of the residual, in its standard deviations."""
        return 2.0 * float(np.sum(np.abs(self._less(errors)) ** 2 / power(self.E)[:, None]))

    def _less(self, errors: Errors) -> Complex:
        """Return the (B, BINS) residual that neither the drive nor the errors explain."""
        return self.E - self.drive.off(blocks(_error(self.x, errors))) if errors else self.E


def _parabola_offset(size: Array, k: int) -> float:
    """Return the distance of the top of a parabola through a peak and its neighbours from the peak, in steps."""
    if not 0 < k < size.size - 1:
        return 0.0
    a, b, c = size[k - 1 : k + 2]
    return float(0.5 * (a - c) / (a - 2.0 * b + c))


def interpolation_errors(record: Record) -> Errors:
    """Return an encoder's periodic errors, the largest first; none if nothing repeats or the record is too short."""
    left = _Residual.of(record)
    found: Errors = ()
    while left is not None and len(found) < LINES:
        period = left.period(found)
        if period is None:
            break
        found = left.fitted((*found, PeriodicError(period)))
    return tuple(sorted(found, key=lambda e: -e.amplitude_m))


def errors_of_other_record(errors: Errors, record: Record) -> Errors:
    """Return the errors of the same encoder in another record: unchanged, unless errors fitted there explain far more
    (the counter was set to zero in between). A motion of few periods cannot show this."""
    left = _Residual.of(record) if errors else None
    if left is None or np.ptp(left.x) < WHOLE * max(e.period_m for e in errors):
        return errors
    own = left.fitted(errors)
    return own if left.cost(own) + ZEROED < left.cost(errors) else errors


def error_notes(errors: Errors) -> tuple[str, ...]:
    """Return remarks on the errors, for the reader of an answer from which they were removed; empty without errors."""
    if not errors:
        return ()
    each = [f"{1e9 * e.amplitude_m:.2g} nm that repeats every {1e6 * e.period_m:.3g} um" for e in errors]
    return (f"the encoder's interpolation has an error of {' and '.join(each)}; it was taken out of de",)


def remove_errors(record: Record, errors: Errors) -> Record:
    """Return the record as an encoder without them would have read it."""
    if not errors:
        return record
    x = record[ENCODER]
    return replace(record, channels={**record.channels, ENCODER: x - _error(x, errors)})


def _error(x: Array, errors: Errors) -> Array:
    """Return the error (N,) of readings x (N,); the position is the reading minus the error."""
    off = np.zeros_like(x)
    for _ in range(2):
        off = _at(x - off, errors)
    return off


def _at(x: Array, errors: Errors) -> Array:
    waves = _waves(x, errors)
    out: Array = np.array([v for e in errors for v in (e.cosine_m, e.sine_m)]) @ waves
    return out


def _waves(x: Array, errors: Errors) -> Array:
    """Return the (2 L, N) cosine and sine of every period."""
    angles = [2.0 * np.pi / e.period_m * x for e in errors]
    return np.array([wave(a) for a in angles for wave in (np.cos, np.sin)])


def _slopes(x: Array, errors: Errors) -> Array:
    """Return the (L, N) derivatives of every error by 1 / period [m2]."""
    turned = [replace(e, cosine_m=e.sine_m, sine_m=-e.cosine_m) for e in errors]
    return np.array([2.0 * np.pi * x * _at(x, (t,)) for t in turned])
