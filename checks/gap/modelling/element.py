"""Generic elements: what attaches to the strut at a place, along a direction, of a kind. They are members of an
explanation as the library's effects are, and have place, kind and values in place of a name."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import nan, sqrt

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment
from checks.model.model import Model
from checks.model.structure.attached import BETWEEN, DIRECTIONS, TILTS, Places, quantities_of

SPRING, MASS, DAMPER, RESONATOR, JOINT = "spring", "mass", "damper", "resonator", "joint"
ROCKING = "payload"  # of which the inertia about its centre of mass hangs on its guide
HOLDER = "holder"  # a spring with a mass and a damper of its own, at one point
PARTS = (SPRING, MASS, DAMPER)  # of a holder
KINDS = (SPRING, MASS, DAMPER, HOLDER, RESONATOR, JOINT, ROCKING)
KINDRED = {RESONATOR: (RESONATOR, ROCKING), ROCKING: (ROCKING, RESONATOR)}  # kinds that move the axis alike
UNITS = {"k_N_per_um": 1e6, "spring_N_per_um": 1e6}  # in SI
LEAST = 1e-5  # kg that hangs: less is not seen
LEVER = 1e-4  # m2: of a rotation's values, a lever of a centimetre
OFF_AXIS_MM, REACH_MM = 15.0, 60.0
BESIDE_THE_AXIS = ("top_interface", "bottom_interface")  # where an element along z may sit beside the axis
STACKS = frozenset({"sensor_stack", "actuator_stack"})
ACROSS = STACKS | {"top_joint", "bottom_joint", "apa"}
OF_PLACE = {"payload": "z", "sensor_stack": "x", "actuator_stack": "x", "head": "xyz", "ruler": "xyz"}
OF_APA = ("z", "Rx", "Ry", "Rz")  # what two ends of a body that turns as a whole keep


@dataclass(frozen=True)
class Direction:
    """A direction of a place, at a point [mm] beside its node."""

    place: str
    direction: str
    point: tuple[float, float] = (0.0, 0.0)


def directions(places: Places) -> Iterator[Direction]:
    """Yield every direction in which an element may act at some places: those in which they move."""
    for place, rows in places.items():
        wanted = OF_APA if place == "apa" else OF_PLACE.get(place, DIRECTIONS)
        yield from (Direction(place, d) for d in wanted if rows[DIRECTIONS.index(d)].any())
        if place in BESIDE_THE_AXIS:
            for sign in (-OFF_AXIS_MM, OFF_AXIS_MM):
                yield from (Direction(place, "z", point) for point in ((sign, 0.0), (0.0, sign)))


@dataclass(frozen=True, kw_only=True)
class GenericElement(Effect):
    """An element at a place of the structure. place, direction: as `checks.model.structure.attached` names them; kind:
    of its dynamic stiffness."""

    place: str
    direction: str
    kind: str
    against = "factor on all"  # of a family, which has no direction

    @property
    def rivals_elements(self) -> bool:
        return True

    @property
    def of_kind(self) -> str:
        """Return its kind for readers: a holder is a spring that weighs something."""
        return SPRING if self.kind == HOLDER else self.kind

    @property
    def sizes(self) -> tuple[Parameter, ...]:
        """Return the parameters that say what it is: without those that say where."""
        return tuple(p for p in self.parameters if not p.name.endswith("_mm"))

    @property
    def label(self) -> str:
        return f"a {self.kind} at the {self.place.replace('_', ' ')} along {self.direction}"

    def attached_to(self, model: Model) -> Model:
        return model.with_elements({**model.elements, **{t: p.start for p in self.parameters for t in p.sets}})

    def detached_from(self, model: Model) -> Model:
        own = {t for p in self.parameters for t in p.sets}
        return model.with_elements({n: v for n, v in model.elements.items() if n not in own})


@lru_cache(maxsize=512)
def element(place: str, direction: str, kind: str) -> GenericElement:
    """Return the element of a kind at a place along a direction."""
    parameters = [*_of_kind(f"element.{place}.{direction}", direction, kind)]
    if direction == "z" and place in BESIDE_THE_AXIS:
        parameters += _beside(f"{place}.z", "xy")
    return _element(place, direction, kind, parameters)


def kind_of(member: object) -> str:
    """Return the kind of an element, "" for another member."""
    return member.kind if isinstance(member, GenericElement) else ""


def parts_of(member: object) -> list[GenericElement]:
    """Return the elements of one value that could be in the place of one of several, as a resonator that hardly swings
    is a damper; none for another member."""
    if member is rocking(read=True):
        return [rocking()]
    if not isinstance(member, GenericElement) or member.kind not in (HOLDER, RESONATOR):
        return []
    return [element(member.place, member.direction, kind) for kind in kinds_at(member.place, PARTS)]


def kinds_at(place: str, kinds: Iterable[str] = KINDS) -> list[str]:
    """Return the kinds of elements of rank one at a place. What lies across a part has no mass of its own; a stack is
    solid, so nothing swings in it, and what would is a filter of the drive or of Vs; a mass on the payload is an effect
    of the library."""
    without = {JOINT, ROCKING}
    if place in STACKS:
        without.add(RESONATOR)
    if BETWEEN in place:
        without.add(HOLDER)
    if is_across(place) or place == "payload":
        without.add(MASS)
    return [k for k in kinds if k not in without]


def is_across(place: str) -> bool:
    """Return whether a place reads the motion across a part, or of one point against another."""
    return place in ACROSS or BETWEEN in place


def has_negative(member: Effect, values: Mapping[str, float]) -> bool:
    """Return whether a member takes away a mass, a damper, a lag or, except in a part that may be softer than drawn, a
    spring."""
    softer = isinstance(member, GenericElement) and is_across(member.place)
    positive = ("m_kg", "J_", "c_", "tau_", *(() if softer else ("k_",)))
    return any(v <= 0.0 for n, v in values.items() if n.startswith(positive))


def on_the_other_side(e: Effect, values: Mapping[str, float]) -> dict[str, float]:
    """Return values of an element that may be there in the place of such as may not: beside the axis, what is taken
    away on one side bends the strut as what is added on the other does."""
    if "x_mm" not in values or not has_negative(e, values):
        return dict(values)
    return {n: -v if n.endswith("_mm") else abs(v) for n, v in values.items()}


@lru_cache(maxsize=2)
def joint(place: str) -> GenericElement:
    """Return the joint at one end whose stiffnesses and dampings differ from the model's."""

    def along(which: Iterable[str], kind: str) -> tuple[str, ...]:
        return tuple(f"element.{place}.{d}.{quantities_of(d)[kind]}" for d in which)

    return _element(
        place,
        "z",
        JOINT,
        [
            _free("k_N_per_um", along("z", "spring"), 1e3, 5.0),
            _free("kR_Nm_per_rad", along(("Rx", "Ry"), "spring"), 100.0, 0.3),
            _free("kxy_N_per_um", along("xy", "spring"), 1e3, 1.0),
            _free("c_N_s_per_m", along("z", "damper"), 1e5, 20.0),
            _free("cR_Nm_s_per_rad", along(("Rx", "Ry"), "damper"), 10.0, 1e-3),
        ],
    )


@lru_cache(maxsize=2)
def rocking(read: bool = False) -> GenericElement:
    """Return the payload whose centre of mass lies beside the axis (x, y), and which rocks on its guide. read: whether
    da may be read beside the axis."""

    def both(quantity: str) -> tuple[str, ...]:
        return tuple(f"element.payload.{d}.{quantity}" for d in TILTS)

    where = Parameter("read_share", lo=-10.0, hi=10.0, off=nan, start=1.0, scale=0.1, sets=both("read_share"))
    one = _element(
        "payload",
        "z",
        ROCKING,
        [
            Parameter("J_kg_m2", lo=1e-4, hi=50.0, off=0.03, start=0.03, scale=1e-3, sets=both("hung_kg_m2")),
            *_swinging(both("hung_Hz"), both("hung_damping_ratio")),
            *_beside("payload.Ry", "x"),
            *_beside("payload.Rx", "y"),
            *([where] if read else []),
        ],
    )
    return replace(one, name=f"{one.name}_read") if read else one


def seems_to_hang(values: Mapping[str, float], m: float) -> dict[str, float]:
    """Return the mass on a spring that a rocking payload of mass m [kg] seems to be along the axis."""
    away = 1e-6 * m * (values["x_mm"] ** 2 + values["y_mm"] ** 2)
    slower = sqrt(values["J_kg_m2"] / (values["J_kg_m2"] + away))
    of_both = {n: slower * values[n] for n in ("f_Hz", "damping_ratio")}
    return {"m_kg": m * away / (values["J_kg_m2"] + away), **of_both}


@lru_cache(maxsize=64)
def family(name: str, shares: tuple[str, ...]) -> GenericElement:
    """Return the parts of a family that are all off by one factor, on top of what each may be off alone."""
    common = Parameter("factor", lo=-0.95, hi=20.0, scale=0.01, adds=shares)
    return _element(name, "", JOINT, [common])


def _element(place: str, direction: str, kind: str, parameters: list[Parameter]) -> GenericElement:
    return GenericElement(
        name=f"{kind}_{place}_{direction}",
        title=f"{kind} at {place.replace('_', ' ')}",
        parameters=tuple(parameters),
        channels=("da", "de", "Vs"),
        sign="one dynamic stiffness explains every channel",
        sentence="",
        sources=("[GAP] 12",),
        experiment=Experiment.TURN,
        place=place,
        direction=direction,
        kind=kind,
    )


def _free(name: str, sets: tuple[str, ...], reach: float, scale: float) -> Parameter:
    return Parameter(name, lo=-reach, hi=reach, scale=scale, sets=sets)


def _beside(head: str, axes: str) -> list[Parameter]:
    """Return the coordinates of a point beside the axis."""
    return [_free(f"{a}_mm", (f"element.{head}.point_{a}_mm",), REACH_MM, 2.0) for a in axes]


def _of_kind(head: str, direction: str, kind: str) -> Iterator[Parameter]:
    names, turns = quantities_of(direction), direction.startswith("R")
    size = LEVER if turns else 1.0
    mass = "J_kg_m2" if turns else "m_kg"
    if kind in (SPRING, HOLDER):
        yield _free(
            "k_Nm_per_rad" if turns else "k_N_per_um", (f"{head}.{names['spring']}",), 1e3, 0.5 if turns else 0.01
        )
    if kind in (MASS, HOLDER):
        yield _free(mass, (f"{head}.{names['mass']}",), 50.0, 0.01 * size)
    if kind in (DAMPER, HOLDER):
        yield _free("c_Nm_s_per_rad" if turns else "c_N_s_per_m", (f"{head}.{names['damper']}",), 1e5, 5.0 * size)
    if kind == RESONATOR:
        least = LEAST * size
        yield Parameter(
            mass, lo=least, hi=50.0, off=least, start=least, scale=0.01 * size, sets=(f"{head}.{names['hung']}",)
        )
        yield from _swinging((f"{head}.hung_Hz",), (f"{head}.hung_damping_ratio",))


def _swinging(f_Hz: tuple[str, ...], ratio: tuple[str, ...]) -> Iterator[Parameter]:
    """Yield the frequency and the damping ratio of what hangs."""
    yield Parameter("f_Hz", lo=2.0, hi=5000.0, off=100.0, start=100.0, scale=1.0, sets=f_Hz)
    yield Parameter("damping_ratio", lo=5e-4, hi=0.7, off=0.02, start=0.02, scale=5e-3, sets=ratio)
