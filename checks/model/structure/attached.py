"""Elements attached to the strut: a spring, a damper, a mass, or a mass that hangs on a spring, along one direction of
a place, against ground or across a part.

They are values of the model by flat name, `element.<place>.<direction>.<quantity>`, so that whatever varies a model's
values can vary them too: element.top_interface.z.spring_N_per_um, element.payload.z.hung_Hz."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex, between_zeros
from checks.errors import ModelError
from checks.model.structure.matrix_builder import Builder
from checks.model.structure.rigid_motion import lever

ELEMENT = "element."  # beginning of the names of their values
TILT = f"{ELEMENT}payload.R"  # of those of a payload that rocks: its inertia hangs on its guide
DIRECTIONS = ("x", "y", "z", "Rx", "Ry", "Rz")
TILTS = ("Rx", "Ry")  # in which a payload may rock
BETWEEN = " to "  # in the name of a place that reads the motion of one point against another
SIDES = {
    "+x": (0.03, 0.0),
    "-x": (-0.03, 0.0),
    "+y": (0.0, 0.03),
    "-y": (0.0, -0.03),
}  # [m] beside a place: its name ends so
PER_UM = 1e6
Places = Mapping[str, Array]  # place -> rows (6, n) that read its motion, or the motion across it


@dataclass(frozen=True)
class Attached:
    """Values in SI; point (2,) [m]: x and y of the place's point from its node. hung: mass [kg] or inertia [kg m2],
    frequency [Hz] and damping ratio of a hanging element, or None. Of a payload that rocks, point is its centre of mass
    beside the axis, and read where da is read: 0 there, 1 on the axis."""

    place: str
    direction: str
    spring: float
    damper: float
    mass: float
    point: tuple[float, float]
    hung: tuple[float, float, float] | None
    read: float = 1.0

    @property
    def tilts(self) -> bool:
        """Return whether it is no element beside the strut, but the payload's own inertia on its guide."""
        return self.place == "payload" and self.direction in TILTS and self.hung is not None

    def stiffness(self, s: Complex) -> Complex:
        """Return its dynamic stiffness (F,) at s (F,) [1/s]."""
        z = self.spring + self.damper * s + self.mass * s * s
        if self.hung is not None:
            mass, f_Hz, ratio = self.hung
            link = (2.0 * np.pi * f_Hz) * (2.0 * np.pi * f_Hz + 2.0 * ratio * s)
            z += mass * s * s * link / (s * s + link)
        return np.asarray(z)


def quantities_of(direction: str) -> dict[str, str]:
    """Return the names of the quantities of an element along a direction, by kind."""
    turns = direction.startswith("R")
    return {
        "spring": "spring_Nm_per_rad" if turns else "spring_N_per_um",
        "damper": "damper_Nm_s_per_rad" if turns else "damper_N_s_per_m",
        "mass": "added_kg_m2" if turns else "added_kg",
        "hung": "hung_kg_m2" if turns else "hung_kg",
    }


def check_elements(values: Mapping[str, float]) -> None:
    """Raise ModelError for a quantity that no element along its direction has, or for something that hangs and lacks
    its mass, frequency or damping ratio."""
    for head in dict.fromkeys(n.rpartition(".")[0] for n in values if n.startswith(ELEMENT)):
        names = quantities_of(head.rpartition(".")[2])
        hangs = {f"{head}.{q}" for q in (names["hung"], "hung_Hz", "hung_damping_ratio")}
        have = {f"{head}.{q}" for q in (*names.values(), "point_x_mm", "point_y_mm", "read_share")} | hangs
        given = {n for n in values if n.startswith(f"{head}.")}
        wrong = sorted(given - have) or (sorted(hangs - given) if given & hangs else [])
        if wrong:
            why = "is missing" if wrong[0] not in given else f"expected one of {', '.join(sorted(have))}"
            raise ModelError(f"{wrong[0]}: {why}")


def attached_of(values: Mapping[str, float]) -> tuple[Attached, ...]:
    """Return the elements that a model's values describe."""
    heads = dict.fromkeys(n.rpartition(".")[0] for n in values if n.startswith(ELEMENT))
    return tuple(_attached(values, head) for head in heads)


def _attached(values: Mapping[str, float], head: str) -> Attached:
    _, place, direction = head.split(".")
    names = quantities_of(direction)

    def at(quantity: str) -> float:
        return values.get(f"{head}.{quantity}", 0.0)

    hung = (at(names["hung"]), at("hung_Hz"), at("hung_damping_ratio")) if f"{head}.hung_Hz" in values else None
    per = 1.0 if direction.startswith("R") else PER_UM
    point = (1e-3 * at("point_x_mm"), 1e-3 * at("point_y_mm"))
    read = values.get(f"{head}.read_share", 1.0)
    k, c, m = per * at(names["spring"]), at(names["damper"]), at(names["mass"])
    return Attached(place, direction, k, c, m, point, hung, read)


def row_of(places: Places, place: str, direction: str, point: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return the row (n,) of the motion of a place, or of its side, along a direction. Raises ModelError without it."""
    if place[-2:] in SIDES:
        place, point = place[:-2], SIDES[place[-2:]]
    if place not in places:
        have = ", ".join(places)
        raise ModelError(f"an element is attached to {place}, which this strut does not have (has: {have})")
    row: Array = (lever((*point, 0.0)) @ places[place])[DIRECTIONS.index(direction)]
    return row


def attach(b: Builder, places: Places, elements: tuple[Attached, ...], first: int) -> None:
    """Add elements to the matrices under construction. first: number of the first motion of hanging ones."""
    for e in elements:
        row = row_of(places, e.place, e.direction, e.point)
        b.spring(row[None], np.array([e.spring]), np.array([e.damper]))
        b.along(row[None], e.mass)
        if e.hung is not None:
            mass, f_Hz, ratio = e.hung
            own, w = np.eye(first + 1)[first], 2.0 * np.pi * f_Hz
            away = own if e.tilts else own - between_zeros(row, 0, own.size - row.size)
            b.spring(away[None], np.array([mass * w * w]), np.array([2.0 * ratio * w * mass]))
            b.along(own[None], mass)
            first += 1


def axis_of_payload(elements: tuple[Attached, ...], payload: int, first: int) -> tuple[Array, Array]:
    """Return the rows (6, n) that read the payload's motion where the strut's axis meets it, and the row (n,) that da
    reads. payload: number of the motion of its centre of mass; first: of the first one of what hangs."""
    hung = [e for e in elements if e.hung is not None]
    rows = np.zeros((6, first + len(hung)))
    rows[DIRECTIONS.index("z"), payload] = 1.0
    read = rows[DIRECTIONS.index("z")].copy()
    for k, e in enumerate(hung, first):
        if e.tilts:
            about = DIRECTIONS.index(e.direction)
            rise = lever((-e.point[0], -e.point[1], 0.0))[DIRECTIONS.index("z"), about]
            rows[about, k], rows[DIRECTIONS.index("z"), k], read[k] = 1.0, rise, e.read * rise
    return rows, read


@dataclass(frozen=True, eq=False)
class PlaceReceptances:
    """Receptances for elements at F frequencies. places: rows (6, m) of each in terms of m motions; between (m, m, F):
    receptances; driven (m, F): motions per newton of drive; seen (m, F, C): measured channels per volt of Va, per unit
    of the drive's force that acts along a motion.

    An element of dynamic stiffness z along v changes the channels by reach(v) z / (1 + z own(v)), exactly and at every
    frequency alone."""

    places: Places
    between: Complex
    driven: Complex
    seen: Complex

    def along(self, place: str, direction: str, point: tuple[float, float] = (0.0, 0.0)) -> tuple[Complex, Complex]:
        """Return reach (F, C) and own (F,) of a direction."""
        v = row_of(self.places, place, direction, point)
        reach = -np.tensordot(v, self.seen, 1) * (v @ self.driven)[:, None]
        return reach, np.einsum("i,ijf,j->f", v, self.between, v)
