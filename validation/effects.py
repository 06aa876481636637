"""What can be hidden in a blind unit: every effect of [DESIGN] 6, and things that no library holds.

Each turns a world into another one, from the words of the design only; their sizes are stated beside them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from validation.bench import Bend, World
from validation.rational import Rational, highpass, lowpass, resonance
from validation.strut import AMPLIFIER_GAIN, CHANNELS, Hung

Array = NDArray[np.float64]
Values = Mapping[str, float]
Rng = np.random.Generator

DE, DA, VS = 0, 1, 2
ALL = (DE, DA, VS)
LARGEST_V = 2.0  # of the slow sines: where the width of the loop is stated


@dataclass(frozen=True)
class Hidden:
    """draw: parameters, in the units of their names; add: the world with them. alike: names that would be no lie;
    settles: fields of Strut that stay at their mean, because the effect counts from there; grows: parameters that the
    effect is about in proportion to, or (with fades) to one over, counted from `off`; none: it cannot be made weak."""

    draw: Callable[[Rng], dict[str, float]]
    add: Callable[[World, Values], World]
    grows: tuple[str, ...] = ()
    fades: tuple[str, ...] = ()
    off: float = 0.0
    alike: tuple[str, ...] = ()
    settles: tuple[str, ...] = ()

    def names(self, values: Values) -> list[str]:
        """Return the names that would be no lie; {channel} in `alike` is the channel that the values choose."""
        channel = CHANNELS[int(values.get("channel", 0))]
        return [name.format(channel=channel) for name in self.alike]

    def weaker(self, parameters: Values, factor: float) -> dict[str, float]:
        """Return the parameters of about that share of the effect."""
        small = {p: self.off + factor * (parameters[p] - self.off) for p in self.grows}
        return dict(parameters) | small | {p: parameters[p] / factor for p in self.fades}


def _strut(world: World, **fields: object) -> World:
    return replace(world, strut=replace(world.strut, **fields))


def _filter(world: World, channels: tuple[int, ...], each: Rational) -> World:
    return replace(world, filters=(*world.filters, (channels, each)))


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _log(rng: Rng, lo: float, hi: float) -> float:
    return float(np.exp(rng.uniform(np.log(lo), np.log(hi))))


def hysteresis(relative_width: float) -> Bend:
    """Return a rate-independent hysteresis: plays of every width side by side (Prandtl and Ishlinskii), all alike, so
    that loops open in proportion to the amplitude (Rayleigh). relative_width: opening at mid-voltage over the peak to
    peak, at 2 V."""
    edges = np.concatenate([[0.0], np.geomspace(2e-3, 4.0, 49)])
    width, share = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
    # a play of half-width r opens by 2 min(r, A - r) and runs through 2 (A - r); summed: c A^2 / 2 and c A^2 beside 2 A
    density = 4 * relative_width / ((1 - 2 * relative_width) * LARGEST_V)
    return lambda u: u + density * _plays(u, width, share)


def _plays(u: Array, width: Array, share: Array) -> Array:
    """Return the weighted sum (N,) of plays of half-width r, from rest: between turns each one waits, then follows."""
    turns = np.concatenate([[0], np.sort(np.concatenate([find_peaks(u)[0], find_peaks(-u)[0]])), [u.size - 1]])
    ends = np.unique(turns)
    total, play = np.zeros(u.size), np.zeros(width.size)
    steps = np.searchsorted(ends, np.arange(u.size), side="left")
    states = np.zeros((ends.size, width.size))
    for k, end in enumerate(ends):
        play = np.clip(play, u[end] - width, u[end] + width)
        states[k] = play
    for r, w, column in zip(width, share, states.T, strict=True):
        before = np.concatenate([[0.0], column])[steps]
        total += w * np.clip(before, u - r, u + r)
    return total


def saturation(limit_V: float) -> Bend:
    """Return an amplifier whose gain falls towards its rails; limit in volts of Va."""
    return lambda u: limit_V * np.tanh(u / limit_V)


def creep(per_decade: float) -> Rational:
    """Return a step response that grows by `per_decade` each decade of time, from 10 us to 1000 s: relaxations, two a
    decade."""
    tau = np.logspace(-5, 3, 17)
    share = per_decade / 2
    return Rational(-1 / tau + 0j, (share / tau)[None, :] + 0j, np.ones(1))


def _misalignment(rng: Rng) -> dict[str, float]:
    return {"dx_um": rng.uniform(-90, 90), "dy_um": _sign(rng) * rng.uniform(60, 350)}


def _axial(rng: Rng) -> dict[str, float]:
    return {"kz_N_per_um": rng.uniform(35, 50) if rng.random() < 0.7 else rng.uniform(130, 200)}


def _bench_mode(rng: Rng) -> dict[str, float]:
    while True:  # on a resonance of the strut it could not be distinguished
        f_Hz = _log(rng, 25, 350)
        if all(abs(f_Hz / own - 1) > 0.06 for own in (85.7, 191.0, 282.0)):
            return {"f_Hz": f_Hz, "ratio": _log(rng, 0.015, 0.08), "damping_ratio": _log(rng, 0.005, 0.03)}


def _bracket(rng: Rng) -> dict[str, float]:
    return {"f_Hz": _log(rng, 450, 1600), "damping_ratio": _log(rng, 0.005, 0.03)}


def _crosstalk(world: World, p: Values) -> World:
    return replace(world, crosstalk=world.crosstalk + p["V_per_V"] * AMPLIFIER_GAIN)


def _gain(world: World, channel: int, factor: float) -> World:
    return replace(world, gains=tuple(g * (factor if c == channel else 1.0) for c, g in enumerate(world.gains)))


def _loaded(world: World, kg: float) -> World:
    return _strut(world, head=world.strut.head + kg, ruler=world.strut.ruler + kg)


LIBRARY: Mapping[str, Hidden] = {
    "misalignment": Hidden(
        _misalignment, lambda w, p: _strut(w, dx=1e-6 * p["dx_um"], dy=1e-6 * p["dy_um"]), grows=("dx_um", "dy_um")
    ),
    "joint_axial_compliance": Hidden(
        _axial, lambda w, p: _strut(w, kz=1e6 * p["kz_N_per_um"]), settles=("kz",), grows=("kz_N_per_um",), off=90.0
    ),
    "loop_delay": Hidden(
        lambda rng: {"tau_us": _log(rng, 15, 150)},
        lambda w, p: replace(w, tau=w.tau + 1e-6 * p["tau_us"]),
        grows=("tau_us",),
    ),
    "amplifier_bandwidth": Hidden(
        lambda rng: {"f_Hz": _log(rng, 1500, 6000)},
        lambda w, p: replace(w, drive_filters=(*w.drive_filters, lowpass(p["f_Hz"]))),
        fades=("f_Hz",),
    ),
    "sensor_highpass": Hidden(
        lambda rng: {"f_Hz": _log(rng, 2.5, 15)}, lambda w, p: _filter(w, (VS,), highpass(p["f_Hz"])), grows=("f_Hz",)
    ),
    "crosstalk": Hidden(lambda rng: {"V_per_V": _sign(rng) * _log(rng, 0.005, 0.04)}, _crosstalk, grows=("V_per_V",)),
    "bench_mode": Hidden(
        _bench_mode,
        lambda w, p: replace(w, modes=(*w.modes, (p["f_Hz"], p["ratio"], p["damping_ratio"]))),
        grows=("ratio",),
    ),
    "encoder_bracket_mode": Hidden(_bracket, lambda w, p: _filter(w, (DE,), resonance(p["f_Hz"], p["damping_ratio"]))),
    "encoder_scale": Hidden(
        lambda rng: {"relative": _sign(rng) * rng.uniform(0.03, 0.10)},
        lambda w, p: _gain(w, DE, 1 + p["relative"]),
        grows=("relative",),
    ),
    "encoder_mass": Hidden(
        lambda rng: {"kg": _sign(rng) * rng.uniform(0.015, 0.04)},
        lambda w, p: _loaded(w, p["kg"]),
        settles=("head", "ruler"),
        grows=("kg",),
    ),
    "sensor_polarity": Hidden(lambda _: {}, lambda w, _: _gain(w, VS, -1.0)),
    "hysteresis": Hidden(
        lambda rng: {"relative_width": rng.uniform(0.03, 0.12)},
        lambda w, p: replace(w, bends=(*w.bends, hysteresis(p["relative_width"]))),
    ),
    "creep": Hidden(
        lambda rng: {"per_decade": rng.uniform(0.015, 0.04)},
        lambda w, p: replace(w, drive_filters=(*w.drive_filters, creep(p["per_decade"]))),
        grows=("per_decade",),
    ),
    "open_circuit_stiffening": Hidden(
        lambda rng: {"ratio": rng.uniform(0.3, 1.0)}, lambda w, p: _strut(w, stiffening=p["ratio"]), grows=("ratio",)
    ),
    "payload_mass": Hidden(
        lambda rng: {"kg": _sign(rng) * rng.uniform(0.35, 1.0)},
        lambda w, p: _strut(w, payload=w.strut.payload + p["kg"]),
        settles=("payload",),
        grows=("kg",),
    ),
}

# Two with nearly the same effect, or whose order the design leaves open, are not hidden together.
NEVER_TOGETHER = (
    {"loop_delay", "amplifier_bandwidth"},
    {"hysteresis", "creep"},
    {"crosstalk", "sensor_highpass"},
    {"crosstalk", "sensor_polarity"},
    {"payload_mass", "open_circuit_stiffening"},
)


def _one_channel(rng: Rng) -> dict[str, float]:
    f_Hz = _log(rng, 450, 1500)
    return {"channel": float(rng.integers(3)), "f_Hz": f_Hz, "ratio": _log(rng, 0.02, 0.06), "damping_ratio": 0.01}


def _resonant(world: World, p: Values) -> World:
    return _filter(world, (int(p["channel"]),), resonance(p["f_Hz"], p["damping_ratio"], p["ratio"], 1.0))


def _lag(world: World, p: Values) -> World:
    lags = [late + (1e-6 * p["tau_us"] if c == int(p["channel"]) else 0.0) for c, late in enumerate(world.lags)]
    return replace(world, lags=tuple(lags))


def _hung(rng: Rng) -> dict[str, float]:
    return {"kg": rng.uniform(0.004, 0.015), "f_Hz": _log(rng, 230, 900), "damping_ratio": _log(rng, 0.005, 0.02)}


OUTSIDE: Mapping[str, Hidden] = {
    "channel_resonance": Hidden(_one_channel, _resonant),  # one output times 1 + ratio w^2/(s^2 + 2 z w s + w^2)
    "channel_lag": Hidden(  # part of a sample, on one output alone
        lambda rng: {"channel": float(rng.integers(3)), "tau_us": rng.uniform(20, 80)},
        _lag,
        alike=("sample_offset", "channel_latency_{channel}"),
    ),
    "saturating_amplifier": Hidden(
        lambda rng: {"limit_V": rng.uniform(0.9, 1.6)},
        lambda w, p: replace(w, bends=(*w.bends, saturation(p["limit_V"]))),
    ),
    "cubic_spring": Hidden(
        lambda rng: {"N_per_m3": rng.uniform(2.0e13, 6.0e13)}, lambda w, p: replace(w, cubic=p["N_per_m3"])
    ),
    "second_mass_on_encoder": Hidden(_hung, lambda w, p: _strut(w, hung=Hung(p["kg"], p["f_Hz"], p["damping_ratio"]))),
    "sensor_lowpass": Hidden(
        lambda rng: {"f_Hz": _log(rng, 1200, 4000)},
        lambda w, p: _filter(w, (VS,), lowpass(p["f_Hz"])),
        alike=("channel_lowpass_Vs",),
    ),
}
