"""Which units a blind test holds: the mix, the draw of each, the sealed truth, and how visible each effect is.

The mix is that of the method: 30 % nothing missing, 40 % one effect, 15 % two, 15 % outside the library; effects take
turns, so that each stands equally often. A seed settles everything.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.blind_bench import FS, SECONDS, Setting, World, draw_setting, frf, write_unit
from tests.blind_effects import LIBRARY, NEVER_TOGETHER, OUTSIDE, Values
from tests.blind_strut import Strut, draw, nominal, plant, priors

Array = NDArray[np.float64]

SHARES = {"none": 0.30, "one": 0.40, "two": 0.15, "outside": 0.15}
TOLERANCE = 0.01  # of the model file
BAND_HZ = (10.0, 2000.0)
BINS = 400
MERGE_HZ = 350.0
USED = 0.65  # of the bins' power that is left to the estimate once local polynomials have taken theirs


@dataclass(frozen=True, eq=False)
class Case:
    """One unit before it is recorded. effects: name -> parameters; outside: name -> parameters."""

    serial: str
    kind: str
    seed: int
    strut: Strut
    setting: Setting
    effects: Mapping[str, Values]
    outside: Mapping[str, Values]

    @property
    def world(self) -> World:
        world = World(self.strut)
        for name, parameters in self.effects.items():
            world = LIBRARY[name].add(world, parameters)
        for name, parameters in self.outside.items():
            world = OUTSIDE[name].add(world, parameters)
        return world

    def write(self, parent: Path) -> Path:
        """The unit's folder below `parent`. The truth is not in it."""
        return write_unit(parent / self.serial, self.serial, self.world, self.setting, self.seed)

    def truth(self) -> dict[str, Any]:
        nominal = {k: v for k, v in asdict(self.strut).items() if k in priors()}
        stated = {"kind": self.kind, "seed": self.seed, "effects": dict(self.effects), "outside": dict(self.outside)}
        return stated | {"alike": self.alike, "detectability": self.detectability(), "nominal": nominal}

    @property
    def alike(self) -> list[str]:
        return sorted({name for each in self.outside for name in OUTSIDE[each].alike})

    def detectability(self) -> float | None:
        """Length of what is hidden, in standard deviations of noise and tolerance, beyond all that the model's own
        parameters could do; none for what is not linear."""
        if not self.effects and not self.outside:
            return 0.0
        world = self.world
        if world.bends or world.cubic:
            return None
        f = _bins()
        bare = World(self.strut)
        return _beyond(frf(world, f) - frf(bare, f), bare, self.setting, f)


def _beyond(change: NDArray[np.complex128], bare: World, s: Setting, f: Array) -> float:
    weight = 1 / _deviation(frf(bare, f), s, f)
    target = _stacked(change * weight)
    columns = [_stacked(d * weight) for d in _sensitivities()]
    A = np.vstack([np.array(columns).T, np.eye(len(columns))])  # in prior standard deviations
    b = np.concatenate([target, np.zeros(len(columns))])
    left = b - A @ np.linalg.lstsq(A, b, rcond=None)[0]
    return float(np.linalg.norm(left))


def _stacked(x: NDArray[np.complex128]) -> Array:
    return np.concatenate([x.real.ravel(), x.imag.ravel()])


@cache
def _sensitivities() -> list[NDArray[np.complex128]]:
    """Change of the mean strut's response per prior standard deviation of each drawn parameter."""
    f, mean = _bins(), nominal()
    changes = []
    for name, (_, sd) in priors().items():
        h, value = 1e-2 * sd, getattr(mean, name)
        up, down = (plant(replace(mean, **{name: value + sign * h})).frf(f) for sign in (1, -1))
        changes.append((up - down) / 2e-2)
    return changes


def _bins() -> Array:
    return np.geomspace(*BAND_HZ, BINS)


def _deviation(H: NDArray[np.complex128], s: Setting, f: Array) -> Array:
    """(3, F) standard deviation of real and of imaginary part: white noise over drive in a bin's share of the record,
    and the tolerance."""
    width = np.gradient(f) * SECONDS * USED
    noise = np.array([[s.encoder_m], [s.interferometer_m], [s.sensor_V]]) ** 2 * 2 / FS
    high = f > MERGE_HZ
    drive = np.where(high, s.high_rms_V**2 / (s.high_to_Hz - s.high_from_Hz), s.low_rms_V**2 / s.low_Hz)
    return np.sqrt((noise / (drive * width) + (TOLERANCE * np.abs(H)) ** 2) / 2)


def counts(number: int) -> dict[str, int]:
    """How many of each kind; every kind at least once from four units on, what rounding leaves goes to one effect."""
    share = {kind: max(int(number * part), 1) for kind, part in SHARES.items() if kind != "one"}
    return share | {"one": max(number - sum(share.values()), 0)}


def draw_cases(number: int, seed: int, prefix: str = "B") -> list[Case]:
    """The units of a blind test, in no order that tells anything."""
    rng = np.random.default_rng(seed)
    kinds = [kind for kind, n in counts(number).items() for _ in range(n)]
    turns = {kind: _turns(kind, rng) for kind in SHARES}
    made = [(kind, *next(turns[kind])) for kind in kinds]
    order = rng.permutation(number)
    return [_case(f"{prefix}-{i:03d}", *made[k], rng) for i, k in enumerate(order)]


def _turns(kind: str, rng: np.random.Generator) -> Iterator[tuple[Sequence[str], Sequence[str]]]:
    """Names inside and outside the library, for one unit of a kind after the other, for ever."""
    choices: dict[str, list[tuple[Sequence[str], Sequence[str]]]] = {
        "none": [((), ())],
        "one": [((name,), ()) for name in LIBRARY],
        "two": [(pair, ()) for pair in combinations(LIBRARY, 2) if set(pair) not in NEVER_TOGETHER],
        "outside": [((), (name,)) for name in OUTSIDE],
    }
    while True:
        for k in rng.permutation(len(choices[kind])):
            yield choices[kind][k]


def _case(serial: str, kind: str, inside: Sequence[str], outside: Sequence[str], rng: np.random.Generator) -> Case:
    strut = draw(rng)
    settled = {field: priors()[field][0] for name in inside for field in LIBRARY[name].settles}
    effects = {name: LIBRARY[name].draw(rng) for name in inside}
    strange = {name: OUTSIDE[name].draw(rng) for name in outside}
    setting, seed = draw_setting(rng), int(rng.integers(2**31))
    return Case(serial, kind, seed, replace(strut, **settled), setting, effects, strange)


def seal(cases: Sequence[Case]) -> tuple[str, str]:
    """The truth of all units as one text, and its sha256: printed before anything is run."""
    text = json.dumps({case.serial: case.truth() for case in cases}, indent=1, sort_keys=True)
    return text, hashlib.sha256(text.encode()).hexdigest()
