"""Generic elements of an explanation in words: place, kind, values, likely causes, the measurement that tells more."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from checks.fitting.fit import Fit
from checks.gap.decision.gates import Claim
from checks.gap.decision.result import Ambiguous, FoundElement, FoundPlace, NamedValue
from checks.gap.effects import EFFECTS
from checks.gap.modelling.element import (
    ACROSS,
    BESIDE_THE_AXIS,
    DAMPER,
    JOINT,
    MASS,
    OF_PLACE,
    RESONATOR,
    SPRING,
    GenericElement,
)
from checks.gap.modelling.unmodelled_modes import FILTER, UnmodelledMode
from checks.gap.search.candidate import Candidate
from checks.gap.search.forward import SearchResult
from checks.model.model import Model
from checks.model.structure.attached import BETWEEN
from checks.rounding import rounded
from specs import model_sections
from specs.model import ModelDocument
from specs.model_sections import ByChannel, ModelSection
from specs.units import DIMENSIONLESS, unit_of

FitAll = Callable[[Candidate], Fit]
Unnamed = GenericElement | UnmodelledMode
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
OTHER_VALUES = "other values of"
SHOWN = 3  # places besides the best that a sentence lists


def found_elements(
    claims: Sequence[Claim], rivals: Sequence[Ambiguous], result: SearchResult, fit: Fit, full: Candidate, again: FitAll
) -> tuple[FoundElement, ...]:
    """Return the elements among the claims that passed every gate, each with all places that do as well; and those that
    do as well as a named effect, which loses its name. again: fits a rival to all bins."""
    out = []
    for claim in claims:
        effect, model = claim.effect, full.response.model
        alike = {n for a in rivals if effect.name in a.effects for n in a.effects} - {effect.name}
        others = _rivals_by_element(result, effect.name, alike)
        library = tuple(sorted(n for n in alike if n not in {e.name for e, _ in others}))
        if isinstance(effect, GenericElement):
            out.append(replace(found_element(effect, others, fit, model, library), fitted=effect.name))
        elif others:
            (first, rival), *rest = others
            out.append(found_element(first, rest, again(rival), model, (effect.name, *library)))
    return tuple(out)


def _rivals_by_element(result: SearchResult, name: str, alike: set[str]) -> list[tuple[GenericElement, Candidate]]:
    """Return the elements that do as well in the place of a member, the best first."""
    best: dict[str, tuple[GenericElement, Candidate]] = {}
    for rival in sorted(result.rivals, key=lambda c: -c.score):
        for e in rival.response.effects:
            if isinstance(e, GenericElement) and e.name in alike - (result.best.names - {name}):
                best.setdefault(e.name, (e, rival))
    return [*best.values()]


def found_element(
    e: Unnamed,
    others: Sequence[tuple[Unnamed, Candidate]],
    fit: Fit,
    model: Model,
    library: tuple[str, ...] = (),
) -> FoundElement:
    """Return a member of an explanation in words, with its values. others: what does as well in its place; library:
    effects that do."""
    shown = {p.name: NamedValue(fit.at[n], *fit.interval(n)) for p in e.parameters if (n := f"{e.name}.{p.name}")}
    places = [_place(e, {k: v.value for k, v in shown.items()})]
    places += [_place(o, rival.response.of(rival.at, o.name)) for o, rival in others]
    first: dict[tuple[str, str, str], FoundPlace] = {}
    for p in places:
        first.setdefault((p.part, p.against, p.direction), p)
    places = [*first.values()]
    kind = e.of_kind
    values = _ratios(e, shown, model, fit) if kind == JOINT else {k: v for k, v in shown.items() if k[1:] != "_mm"}
    causes = tuple(dict.fromkeys(c for o in (e, *(o for o, _ in others)) for c in _causes(o)))
    words = _sentence(kind, places, values, causes[0], library)
    return FoundElement(kind, tuple(places), values, words, causes, _experiment(places, library), library)


def _causes(e: Unnamed) -> tuple[str, ...]:
    return LOOKS_LIKE.get((e.of_kind, e.place)) or OF_KIND[e.of_kind]


def _place(e: Unnamed, values: Mapping[str, float]) -> FoundPlace:
    if not e.direction:
        return FoundPlace(e.place, e.against, "")
    point = None
    if e.place in NODES:
        point = (values.get("x_mm", 0.0), values.get("y_mm", 0.0), 0.0)
    part, _, end = ("top interface" if e.place == "apa" else e.place.replace("_", " ")).partition(BETWEEN)
    other = AGAINST.get(e.place, f"across the {part}" if e.place in ACROSS else end or "ground")
    return FoundPlace(part, other, e.direction, point)


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


def _sentence(
    kind: str, places: Sequence[FoundPlace], values: Mapping[str, NamedValue], cause: str, library: tuple[str, ...]
) -> str:
    if not places[0].direction:
        what = _where(places[0])
    else:
        what = f"{places[0].part} of other stiffness" if kind == JOINT else f"{WORDS[kind]} {_where(places[0])}"
    numbers = ", ".join(_value_words(name, v) for name, v in values.items())
    more = [_where(p) for p in places[1 : 1 + SHOWN]]
    beyond = len(places) - 1 - len(more)
    others = f" As good: {'; '.join(more)}{f'; and {beyond} more' if beyond > 0 else ''}." if more else ""
    names = f" Explained as well by {', '.join(map(_label, library))}." if library else ""
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


def _experiment(places: Sequence[FoundPlace], library: tuple[str, ...]) -> str:
    """Return the next measurement: without the part, a constant of the signal path would stay."""
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


def _parameter_words() -> str:
    """Return the pattern of the flat names of a model's parameters: no other words with dots."""
    kinds = (k for k in vars(model_sections).values() if isinstance(k, type) and issubclass(k, ModelSection))
    axis = f"(?:_(?:[xyz]|{'|'.join(ByChannel.model_fields)}))?"
    key = "|".join(sorted({n.replace("_", f"{axis}_", 1) for k in kinds for n in k.model_fields}, reverse=True))
    place = "|".join((*BESIDE_THE_AXIS, *ACROSS, *OF_PLACE, "bottom", "top"))
    return rf"(?:{'|'.join(ModelDocument.model_fields)}|element)(?:\.(?:{place}|R?[xyz]))*\.(?:{key})(?:_\d{{1,3}})?"


def element_words() -> tuple[str, str]:
    """Return the patterns of every sentence and of every next measurement, for any numbers."""
    causes = {c for each in (*LOOKS_LIKE.values(), *OF_KIND.values()) for c in each}
    parts = {"base", "ground", *(p.replace("_", " ") for p in (*BESIDE_THE_AXIS, *ACROSS, *OF_PLACE))}
    part, cause, kind = ("|".join(map(re.escape, words)) for words in (parts, causes, WORDS.values()))
    value_of = _parameter_words()
    name = rf"(?:{'|'.join(n.replace('_', ' ') for n in EFFECTS)}|{OTHER_VALUES} {value_of}(?:, {value_of})*)"
    number, point = r"-?[\d.e+-]{1,20}", r"(?:, at \(-?\d+, -?\d+\) mm)?"
    where = rf"(?:across the (?:{part}|APA)|to (?:{part}) at the (?:{part})), (?:along|about) [xyz]{point}"
    symbol = r"(?:[A-Za-z]{1,3}|(?:damping|kz|kR|kxy) ratio)"
    value = rf"{symbol} {number}(?: [NmskgHzradu2/ ]{{1,9}})? \(95 %: {number} to {number}\)"
    what = rf"Something like a (?:(?:{kind}) {where}|(?:{part}) of other stiffness): {value}(?:, {value})*"
    others = rf"(?: As good: {where}(?:; {where})*(?:; and \d+ more)?\.)?"
    library = rf"(?: Explained as well by {name}(?:, {name})*\.)?"
    removed = rf"repeat the record with whatever touches or hangs on the (?:{part})(?: and the (?:{part}))* removed"
    gone = rf"(?:it is then gone|an element there is then gone, {name}(?: and {name})* stays)"
    experiment = rf"{removed}(?:, one part after the other)?: {gone}"
    return rf"{what}; (?:{cause}) would look like this\.{others}{library}", experiment
