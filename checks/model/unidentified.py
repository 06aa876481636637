"""An unidentified factor on a channel: a rational element with as many poles as zeros.

gain times the product of (1 + 2 z s / w + (s / w)^2) of the zeros over that of the poles, each by its frequency and
damping ratio. Its numbers are values of the model (`unidentified.Vs.pole_1_Hz`), so everything that uses the model
includes it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError

PREFIX = "unidentified."
Pair = tuple[float, float]  # frequency [Hz], damping ratio


@dataclass(frozen=True)
class UnidentifiedElement:
    """poles, zeros: pairs of frequency [Hz] and damping ratio, as many of each."""

    channel: str
    gain: float
    poles: tuple[Pair, ...]
    zeros: tuple[Pair, ...]

    NAME: ClassVar = "unidentified"  # of its entry in a model file

    @classmethod
    def of_entry(cls, given: Mapping[str, object], where: str) -> "UnidentifiedElement":
        """Return the element of an entry of a model file. Raises ModelError with key, value and expectation."""
        channel, gain = given.get("channel"), given.get("gain")
        if channel not in ("Vs", "de", "da"):
            raise ModelError(f"{where}: channel is {channel!r}; expected Vs, de or da")
        if not _number(gain) or not float(gain) > 0.0:  # type: ignore[arg-type]
            raise ModelError(f"{where}: gain is {gain!r}; expected a number above 0")
        unknown = given.keys() - {"channel", "gain", "poles", "zeros", "covariance"}
        if unknown:
            raise ModelError(
                f"{where}: unknown {', '.join(sorted(unknown))} (known: channel, gain, poles, zeros, covariance)"
            )
        poles, zeros = _pairs(given.get("poles"), f"{where}: poles"), _pairs(given.get("zeros"), f"{where}: zeros")
        if len(poles) != len(zeros):
            raise ModelError(f"{where}: {len(poles)} poles and {len(zeros)} zeros; expected as many of each")
        if not all(0.0 < ratio < 1.0 for _, ratio in poles):
            raise ModelError(f"{where}: a damping ratio of a pole is not above 0 and below 1: it would not be stable")
        return cls(str(channel), float(gain), poles, zeros)  # type: ignore[arg-type]

    def factor(self, f: Array) -> Complex:
        """Return the factor (F,) at f (F,) [Hz]."""
        out = np.full(f.shape, self.gain, dtype=complex)
        for pole, zero in zip(self.poles, self.zeros, strict=True):
            out *= _square(f, zero) / _square(f, pole)
        return out

    def values(self) -> dict[str, float]:
        head = f"{PREFIX}{self.channel}."
        out = {f"{head}gain": self.gain}
        for kind, pairs in (("pole", self.poles), ("zero", self.zeros)):
            for k, (f_Hz, ratio) in enumerate(pairs, 1):
                out |= {f"{head}{kind}_{k}_Hz": f_Hz, f"{head}{kind}_{k}_damping": ratio}
        return out


def _square(f: Array, pair: Pair) -> Complex:
    x = 1j * f / pair[0]
    return np.asarray(1.0 + 2.0 * pair[1] * x + x * x)


def element_of(values: Mapping[str, float], channel: str) -> UnidentifiedElement | None:
    """Return a channel's unidentified element among a model's values; None without one."""
    head = f"{PREFIX}{channel}."
    if f"{head}gain" not in values:
        return None

    def pairs(kind: str) -> tuple[Pair, ...]:
        count = sum(n.startswith(f"{head}{kind}_") and n.endswith("_Hz") for n in values)
        names = (f"{head}{kind}_{k}" for k in range(1, count + 1))
        return tuple((values[f"{n}_Hz"], values[f"{n}_damping"]) for n in names)

    return UnidentifiedElement(channel, values[f"{head}gain"], pairs("pole"), pairs("zero"))


def factor(values: Mapping[str, float], channel: str, f: Array) -> Complex | float:
    """Return the factor (F,) by which a channel is multiplied; one if a model has no such element."""
    found = element_of(values, channel)
    return 1.0 if found is None else found.factor(f)


def _pairs(given: object, where: str) -> tuple[Pair, ...]:
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise ModelError(f"{where} is {given!r}; expected a list of [frequency in Hz, damping ratio]")
    out = []
    for pair in given:
        good = isinstance(pair, Sequence) and not isinstance(pair, str) and len(pair) == 2 and all(map(_number, pair))
        if not good or not float(pair[0]) > 0.0:
            raise ModelError(f"{where}: {pair!r}; expected [frequency in Hz, damping ratio]")
        out.append((float(pair[0]), float(pair[1])))
    return tuple(out)


def _number(x: object) -> bool:
    return isinstance(x, int | float) and not isinstance(x, bool) and bool(np.isfinite(x))
