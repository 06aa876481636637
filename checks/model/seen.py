"""What the converters see of the strut's motion: constants, electronics, the bench's own mode, the encoder's optics."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from checks.model.bench import suspension
from checks.model.encoder import bracket
from checks.model.parts import electrical_of
from checks.model.superelement import Array, ModelError

Complex = NDArray[np.complex128]
Values = Mapping[str, float]
Channels = tuple[str, ...]


def seen(f: Array, v: Values, have: Channels, H: Complex, static: Array, wanted: Channels) -> Complex:
    """(F, C) responses to one volt of Va [V/V, m/V] at f (F,) [Hz] of the wanted channels.

    H (F, c), static (c,): motion of the channels `have` per newton of force pair, at f and at rest. Raises ModelError
    for a channel that the motion does not have."""
    out = in_proportion(f, v, have, H, static, wanted)
    e = electrical_of(v)
    if e.crosstalk and "Vs" in wanted:
        out[:, wanted.index("Vs")] += e.crosstalk * e.gain * e.drive(f)
    return out


def in_proportion(f: Array, v: Values, have: Channels, H: Complex, static: Array, wanted: Channels) -> Complex:
    """The part of `seen` that is in proportion to the motion: all but cross-talk."""
    e = electrical_of(v)
    per_volt = e.gain * e.ga
    at_rest = float(static[_index(have, "da")]) * per_volt
    added = suspension(f, at_rest, v["bench.mode_ratio"], v["bench.mode_Hz"], v["bench.mode_damping_ratio"])
    out = np.empty((f.size, len(wanted)), dtype=complex)
    for i, channel in enumerate(wanted):
        h = H[:, _index(have, channel)] * per_volt
        if channel == "Vs":
            out[:, i] = h * e.gs * e.sensor(f)
        else:
            out[:, i] = (h + added) * (_optics(f, v) if channel == "de" else 1.0)
    return out * e.drive(f)[:, None]


def _index(have: Channels, channel: str) -> int:
    if channel not in have:
        raise ModelError(f"no channel '{channel}' (has: {', '.join(have)})")
    return have.index(channel)


def _optics(f: Array, v: Values) -> Complex:
    """(F,) factor on de of the encoder's scale and of its head's bracket."""
    if "encoder.scale" not in v:
        return np.ones(f.shape, dtype=complex)
    return (1.0 + v["encoder.scale"]) * bracket(f, v["encoder.bracket_Hz"], v["encoder.bracket_damping_ratio"])
