"""Benches as laboratories have them, in the words of their measurements: every unit of a bench shares what it adds.

A bench samples its channels some microseconds apart, its amplifier and sometimes a filter take magnitude and phase, its
gains are a little off and move, its mains hum, its encoder interpolates, its guide may give way, and a third of the
benches do something that is on no list. Sizes are stated beside the draws.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.bench import Array, Change, Curve, Drifting, Sampling, Setting, World, frf
from validation.rational import Rational, butterworth, in_channels, lowpass, resonance
from validation.strut import CHANNELS, Support, nominal, priors

Rng = np.random.Generator

ALL = (0, 1, 2)
PIVOT_HZ = 100.0  # where a fractional power is one
NUISANCES = ("dispersion", "two_modes", "drifting_mode")
SEEN_LATENCY_US = 2.0  # what is less is no property that a name could stand for


@dataclass(frozen=True)
class Bench:
    """What one bench adds to every strut. latency_us (3,): of de, da, Vs against Va; amplifier: f_Hz and, of second
    order, damping_ratio; antialias: channel, f_Hz, order; gains (3,); drift (3,): largest change of a gain, within a
    record or between records; support: a guide that gives way; nuisance: of NUISANCES, with its values."""

    latency_us: tuple[float, float, float]
    amplifier: Mapping[str, float]
    antialias: Mapping[str, float]
    gains: tuple[float, float, float]
    drift: tuple[float, float, float]
    drifts_within: bool
    mains_m: float
    mains_V: float
    mains_lines: tuple[tuple[float, float], ...]
    interpolation_m: float
    period_m: float
    support: Support | None = None
    nuisance: str | None = None
    values: Mapping[str, Any] = field(default_factory=dict)

    def hold(self, world: World) -> World:
        """Return the world on this bench."""
        strut = world.strut if self.support is None else replace(world.strut, support=self.support)
        gains = tuple(a * b for a, b in zip(world.gains, self.gains, strict=True))
        lags = tuple(a + 1e-6 * b for a, b in zip(world.lags, self.latency_us, strict=True))
        f_Hz, zeta = self.amplifier["f_Hz"], self.amplifier.get("damping_ratio")
        amplifier = lowpass(f_Hz) if zeta is None else resonance(f_Hz, zeta)
        held = replace(
            world,
            strut=strut,
            gains=gains,
            lags=lags,
            drive_filters=(*world.drive_filters, amplifier),
            changes=(*world.changes, drifting_gains(self.drift, self.drifts_within)),
        )
        if self.antialias:
            each = butterworth(self.antialias["f_Hz"], int(self.antialias["order"]))
            held = replace(held, filters=(*held.filters, ((int(self.antialias["channel"]),), each)))
        return held if self.nuisance is None else _NUISANCES[self.nuisance](held, self.values)

    def record_with(self, day: Setting) -> Setting:
        """Return the state of a day with this bench's hum and encoder."""
        return replace(
            day,
            mains_m=self.mains_m,
            mains_V=self.mains_V,
            mains_lines=self.mains_lines,
            interpolation_m=self.interpolation_m,
            period_m=self.period_m,
        )

    def truth(self) -> dict[str, Any]:
        return asdict(self)

    @property
    def names(self) -> list[str]:
        """Return the names that are right for this bench, if its model knows nothing of it."""
        late = [c for c, us in zip(CHANNELS, self.latency_us, strict=True) if us > SEEN_LATENCY_US]
        names = [f"channel_latency_{c}" for c in late] + (["loop_delay"] if len(late) == len(CHANNELS) else [])
        names.append("amplifier_second_order" if "damping_ratio" in self.amplifier else "amplifier_bandwidth")
        names += [f"channel_lowpass_{CHANNELS[int(self.antialias['channel'])]}"] if self.antialias else []
        moves = self.support is not None or self.nuisance in ("two_modes", "drifting_mode")
        return sorted(names + (["support_mode"] if moves else []))


def drifting_gains(size: tuple[float, float, float], within: bool) -> Change:
    """Return the change of outputs whose gains move by up to `size` in a record, in proportion to time, or from record
    to record."""

    def change(y: Array, s: Sampling) -> Array:
        drawn = np.array(size)[:, None] * s.rng.uniform(-1, 1, (3, 1))
        return y * (1 + drawn * (np.linspace(-0.5, 0.5, y.shape[1]) if within else 0.5))

    return change


def power_of_frequency(exponent: float) -> Curve:
    """Return the factor (i f / PIVOT_HZ)^exponent: the same phase at every frequency, as losses and relaxations of
    every time constant give it. Below 1 Hz it stays what it is there."""

    def curve(f: Array) -> NDArray[np.complex128]:
        factor = (1j * np.maximum(f, 1.0) / PIVOT_HZ) ** exponent
        return np.where(f == 0, np.abs(factor), factor)

    return curve


def modes_of(values: Mapping[str, Any]) -> tuple[Rational, ...]:
    """Return the modes beside the strut's own: f_Hz, damping_ratio and gains (3,) of each."""
    rows = zip(values["f_Hz"], values["damping_ratio"], values["gains"], strict=True)
    return tuple(in_channels(resonance(f_Hz, zeta), gains) for f_Hz, zeta, gains in rows)


def gains_for(f_Hz: float, zeta: float, peaks: Array) -> tuple[float, ...]:
    """Return the gains (3,) far below a mode that peaks (3,) at so many parts of the mean strut's own there."""
    own = np.abs(frf(World(nominal()), np.array([f_Hz]))[:, 0])
    return tuple(float(x) for x in 2 * zeta * peaks * own)


def draw_modes(rng: Rng, number: int, from_Hz: float, to_Hz: float, peak: tuple[float, float]) -> dict[str, Any]:
    """Return close modes, each seen by every channel to another extent."""
    first = float(rng.uniform(from_Hz, to_Hz))
    f_Hz = [first * float(np.prod(1 + rng.uniform(0.02, 0.05, k))) for k in range(number)]
    zeta = [float(rng.uniform(0.006, 0.02)) for _ in f_Hz]
    peaks = [rng.uniform(*peak, 3) * rng.choice([-1.0, 1.0], 3) for _ in f_Hz]
    gains = [gains_for(f, z, p) for f, z, p in zip(f_Hz, zeta, peaks, strict=True)]
    return {"f_Hz": f_Hz, "damping_ratio": zeta, "gains": gains}


def _dispersion(world: World, values: Mapping[str, Any]) -> World:
    channels = tuple(int(c) for c in values["channels"])
    return replace(world, curves=(*world.curves, (channels, power_of_frequency(values["exponent"]))))


def _two_modes(world: World, values: Mapping[str, Any]) -> World:
    return replace(world, added=(*world.added, *modes_of(values)))


def _drifting_mode(world: World, values: Mapping[str, Any]) -> World:
    (f_Hz,), (zeta,), (gains,) = (values[k] for k in ("f_Hz", "damping_ratio", "gains"))
    return replace(world, drifting=(*world.drifting, Drifting(f_Hz, zeta, gains, values["relative"])))


_NUISANCES: Mapping[str, Callable[[World, Mapping[str, Any]], World]] = {
    "dispersion": _dispersion,
    "two_modes": _two_modes,
    "drifting_mode": _drifting_mode,
}


def _draw_nuisance(rng: Rng, nuisance: str | None) -> dict[str, Any]:
    match nuisance:
        case "dispersion":  # 2 to 6 % of magnitude from 10 to 2000 Hz, up to 1 degree
            channels = ALL if rng.random() < 0.5 else (int(rng.integers(3)),)
            return {"channels": channels, "exponent": float(-rng.uniform(0.004, 0.012))}
        case "two_modes":  # peaks of 3 to 12 % of the response beside them
            return draw_modes(rng, 2, 420, 900, (0.03, 0.12))
        case "drifting_mode":
            moved = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.005, 0.02))
            return draw_modes(rng, 1, 420, 900, (0.03, 0.12)) | {"relative": moved}
    return {}


def draw_support(rng: Rng) -> Support:
    """Return a guide with its modes at 400 to 700 Hz, were the strut not there; the strut passes the payload's centre
    of mass within a millimetre."""
    mass = priors()["payload"][0]
    inertia = float(np.exp(rng.uniform(np.log(0.05), np.log(1.0))))
    lateral, tilt = rng.uniform(400, 680, 2)
    near = 1 + np.array([0.0, 0.03, 0.0, 0.03]) * rng.uniform(-1, 1, 4)
    k = (2 * np.pi * np.array([lateral, lateral, tilt, tilt]) * near) ** 2 * [mass, mass, inertia, inertia]
    x, y, read_x, read_y = (float(v) for v in rng.normal(0.0, 0.5e-3, 4))
    return Support(
        *(float(v) for v in k),
        krz=float(k[2]),
        inertia=(inertia, inertia, inertia),
        damping_ratio=float(rng.uniform(0.005, 0.02)),
        axis_x=x,
        axis_y=y,
        height=float(rng.uniform(0.0, 0.05)),
        read_x=read_x,
        read_y=read_y,
    )


def draw_bench(rng: Rng, yields: bool, nuisance: str | None) -> Bench:
    """Draw a bench. yields: whether its guide gives way."""
    second = rng.random() < 0.4
    amplifier = (
        {"f_Hz": float(rng.uniform(6e3, 15e3)), "damping_ratio": float(rng.uniform(0.5, 0.9))}
        if second
        else {"f_Hz": float(rng.uniform(6e3, 20e3))}
    )
    filtered = rng.random() < 0.5
    antialias = {
        "channel": int(rng.integers(3)),
        "f_Hz": float(rng.uniform(5e3, 14e3)),
        "order": 2 * int(rng.integers(1, 3)),
    }
    hum = float(rng.uniform(49.95, 50.05))
    return Bench(
        latency_us=_three(rng.uniform(0.0, 20.0, 3)),
        amplifier=amplifier,
        antialias=antialias if filtered else {},
        gains=_three(rng.normal(1.0, 0.005, 3)),
        drift=_three(rng.uniform(0.001, 0.01, 3)),
        drifts_within=bool(rng.integers(2)),
        mains_m=float(rng.uniform(0.5e-9, 4e-9)),
        mains_V=float(rng.uniform(0.5e-3, 4e-3)),
        mains_lines=tuple((k * hum, share) for k, share in ((1, 1.0), (2, 0.2), (3, 0.5), (5, 0.3), (7, 0.1))),
        interpolation_m=float(rng.uniform(6e-9, 12e-9)),
        period_m=float(np.exp(rng.uniform(np.log(0.5e-6), np.log(4e-6)))),
        support=draw_support(rng) if yields else None,
        nuisance=nuisance,
        values=_draw_nuisance(rng, nuisance),
    )


def _three(values: Array) -> tuple[float, float, float]:
    a, b, c = (float(v) for v in values)
    return a, b, c


def draw_benches(number: int, rng: Rng) -> list[Bench]:
    """Draw benches: the guide of every second one gives way, every nuisance in one of six, in random order."""
    yields = rng.permutation(np.arange(number) % 2 == 0)
    order = rng.permutation(number)
    nuisance = [NUISANCES[k % 6] if k % 6 < len(NUISANCES) else None for k in order]
    return [draw_bench(rng, bool(y), n) for y, n in zip(yields, nuisance, strict=True)]
