"""What else goes wrong in a laboratory, written without knowledge of the library that is tested.

Each kind turns a world into another one. `alike`: names that would be no lie, because they mean the same physics
({channel}: of the channel that it is in); for the kinds without, any name is false. Draws are well above noise and the
tolerance of one percent: what it changes in some channel and band is at least five times the two together (tested).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from validation.bench import Array, Change, Curve, Drive, Law, Sampling, World
from validation.benches import draw_modes, modes_of, power_of_frequency
from validation.rational import (
    Rational,
    butterworth,
    highpass,
    highpass_of_second_order,
    in_channels,
    resonance,
    shelf,
)
from validation.strut import AMPLIFIER_GAIN, CHANNELS, Hung, Support

Values = Mapping[str, float]
Rng = np.random.Generator

DE, DA, VS = 0, 1, 2
ALONE_IN_VS = (0.0, 0.0, 1.0)
PICKUP_TO_HZ = 30e3  # what picks up a derivative has an end as well
RECORD_GAP_S = 20.0  # from the beginning of a record to that of the next
RIGID_HZ = 4000.0  # a payload that only tilts


@dataclass(frozen=True)
class Outsider:
    """draw: parameters, in the units of their names; add: the world with them; alike: names that would be no lie."""

    draw: Callable[[Rng], dict[str, float]]
    add: Callable[[World, Values], World]
    alike: tuple[str, ...] = ()

    def names(self, parameters: Values) -> list[str]:
        """Return the names that are right for these parameters."""
        channel = CHANNELS[int(parameters.get("channel", VS))]
        return [name.format(channel=channel) for name in self.alike]


def _log(rng: Rng, lo: float, hi: float) -> float:
    return float(np.exp(rng.uniform(np.log(lo), np.log(hi))))


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _any_channel(rng: Rng) -> float:
    return float(rng.integers(3))


def _filtered(world: World, channel: float, each: Rational) -> World:
    return replace(world, filters=(*world.filters, ((int(channel),), each)))


def _shaped(world: World, channel: float, curve: Curve) -> World:
    return replace(world, curves=(*world.curves, ((int(channel),), curve)))


def _changed(world: World, change: Change) -> World:
    return replace(world, changes=(*world.changes, change))


def _driven(world: World, drive: Drive) -> World:
    return replace(world, drives=(*world.drives, drive))


def _added(world: World, *paths: Rational) -> World:
    return replace(world, added=(*world.added, *paths))


# --- converters and their timing --------------------------------------------------------------------------------------


def late(seconds: float) -> Curve:
    return lambda f: np.exp(-2j * np.pi * f * seconds)


def echo(share: float, seconds: float) -> Curve:
    """Return what a copy of the signal, `share` of it and late, adds."""
    return lambda f: 1 + share * np.exp(-2j * np.pi * f * seconds)


def moving_average(seconds: float) -> Curve:
    """Return the mean over the last so many seconds."""
    return lambda f: np.sinc(f * seconds) * np.exp(-1j * np.pi * f * seconds)


def hold(rate_Hz: float) -> Drive:
    """Return a drive that is held from one step of a slower controller to the next."""

    def drive(u: Array, dt: float) -> Array:
        every = max(round(1 / (rate_Hz * dt)), 1)
        return np.repeat(u[::every], every)[: u.size]

    return drive


def jitter(channel: int, seconds: float) -> Change:
    """Return the samples of a channel taken at the wrong times, independent from sample to sample (1 sd)."""

    def change(y: Array, s: Sampling) -> Array:
        moved = y.copy()
        moved[channel] += np.gradient(y[channel]) * s.fs * seconds * s.rng.standard_normal(y.shape[1])
        return moved

    return change


def interpolated(channel: int, block_s: float, per_second: float) -> Change:
    """Return a channel whose lost blocks were filled with straight lines."""

    def change(y: Array, s: Sampling) -> Array:
        n, size, filled = y.shape[1], max(int(block_s * s.fs), 2), y.copy()
        for start in s.rng.integers(1, n - size - 1, max(int(per_second * n / s.fs), 1)):
            ends = filled[channel, [start - 1, start + size]]
            filled[channel, start : start + size] = np.linspace(*ends, size + 2)[1:-1]
        return filled

    return change


# --- amplifier, sensors, cables ---------------------------------------------------------------------------------------


def slew_limit(V_per_s: float) -> Drive:
    """Return a drive that follows no faster than so many volts of Va per second."""

    def drive(u: Array, dt: float) -> Array:
        most, now, out = V_per_s * dt, float(u[0]), []
        for wanted in u.tolist():
            now += min(max(wanted - now, -most), most)
            out.append(now)
        return np.array(out)

    return drive


def dead_zone(channel: int, half_width: float) -> Change:
    """Return a channel that stays at zero as long as its signal is small."""

    def change(y: Array, _: Sampling) -> Array:
        moved = y.copy()
        moved[channel] = np.sign(y[channel]) * np.maximum(np.abs(y[channel]) - half_width, 0.0)
        return moved

    return change


def compressed(channel: int, volts: float) -> Change:
    """Return a channel that bends towards an end at so many volts."""

    def change(y: Array, _: Sampling) -> Array:
        moved = y.copy()
        moved[channel] = volts * np.arctan(y[channel] / volts)
        return moved

    return change


def drifting(channels: tuple[int, ...], relative: float, tau_s: float) -> Change:
    """Return channels whose gain settles to 1 + relative with a time constant, from the first record on."""

    def change(y: Array, s: Sampling) -> Array:
        t = s.index * RECORD_GAP_S + np.arange(y.shape[1]) / s.fs
        factor = np.ones(y.shape)
        factor[list(channels)] += relative * (1 - np.exp(-t / tau_s))
        return y * factor

    return change


def wandering(channel: int, relative: float, period_s: float) -> Change:
    """Return a channel whose gain goes up and down by `relative`, slowly, as a cable that is moved."""

    def change(y: Array, s: Sampling) -> Array:
        t = np.arange(y.shape[1]) / s.fs
        factor = np.ones(y.shape)
        factor[channel] += relative * np.sin(2 * np.pi * t / period_s + s.rng.uniform(0, 2 * np.pi))
        return y * factor

    return change


def gain_step(channel: int, relative: float) -> Change:
    """Return a channel with another gain in every second record, as a plug that touches differently."""

    def change(y: Array, s: Sampling) -> Array:
        factor = np.ones((3, 1))
        factor[channel] += relative * (s.index % 2)
        return y * factor

    return change


def play(channel: int, half_width: float) -> Change:
    """Return a channel whose scale slips in its clamp: it follows only when it is pulled beyond the play."""

    def change(y: Array, _: Sampling) -> Array:
        now, out = 0.0, []
        for x in y[channel].tolist():
            now = min(max(now, x - half_width), x + half_width)
            out.append(now)
        moved = y.copy()
        moved[channel] = out
        return moved

    return change


def _pickup(world: World, p: Values) -> World:
    """Add the derivative of the amplifier's output to Vs, up to 30 kHz."""
    slope = AMPLIFIER_GAIN * 1e-6 * p["V_us_per_V"] * 2 * np.pi * PICKUP_TO_HZ
    return _added(world, in_channels(highpass(PICKUP_TO_HZ), [slope * g for g in ALONE_IN_VS]))


def _neighbour(world: World, p: Values) -> World:
    """Add what a neighbouring strut, which hangs on the same payload, puts into the cable of Vs: its own axial and
    bending mode."""
    axial = resonance(p["f_Hz"], p["damping_ratio"])
    bending = resonance(p["bending_Hz"], p["damping_ratio"])
    both = ((axial, p["V_per_V"]), (bending, 0.3 * p["V_per_V"]))
    return _added(world, *(in_channels(mode, [size * g for g in ALONE_IN_VS]) for mode, size in both))


# --- bench and payload ------------------------------------------------------------------------------------------------


def _tilt(world: World, p: Values) -> World:
    """Let the payload tilt about its centre of mass, which the strut's axis misses."""
    inertia = p["inertia_kg_m2"]
    turning = (2 * np.pi * p["f_Hz"]) ** 2 * inertia
    stiff = (2 * np.pi * RIGID_HZ) ** 2
    held = world.strut.support or Support(
        stiff * world.strut.payload,
        stiff * world.strut.payload,
        turning,
        1.1 * turning,
        stiff * inertia,
        (inertia, inertia, inertia),
        p["damping_ratio"],
    )
    tilting = replace(
        held,
        krx=turning,
        kry=1.1 * turning,
        inertia=(inertia, inertia, inertia),
        axis_x=1e-3 * p["axis_x_mm"],
        axis_y=1e-3 * p["axis_y_mm"],
        read_x=1e-3 * p["read_mm"],
    )
    return replace(world, strut=replace(world.strut, support=tilting))


def _close_modes(rng: Rng) -> dict[str, float]:
    modes = draw_modes(rng, 2, 130, 700, (0.3, 0.9))
    flat = {f"{k}_{i}": modes[k][i] for k in ("f_Hz", "damping_ratio") for i in range(2)}
    return flat | {f"gain_{c}_{i}": modes["gains"][i][k] for i in range(2) for k, c in enumerate(CHANNELS)}


def _with_close_modes(world: World, p: Values) -> World:
    values = {k: [p[f"{k}_{i}"] for i in range(2)] for k in ("f_Hz", "damping_ratio")}
    return _added(world, *modes_of(values | {"gains": [[p[f"gain_{c}_{i}"] for c in CHANNELS] for i in range(2)]}))


def friction(newton: float, stiffness: float) -> Law:
    """Return a guide that sticks and slips (Dahl): its force follows the motion as a spring until it slips."""

    def law() -> Callable[[float], float]:
        held = 0.0
        before = 0.0

        def force(x: float) -> float:
            nonlocal held, before
            step, before = x - before, x
            held += stiffness * (step - abs(step) * held / newton)
            held = min(max(held, -newton), newton)
            return -held

        return force

    return law


def contact(stiffness: float, at_m: float) -> Law:
    """Return what a contact takes away that opens beyond so much motion to one side: there the payload is softer."""

    def law() -> Callable[[float], float]:
        return lambda x: stiffness * max(x - at_m, 0.0)

    return law


OUTSIDERS: Mapping[str, Outsider] = {
    "antialias_of_fourth_order": Outsider(
        lambda rng: {"channel": _any_channel(rng), "f_Hz": _log(rng, 1500, 3500)},
        lambda w, p: _filtered(w, p["channel"], butterworth(p["f_Hz"], 4)),
        ("channel_lowpass_{channel}",),
    ),
    "skew_of_one_channel": Outsider(
        lambda rng: {"channel": _any_channel(rng), "tau_us": _sign(rng) * rng.uniform(20, 70)},
        lambda w, p: _shaped(w, p["channel"], late(1e-6 * p["tau_us"])),
        ("channel_latency_{channel}",),
    ),
    "resonant_amplifier": Outsider(
        lambda rng: {"f_Hz": _log(rng, 1500, 3500), "damping_ratio": rng.uniform(0.15, 0.6)},
        lambda w, p: replace(w, drive_filters=(*w.drive_filters, resonance(p["f_Hz"], p["damping_ratio"]))),
        ("amplifier_second_order",),
    ),
    "highpass_of_second_order": Outsider(
        lambda rng: {"f_Hz": _log(rng, 4, 12), "damping_ratio": rng.uniform(0.5, 0.9)},
        lambda w, p: _filtered(w, VS, highpass_of_second_order(p["f_Hz"], p["damping_ratio"])),
        ("charge_highpass",),
    ),
    "tilting_payload": Outsider(
        lambda rng: {
            "f_Hz": rng.uniform(110, 320),
            "damping_ratio": rng.uniform(0.005, 0.02),
            "inertia_kg_m2": _log(rng, 0.02, 0.06),
            "axis_x_mm": _sign(rng) * rng.uniform(3, 8),
            "axis_y_mm": _sign(rng) * rng.uniform(3, 8),
            "read_mm": rng.uniform(-5, 5),
        },
        _tilt,
        ("support_mode", "bench_mode"),
    ),
    "two_close_modes": Outsider(_close_modes, _with_close_modes, ("support_mode", "bench_mode")),
    "tuned_mass_on_payload": Outsider(
        lambda rng: {
            "kg": rng.uniform(0.05, 0.2),
            "f_Hz": _log(rng, 130, 500),
            "damping_ratio": rng.uniform(0.005, 0.02),
        },
        lambda w, p: replace(w, strut=replace(w.strut, tuned=Hung(p["kg"], p["f_Hz"], p["damping_ratio"]))),
        ("support_mode", "bench_mode"),
    ),
    "pickup_of_the_derivative": Outsider(
        lambda rng: {"V_us_per_V": _sign(rng) * _log(rng, 2.0, 8.0)}, _pickup, ("crosstalk", "sensor_pickup")
    ),
    "neighbour_in_vs": Outsider(
        lambda rng: {
            "V_per_V": _sign(rng) * _log(rng, 0.05, 0.2),
            "f_Hz": rng.uniform(60, 120),
            "bending_Hz": rng.uniform(200, 450),
            "damping_ratio": rng.uniform(0.005, 0.015),
        },
        _neighbour,
        ("crosstalk",),
    ),
    "leaking_charge_amplifier": Outsider(
        lambda rng: {"zero_Hz": _log(rng, 1, 4), "pole_Hz": _log(rng, 8, 20)},
        lambda w, p: _filtered(w, VS, shelf(p["zero_Hz"], p["pole_Hz"])),
        ("sensor_highpass",),
    ),
    "moving_average": Outsider(
        lambda rng: {"channel": _any_channel(rng), "samples": float(rng.integers(3, 7))},
        lambda w, p: _shaped(w, p["channel"], moving_average(1e-4 * p["samples"])),
        ("channel_lowpass_{channel}", "channel_latency_{channel}"),
    ),
    "hold_of_another_rate": Outsider(
        lambda rng: {"rate_Hz": float(rng.choice([2500.0, 4000.0, 5000.0]))},
        lambda w, p: _driven(w, hold(p["rate_Hz"])),
        ("loop_delay",),
    ),
    "resonant_cable": Outsider(
        lambda rng: {"channel": VS, "f_Hz": _log(rng, 1300, 3000), "damping_ratio": rng.uniform(0.03, 0.2)},
        lambda w, p: _filtered(w, p["channel"], resonance(p["f_Hz"], p["damping_ratio"])),
    ),
    "losses_of_one_channel": Outsider(
        lambda rng: {"channel": _any_channel(rng), "exponent": -rng.uniform(0.02, 0.05)},
        lambda w, p: _shaped(w, p["channel"], power_of_frequency(p["exponent"])),
    ),
    "echo": Outsider(
        lambda rng: {"channel": _any_channel(rng), "share": rng.uniform(0.08, 0.25), "ms": rng.uniform(0.6, 3.0)},
        lambda w, p: _shaped(w, p["channel"], echo(p["share"], 1e-3 * p["ms"])),
    ),
    "moved_cable": Outsider(
        lambda rng: {"channel": VS, "relative": rng.uniform(0.06, 0.15), "period_s": rng.uniform(2, 8)},
        lambda w, p: _changed(w, wandering(VS, p["relative"], p["period_s"])),
    ),
    "warming_amplifier": Outsider(
        lambda rng: {"relative": _sign(rng) * rng.uniform(0.05, 0.12), "tau_s": rng.uniform(15, 60)},
        lambda w, p: _changed(w, drifting((DE, DA, VS), p["relative"], p["tau_s"])),
    ),
    "loose_plug": Outsider(
        lambda rng: {"channel": VS, "relative": _sign(rng) * rng.uniform(0.06, 0.15)},
        lambda w, p: _changed(w, gain_step(VS, p["relative"])),
    ),
    "dead_zone": Outsider(
        lambda rng: {"channel": VS, "mV": rng.uniform(40, 120)},
        lambda w, p: _changed(w, dead_zone(VS, 1e-3 * p["mV"])),
    ),
    "compressed_sensor": Outsider(
        lambda rng: {"channel": VS, "volts": rng.uniform(2.0, 5.0)},
        lambda w, p: _changed(w, compressed(VS, p["volts"])),
    ),
    "slipping_scale": Outsider(
        lambda rng: {"channel": DE, "nm": rng.uniform(30, 100)},
        lambda w, p: _changed(w, play(DE, 1e-9 * p["nm"])),
    ),
    "slew_limit": Outsider(
        lambda rng: {"V_per_s": rng.uniform(2200, 3600)}, lambda w, p: _driven(w, slew_limit(p["V_per_s"]))
    ),
    "jitter": Outsider(
        lambda rng: {"channel": float(rng.choice([DE, VS])), "us": rng.uniform(10, 25)},
        lambda w, p: _changed(w, jitter(int(p["channel"]), 1e-6 * p["us"])),
    ),
    "interpolated_blocks": Outsider(
        lambda rng: {"channel": _any_channel(rng), "ms": rng.uniform(3, 10), "per_second": rng.uniform(1, 4)},
        lambda w, p: _changed(w, interpolated(int(p["channel"]), 1e-3 * p["ms"], p["per_second"])),
    ),
    "sticking_guide": Outsider(
        lambda rng: {"N": rng.uniform(0.3, 1.5), "N_per_um": rng.uniform(0.05, 0.4)},
        lambda w, p: replace(w, law=friction(p["N"], 1e6 * p["N_per_um"])),
    ),
    "opening_contact": Outsider(
        lambda rng: {"N_per_um": rng.uniform(0.1, 0.4), "um": rng.uniform(1.0, 4.0)},
        lambda w, p: replace(w, law=contact(1e6 * p["N_per_um"], 1e-6 * p["um"])),
    ),
}
