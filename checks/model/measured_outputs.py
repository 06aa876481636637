"""The converters' view of the strut's motion: constants, electronics, the bench's own mode, the encoder's optics."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.model.channel_paths import channel_path
from checks.model.electrical import electrical_of
from checks.model.learned_bench import LearnedBench
from checks.model.structure.fastened import bracket, suspension
from checks.model.unidentified import factor

Values = Mapping[str, float]
Channels = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class OutputGains:
    """gain (F, C) per motion of a channel; with_rest (F, C) per motion of da at rest; with_own_rest (F, C) per motion
    of the channel itself at rest; alone (F, C) without any motion; picked (C,): which channels of the motion; da: that
    of the payload."""

    gain: Complex
    with_rest: Complex
    with_own_rest: Complex
    alone: Complex
    picked: tuple[int, ...]
    da: int

    def __call__(self, H: Complex, static: Array) -> Complex:
        """Return the responses (F, C) to one volt of Va [V/V, m/V] to a motion H (F, c), static (c,) at rest, per
        newton."""
        return self.in_proportion(H, static) + self.alone

    def in_proportion(self, H: Complex, static: Array) -> Complex:
        """Return the responses (..., F, C) of H (..., F, c), static (..., c), without cross-talk."""
        moved = (H if self.picked == tuple(range(H.shape[-1])) else H[..., self.picked]) * self.gain
        if self.with_rest.any():
            moved += static[..., self.da][..., None, None] * self.with_rest
        if self.with_own_rest.any():
            moved += static[..., None, self.picked] * self.with_own_rest
        return np.asarray(moved)


def output_gains(
    f: Array, v: Values, have: Channels, wanted: Channels, learned: LearnedBench | None = None
) -> OutputGains:
    """Return the channels measured at f (F,) [Hz] from a motion of channels `have`. Raises ModelError for others."""
    e = electrical_of(v)
    drive = e.drive(f)
    per_volt = drive * (e.gain * e.ga)
    # A channel lies in one piece, as in the derivatives that are multiplied by it.
    gain, with_rest, with_own_rest, alone = np.zeros((4, len(wanted), f.size), dtype=complex).swapaxes(1, 2)
    for i, channel in enumerate(wanted):
        path = factor(v, channel, f) * channel_path(f, v, channel)
        if learned is not None:
            path = path * learned.at(f, channel)
        if channel == "Vs":
            gain[:, i] = per_volt * (e.gs * path) * e.sensor(f)
            alone[:, i] = drive * (e.coupling(f) * e.gain * path)
        else:
            gain[:, i] = per_volt * path if channel == "da" else per_volt * path * _encoder_factor(f, v)
            if v["bench.mode_ratio"] != 0.0:
                mode = suspension(f, 1.0, v["bench.mode_ratio"], v["bench.mode_Hz"], v["bench.mode_damping_ratio"])
                with_rest[:, i] = gain[:, i] * mode
        if v[ratio := f"bench.support_mode_ratio_{channel}"] != 0.0:
            mode = suspension(f, 1.0, v[ratio], v["bench.support_mode_Hz"], v["bench.support_mode_damping_ratio"])
            with_own_rest[:, i] = gain[:, i] * mode
    picked = tuple(_index(have, c) for c in wanted)
    return OutputGains(gain, with_rest, with_own_rest, alone, picked, _index(have, "da"))


def _index(have: Channels, channel: str) -> int:
    if channel not in have:
        raise ModelError(f"no channel '{channel}' (has: {', '.join(have)})")
    return have.index(channel)


def _encoder_factor(f: Array, v: Values) -> Complex:
    """Return the factor (F,) on de of the encoder's scale and of its head's bracket."""
    if "encoder.scale" not in v:
        return np.ones(f.shape, dtype=complex)
    return (1.0 + v["encoder.scale"]) * bracket(f, v["encoder.bracket_Hz"], v["encoder.bracket_damping_ratio"])
