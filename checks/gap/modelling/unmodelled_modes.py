"""Stand-ins for what has no name: one channel times a rational function. They compete with the effects of the library,
so that no effect is named only because something must explain the residual.

mode:  1 + ratio w^2 / (s^2 + 2 z w s + w^2), a pole and a zero beside it
lag:   1 + ratio s / (s + w), another gain above a corner (ratio -1 is a first-order lag)
shelf: 1 + ratio w / (s + w), another gain below a corner (ratio -1 is a first-order high-pass)
delay: exp(-s tau)
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeGuard

import numpy as np

from checks.arrays import Complex
from checks.gap.modelling.effect import Effect, Parameter, spread
from checks.gap.modelling.experiment import Experiment
from checks.model.channel_paths import CHANNELS

Values = Mapping[str, float]
FILTER = "filter"
ALL = "all"  # channels: it sits in the drive
NO_ZERO = 1e-3  # of the gain: what is left above a corner when there is no zero


@dataclass(frozen=True)
class RationalShape:
    """factor: (values, s (F,)) -> (F,) complex."""

    name: str
    parameters: tuple[Parameter, ...]
    factor: Callable[[Values, Complex], Complex]


@dataclass(frozen=True, kw_only=True)
class UnmodelledMode(Effect):
    """A shape on one channel, or on all of them. counts: whether it means that something is missing; stands_in: whether
    it stands in for a name of the library, or is an explanation as any other."""

    shape: RationalShape
    channel: str
    counts: bool = True
    direction = ""
    of_kind = FILTER
    stands_in: bool = True

    @property
    def label(self) -> str:
        return self.title

    @property
    def place(self) -> str:
        return "drive" if self.channel == ALL else self.channel

    @property
    def against(self) -> str:
        """Return the words between the mode and its channels: the path that it lies in."""
        return f"{self.shape.name} in the path of"

    def poles_and_zeros(self, values: Values) -> tuple[list[float], list[float]]:
        """Return the frequencies [Hz] of the poles and the zeros."""
        if self.shape.name == "mode":
            f, r = values["f_Hz"], values["ratio"]
            return [f], [f * float(np.sqrt(abs(1.0 + r)))]
        f, r = values.get("f_Hz", 0.0), values.get("ratio", 0.0)
        if self.shape.name == "shelf":
            return [f], [f * abs(1.0 + r)]
        if self.shape.name == "lag":
            return [f], [f / abs(1.0 + r)] if abs(1.0 + r) > NO_ZERO else []
        return [], []


def on_channel(
    shape: RationalShape, channel: str, every: tuple[str, ...] = CHANNELS, counts: bool = True
) -> UnmodelledMode:
    """Return a shape on a channel. every: the channels that there are."""
    return UnmodelledMode(
        name=f"unnamed_{shape.name}_{channel}",
        title=f"an unidentified {shape.name} {'in the drive' if channel == ALL else f'on {channel}'}",
        parameters=shape.parameters,
        channels=every if channel == ALL else (channel,),
        sign="one factor on its channels explains them",
        sentence="",
        sources=("[GAP] 12",),
        experiment=Experiment.LOOP_BACK,
        factor=shape.factor,
        shape=shape,
        channel=channel,
        counts=counts,
    )


def _mode(v: Values, s: Complex) -> Complex:
    w = 2.0 * np.pi * v["f_Hz"]
    return np.asarray(1.0 + v["ratio"] * w * w / (s * s + 2.0 * v["damping_ratio"] * w * s + w * w))


def _lag(v: Values, s: Complex) -> Complex:
    return np.asarray(1.0 + v["ratio"] * s / (s + 2.0 * np.pi * v["f_Hz"]))


def _shelf(v: Values, s: Complex) -> Complex:
    return np.asarray(1.0 + v["ratio"] / (1.0 + s / (2.0 * np.pi * v["f_Hz"])))


def _delay(v: Values, s: Complex) -> Complex:
    return np.exp(-s * 1e-6 * v["tau_us"])


MODE = RationalShape(
    "mode",
    (
        Parameter("f_Hz", lo=5.0, hi=5000.0, off=100.0, start=100.0, scale=1.0, grid=spread(15.0, 2000.0, 40)),
        Parameter("ratio", lo=-5.0, hi=5.0, scale=0.01),
        Parameter("damping_ratio", lo=5e-4, hi=0.5, off=0.01, start=0.015, scale=0.005, grid=(0.006, 0.02)),
    ),
    _mode,
)
_CORNER = (
    Parameter("f_Hz", lo=0.05, hi=50_000.0, off=100.0, start=100.0, scale=5.0, grid=spread(0.5, 10_000.0, 16)),
    Parameter("ratio", lo=-20.0, hi=20.0, scale=0.01),
)
LAG, SHELF = RationalShape("lag", _CORNER, _lag), RationalShape("shelf", _CORNER, _shelf)
DELAY = RationalShape("delay", (Parameter("tau_us", lo=-500.0, hi=50_000.0, scale=5.0),), _delay)


def levels(merge_Hz: float, width: float) -> UnmodelledMode:
    """Return the effect of a hysteresis of this relative width on responses taken with noise of two levels, one below
    and one above merge_Hz: a lag of each (the loop's area), the slope that goes with a lag of constant angle in
    anything causal (2 / pi of it per e-fold of frequency: [BODE45] ch. 14; the best linear answer to noise is causal:
    [PS12] 3.4), and another gain above. It does not count as missing: the slow records measure it."""
    parameters = (
        Parameter("lag_below", lo=-1.0, hi=1.0, scale=width, sd=2.0 * width),
        Parameter("lag_above", lo=-1.0, hi=1.0, scale=width, sd=2.0 * width),
        Parameter("gain_above", lo=-1.0, hi=1.0, scale=width, sd=4.0 * width),
    )

    def factor(v: Values, s: Complex) -> Complex:
        e_folds = np.log(np.abs(s) / (2.0 * np.pi * merge_Hz))
        turn = 2.0 / np.pi * e_folds + 1j
        return np.asarray(
            np.where(e_folds <= 0.0, 1.0 - v["lag_below"] * turn, 1.0 + v["gain_above"] - v["lag_above"] * turn)
        )

    return on_channel(RationalShape("levels", parameters, factor), ALL, counts=False)


USUAL_LAG_US = 30.0  # 1 sd: converters, interpolators, filters against aliasing and amplifiers lag by some tens
USUAL_GAIN = 0.003  # 1 sd: a percent between two channels is seen beside a tolerance, and is an encoder's scale


def _path(v: Values, s: Complex) -> Complex:
    x = 1e-6 * USUAL_LAG_US * s
    return np.asarray((1.0 + v["gain"]) * np.exp(-1e-6 * v["tau_us"] * s - v["droop"] * x**2 - v["bend"] * x**3))


PATH = RationalShape(
    "path",
    (
        Parameter("tau_us", lo=-500.0, hi=1000.0, scale=USUAL_LAG_US, sd=USUAL_LAG_US),
        Parameter("droop", lo=-30.0, hi=30.0, scale=1.0, sd=1.0),
        Parameter("bend", lo=-30.0, hi=30.0, scale=1.0, sd=1.0),
        Parameter("gain", lo=-0.5, hi=0.5, scale=USUAL_GAIN, sd=USUAL_GAIN),
    ),
    _path,
)


def bench_paths(channels: tuple[str, ...]) -> tuple[UnmodelledMode, ...]:
    """Return what a bench that no file describes adds to each channel: a gain, and a latency and filters with corners
    above the band, together exp(-c1 s - c2 s^2 - c3 s^3), the first terms of the logarithm of any of them. A path does
    not count as missing."""
    return tuple(on_channel(PATH, c, counts=False) for c in channels)


def is_path(member: Effect) -> TypeGuard[UnmodelledMode]:
    """Return whether a member is the path of a channel."""
    return isinstance(member, UnmodelledMode) and member.shape is PATH


GAIN = RationalShape(
    "gain",
    (Parameter("gain", lo=-3.0, hi=20.0, scale=0.01),),
    lambda v, s: np.full(s.shape, 1.0 + v["gain"], dtype=complex),
)
LOWPASS = RationalShape(
    "low-pass",
    (Parameter("f_Hz", lo=0.05, hi=50_000.0, off=math.inf, start=100.0, scale=5.0, grid=spread(0.5, 10_000.0, 16)),),
    lambda v, s: 1.0 / (1.0 + s / (2.0 * np.pi * v["f_Hz"])),
)
SHAPES = (MODE, LAG, SHELF, DELAY)
FILTERS = (GAIN, DELAY, LOWPASS, MODE)


def filters(channels: tuple[str, ...]) -> tuple[UnmodelledMode, ...]:
    """Return a filter of every kind on every channel and, of several channels, in the drive: for a model whose effects
    no library holds."""
    where = (*channels, ALL) if len(channels) > 1 else channels
    return tuple(replace(on_channel(shape, c, every=channels), stands_in=False) for shape in FILTERS for c in where)


def unmodelled_modes(channels: tuple[str, ...]) -> tuple[UnmodelledMode, ...]:
    """Return an unmodelled mode of every shape for every channel, and those that may be in the drive."""
    common = (on_channel(MODE, ALL), on_channel(LAG, ALL)) if len(channels) > 1 else ()
    return (*common, *(on_channel(shape, c) for shape in SHAPES for c in channels))
