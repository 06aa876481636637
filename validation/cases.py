"""What a blind test is made of: the mix, the draw of each unit, the sealed truth, and how visible each effect is.

The mix of the exact set is that of the method: 30 % nothing missing, 40 % one effect, 15 % two, 15 % outside the
library; effects take turns, so that each occurs equally often. A seed determines everything. The sets: `sets`.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from validation.bench import FS, Setting, World, draw_setting, frf, write_unit
from validation.benches import Bench
from validation.effects import LIBRARY, NEVER_TOGETHER, OUTSIDE, Hidden, Values
from validation.outsiders import OUTSIDERS, Outsider
from validation.strut import CHANNELS, Strut, draw, modes_Hz, plant, priors

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SHARES = {"none": 0.30, "one": 0.40, "two": 0.15, "outside": 0.15}
TOLERANCE = 0.01  # of the model file
SMOOTH_DECADES = 0.1
BAND_HZ = (10.0, 2000.0)
BINS = 400
MERGE_HZ = 350.0
WEAK = (2.0, 100.0)  # standard deviations
TINY = 0.01  # share of an effect at which all is in proportion
ROUNDS = 6
USED = 0.65  # of the bins' power that is left to the estimate once local polynomials have taken theirs
# What the sets that were drawn until now hide, in this order. A set names the effects that it draws from: a new effect
# goes into a list of its own, which new sets name, and shifts none of these.
DRAWN = (
    "misalignment",
    "joint_axial_compliance",
    "loop_delay",
    "amplifier_bandwidth",
    "sensor_highpass",
    "crosstalk",
    "bench_mode",
    "encoder_bracket_mode",
    "encoder_scale",
    "encoder_mass",
    "sensor_polarity",
    "hysteresis",
    "creep",
    "open_circuit_stiffening",
    "payload_mass",
)


@dataclass(frozen=True, eq=False)
class Case:
    """One unit before it is recorded. effects: name -> parameters; outside: name -> parameters; dead: a channel without
    a signal; exchanged: two channels each in the other's place; bench: what it shares with the other units of its
    bench, and learned: whether the model is learned on that bench, so that its own properties are no news; hidden: what
    else is put into the world."""

    serial: str
    kind: str
    seed: int
    strut: Strut
    setting: Setting
    effects: Mapping[str, Values]
    outside: Mapping[str, Values]
    dead: str | None = None
    exchanged: tuple[str, str] | None = None
    bench: Bench | None = None
    learned: bool = False
    hidden: Callable[[World], World] | None = None

    @property
    def world(self) -> World:
        gains = tuple(0.0 if channel == self.dead else 1.0 for channel in CHANNELS)
        world = World(self.strut, gains=gains, exchanged=self.exchanged)
        if self.bench is not None:
            world = self.bench.hold(world)
        for name, parameters in self.effects.items():
            world = LIBRARY[name].add(world, parameters)
        for name, parameters in self.outside.items():
            world = outside_of(name).add(world, parameters)
        return world if self.hidden is None else self.hidden(world)

    def write(self, parent: Path) -> Path:
        """Write the unit's folder below `parent` and return it. The truth is not in it."""
        return write_unit(parent / self.serial, self.serial, self.world, self.setting, self.seed)

    def truth(self) -> dict[str, Any]:
        nominal = {k: getattr(self.strut, k) for k in (*priors(), "ruler_x", "ruler_y")}
        stated = {"kind": self.kind, "seed": self.seed, "effects": dict(self.effects), "outside": dict(self.outside)}
        bench = {k: v for k, v in asdict(self.setting).items() if k in ("interpolation_m", "period_m", "mains_lines")}
        wrong = {"dead": self.dead, "exchanged": self.exchanged}
        held = {"laboratory": self.bench.truth()} if self.bench is not None else {}
        stated |= {"alike": self.alike, "nominal": nominal, "built": _first(self.strut), "bench": bench}
        return stated | wrong | held

    @property
    def alike(self) -> list[str]:
        """Return the names that are right although no effect of the library was hidden."""
        faults = [name for name, it in (("dead_channel", self.dead), ("swapped_channels", self.exchanged)) if it]
        own = self.bench.names if self.bench is not None and not self.learned else []
        alike = (name for each, values in self.outside.items() for name in outside_of(each).names(values))
        return sorted({*alike, *faults, *own})

    def detectability(self, rounds: int = ROUNDS) -> float | None:
        """Return the length of the hidden effect, in standard deviations of noise and tolerance, beyond all that the
        model's own parameters and their priors could do; None for an effect that is not linear, or for a shell that
        differs from its matrices: there the workflow's stated limits have to tell how much of an effect its modes hide.
        rounds: of calibration; one for the weak."""
        if not self.effects and not self.outside:
            return 0.0
        if self.strut.built is not None:
            return None
        world = self.world
        if world.bends or world.cubic:
            return None
        f = np.geomspace(*BAND_HZ, BINS)
        whiten = whiteners(frf(World(self.strut), f), self.setting, f)
        return least_misfit(frf(world, f), self.strut, whiten, f, _start(self.strut, world.strut), rounds)


def outside_of(name: str) -> Hidden | Outsider:
    """Return what is outside the library by its name, of either list."""
    return OUTSIDE[name] if name in OUTSIDE else OUTSIDERS[name]


def _first(strut: Strut, modes: int = 10) -> dict[str, list[float]] | None:
    """Return the deviations of the lowest modes of its shell, for readers of the truth."""
    if strut.built is None:
        return None
    return {k: getattr(strut.built, k)[:modes].tolist() for k in ("frequency", "damping")}


def _start(strut: Strut, hidden: Strut) -> Array:
    """Return a start of calibration, in prior standard deviations: with the parameters that the effect stands for, else
    with the payload that puts the axial mode at its place; from further away, no step along a resonance leads back."""
    moved = np.array([(getattr(hidden, name) - getattr(strut, name)) / sd for name, (_, sd) in priors().items()])
    if not moved.any() and replace(hidden, hung=None) != strut:
        ratio = modes_Hz(strut)[0] / modes_Hz(hidden)[0]
        moved[list(priors()).index("payload")] = (ratio**2 - 1) * strut.payload / priors()["payload"][1]
    return moved


def least_misfit(
    target: Complex, strut: Strut, whiten: Sequence[Complex], f: Array, off: Array, rounds: int = ROUNDS
) -> float:
    """Return the smallest misfit of a strut without the effect, by Gauss and Newton, in prior standard deviations from
    the truth. off: where to begin."""
    best, kept, step = np.inf, off, np.zeros(off.size)
    for _ in range(rounds + 1):
        left = stacked(whiten, target - frf(World(_moved(strut, off)), f))
        cost = float(np.hypot(np.linalg.norm(left), np.linalg.norm(off)))
        if cost < best:
            best, kept = cost, off
            J = np.array([stacked(whiten, each) for each in sensitivities(_moved(strut, off), f)]).T
            A, b = np.vstack([J, np.eye(off.size)]), np.concatenate([left, -off])
            step = np.linalg.lstsq(A, b, rcond=None)[0]
        else:
            step = step / 3  # too far for a straight line
        off = kept + step
    return best


def _moved(strut: Strut, off: Array) -> Strut:
    """Return the strut with each drawn parameter so many prior standard deviations further, but without a change of
    sign."""
    moved = {}
    for (name, (mean, sd)), by in zip(priors().items(), off, strict=True):
        value = getattr(strut, name)
        moved[name] = mean * max((value + by * sd) / mean, 0.02)
    return replace(strut, **moved)


def stacked(whiten: Sequence[Complex], x: Complex) -> Array:
    """Return the real and imaginary parts (6 F,), each of variance one if there is only noise and tolerance."""
    white = np.sqrt(2) * np.concatenate(
        [linalg.solve_triangular(half, channel, lower=True) for half, channel in zip(whiten, x, strict=True)]
    )
    return np.concatenate([white.real, white.imag])


def sensitivities(strut: Strut, f: Array) -> Iterator[Complex]:
    """Return the change of the response per prior standard deviation of each drawn parameter."""
    for name, (_, sd) in priors().items():
        h, value = 1e-2 * sd, getattr(strut, name)
        up, down = (plant(replace(strut, **{name: value + sign * h})).frf(f) for sign in (1, -1))
        yield (up - down) / 2e-2


def whiteners(H: Complex, s: Setting, f: Array) -> list[Complex]:
    """Return the Cholesky factors of each channel's covariance (F, F): white noise over drive in a bin's share of the
    record, and the tolerance, which is smooth: an error of a model keeps its size over a tenth of a decade or so."""
    noise = np.array([s.encoder_m, s.interferometer_m, s.sensor_V]) ** 2 * 2 / FS
    high = f > MERGE_HZ
    drive = np.where(high, s.high_rms_V**2 / (s.high_to_Hz - s.high_from_Hz), s.low_rms_V**2 / s.low_Hz)
    averages = np.gradient(f) * s.seconds * USED
    apart = np.abs(np.subtract.outer(np.log10(f), np.log10(f)))
    smooth = TOLERANCE**2 * np.exp(-apart / SMOOTH_DECADES)
    return [
        np.linalg.cholesky(np.diag(n / (drive * averages)) + smooth * np.outer(h, h.conj()))
        for n, h in zip(noise, H, strict=True)
    ]


def counts(number: int, shares: Mapping[str, float] = SHARES) -> dict[str, int]:
    """Return the number of units of each kind; every kind at least once from four units on, the remainder of rounding
    goes to the largest."""
    most = max(shares, key=lambda kind: shares[kind])
    share = {kind: max(int(number * part), 1) for kind, part in shares.items() if kind != most}
    return share | {most: max(number - sum(share.values()), 0)}


def draw_cases(
    number: int,
    seed: int | Sequence[int],
    prefix: str = "B",
    shares: Mapping[str, float] = SHARES,
    names: Sequence[str] = DRAWN,
) -> list[Case]:
    """Draw the units of a blind test, in random order. names: effects to draw from."""
    rng = np.random.default_rng(seed)
    kinds = [kind for kind, n in counts(number, shares).items() for _ in range(n)][:number]
    turns = {kind: _turns(kind, rng, names) for kind in dict.fromkeys(kinds)}
    made = [(kind, *next(turns[kind])) for kind in kinds]
    order = rng.permutation(number)
    return [_case(f"{prefix}-{i:03d}", *made[k], rng) for i, k in enumerate(order)]


def _turns(kind: str, rng: np.random.Generator, names: Sequence[str]) -> Iterator[tuple[Sequence[str], Sequence[str]]]:
    """Yield the names inside and outside the library, for one unit of a kind after the other, without end."""
    choices: dict[str, list[tuple[Sequence[str], Sequence[str]]]] = {
        "none": [((), ())],
        "one": [((name,), ()) for name in names],
        "two": [(pair, ()) for pair in combinations(names, 2) if _together(pair)],
        "three": [(some, ()) for some in combinations(names, 3) if _together(some)],
        "outside": [((), (name,)) for name in OUTSIDE],
        "outsider": [((), (name,)) for name in OUTSIDERS],
    }
    while True:
        for k in rng.permutation(len(choices[kind])):
            yield choices[kind][k]


def kinds_in_order(number: int, shares: Mapping[str, float]) -> list[str]:
    """Return the kinds of units one after the other, so that the first so many are always a fair mixture: each is
    of the kind that lags most behind its share."""
    kinds: list[str] = []
    for k in range(1, number + 1):
        kinds.append(max(shares, key=lambda kind: shares[kind] * k - kinds.count(kind)))
    return kinds


def draw_in_order(
    number: int, seed: Sequence[int], shares: Mapping[str, float], names: Sequence[str], prefix: str
) -> list[Case]:
    """Draw units whose first so many are a fair mixture, with one unit's draws apart from the next one's."""
    kinds = kinds_in_order(number, shares)
    turns = {kind: _turns(kind, np.random.default_rng([*seed, k]), names) for k, kind in enumerate(shares)}
    apart = [np.random.default_rng([*seed, 99, k]) for k in range(number)]
    return [_case(f"{prefix}-{k:03d}", kind, *next(turns[kind]), apart[k]) for k, kind in enumerate(kinds)]


def _together(names: Sequence[str]) -> bool:
    return not any(pair <= set(names) for pair in NEVER_TOGETHER)


def _case(serial: str, kind: str, inside: Sequence[str], outside: Sequence[str], rng: np.random.Generator) -> Case:
    strut = draw(rng)
    settled = {field: priors()[field][0] for name in inside for field in LIBRARY[name].settles}
    effects = {name: LIBRARY[name].draw(rng) for name in inside}
    strange = {name: outside_of(name).draw(rng) for name in outside}
    setting, seed = draw_setting(rng), int(rng.integers(2**31))
    return Case(serial, kind, seed, replace(strut, **settled), setting, effects, strange)


def draw_weak(number: int, seed: int, prefix: str = "W") -> list[Case]:
    """Return the units with one effect, made weak: from hardly visible to what is drawn elsewhere, evenly in the
    logarithm."""
    rng = np.random.default_rng([seed, 1])
    names = [name for name in DRAWN if LIBRARY[name].grows or LIBRARY[name].fades]
    turns = [names[k] for k in np.resize(rng.permutation(len(names)), number)]
    return [_weak(_case(f"{prefix}-{k:03d}", "weak", (name,), (), rng), name, rng) for k, name in enumerate(turns)]


def _weak(case: Case, name: str, rng: np.random.Generator) -> Case:
    tiny = replace(case, effects={name: LIBRARY[name].weaker(case.effects[name], TINY)})
    share = TINY * np.exp(rng.uniform(*np.log(WEAK))) / (tiny.detectability(rounds=1) or 1.0)
    return replace(case, effects={name: LIBRARY[name].weaker(case.effects[name], min(float(share), 1.0))})


def seal(cases: Sequence[Case]) -> tuple[str, str]:
    """Return the truth of all units as one text, and its sha256: printed before anything is run."""
    text = json.dumps({case.serial: case.truth() for case in cases}, indent=1, sort_keys=True)
    return text, hashlib.sha256(text.encode()).hexdigest()
