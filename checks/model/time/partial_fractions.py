"""The whole path from the converter's volts to one channel as a sum over poles, for exact steps in time.

y = direct u + sum over p of Re(residues[p] x_p),   x_p' = poles[p] x_p + u. Of a conjugate pair only one pole is kept;
its residue is doubled. The delay is apart: it is no fraction."""

from dataclasses import dataclass
from functools import reduce

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.model.channel_paths import lowpass_poles
from checks.model.dynamics.complex_modes import FAST, Modal
from checks.model.electrical import PICKUP_TO_HZ, electrical_of
from checks.model.model import Model, Values
from checks.model.unidentified import Pair, element_of

STILL = 1e-12  # of the largest part: a pole that shows less is not worth its time


@dataclass(frozen=True, eq=False)
class Fractions:
    """poles (P,) [rad/s] complex, residues (P,) [unit per second per input], direct [unit per input]."""

    poles: Complex
    residues: Complex
    direct: float

    def at(self, s: Complex) -> Complex:
        """Return the value (S,) at s (S,) [rad/s]. Each member of a pair counts half, which is valid for every s."""
        pair = np.where(self.poles.imag == 0.0, 1.0, 0.5)
        one = (self.residues * pair) @ (1.0 / (s - self.poles[:, None]))
        other = (np.conj(self.residues) * (1.0 - pair)) @ (1.0 / (s - np.conj(self.poles)[:, None]))
        return np.asarray(self.direct + one + other)

    def plus(self, other: "Fractions") -> "Fractions":
        poles, residues = (np.concatenate(p) for p in zip(self.parts(), other.parts(), strict=True))
        return Fractions(poles, residues, self.direct + other.direct)

    def times(self, other: "Fractions") -> "Fractions":
        """Return both in series; they may have no pole in common."""
        residues = np.concatenate([self.residues * other.at(self.poles), other.residues * self.at(other.poles)])
        return Fractions(np.concatenate([self.poles, other.poles]), residues, self.direct * other.direct)

    def scaled(self, factor: float) -> "Fractions":
        return Fractions(self.poles, factor * self.residues, factor * self.direct)

    def static(self) -> float:
        return float(self.at(np.zeros(1, dtype=complex))[0].real)

    def held(self, u: Array, fs: float, late: float = 0.0) -> Array:
        """Return the exact response (N,) from rest to u (N,), each sample held until the next, delayed by so many
        seconds. Read at the tick itself (late = 0), u and its immediate answer have changed."""
        ticks = int(np.ceil(late * fs - 1e-9))
        since = ticks / fs - late  # a reading at tick n is taken this long after tick n - ticks, as the path sees it
        y = self.direct * u
        share = np.abs(self.residues / self.poles)
        kept = share > STILL * max(float(share.max(initial=0.0)), abs(self.direct))
        for p, r in zip(self.poles[kept], self.residues[kept], strict=True):  # the others add nothing that shows
            from scipy.signal import lfilter  # loads slowly: only when wanted

            x = lfilter([0.0, np.expm1(p / fs) / p], [1.0, -np.exp(p / fs)], u.astype(complex))
            y += (r * (np.exp(p * since) * x + np.expm1(p * since) / p * u)).real
        return np.concatenate([np.zeros(min(ticks, u.size)), y[: u.size - min(ticks, u.size)]])

    def parts(self) -> tuple[Complex, Complex]:
        return self.poles, self.residues


def real_pole(w: float, highpass: bool = False) -> Fractions:
    """Return a low-pass w / (s + w) or a high-pass s / (s + w)."""
    rate = -w if highpass else w
    return Fractions(np.array([-w + 0j]), np.array([rate + 0j]), 1.0 if highpass else 0.0)


def oscillator(f_Hz: float, damping_ratio: float, highpass: bool = False) -> Fractions:
    """Return w^2 / (s^2 + 2 z w s + w^2), or s^2 over the same, z below one."""
    w = 2.0 * np.pi * f_Hz
    p = w * complex(-damping_ratio, np.sqrt(1.0 - damping_ratio**2))
    over = p * p if highpass else w * w
    return Fractions(np.array([p]), np.array([2.0 * over / (2j * p.imag)]), 1.0 if highpass else 0.0)


def pair(pole: Pair, zero: Pair) -> Fractions:
    """Return a zero over a pole, each 1 + 2 z s / w + (s / w)^2 with a frequency [Hz] and a damping ratio."""
    w, v = 2.0 * np.pi * pole[0], 2.0 * np.pi * zero[0]
    p = w * complex(-pole[1], np.sqrt(1.0 - pole[1] ** 2))
    at_pole = 1.0 + 2.0 * zero[1] * p / v + (p / v) ** 2
    return Fractions(np.array([p]), np.array([2.0 * at_pole * w * w / (2j * p.imag)]), (w / v) ** 2)


def paths(model: Model) -> dict[str, Fractions]:
    """Return for every channel the path from Va at the DAC to it, without the delay. Raises ModelError."""
    values, form = model.values, model.modal()
    e = electrical_of(values)
    forces = {c: _motion_fractions(form, c).scaled(e.gain * e.ga) for c in form.channels}
    mode: Fractions | None = None
    if ratio := values["bench.mode_ratio"]:
        bench = oscillator(values["bench.mode_Hz"], values["bench.mode_damping_ratio"])
        mode = bench.scaled(ratio * forces["da"].static())
    out = {}
    for channel, motion in forces.items():
        own = motion
        if ratio := values[f"bench.support_mode_ratio_{channel}"]:
            support = oscillator(values["bench.support_mode_Hz"], values["bench.support_mode_damping_ratio"])
            own = motion.plus(support.scaled(ratio * motion.static()))
        measured = _sensor(own, values) if channel == "Vs" else own.plus(mode) if mode else own
        measured = _encoder_fractions(measured, values) if channel == "de" else measured
        if (own_element := element_of(values, channel)) is not None:
            measured = reduce(Fractions.times, map(pair, own_element.poles, own_element.zeros), measured).scaled(
                own_element.gain
            )
        out[channel] = reduce(Fractions.times, _filters(values, channel), measured)
    return out


def _filters(values: Values, channel: str) -> list[Fractions]:
    """Return the filters that a channel's signal passes in turn: the amplifier, and the low-pass of its converter."""
    e = electrical_of(values)
    passed = [] if np.isinf(e.amplifier_Hz) else [real_pole(2.0 * np.pi * e.amplifier_Hz)]
    if np.isfinite(e.second_order[0]):
        passed.append(oscillator(*e.second_order))
    corner_Hz, order = values[f"bench.lowpass_{channel}_Hz"], values[f"bench.lowpass_{channel}_order"]
    if np.isinf(corner_Hz):
        return passed
    if order != round(order):
        raise ModelError(f"bench.lowpass_{channel}_order is {order:g}: only a filter of a whole order runs in time")
    for p in (p for p in lowpass_poles(round(order)) if p.imag > -1e-9):
        is_real = abs(p.imag) < 1e-9
        passed.append(real_pole(2.0 * np.pi * corner_Hz) if is_real else oscillator(corner_Hz, -p.real))
    return passed


def _motion_fractions(form: Modal, channel: str) -> Fractions:
    slow, c = np.abs(form.mu) > FAST, form.index(channel)
    weight = np.where(form.paired, 2.0, 1.0)
    poles = 1.0 / form.mu[slow]
    at_once = -float(weight[~slow] @ form.residues[~slow, c].real)
    return Fractions(poles, weight[slow] * form.residues[slow, c] * poles, at_once)


def _sensor(own: Fractions, values: Values) -> Fractions:
    e = electrical_of(values)
    own = own.scaled(e.gs)
    if e.highpass_Hz:
        own = own.times(real_pole(2.0 * np.pi * e.highpass_Hz, highpass=True))
    if e.charge_highpass[0]:
        own = own.times(oscillator(*e.charge_highpass, highpass=True))
    own = Fractions(own.poles, own.residues, own.direct + e.crosstalk * e.gain)
    if e.pickup:
        end = 2.0 * np.pi * PICKUP_TO_HZ
        own = own.plus(real_pole(end, highpass=True).scaled(e.pickup * e.gain * end))
    return own


def _encoder_fractions(own: Fractions, values: Values) -> Fractions:
    f_Hz = values.get("encoder.bracket_Hz", np.inf)
    if np.isfinite(f_Hz):
        own = own.times(oscillator(f_Hz, values["encoder.bracket_damping_ratio"]))
    return own.scaled(1.0 + values.get("encoder.scale", 0.0))
