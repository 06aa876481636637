"""Simulated measurements of an APA outside its responses, each with the true values of its quantities.

Nothing here is shared with the checks or with the program's own simulator. What a spec states about an instrument is
drawn anew for every unit, from a normal distribution with half of the stated U.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from checks.declare import Measured
from checks.record import Record

Array = NDArray[np.float64]
Draw = np.random.Generator
UM = 1e-6
POSITIONS_MM = np.array(
    [[-29.5, 9.0], [-16.0, 9.0], [-16.0, -9.0], [-29.5, -9.0], [16.0, 9.0], [29.5, 9.0], [29.5, -9.0], [16.0, -9.0]]
)


@dataclass(frozen=True)
class Simulated:
    """What a check is given, and the true value of each of its quantities."""

    values: Mapping[str, Any]
    truth: Mapping[str, float]


def off(rng: Draw, U_percent: float) -> float:
    """Return a factor drawn from what is stated about an instrument, U in percent with k = 2."""
    return 1.0 + 0.01 * U_percent / 2.0 * float(rng.standard_normal())


def floor_noise(n: int, rng: Draw) -> Array:
    """Return noise (n,) of unit standard deviation whose power falls with the frequency, as that of a floor does."""
    f = np.fft.rfftfreq(n)
    f[0] = f[1]
    x = np.fft.irfft((rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)) / np.sqrt(f), n)
    return np.asarray(x / x.std())


# --- flatness and capacitance ----------------------------------------------------------------------------------------


def smallest_zone(points: Array) -> float:
    """Return the half-width of the minimum zone of points (N, 3), small slopes: the largest of those of four points,
    each in closed form ([BV04] 6.1: four points touch the zone)."""
    widest = 0.0
    for four in combinations(range(len(points)), 4):
        x, y, z = points[list(four)].T
        weights = np.linalg.svd(np.array([np.ones(4), x, y]))[2][-1]  # no plane is seen by them
        widest = max(widest, abs(weights @ z) / np.abs(weights).sum())
    return widest


def plane(x: Array, y: Array, z: Array) -> Array:
    """Return the least-squares slopes in x and y, and the height at the origin (3,)."""
    return np.linalg.lstsq(np.column_stack([x, y, np.ones_like(x)]), z, rcond=None)[0]


def flatness(rng: Draw) -> Simulated:
    """Two interfaces, tilted to each other, each with waves of its own; read to 0.5 um."""
    x, y = POSITIONS_MM.T * 1e-3
    tilts = rng.uniform(-150e-6, 150e-6, (2, 2))
    side = (x > 0).astype(int)
    z = tilts[side, 0] * x + tilts[side, 1] * y + rng.uniform(-2e-6, 2e-6, x.size) + 3e-6 * side * rng.uniform()
    points = np.column_stack([x, y, z])
    half = smallest_zone(points) / UM
    slopes = plane(x, y, z)
    left = z - np.column_stack([x, y, np.ones_like(x)]) @ slopes
    two = [plane(x[side == s], y[side == s], z[side == s])[:2] for s in (0, 1)]
    truth = {
        "flatness_um": half,
        "flatness_pv_um": 2.0 * half,
        "flatness_ls_pv_um": float(np.ptp(left)) / UM,
        "interface_tilt_urad": float(np.linalg.norm(two[1] - two[0])) * 1e6,
    }
    read = z / UM + 0.25 * rng.standard_normal(z.size)
    return Simulated({"z_um": list(read)}, truth)


def capacitance(rng: Draw) -> Simulated:
    """Two readings of a meter that is good to 0.5 percent."""
    truth = {"sensor_uF": rng.uniform(4.6, 5.3), "actuator_uF": rng.uniform(9.3, 10.5)}
    return Simulated({name: Measured(value * off(rng, 0.5)) for name, value in truth.items()}, truth)


# --- slow loops ------------------------------------------------------------------------------------------------------


class Plays:
    """A line and plays of growing radius: loops whose width and height have a closed form ([BS96] 2.3)."""

    def __init__(self, gain: float, share: float, largest: float, count: int = 60) -> None:
        self.gain = gain
        self.radii = largest * (np.arange(count) + 0.5) / count
        self.weights = np.full(count, gain * share / count)

    def response(self, u: Array, start: Array | None = None) -> Array:
        """Return the response (N,) to u (N,); start: of the plays (P,), by default centred on the first sample. On a
        stretch that only rises, a play is either where it was or pushed along; so on one that only falls."""
        state = np.full(self.radii.size, u[0]) if start is None else start
        turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(u))))
        plays = np.empty(u.size)
        for lo, hi in pairwise([0, *turns, u.size - 1]):
            x = u[lo : hi + 1, None]
            every = np.maximum(state, x - self.radii) if u[hi] > u[lo] else np.minimum(state, x + self.radii)
            plays[lo : hi + 1], state = every @ self.weights, every[-1]
        return self.gain * u + plays

    def settled(self, lowest: float, amplitude: float) -> Array:
        """Return the state of the plays (P,) at the lowest point of a settled loop."""
        return np.minimum(lowest + self.radii, lowest + amplitude)

    def opening(self, amplitude: float) -> float:
        """Return the opening of a settled loop at mid-drive."""
        return float(2.0 * self.weights @ np.maximum(np.minimum(self.radii, amplitude - self.radii), 0.0))

    def height(self, amplitude: float) -> float:
        """Return the peak to peak of a settled loop."""
        return float(2.0 * (self.gain * amplitude + self.weights @ np.maximum(amplitude - self.radii, 0.0)))

    def percent(self, amplitude: float) -> float:
        """Return the width of a settled loop, percent of its height."""
        return 100.0 * self.opening(amplitude) / self.height(amplitude)


def stroke(rng: Draw) -> Simulated:
    """One stack and two, three slow sines from -20 V to 150 V after others: settled loops, ends off by some 0.1 V, a
    gauge of 0.3 percent that drifts by a thousandth."""
    gauge, t = off(rng, 0.3), np.arange(0.0, 30.0, 0.01)
    drift = rng.normal(0.0, 0.1e-6) / t[-1]
    truth: dict[str, float] = {}
    values, openings = {}, []
    for key, name, stacks in (("one_stack", "one_stack", 1.0), ("two_stacks", "two_stacks", 2.0)):
        gain = stacks * rng.uniform(0.58, 0.64) * UM
        unit = Plays(gain, rng.uniform(0.15, 0.3), 90.0)
        low, high = -20.0 + 0.1 * rng.standard_normal(), 150.0 + 0.1 * rng.standard_normal()
        half = (high - low) / 2.0
        V = (low + high) / 2.0 - half * np.cos(2.0 * np.pi * t / 10.0)
        d = unit.response(V, unit.settled(low, half))
        d = gauge * (d - d[0]) + drift * t + 20e-9 * rng.standard_normal(t.size)
        values[key] = Record(t, {"V": V, "d": 1e-8 * np.round(d / 1e-8)}, {"V": "V", "d": "m"})
        truth[f"stroke_{name}_um"] = unit.height(85.0) / UM
        truth[f"stroke_hysteresis_{name}_percent"] = unit.percent(85.0)
        openings.append(unit.opening(85.0) / UM)
    truth["stroke_um"] = truth["stroke_one_stack_um"] + truth["stroke_two_stacks_um"]
    truth["stroke_hysteresis_percent"] = 100.0 * sum(openings) / truth["stroke_um"]
    return Simulated(values, truth)


def hysteresis(rng: Draw) -> Simulated:
    """Sines of 0.1 Hz about 3.25 V, two periods of each amplitude; de stored by up to a sample beside Va, Vs through a
    high-pass of the open input."""
    fs, period, centre = 100.0, 1000, 3.25
    amplitudes = (0.2, 1.0, 2.0, 4.0)
    one = np.sin(2.0 * np.pi * np.arange(2 * period) / period)
    swing = np.concatenate([a * one for a in amplitudes])
    moved = Plays(rng.uniform(20e-6, 24e-6), rng.uniform(0.15, 0.4), 4.5)
    sensed = Plays(rng.uniform(0.9, 1.1), rng.uniform(0.05, 0.3), 4.5)
    t = np.arange(swing.size) / fs
    at = t + rng.uniform(-1.0, 1.0) / fs
    de = np.interp(at, t, moved.response(swing)) + 4e-9 * rng.standard_normal(t.size)
    w = 2.0 * np.pi * 0.002 / fs
    Vs = lfilter([1.0, -1.0], [1.0, w - 1.0], sensed.response(swing)) + 1e-4 * rng.standard_normal(t.size)
    channels = {"Va": centre + swing, "de": 2.5e-9 * np.round(de / 2.5e-9), "Vs": Vs}
    truth = {
        "hysteresis_percent": moved.percent(4.0),
        "hysteresis_small_signal_percent": moved.percent(0.2),
        "sensor_hysteresis_percent": sensed.percent(4.0) - sensed.percent(0.2),
    }
    return Simulated({"record": Record(t, channels, {"Va": "V", "de": "m", "Vs": "V"})}, truth)


# --- stiffness -------------------------------------------------------------------------------------------------------


def stiffness(rng: Draw) -> Simulated:
    """Put a mass on and take it off, circuit closed and open: creep with the logarithm of time from the moment at
    which the mass lies, which takes it up to 20 ms to settle; a floor with more noise the slower it is."""
    mass, g = 6.4, 9.80665 + 0.0135 * rng.standard_normal()
    stiff = {"closed_circuit": rng.uniform(1.65, 1.9), "open_circuit": rng.uniform(2.1, 2.5)}
    creep = {"closed_circuit": rng.uniform(0.012, 0.03), "open_circuit": rng.uniform(0.004, 0.01)}
    encoder, weighed = off(rng, 0.5), Measured(mass * off(rng, 0.5))
    values: dict[str, Any] = {"mass_kg": weighed}
    t = np.arange(0.0, 30.0, 1e-2)
    for key, k in stiff.items():
        y = 8e-9 * floor_noise(t.size, rng) + 3e-9 * rng.standard_normal(t.size)
        for at, sign in ((15.0 + rng.uniform(0.0, 0.5), -1.0), (22.0 + rng.uniform(0.0, 0.5), 1.0)):
            since = np.maximum(t - at, 0.0)
            creeping = 1.0 + creep[key] * np.log10(np.maximum(since, 1e-3) / 0.1)
            lying = 1.0 - np.exp(-since / rng.uniform(1e-3, 2e-2))
            y = y + sign * mass * g / k * UM * (t > at) * creeping * lying
        values[key] = Record(t, {"de": encoder * y}, {"de": "m"})
    late = 1.0 + creep["closed_circuit"] * float(np.mean(np.log10(np.linspace(5.0, 5.5, 101) / 0.1)))
    truth = {
        "k_closed_N_per_um": stiff["closed_circuit"],
        "k_open_N_per_um": stiff["open_circuit"],
        "k_ratio": stiff["open_circuit"] / stiff["closed_circuit"],
        "k_closed_windowed_N_per_um": stiff["closed_circuit"] / late,
        "creep_per_decade_percent": 100.0 * creep["closed_circuit"],
    }
    return Simulated(values, truth)


# --- high-pass -------------------------------------------------------------------------------------------------------


def sensor_highpass(rng: Draw) -> Simulated:
    """Send a sweep from 0.1 to 10 Hz through a capacitor with its resistor, and through it with the input's own
    resistance; a resonance far above. Steps of a tenth of a sample; a clock that is off by 0.01 percent."""
    fs, seconds, finer = 100.0, 150.0, 10
    farad, ohm = rng.uniform(4.9e-6, 5.3e-6), 80600.0
    resistor = ohm * off(rng, 0.2)
    open_Hz = rng.uniform(0.02, 0.04)
    corners = {"with_resistor": 1.0 / (2.0 * np.pi * resistor * farad) + open_Hz, "without_resistor": open_Hz}
    dt = 1.0 / fs / finer
    t = np.arange(round(seconds / dt)) * dt
    rate = np.log(100.0) / seconds
    u = 0.5 * np.sin(2.0 * np.pi * 0.1 / rate * (np.exp(rate * t) - 1.0))
    w0 = 2.0 * np.pi * rng.uniform(88.0, 100.0)
    flank = np.gradient(np.gradient(u, dt), dt) / w0**2  # far below a resonance: u less its second derivative
    clock = off(rng, 0.02)
    values: dict[str, Any] = {"resistor_ohm": Measured(ohm, 0.002 * ohm)}
    for key, f in corners.items():
        a = np.tan(np.pi * f * dt)
        y = 0.05 * lfilter([1.0 / (1.0 + a), -1.0 / (1.0 + a)], [1.0, (a - 1.0) / (a + 1.0)], u - flank)
        y = y[::finer] + 1e-3 + 5e-4 * rng.standard_normal(y[::finer].size)
        values[key] = Record(clock * t[::finer], {"Va": u[::finer], "Vs": y}, {"Va": "V", "Vs": "V"})
    truth = {
        "sensor_highpass_Hz": corners["with_resistor"],
        "sensor_highpass_without_Hz": open_Hz,
        "sensor_capacitance_implied_uF": farad * 1e6,
    }
    return Simulated(values, truth)
