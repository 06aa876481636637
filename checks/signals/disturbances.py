"""Disturbances of records that the drive does not explain: lines of the mains or a motion, bursts, a drive at its rail.

They do not belong to the strut or the model, but they explain a response that is noisier than it should be."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.record import Record
from checks.signals.record_checks import overload
from checks.signals.spectral.segments import hann
from checks.signals.spectral.unexplained import BINS, DrivePart, power

MAINS_HZ = (50.0, 60.0)
LEAST_LINES = 20  # of a band: with fewer a line does not stand out of its neighbours
MAINS_WITHIN_HZ = 0.2  # about its frequency: the grid's ordinary band
ALIKE = 0.1  # of the ratio of two channels: a motion shows in de and da as the payload's motion does
BESIDE_HZ = 3.0  # half a band in which the response to the drive is a parabola
STANDS_OUT = 8.0  # times the median of the unexplained part: by chance once in 1e18 lines

SLOT = 256  # samples whose power is looked at together
BAND, BURST_TO_HZ = 64, 2000.0  # blocks of the spectrum that are looked at together, and up to where
BURST, CALM = 5.0, 3.0  # times the median over all slots: within a burst, and everywhere else; 2.5 on sound records
SHORT = 0.05  # of the record: a burst is shorter
TIMES_CUT, MOST_CUT = 3, 0.3  # how often, and in what part of its samples, a drive is cut off
SHOWN_IN = {"Vs": (1e3, "mV"), "de": (1e9, "nm"), "da": (1e9, "nm")}
LEAST_HELD = 2.5  # samples, on average: a sine that repeats exactly holds its crest for one or two


@dataclass(frozen=True)
class Hum:
    """Line about the mains: frequency [Hz], and amplitude in the channel's unit; per_response: its complex size over
    the channel's response to the drive at this frequency."""

    f_Hz: float
    amplitude: float
    per_response: complex = 0.0

    @property
    def may_be_mains(self) -> bool:
        return min(abs(self.f_Hz - f) for f in MAINS_HZ) <= MAINS_WITHIN_HZ


def is_motion(lines: Mapping[str, Hum]) -> bool:
    """Return whether encoder and interferometer show a line in the same ratio and phase as a motion of the payload."""
    if not {"de", "da"} <= lines.keys():
        return False
    de, da = lines["de"], lines["da"]
    return bool(da.per_response and abs(de.per_response / da.per_response - 1.0) < ALIKE)


def hum(record: Record, channels: Sequence[str]) -> dict[str, Hum]:
    """Return, by channel, the strongest line about the mains that Va does not explain, if one stands out."""
    window = hann(record.t.size)
    f: Array = np.fft.rfftfreq(record.t.size, 1.0 / record.fs).astype(float)
    near = (f >= MAINS_HZ[0] - BESIDE_HZ) & (f <= MAINS_HZ[1] + BESIDE_HZ)
    U = _lines(record["Va"], window)[near]
    found = {c: _strongest(f[near], U, _lines(record[c], window)[near]) for c in channels if c in record.channels}
    return {c: Hum(f_Hz, 2.0 * size / float(window.sum()), per) for c, (f_Hz, size, per) in found.items() if size > 0.0}


def _lines(x: Array, window: Array) -> Complex:
    return np.asarray(np.fft.rfft(window * (x - x.mean())))


def _strongest(f: Array, U: Complex, Y: Complex) -> tuple[float, float, complex]:
    """Return frequency and size of the strongest line in Y at f (F,) that U does not explain, and its ratio to the
    response to U; size 0 if no line stands out."""
    best = (0.0, 0.0, 0j)
    for centre in MAINS_HZ:
        band = np.flatnonzero(np.abs(f - centre) <= BESIDE_HZ)
        if band.size < LEAST_LINES:
            return 0.0, 0.0, 0j
        line = _remainder(f[band] - centre, U[band], Y[band])
        left = np.abs(line)
        k = int(np.argmax(left))
        if left[k] > max(STANDS_OUT * float(np.median(left)), best[1]):
            explained = Y[band[k]] - line[k]
            per = complex(line[k] * U[band[k]] / explained) if explained else 0j
            best = float(f[band[k]] + _between(left, k) * (f[1] - f[0])), float(left[k]), per
    return best


def _between(left: Array, k: int) -> float:
    """Return the distance of a sine from the largest bin k of a spectrum with a Hann window, in bins ([GRANDKE83])."""
    if not 0 < k < left.size - 1:
        return 0.0
    side = 1 if left[k + 1] > left[k - 1] else -1
    r = float(left[k + side] / left[k])
    return side * float(np.clip((2.0 * r - 1.0) / (r + 1.0), 0.0, 0.5))


def _remainder(x: Array, U: Complex, Y: Complex) -> Complex:
    """Return Y (B,) minus the best parabola of U over x (B,), fitted without the lines that stand out."""
    base = U[:, None] * np.column_stack([np.ones_like(x), x, x * x])
    use = np.ones(x.size, dtype=bool)
    for _ in range(3):
        H, *_ = np.linalg.lstsq(base[use], Y[use], rcond=None)
        left = Y - base @ H
        use = np.abs(left) < 4.0 * np.median(np.abs(left))
    return np.asarray(left)


@dataclass(frozen=True)
class Burst:
    """A short disturbance: the channels that show it, when it begins and how long it lasts [s]."""

    channels: tuple[str, ...]
    at_s: float
    seconds: float


def bursts(record: Record, channels: Sequence[str]) -> tuple[Burst, ...]:
    """Return the largest short disturbance of each channel, simultaneous ones together: a part of the record with a far
    larger unexplained remainder than everywhere else."""
    part = DrivePart.of(record["Va"]) if np.ptp(record["Va"]) > 0.0 else None
    if part is None:
        return ()
    slots = {
        c: s for c in channels if c in record.channels and (s := _burst_slots(part, record[c], record.fs)) is not None
    }
    out: list[Burst] = []
    for channel, (first, last) in sorted(slots.items(), key=lambda each: each[1]):
        at, seconds = first * SLOT / record.fs, (last - first) * SLOT / record.fs
        if out and at <= out[-1].at_s + out[-1].seconds:
            out[-1] = Burst((*out[-1].channels, channel), out[-1].at_s, max(seconds, out[-1].seconds))
        else:
            out.append(Burst((channel,), at, seconds))
    return tuple(out)


def _burst_slots(part: DrivePart, y: Array, fs: float) -> tuple[int, int] | None:
    """Return the first slot of the largest burst and the one behind its last, or None. Each band of the spectrum is
    examined alone, each block over its own power: a mode that the drive does not explain whole is not short, and a
    burst in one band would drown in the noise of the others."""
    E = part.left(y)
    white = E / np.sqrt(power(E))[:, None]
    found, largest = None, BURST
    for first in range(0, min(len(white), int(BURST_TO_HZ * part.n / fs / BINS)), BAND):
        band = np.zeros_like(white)
        band[first : first + BAND] = white[first : first + BAND]
        left = part.in_time(band)
        size = np.sqrt(np.mean(left[: left.size // SLOT * SLOT].reshape(-1, SLOT) ** 2, axis=1))
        size /= np.median(size)
        high = np.flatnonzero(size > CALM)
        if size.max() > largest and high[-1] - high[0] < SHORT * size.size:
            found, largest = (int(high[0]), int(high[-1]) + 1), float(size.max())
    return found


def at_rail(drive: Array) -> tuple[int, float] | None:
    """Return (number of samples, value) at the largest or smallest value of a drive, if an output cut it off there.
    None for a drive that rests there, or that has few values, such as a binary sequence."""
    for reason in overload("Va", drive):
        count, value = int(reason.parameters["count"]), float(reason.parameters["value"])
        begins = np.flatnonzero(np.diff((drive == value).astype(np.int8)) == 1)
        often = begins.size >= TIMES_CUT and count >= LEAST_HELD * begins.size
        if often and count < MOST_CUT * drive.size:
            return count, value
    return None


def disturbance_notes(low: Record) -> tuple[str, ...]:
    """Return notes on what disturbs the low record: lines, bursts, a drive that was cut off."""
    outputs = tuple(SHOWN_IN)
    lines = hum(low, outputs)
    near = {c: line for c, line in lines.items() if line.may_be_mains}
    far = {c: line for c, line in lines.items() if c not in near}
    hummed = "mains hum or a motion of {} Hz in the records" if is_motion(near) else "mains hum of {} Hz in the records"
    notes = [*_line_notes(hummed, near)]
    motion = (
        "a motion of {} Hz that the drive does not explain, not the mains: de and da show it as they show the payload"
    )
    notes += _line_notes(motion if is_motion(far) else "a line of {} Hz that the drive does not explain", far)
    for burst in bursts(low, outputs):
        where = f"{burst.channels[0]} alone" if len(burst.channels) == 1 else ", ".join(burst.channels)
        begun = f"a burst of {1e3 * burst.seconds:.2g} ms in {where} at {burst.at_s:.2f} s"
        notes.append(f"{begun}, which the drive does not explain")
    if (rail := at_rail(low["Va"])) is not None:
        words = "what an amplifier or converter at its end adds is no linear response"
        notes.append(f"the drive Va is at its rail: {rail[0]} samples hold {rail[1]:.3g} V; {words}")
    return tuple(notes)


def _line_notes(words: str, lines: Mapping[str, Hum]) -> tuple[str, ...]:
    if not lines:
        return ()
    sizes = {c: line.amplitude * SHOWN_IN[c][0] for c, line in lines.items()}
    most = lines[max(sizes, key=lambda c: sizes[c])].f_Hz
    listed = ", ".join(f"{c} {size:.2g} {SHOWN_IN[c][1]}" for c, size in sizes.items())
    return (f"{words.format(f'{most:.2f}')}: {listed}",)
