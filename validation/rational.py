"""Sums of first-order terms, for the blind bench: their response, their products, and exact steps through time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.signal import lfilter

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

FAST_HZ = 4000.0
AT_ONCE = 128  # frequencies: what stands between with a hundred poles fits into a processor's cache
SMALL = 1e-3  # |pole * step| below which the coefficients are taken from their series: the closed form cancels


@dataclass(frozen=True, eq=False)
class Rational:
    """direct + sum of residue / (s - pole), the conjugate terms implied.

    poles (P,) with imag >= 0; residues (C, P); direct (C,).
    """

    poles: Complex
    residues: Complex
    direct: Array

    def at(self, s: Complex) -> Complex:
        """Return the value (C, F) at complex frequencies s (F,) [rad/s]."""
        s = np.asarray(s, dtype=complex)
        pair = self.poles.imag > 0  # a real pole stands once, a pair twice
        poles = np.concatenate([self.poles, self.poles[pair].conj()])
        residues = np.hstack([self.residues, self.residues[:, pair].conj()])
        found = np.empty((self.direct.size, s.size), complex)
        for begin in range(0, s.size, AT_ONCE):
            part = slice(begin, begin + AT_ONCE)
            found[:, part] = residues @ (1 / (s[part] - poles[:, None]))
        return self.direct[:, None] + found

    def frf(self, f: Array) -> Complex:
        """Return the response (C, F) at frequencies f (F,) [Hz]."""
        return self.at(2j * np.pi * np.asarray(f))

    def run(self, u: Array, dt: float, every: int = 1) -> Array:
        """Return every n-th output (C, N), n = `every`, from rest, for a drive that passes smoothly through its samples
        u (N every,).

        Poles below `FAST_HZ` take exact steps for a drive that is straight between samples, lifted beforehand by what
        straight lines take away from a smooth one. Faster ones forget within the padding: the smooth drive's spectrum.
        """
        size = fft.next_fast_len(u.size + 4096, real=True)
        spectrum, cycles = fft.rfft(u, size), np.arange(size // 2 + 1) / size
        fast = np.abs(self.poles) > 2 * np.pi * FAST_HZ
        quick = Rational(self.poles[fast], self.residues[:, fast], self.direct)
        y = fft.irfft(quick.frf(cycles / dt) * spectrum, size)[:, : u.size : every]
        lifted = fft.irfft(spectrum / np.sinc(cycles) ** 2, size)[: u.size]
        for pole, residue in zip(self.poles[~fast], self.residues[:, ~fast].T, strict=True):
            new, old, decay = step(pole, dt)
            if pole.imag == 0:
                x = lfilter([new.real, old.real], [1.0, -decay.real], lifted)[::every]
                y += residue.real[:, None] * x
            else:
                x = lfilter([new, old], [1.0, -decay], lifted)[::every]
                y += 2 * (residue.real[:, None] * x.real - residue.imag[:, None] * x.imag)
        return y

    def times(self, other: "Rational", channels: Sequence[int] = (0, 1, 2)) -> "Rational":
        """Return the product with a filter of one channel, on some channels only. The two may have no pole in
        common."""
        on = np.zeros((self.direct.size, 1))
        on[list(channels)] = 1.0
        mine = self.residues * (1 - on + on * other.at(self.poles))
        theirs = on * other.residues * self.at(other.poles)
        poles = np.concatenate([self.poles, other.poles])
        direct = self.direct * (1 - on + on * other.direct)[:, 0]
        return Rational(poles, np.hstack([mine, theirs]), direct)

    def plus(self, other: "Rational") -> "Rational":
        """Return the sum of two with the same number of channels."""
        poles = np.concatenate([self.poles, other.poles])
        return Rational(poles, np.hstack([self.residues, other.residues]), self.direct + other.direct)

    def scaled(self, factors: Array) -> "Rational":
        """Return each channel times a factor (C,)."""
        return replace(self, residues=self.residues * factors[:, None], direct=self.direct * factors)


def step(pole: complex, dt: float) -> tuple[complex, complex, complex]:
    """Return the weights of the new and the old sample of a straight drive in x' = pole x + u, and the decay over one
    step."""
    a = complex(pole) * dt
    z = np.exp(a)
    if abs(a) < SMALL:
        return dt * (1 / 2 + a / 6 + a**2 / 24), dt * (1 / 2 + a / 3 + a**2 / 8), z
    return dt * (z - 1 - a) / a**2, dt * (z * (a - 1) + 1) / a**2, z


def one(real_pole: float, residue: float, direct: float) -> Rational:
    """Return a filter of one channel with one real pole [rad/s]."""
    return Rational(np.array([real_pole + 0j]), np.array([[residue + 0j]]), np.array([direct]))


def lowpass(f_Hz: float) -> Rational:
    """Return a first-order low-pass, 1 / (1 + s / w)."""
    w = 2 * np.pi * f_Hz
    return one(-w, w, 0.0)


def highpass(f_Hz: float) -> Rational:
    """Return a first-order high-pass, s / (s + w)."""
    w = 2 * np.pi * f_Hz
    return one(-w, -w, 1.0)


def resonance(f_Hz: float, zeta: float, gain: float = 1.0, direct: float = 0.0) -> Rational:
    """Return a resonance, direct + gain w^2 / (s^2 + 2 zeta w s + w^2), zeta < 1."""
    w = 2 * np.pi * f_Hz
    damped = w * np.sqrt(1 - zeta**2)
    pole = -zeta * w + 1j * damped
    return Rational(np.array([pole]), np.array([[gain * w**2 / (2j * damped)]]), np.array([direct]))


def highpass_of_second_order(f_Hz: float, zeta: float) -> Rational:
    """Return s^2 / (s^2 + 2 zeta w s + w^2), zeta < 1."""
    w = 2 * np.pi * f_Hz
    pole = w * complex(-zeta, np.sqrt(1 - zeta**2))
    residue = -(2 * zeta * w * pole + w**2) / (pole - pole.conjugate())
    return Rational(np.array([pole]), np.array([[residue]]), np.ones(1))


def butterworth(f_Hz: float, order: int) -> Rational:
    """Return the Butterworth low-pass, |H| = 1 / sqrt(1 + (f / f_Hz)^(2 order))."""
    w = 2 * np.pi * f_Hz
    poles = w * np.exp(1j * np.pi * (2 * np.arange(1, order + 1) + order - 1) / (2 * order))
    poles[np.abs(poles.imag) < 1e-9 * w] = -w
    residues = [w**order / np.prod([p - q for q in poles if q != p]) for p in poles]
    upper = poles.imag >= 0
    return Rational(poles[upper], np.array(residues)[None, upper], np.zeros(1))


def shelf(zero_Hz: float, pole_Hz: float) -> Rational:
    """Return (s + z) / (s + p): one far above both corners, z / p far below."""
    z, p = 2 * np.pi * zero_Hz, 2 * np.pi * pole_Hz
    return one(-p, z - p, 1.0)


def in_channels(each: Rational, gains: Sequence[float]) -> Rational:
    """Return a filter of one channel as a path into three, with a gain for each."""
    share = np.array(gains, dtype=float)[:, None]
    return Rational(each.poles, share * each.residues, (share * each.direct)[:, 0])
