"""Records whose response is known in closed form: one resonance at 120 Hz, periodic, without noise."""

import numpy as np

FS = 2000.0  # Hz
PERIOD = 400  # samples: lines every 5 Hz
SHIFT = 10  # samples between two starts: 5 ms, a phase of 90 degrees at 50 Hz
BAND = (20.0, 300.0)  # Hz, where the responses are compared

HAMMER_FS = 2048.0  # Hz
HAMMER_HZ, HAMMER_DAMPING, HAMMER_STATIC = 150.0, 0.02, 1e-6


def H_de(f: np.ndarray) -> np.ndarray:
    """Return the response of `de` [m/V] at f [Hz]: 2 um/V, 120 Hz, 1 %."""
    return 2e-6 * 120.0**2 / (120.0**2 - f**2 + 2j * 0.01 * 120.0 * f)


def H_da(f: np.ndarray) -> np.ndarray:
    """Return the response of a second channel: half of the first, 170 Hz, 2 %."""
    return 1e-6 * 170.0**2 / (170.0**2 - f**2 + 2j * 0.02 * 170.0 * f)


def H_force(f: np.ndarray) -> np.ndarray:
    """Return the receptance [m/N] of the structure under the hammer."""
    return HAMMER_STATIC * HAMMER_HZ**2 / (HAMMER_HZ**2 - f**2 + 2j * HAMMER_DAMPING * HAMMER_HZ * f)


def record(periods: int = 9, *channels: str) -> dict[str, np.ndarray]:
    """Return t [s], Va [V] and de [m] (with "da" that too) over whole periods, in steady state: exact at each line."""
    f = np.fft.rfftfreq(PERIOD, 1.0 / FS)
    phase = np.exp(2j * np.pi * np.random.default_rng(1).random(f.size))
    drive = np.fft.irfft(phase * ((f > 0.0) & (f <= 800.0)), PERIOD)
    drive /= drive.std()  # 1 V rms, about 3 V peak: inside every range
    made = {"t": np.arange(periods * PERIOD) / FS, "Va": np.tile(drive, periods)}
    for name, H in (("de", H_de), *((c, H_da) for c in channels)):
        made[name] = np.tile(np.fft.irfft(H(f) * np.fft.rfft(drive), PERIOD), periods)
    return made


def late(samples: int = SHIFT) -> dict[str, np.ndarray]:
    """Return a record whose `de` begins some samples after `Va`: equal lengths, other starts."""
    made = record(10)
    length = 9 * PERIOD
    return {"t": made["t"][:length], "Va": made["Va"][:length], "de": made["de"][samples : samples + length]}


def response(lines: int = 200, step_Hz: float = 5.0) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [Hz] and the response of `de` [m/V]."""
    f = step_Hz * np.arange(1, lines + 1)
    return f, H_de(f)


def hits(count: int = 4) -> dict[str, np.ndarray]:
    """Return t [s], force [N] and x [m] of some hits, each decayed before the next."""
    t = np.arange(int(HAMMER_FS * (0.4 + 1.1 * count))) / HAMMER_FS
    force = np.zeros_like(t)
    for k in range(count):
        at = t - 0.2 - 1.1 * k
        force += np.where((at >= 0.0) & (at < 0.003), (80.0 + 5.0 * k) * np.sin(np.pi * at / 0.003), 0.0)
    x = np.fft.irfft(H_force(np.fft.rfftfreq(t.size, 1.0 / HAMMER_FS)) * np.fft.rfft(force), t.size)
    rng = np.random.default_rng(2)
    return {
        "t": t,
        "force": force + 1e-3 * rng.standard_normal(t.size),
        "x": x + 1e-11 * rng.standard_normal(t.size),
    }
