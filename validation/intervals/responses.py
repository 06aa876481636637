"""Simulated hammer tests and frequency responses, each with the true values of its quantities.

Modes are summed in the frequency domain, where they have a closed form; drives are limited in frequency, so that the
samples of their response are exact.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import firwin, lfilter, upfirdn

from checks.declare import Measured
from checks.record import Record
from checks.signals import Frf
from validation import strut
from validation.intervals.parts import Array, Draw, Simulated, off

# --- hammer ----------------------------------------------------------------------------------------------------------

HAMMER_HZ, OVER = 5120.0, 4


@dataclass(frozen=True)
class Mode:
    """f_Hz; damping ratio; size at rest."""

    f_Hz: float
    damping: float
    size: float

    def ringing(self, force: Array, fs: float) -> Array:
        """Return the response (N,) to a force that is constant between samples, by the mode's own impulse response."""
        w = 2.0 * np.pi * self.f_Hz
        damped = w * np.sqrt(1.0 - self.damping**2)
        pole = np.exp((-self.damping * w + 1j * damped) / fs)
        b = [0.0, self.size * w**2 / damped / fs * pole.imag]
        return np.asarray(lfilter(b, [1.0, -2.0 * pole.real, abs(pole) ** 2], force))


def hits(modes: Sequence[Mode], rng: Draw, clock: float) -> Record:
    """Return eight single hits of a hammer on some modes, through the filter of an analyser."""
    fs, seconds = HAMMER_HZ * OVER, 12.5
    t = np.arange(round(seconds * fs)) / fs
    force = np.zeros(t.size)
    for k in range(8):
        at, width = 0.5 + 1.5 * k + 0.1 * rng.uniform(), 0.9e-3
        inside = (t >= at) & (t < at + width)
        force[inside] = rng.uniform(60.0, 95.0) * np.sin(np.pi * (t[inside] - at) / width)
    moved = sum(m.ringing(force, fs) for m in modes)
    taps = firwin(40 * OVER + 1, 0.9 / OVER)
    kept = slice(20, 20 + t.size // OVER)
    rest = np.zeros(20 * OVER)
    tracks = [upfirdn(taps, np.append(x, rest), 1, OVER)[kept] for x in (force, moved)]
    noise = (0.02, 2e-8)
    y = [x + sd * rng.standard_normal(x.size) for x, sd in zip(tracks, noise, strict=True)]
    channels = {"Track1": y[0], "Track2": y[1]}
    return Record(clock * np.arange(y[0].size) / HAMMER_HZ, channels, {"Track1": "N", "Track2": "rad"})


def spurious_modes(rng: Draw) -> Simulated:
    """Four records of one unit, whose damping is another one by some percent whenever it is clamped."""
    f = {"x": 280.0 * off(rng, 8.0), "y": 412.0 * off(rng, 8.0), "z": 800.0 * off(rng, 4.0)}
    damping = {k: rng.uniform(0.006, 0.012) for k in f}
    now = {k: d * off(rng, 2.0) for k, d in damping.items()}  # as the spec states that it repeats
    third, fifth, of_y = 3.0 * f["x"] * off(rng, 2.0), 5.0 * f["x"] * off(rng, 2.0), 3.0 * f["y"] * off(rng, 2.0)
    x, y = Mode(f["x"], now["x"], 1e-6), Mode(f["y"], now["y"], 8e-7)
    torsion = Mode(f["z"], now["z"], 3e-7)
    records = {
        "x_bending": (x, Mode(third, 0.008, 1.2e-7), Mode(fifth, 0.008, 5e-8)),
        "y_bending": (y, Mode(of_y, 0.008, 1e-7)),
        "torsion_left": (Mode(x.f_Hz, x.damping, 3e-7), Mode(y.f_Hz, y.damping, 3e-7), torsion),
        "torsion_top": (Mode(x.f_Hz, x.damping, 3e-7), Mode(y.f_Hz, y.damping, 3e-7)),
    }
    clock = off(rng, 0.02)
    truth = {
        **{f"{k}_bending_Hz": f[k] for k in "xy"},
        "z_torsion_Hz": f["z"],
        **{f"{k}_bending_damping_percent": 100.0 * damping[k] for k in "xy"},
        "z_torsion_damping_percent": 100.0 * damping["z"],
        "x_bending_harmonic_3_Hz": third,
        "x_bending_harmonic_5_Hz": fifth,
        "y_bending_harmonic_3_Hz": of_y,
    }
    return Simulated({key: hits(modes, rng, clock) for key, modes in records.items()}, truth)


# --- responses -------------------------------------------------------------------------------------------------------

FS, SECONDS = 5000.0, 12.0
LOW_HZ, HIGH_HZ = (4.0, 450.0), (250.0, 2100.0)
LOW_V, HIGH_V = 0.04, 0.3  # rms
NOISE = {"Vs": 2e-3, "de": 2e-9, "da": 1e-9}  # rms: steps of a converter, an encoder, an interferometer


@dataclass(frozen=True)
class Structure:
    """f_Hz and damping of the axial mode; static gain [m/V]; others: modes with their size on de and da as shares of
    the static gain; zero of Vs: f_Hz, damping; `Vs`: its gain far above both."""

    axial: Mode
    others: tuple[tuple[Mode, float], ...]
    zero_Hz: float
    zero_damping: float
    Vs: float

    def response(self, f: Array) -> dict[str, Array]:
        """Return channel -> H (F,) over Va, with one sample of delay."""
        s, late = 2j * np.pi * f, np.exp(-2j * np.pi * f / FS)
        axial = self.axial.size * _mode(s, self.axial.f_Hz, self.axial.damping)
        more = [(self.axial.size * m.size * _mode(s, m.f_Hz, m.damping), on_da) for m, on_da in self.others]
        wz, wa = 2.0 * np.pi * self.zero_Hz, 2.0 * np.pi * self.axial.f_Hz
        above = s**2 + 2.0 * self.zero_damping * wz * s + wz**2
        below = s**2 + 2.0 * self.axial.damping * wa * s + wa**2
        return {
            "Vs": -self.Vs * above / below * late,
            "de": (axial + sum(m for m, _ in more)) * late,
            "da": (axial + sum(on_da * m for m, on_da in more)) * late,
        }

    def static(self, channel: str) -> float:
        """Return the gain at 0 Hz."""
        return float(abs(self.response(np.zeros(1))[channel][0]))


def _mode(s: Array, f_Hz: float, damping: float) -> Array:
    w = 2.0 * np.pi * f_Hz
    return np.asarray(w**2 / (s**2 + 2.0 * damping * w * s + w**2))


def shape(f: Array, band: tuple[float, float]) -> Array:
    """Return the spectrum of the drive's size (F,) within a band [Hz], any unit."""
    return np.asarray(1.0 / (1.0 + (band[0] / np.maximum(f, 1e-9)) ** 8) / (1.0 + (f / band[1]) ** 8) * (f < 0.48 * FS))


def coherent_up_to(structure: Structure, channel: str) -> float:
    """Return the frequency [Hz] up to which more than half of the third of an octave about it has 0.9 of a channel's
    power from the drive of the high record; at most the end of the record."""
    f = np.arange(0.5, FS / 2, 0.5)
    power = shape(f, HIGH_HZ) ** 2
    of_drive = np.abs(structure.response(f)[channel]) ** 2 * power * HIGH_V**2 / power.sum()
    good = of_drive >= 9.0 * NOISE[channel] ** 2 / f.size
    for at in np.arange(1000.0, FS / 2, 1.0):
        if not good[(f >= at / 2 ** (1 / 6)) & (f <= at * 2 ** (1 / 6))].mean() >= 0.5:
            return float(at)
    return FS / 2


def driven(structure: Structure, rng: Draw, band: tuple[float, float], rms: float, factors: Mapping[str, float]) -> Any:
    """Return a record of noise within a band [Hz]; factors: channel -> what its instrument is off by, and "clock"."""
    n = round(SECONDS * FS)
    f = np.fft.rfftfreq(2 * n, 1.0 / FS)  # as long again beforehand: at its start the structure swings already
    drive = np.fft.irfft(np.fft.rfft(rng.standard_normal(2 * n)) * shape(f, band))
    spectrum, scale = np.fft.rfft(drive), rms / drive.std()
    columns = {"Va": scale * drive[n:]}
    for c, H in structure.response(f).items():
        y = factors[c] * scale * np.fft.irfft(spectrum * H)[n:]
        columns[c] = y + NOISE[c] * rng.standard_normal(n)
    units = {"Va": "V", "Vs": "V", "de": "m", "da": "m"}
    return Record(factors["clock"] * np.arange(n) / FS, columns, units)


def responses_of(kind: str, rng: Draw, second: bool = False) -> Simulated:
    """Two records of an APA or a strut; instruments, payload and damping are off by what the spec states of them.
    second: with a second resonance beside the first one."""
    strut = kind == "strut"
    payload = (5.7 if strut else 5.0) * off(rng, 4.0)
    f_Hz, damping = rng.uniform(84.0, 96.0) if strut else rng.uniform(90.0, 100.0), rng.uniform(0.003, 0.008)
    bending = ((197.0, 0.02), (290.0, 0.01), (376.0, 0.008)) if strut else ((280.0, 0.002), (412.0, 0.002))
    modes = tuple(Mode(f * off(rng, 6.0), rng.uniform(0.004, 0.01), size) for f, size in bending)
    beside = Mode(f_Hz * rng.uniform(1.1, 1.15), 0.006, 0.15 if second else 0.0)
    others = [*((m, 0.02) for m in modes), (beside, 1.0)]
    zero = rng.uniform(36.0, 42.0)
    now = Mode(f_Hz, damping * off(rng, 2.0), rng.uniform(22e-6, 26e-6))
    structure = Structure(now, tuple(others), zero, 0.01, 5.0)
    factors = {"Vs": off(rng, 0.3), "de": off(rng, 0.5), "da": off(rng, 0.2), "clock": off(rng, 0.02)}
    values: dict[str, Any] = {
        "low": driven(structure, rng, LOW_HZ, LOW_V, factors),
        "high": driven(structure, rng, HIGH_HZ, HIGH_V, factors),
        "payload_kg": Measured(payload * off(rng, 1.0)),
    }
    f = np.arange(400.0, 500.0, 0.5)
    static = structure.static("da")
    truth = {
        "axial_resonance_Hz": f_Hz,
        "axial_damping_percent": 100.0 * damping,
        "vs_zero_Hz": zero,
        "gain_de_um_per_V": structure.static("de") * 1e6,
        "gain_da_um_per_V": static * 1e6,
        "gain_Vs_V_per_V": float(np.mean(np.abs(structure.response(f)["Vs"]))),
        "k_resonance_N_per_um": payload * (2.0 * np.pi * f_Hz) ** 2 * 1e-6,
        "mass_line_um_per_V": now.size * (f_Hz**2 + beside.size * beside.f_Hz**2) / 250.0**2 * 1e6,
    }
    truth |= {"second_resonance_Hz": beside.f_Hz} if second else {"mass_line_kg": payload}
    truth |= {f"coherent_{c}_Hz": coherent_up_to(structure, c) for c in NOISE}
    if strut:
        names = ("x_bending_Hz", "y_bending_Hz", "z_torsion_Hz")
        truth |= {name: m.f_Hz for name, m in zip(names, modes, strict=True)}
    return Simulated(values, truth)


def constants(rng: Draw) -> Simulated:
    """Return a response of a strut of the blind tests, whose parts scatter as its model file says, as seen by
    instruments that are off by what the spec states of them."""
    made = strut.draw(rng)
    f = np.arange(5.0, 600.0, 1.0)
    H = strut.plant(made).frf(f)[[2, 0, 1]].T * np.array([off(rng, 0.3), off(rng, 0.5), off(rng, 0.2)])
    var = (1e-3 * np.abs(H)) ** 2
    noise = rng.standard_normal((2, *H.shape)) * np.sqrt(var / 2.0)
    cov = np.einsum("fc,cd->fcd", var, np.eye(3))
    channels, nu = ("Vs", "de", "da"), np.full(f.size, 40.0)
    frf = Frf(f, H + noise[0] + 1j * noise[1], channels, "Va", np.full(H.shape, 0.999), cov, nu, (), "")
    values = {"frf": frf, "payload_kg": Measured(made.payload * off(rng, 1.0))}
    return Simulated(values, {"ga_N_per_V": made.ga, "gs_V_per_m": made.gs})
