"""Elements drawn by place, direction, kind and size, on the mechanics of the independent generator, and filters by
channel: what a unit hides, and the answers that are right for it.

Nothing here knows how it is searched for. A size is drawn in standard deviations of what is seen: noise and tolerance,
beyond all that the strut's own values and, where shells scatter, its modes could do within their priors.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from validation.bench import World, draw_setting, frf
from validation.benches import Bench
from validation.cases import Case, sensitivities, stacked, whiteners
from validation.rational import resonance
from validation.sets import DAMPING
from validation.shell import draw_shell
from validation.strut import CHANNELS, Attached, Hung, Loose, Support, draw

Rng = np.random.Generator
Complex = NDArray[np.complex128]

SEEN = (15.0, 150.0)  # standard deviations; a global test sees about nine
NONE = 1e-6  # share of the most that is as good as nothing
SMALL = 5.0  # standard deviations of the whole change, at which it and what could imitate it are in proportion
HALVINGS = 25
BINS, BAND_HZ = 150, (10.0, 700.0)
SPREAD = 1e-5  # relative step of a mode: small beside the width of its peak
DIRECTIONS = ("x", "y", "z", "Rx", "Ry", "Rz")
PARTS = {
    "top": "top interface",
    "bottom": "bottom interface",
    "head": "head",
    "payload": "payload",
    "sensor": "sensor stack",
}
PLACES = ("top", "bottom", "head", "payload", "sensor")
HELD_INERTIA = 0.3  # kg m2, of a payload that tilts


@dataclass(frozen=True)
class Truth:
    """kind and places (part, against; "" for either) that are right, direction, values by the names of gap.json, and
    the names of library effects that are no lie. seen: standard deviations."""

    kind: str
    places: tuple[tuple[str, str], ...]
    direction: str
    values: Mapping[str, float]
    alike: tuple[str, ...] = ()
    point_mm: tuple[float, float] | None = None
    seen: float = 0.0


@dataclass(frozen=True)
class Unit:
    """What is hidden, before its size is known. world: the world with so many parts of it; truth: of as many parts;
    most: parts above which nobody would leave it there."""

    name: str
    world: Callable[[World, float], World]
    truth: Callable[[float], Truth]
    most: float


def _log(rng: Rng, lo: float, hi: float) -> float:
    return float(np.exp(rng.uniform(np.log(lo), np.log(hi))))


def _attached(world: World, *elements: Attached) -> World:
    return replace(world, strut=replace(world.strut, attached=elements))


def _where(rng: Rng) -> tuple[str, int, tuple[float, float]]:
    """Return place, direction, and a point beside the place's own: of the interfaces' translations along the axis in
    two of three."""
    place = str(rng.choice(PLACES))
    direction = 2 if place in ("payload", "sensor") else int(rng.choice([0, 1, 2, 2, 2]))
    at = (0.0, 0.0)
    if place in ("top", "bottom") and direction == 2 and rng.random() < 2 / 3:
        r, angle = rng.uniform(8e-3, 25e-3), rng.uniform(0.0, 2.0 * np.pi)
        at = (float(r * np.cos(angle)), float(r * np.sin(angle)))
    return place, direction, at


def _against(place: str) -> tuple[tuple[str, str], ...]:
    return ((PARTS[place], "" if place == "sensor" else "ground"),)


def _spring(rng: Rng) -> Unit:
    place, direction, at = _where(rng)

    def truth(k: float) -> Truth:
        mm = (1e3 * at[0], 1e3 * at[1]) if any(at) else None
        return Truth("spring", _against(place), DIRECTIONS[direction], {"k_N_per_um": k}, point_mm=mm)

    return Unit("spring", lambda w, k: _attached(w, Attached(place, direction, at, k=1e6 * k)), truth, 30.0)


def _damper(rng: Rng) -> Unit:
    place, direction, at = _where(rng)

    def truth(c: float) -> Truth:
        return Truth("damper", _against(place), DIRECTIONS[direction], {"c_N_s_per_m": c})

    return Unit("damper", lambda w, c: _attached(w, Attached(place, direction, at, c=c)), truth, 5000.0)


def _mass(rng: Rng) -> Unit:
    place = str(rng.choice(["top", "bottom", "head", "payload"]))
    r, angle = rng.uniform(0.0, 25e-3), rng.uniform(0.0, 2.0 * np.pi)
    at = (float(r * np.cos(angle)), float(r * np.sin(angle))) if place in ("top", "bottom") else (0.0, 0.0)
    along = (2,) if place == "payload" else (0, 1, 2)
    alike = {"head": ("encoder_mass",), "payload": ("payload_mass",)}.get(place, ())

    def world(w: World, m: float) -> World:
        return _attached(w, *(Attached(place, d, at, m=m) for d in along))

    return Unit("mass", world, lambda m: Truth("mass", _against(place), "", {"m_kg": m}, alike), 0.5)


def _resonator(rng: Rng) -> Unit:
    place, direction, at = _where(rng)
    place = "head" if place == "sensor" else place
    f, ratio = _log(rng, 30.0, 350.0), _log(rng, 0.008, 0.05)

    def truth(m: float) -> Truth:
        values = {"m_kg": m, "f_Hz": f, "damping_ratio": ratio}
        return Truth("resonator", _against(place), DIRECTIONS[direction], values)

    def world(w: World, m: float) -> World:
        return _attached(w, Attached(place, direction, at, hung=Hung(m, f, ratio)))

    return Unit("resonator", world, truth, 0.2)


def _joint(rng: Rng) -> Unit:
    side, bends, damped = int(rng.choice([-1, 1])), rng.uniform(0.3, 1.0), rng.uniform(100.0, 600.0)

    def world(w: World, part: float) -> World:
        loose = Loose(side, 1 - part, 1 - bends * part, damped * part, 1e-2 * part)
        return replace(w, strut=replace(w.strut, loose=loose))

    def truth(part: float) -> Truth:
        where = (("bottom joint", ""),) if side < 0 else (("top joint", ""),)
        return Truth("joint", where, "", {"kz_ratio": 1 - part}, ("joint_axial_compliance",))

    return Unit("joint", world, truth, 0.7)


def _tilting(rng: Rng) -> Unit:
    """Return a payload that rocks on its guide, its centre of mass beside the axis; its part: the distance."""
    f, ratio, angle = _log(rng, 80.0, 250.0), rng.uniform(0.01, 0.04), rng.uniform(0.0, 2.0 * np.pi)
    k, far = HELD_INERTIA * (2 * np.pi * f) ** 2, 1e12

    def world(w: World, mm: float) -> World:
        x, y = 1e-3 * mm * np.cos(angle), 1e-3 * mm * np.sin(angle)
        held = w.strut.support or Support(far, far, k, k, k, (HELD_INERTIA,) * 3, ratio)
        held = replace(held, axis_x=held.axis_x + float(x), axis_y=held.axis_y + float(y))
        return replace(w, strut=replace(w.strut, support=held))

    def truth(_: float) -> Truth:
        places = (("payload", ""), ("top joint", ""))
        return Truth("payload", places, "", {}, ("support_mode",))

    return Unit("tilting payload", world, truth, 15.0)


def _filter(rng: Rng) -> Unit:
    """Return a bump of one channel, or of the drive: a filter that no effect of the library is."""
    channels = ((0,), (1,), (2,), (0, 1, 2))[int(rng.integers(4))]
    f, ratio = _log(rng, 40.0, 400.0), _log(rng, 0.05, 0.3)
    part = CHANNELS[channels[0]] if len(channels) == 1 else "drive"

    def world(w: World, height: float) -> World:
        bump = resonance(f, ratio, height * ratio, direct=1.0)
        return replace(w, filters=(*w.filters, (channels, bump)))

    return Unit("filter", world, lambda _: Truth("filter", ((part, ""),), "", {}), 2.0)


DRAWN: tuple[Callable[[Rng], Unit] | None, ...] = (
    _spring,
    _resonator,
    None,
    _mass,
    _joint,
    _damper,
    _spring,
    _filter,
    _resonator,
    _tilting,
)


def draw_anywhere(
    number: int, seed: int, scatter: float, bench: Bench | None = None
) -> Iterator[tuple[str, Case, Truth]]:
    """Yield units, each with what it hides; the draws of one do not depend on how many there are. bench: of all of
    them, learned."""
    for k in range(number):
        rng = np.random.default_rng([seed, 4, k])
        strut, setting = draw(rng), replace(draw_setting(rng), seconds=12.0 if bench is None else 10.0)
        if scatter:
            strut = replace(strut, built=draw_shell(rng, scatter, DAMPING))
        setting = setting if bench is None else bench.record_with(setting)
        case = Case(f"Q-{seed}-{k:03d}", "element", int(rng.integers(2**31)), strut, setting, {}, {}, bench=bench)
        make = DRAWN[k % len(DRAWN)]
        if make is None:
            yield "nothing", case, Truth("nothing", (), "", {})
        else:
            name, world, truth = _sized(make, case, scatter, rng)
            yield name, replace(case, hidden=world), truth


def _sized(
    make: Callable[[Rng], Unit], case: Case, scatter: float, rng: Rng
) -> tuple[str, Callable[[World], World], Truth]:
    """Return a unit as large as drawn; what would be larger than anybody leaves there is drawn again."""
    seen = Seen(case, scatter)
    while True:
        unit = make(rng)
        wanted, each = _log(rng, *SEEN), seen.per_part(unit)
        part = wanted / each
        if part <= unit.most:
            return unit.name, partial(_with, unit, part), replace(unit.truth(part), seen=wanted)


def _with(unit: Unit, part: float, world: World) -> World:
    return unit.world(world, part)


class Seen:
    """Standard deviations of a small element on a strut, by its generator's own responses."""

    def __init__(self, case: Case, scatter: float) -> None:
        self.bare, self.f = case.world, np.geomspace(*BAND_HZ, BINS)
        self.whiten = whiteners(frf(self.bare, self.f), case.setting, self.f)
        rows = [stacked(self.whiten, h) for h in (*sensitivities(case.strut, self.f), *self._of_modes(scatter))]
        self.J = np.array(rows).T

    def _of_modes(self, scatter: float) -> Iterator[Complex]:
        """Yield the change of the response per standard deviation of each mode's frequency."""
        built = self.bare.strut.built
        if built is None:
            return
        for k in range(built.frequency.size):  # those far above the band too: by the compliance that they give
            there = []
            for sign in (1, -1):
                factor = built.frequency.copy()
                factor[k] *= 1 + sign * SPREAD
                moved = replace(self.bare.strut, built=replace(built, frequency=factor))
                there.append(frf(World(moved), self.f))
            yield (there[0] - there[1]) * scatter / (2 * SPREAD)

    def per_part(self, unit: Unit) -> float:
        """Return the standard deviations of one part of it beyond all that the strut could do, from so little of it
        that nothing bends: of a shift of a sharp peak by a hundredth, what bends alone is many standard deviations."""
        still = frf(unit.world(self.bare, NONE * unit.most), self.f)
        A = np.vstack([self.J, np.eye(self.J.shape[1])])
        lo, hi = np.log(NONE * unit.most), np.log(unit.most)
        for _ in range(HALVINGS):
            part = float(np.exp((lo + hi) / 2))
            off = stacked(self.whiten, frf(unit.world(self.bare, part), self.f) - still)
            lo, hi = (lo, np.log(part)) if np.linalg.norm(off) > SMALL else (np.log(part), hi)
        b = np.concatenate([off, np.zeros(self.J.shape[1])])
        return float(np.linalg.norm(b - A @ np.linalg.lstsq(A, b, rcond=None)[0])) / part


def right_places(right: Sequence[tuple[str, str]], places: Sequence[Mapping[str, object]]) -> bool:
    """Return whether a class of places holds one that is right; "" is against anything."""
    return any(p["part"] == part and against in ("", p["against"]) for p in places for part, against in right)
