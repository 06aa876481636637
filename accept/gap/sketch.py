"""The place in the strut of the cause of a gap, and how sure it is: one picture of lines, true to scale, which each
medium draws in its own way."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from accept.gap.text import words_of
from checks.picture import Line, Panel

Point = tuple[float, float]  # x, z [mm] from the middle of the APA; the encoder beside it is turned into the picture

PLACES: dict[str, Point] = {  # parts, as elements and effects name them
    "payload": (0.0, 48.0),
    "top joint": (0.0, 27.75),
    "top interface": (0.0, 15.0),
    "apa": (0.0, 0.0),
    "bottom interface": (0.0, -15.0),
    "bottom joint": (0.0, -27.75),
    "base": (0.0, -43.0),
    "sensor stack": (-22.5, 0.0),
    "actuator stack": (12.5, 0.0),
    "head": (50.0, 12.0),
    "ruler": (50.0, -12.0),
}
_OF_EFFECT = {  # what lies in the rig's electronics has no place here
    "misalignment": ("top interface", "bottom interface"),
    "joint_axial_compliance": ("top joint", "bottom joint"),
    "payload_mass": ("payload",),
    **dict.fromkeys(("bench_mode", "support_mode"), ("base",)),
    **dict.fromkeys(("encoder_mass", "encoder_read_point", "encoder_bracket_mode", "encoder_scale"), ("head",)),
    **dict.fromkeys(("creep", "hysteresis"), ("actuator stack",)),
    **dict.fromkeys(
        ("open_circuit_stiffening", "sensor_highpass", "sensor_pickup", "sensor_polarity", "charge_highpass"),
        ("sensor stack",),
    ),
}
_SURE, _POSSIBLE = "bad", "model"  # roles
_RADIUS = 5.0  # mm


def place_panel(document: Mapping[str, Any], *, of_strut: bool = True) -> Panel | None:
    """Return the strut, or the APA alone, with the places of what gap.json names; None if nothing of it has a place."""
    causes = [line for marked in _causes(document) for line in _rings(*marked)]
    if not causes:
        return None
    drawn = [*_apa(), *(_around() if of_strut else ())]
    outline = (Line(x, z, role="quiet") for x, z in (np.array(points, float).T for points in drawn))
    return Panel("Where it sits, seen from the side", "x [mm]", "z [mm]", (*outline, *causes), equal=True)


def _causes(document: Mapping[str, Any]) -> Iterator[tuple[str, Sequence[Point], bool]]:
    """Yield what may be marked: words, places, and whether nothing else explains the records as well."""
    for named in document.get("named", ()):
        yield f"{words_of(named['effect'])}: the only cause that fits", _of_effect(named["effect"]), True
    for element in document.get("elements", ()):
        places = [_at(place) for place in element["places"]]
        sure = "the only place that fits" if len(places) == 1 else f"one of {len(places)} places"
        yield f"{element['kind']}: {sure}", [point for point in places if point], len(places) == 1
    for rivals in document.get("ambiguous", ()):
        for effect in rivals["effects"]:
            words = f"{words_of(effect)}: one of {len(rivals['effects'])} causes"
            yield words, _of_effect(effect), False


def _of_effect(effect: str) -> Sequence[Point]:
    return [PLACES[part] for part in _OF_EFFECT.get(effect, ())]


def _at(place: Mapping[str, Any]) -> Point | None:
    """Return where an element sits, beside its part's middle if that was estimated."""
    known = PLACES.get(place["part"].lower())
    beside = place.get("point_mm") or (0.0,)
    return None if known is None else (known[0] + beside[0], known[1])


def _rings(words: str, places: Sequence[Point], sure: bool) -> Iterator[Line]:
    """Yield a ring around each place, a full one if it is sure; the first has the words."""
    turn = np.linspace(0.0, 2.0 * math.pi, 33)
    for n, (x, z) in enumerate(places):
        for radius in (_RADIUS, _RADIUS / 2.0) if sure else (_RADIUS,):
            label = words if n == 0 and radius == _RADIUS else ""
            role = _SURE if sure else _POSSIBLE
            yield Line(x + radius * np.cos(turn), z + radius * np.sin(turn), label, role=role)


def _box(left: float, right: float, low: float, high: float) -> Sequence[Point]:
    return [(left, low), (right, low), (right, high), (left, high), (left, low)]


def _apa() -> Iterator[Sequence[Point]]:
    """Yield the shell and its stacks: the sensor at the left, then the two that drive."""
    turn = np.linspace(0.0, 2.0 * math.pi, 65)
    yield list(zip(39.0 * np.cos(turn), 15.0 * np.sin(turn), strict=True))
    for left in (-32.5, -7.5, 12.5):
        yield _box(left, left + 20.0, -5.0, 5.0)


def _around() -> Iterator[Sequence[Point]]:
    """Yield both joints, payload, base, and the encoder's head and ruler."""
    for side in (1.0, -1.0):
        for end in (1.0, -1.0):
            yield [(side * x, end * z) for x, z in ((8, 15), (8, 19), (2, 25), (2, 30.5), (8, 36.5), (8, 40.5))]
    yield _box(-25.0, 25.0, 40.5, 55.0)
    yield [(-35.0, -40.5), (35.0, -40.5)]
    for low in (8.0, -16.0):
        yield _box(45.0, 55.0, low, low + 8.0)
