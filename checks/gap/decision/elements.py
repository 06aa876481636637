"""Generic elements of an explanation in words: place, kind, values, likely causes, the measurement that tells more."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from checks.fitting.fit import Fit
from checks.gap.decision.alternatives import OTHER_VALUES, Alternatives, Unnamed
from checks.gap.decision.result import FoundElement, FoundPlace, NamedValue
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import PAYLOAD
from checks.gap.modelling.element import (
    ACROSS,
    BESIDE_THE_AXIS,
    DAMPER,
    JOINT,
    MASS,
    OF_PLACE,
    RESONATOR,
    ROCKING,
    SPRING,
)
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.unmodelled_modes import FILTER
from checks.gap.search.explanation import Alternative, Explanation
from checks.model.model import Model
from checks.model.parameters import is_declared
from checks.model.structure.attached import BETWEEN
from checks.quantity import TWO_SIDED_95
from checks.rounding import rounded
from specs.units import DIMENSIONLESS, unit_of

FitAll = Callable[[Explanation], Fit]
AGAINST = {"top_joint": "payload", "bottom_joint": "base", "apa": "bottom interface"}
NODES = ("top_interface", "bottom_interface", "payload")  # of which a point is stated
HANGS = "a cable, a hose or a loose part that swings there"
OFF_CENTRE = "a payload whose centre of mass lies beside the axis and rocks on its guide"
LOOKS_LIKE = {
    (SPRING, "payload"): ("bellows, a hose or a stop at the payload",),
    (SPRING, "apa"): ("a part that bridges the APA",),
    (SPRING, "sensor_stack"): ("a stack that is cracked or badly glued",),
    (SPRING, "actuator_stack"): ("a stack that is cracked or partly dead",),
    (SPRING, "top_joint"): ("a loose interface", "a joint of another stiffness"),
    (SPRING, "bottom_joint"): ("a loose interface", "a soft base"),
    (RESONATOR, "payload"): (HANGS, OFF_CENTRE),
    (RESONATOR, "apa"): (HANGS, OFF_CENTRE),
    (RESONATOR, "head"): ("a cable on the head",),
    (RESONATOR, "bottom_joint"): ("a base that gives way",),
    (RESONATOR, "bottom_interface"): ("a base that gives way", HANGS),
    (ROCKING, "payload"): (OFF_CENTRE,),
    (JOINT, "top_joint"): ("a loose screw at the top joint", "a joint of another batch"),
    (JOINT, "bottom_joint"): ("a loose screw at the bottom joint", "a joint of another batch"),
}
OF_KIND = {
    SPRING: ("a holder left in place", "a cable or hose under tension"),
    MASS: ("a part or tool left there",),
    DAMPER: ("something that rubs or is glued there",),
    RESONATOR: (HANGS,),
    JOINT: ("parts of another batch or another material",),
    FILTER: ("a sensor, an amplifier or a filter other than stated",),
}
WORDS = {SPRING: "spring", MASS: "mass", DAMPER: "damper", RESONATOR: "mass on a spring"}
ROCKS = "payload that rocks on its guide, its centre of mass beside the axis"
CENTRED = "repeat the record with the payload's centre of mass moved onto the axis of the strut: it then rocks no more"
AS_WELL = " Explained as well by "
NAMES = (  # of values of an element that is attached, in the order of a sentence
    *("k_N_per_um", "k_Nm_per_rad", "kz_ratio", "kR_ratio", "kxy_ratio", "m_kg", "J_kg_m2"),
    *("c_N_s_per_m", "c_Nm_s_per_rad", "cR_Nm_s_per_rad", "f_Hz", "ratio", "damping_ratio"),
    *("x_mm", "y_mm", "read_share"),
)
SHOWN = 3  # places besides the best that a sentence lists


def found_elements(classes: Sequence[Alternatives], fit: Fit, again: FitAll) -> tuple[FoundElement, ...]:
    """Return the elements among the claims that passed every gate, each with all places that do as well; and those that
    do as well as a named effect, which loses its name. fit: of the explanation; again: fits another to all bins."""
    out = []
    for own in classes:
        effect, model, elements = own.claim.effect, own.whole.response.model, own.elements
        library = tuple(n for n in own.names if n not in {m.member.name for m in elements})
        if isinstance(effect, Unnamed):
            found = found_element(effect, elements, fit, model, library, own.request)
            out.append(replace(found, fitted=effect.name))
        elif elements:
            first, *rest = elements
            names = (effect.name, *library)
            out.append(found_element(first.member, rest, again(first.whole), model, names, own.request))
    return tuple(out)


def found_element(
    e: Unnamed,
    others: Sequence[Alternative[Unnamed]],
    fit: Fit,
    model: Model,
    library: tuple[str, ...] = (),
    request: str = "",
) -> FoundElement:
    """Return a member of an explanation in words, with its values. others: what does as well in its place; library:
    effects that do; request: the experiment that separates them best, if one does."""
    shown = {p.name: NamedValue(fit.at[n], *fit.interval(n)) for p in e.parameters if (n := f"{e.name}.{p.name}")}
    places = [_place(e, {k: v.value for k, v in shown.items()})]
    places += [_place(o.member, o.whole.response.of(o.whole.at, o.member.name)) for o in others]
    first: dict[tuple[str, str, str], FoundPlace] = {}
    for p in places:
        first.setdefault((p.part, p.against, p.direction), p)
    places = [*first.values()]
    kind = e.of_kind
    if kind in (JOINT, ROCKING):
        values = (_ratios if kind == JOINT else _with_moving_mass)(e, shown, model, fit)
    else:
        values = {k: v for k, v in shown.items() if k[1:] != "_mm"}
    every = (e, *(o.member for o in others))
    causes = tuple(dict.fromkeys(c for o in every for c in causes_of(o.of_kind, o.place)))
    words = element_sentence(kind, places, values, causes[0], library)
    experiment = request or element_experiment(kind, places, library)
    return FoundElement(kind, tuple(places), values, words, causes, experiment, library)


def alike_in(sentence: str) -> tuple[str, ...]:
    """Return what a sentence says explains the records as well. Raises ValueError for what no analysis can name."""
    names = sentence.partition(AS_WELL)[2].removesuffix(".")
    of_effects = {f"{e.name}.{p.name}" for e in EFFECTS.values() for p in e.parameters}
    out: list[str] = []
    for name in names.split(", ") if names else ():
        value = name.removeprefix(f"{OTHER_VALUES} ")
        goes_on = value == name and bool(out) and out[-1].startswith(OTHER_VALUES)  # with the values before it
        if name in {_label(n) for n in EFFECTS}:
            out.append(name)
        elif (value == name and not goes_on) or not (value in of_effects or is_declared(value)):
            raise ValueError(f"'{name}' is neither an effect of the library nor a value of a model")
        else:
            out.append(f"{out.pop()}, {name}" if goes_on else name)
    return tuple(out)


def causes_of(kind: str, place: str) -> tuple[str, ...]:
    """Return the likely causes of an element, the first of which its sentence names."""
    return LOOKS_LIKE.get((kind, place)) or OF_KIND[kind]


def _place(e: Unnamed, values: Mapping[str, float]) -> FoundPlace:
    if not e.direction:
        return FoundPlace(e.place, e.against, "")
    point = None
    if e.place in NODES:
        point = (values.get("x_mm", 0.0), values.get("y_mm", 0.0), 0.0)
    return FoundPlace(*_parts(e.place), e.direction, point)


def _parts(place: str) -> tuple[str, str]:
    """Return the part at a place, and what it acts against."""
    part, _, end = ("top interface" if place == "apa" else place.replace("_", " ")).partition(BETWEEN)
    return part, AGAINST.get(place, f"across the {part}" if place in ACROSS else end or "ground")


PLACE_OF = {_parts(place): place for place in (*BESIDE_THE_AXIS, *sorted(ACROSS), *OF_PLACE)}  # of a strut


def _ratios(e: Unnamed, shown: dict[str, NamedValue], model: Model, fit: Fit) -> dict[str, NamedValue]:
    """Return a joint's stiffnesses as factors on those that the model has at the other end; dampers as they are."""
    out = {}
    own = {"k_N_per_um": ("kz", "kz_ratio"), "kR_Nm_per_rad": ("kRx", "kR_ratio"), "kxy_N_per_um": ("kx", "kxy_ratio")}
    if not e.direction:  # a family, whose parts are 1 as drawn
        return {n: NamedValue(1.0 + v.value, 1.0 + v.lo, 1.0 + v.hi) for n, v in shown.items()}
    for name, v in shown.items():
        if name not in own:
            out[name] = v
            continue
        of, ratio = own[name]
        side = e.place.removesuffix("_joint")
        heads = ("joint", f"joint.{side}")
        unit = "Nm_per_rad" if of == "kRx" else "N_per_um"
        target = next((n for head in heads if (n := f"{head}.{of}_{unit}") in model.values), None)
        if target is None:
            continue
        base = fit.at.get(target, model.values[target])
        out[ratio] = NamedValue(*(1.0 + x / base for x in (v.value, v.lo, v.hi)))
    return out


def _with_moving_mass(e: Unnamed, shown: dict[str, NamedValue], model: Model, fit: Fit) -> dict[str, NamedValue]:
    """Return the values of a payload of mass m that rocks, with the mass m^2 e^2 / (J + m e^2) that seems to hang on
    the axis in the place of its inertia J: responses tell little of J and of the distance e of its centre alone."""
    names = [f"{e.name}.{n}" for n in ("J_kg_m2", "x_mm", "y_mm")]
    at, m = [fit.names.index(n) for n in names], fit.at.get(PAYLOAD, model.values[PAYLOAD])
    J, x, y = (fit.at[n] for n in names)
    away = 1e-6 * m * (x * x + y * y)
    mass, by_away = m * away / (J + away), m * J / (J + away) ** 2
    slopes = np.array([-m * away / (J + away) ** 2, *(2e-6 * m * a * by_away for a in (x, y))])
    half = TWO_SIDED_95 * float(np.sqrt(slopes @ fit.cov[np.ix_(at, at)] @ slopes))
    return {"m_kg": NamedValue(mass, mass - half, mass + half), **{n: v for n, v in shown.items() if n != "J_kg_m2"}}


def element_sentence(
    kind: str, places: Sequence[FoundPlace], values: Mapping[str, NamedValue], cause: str, library: tuple[str, ...]
) -> str:
    """Return an element in words."""
    if not places[0].direction:
        what = _where(places[0])
    elif kind == ROCKING:
        what = ROCKS
    else:
        what = f"{places[0].part} of other stiffness" if kind == JOINT else f"{WORDS[kind]} {_where(places[0])}"
    numbers = ", ".join(_value_words(name, v) for name, v in values.items())
    of = {ROCKING: f"a {WORDS[RESONATOR]} ", FILTER: "something "}.get(kind, "")  # elsewhere it is of another kind
    more = [f"{of if p.direction else ''}{_where(p)}" for p in places[1 : 1 + SHOWN]]
    beyond = len(places) - 1 - len(more)
    others = f" As good: {'; '.join(more)}{f'; and {beyond} more' if beyond > 0 else ''}." if more else ""
    names = f"{AS_WELL}{', '.join(map(_label, library))}." if library else ""
    return f"Something like a {what}: {numbers}; {cause} would look like this.{others}{names}"


def _where(p: FoundPlace) -> str:
    """Return a place in words: "to ground at the top interface, along z, at (0, -16) mm"."""
    if not p.direction:
        return f"{p.against} {p.part}"
    to = p.against if p.against.startswith("across") else f"to {p.against} at the {p.part}"
    to = "across the APA" if p.against == AGAINST["apa"] else to
    beside = p.point_mm is not None and max(abs(x) for x in p.point_mm) >= 1.0
    point = f", at ({p.point_mm[0]:.0f}, {p.point_mm[1]:.0f}) mm" if beside and p.point_mm else ""
    return f"{to}, {'about' if p.direction.startswith('R') else 'along'} {p.direction[-1]}{point}"


def _value_words(name: str, v: NamedValue) -> str:
    unit = "" if unit_of(name) == DIMENSIONLESS else f" {unit_of(name)}"
    half = max((v.hi - v.lo) / 2.0, 1e-12)
    at, lo, hi = (rounded(x, half) for x in (v.value, v.lo, v.hi))
    return f"{name.partition('_')[0] if unit else name.replace('_', ' ')} {at}{unit} (95 %: {lo} to {hi})"


def element_experiment(kind: str, places: Sequence[FoundPlace], library: tuple[str, ...]) -> str:
    """Return the next measurement: without the part, a constant of the signal path would stay."""
    if kind in (ROCKING, FILTER):
        return CENTRED if kind == ROCKING else Experiment.LOOP_BACK.value
    parts = " and ".join(dict.fromkeys(f"the {p.part}" for p in places))
    what = f"repeat the record with whatever touches or hangs on {parts} removed"
    library = tuple(n for n in library if not n.startswith(OTHER_VALUES))
    if library:
        return f"{what}: an element there is then gone, {' and '.join(map(_label, library))} stays"
    more = ", one part after the other" if len(places) > 1 else ""
    return f"{what}{more}: it is then gone"


def _label(name: str) -> str:
    """Return an effect's name for readers, or other values of calibrated parameters as they are."""
    return name if name.startswith(OTHER_VALUES) else name.replace("_", " ")
