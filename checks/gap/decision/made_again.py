"""Words and pictures of gap.json, made again from the data beside them, so that a reader need not believe them."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import permutations
from typing import Any

from checks.gap.decision.elements import NAMES, PLACE_OF, alike_in, causes_of, element_experiment, element_sentence
from checks.gap.decision.next_experiment import every_experiment
from checks.gap.decision.panels import magnitude_panel, residual_panel
from checks.gap.decision.result import FoundPlace, NamedValue
from checks.gap.effects import EFFECTS
from checks.gap.modelling.unmodelled_modes import ALL, unmodelled_modes
from checks.gap.preparation.inputs import dead_fault, exchange_fault, offset_fault, sign_fault
from checks.model.channel_paths import CHANNELS
from checks.model.structure.attached import DIRECTIONS
from checks.picture import Band, Line, Panel

PATHS = {(m.place, m.against) for m in unmodelled_modes(CHANNELS)}
SAMPLES = "samples"  # the parameter of a fault of the records


def contradictions(document: Mapping[str, Any], channels: Sequence[str]) -> Iterator[str]:
    """Yield what gap.json, or what a judged unit states of it, says otherwise than its own values. channels: those that
    responses can have."""
    for entry in document.get("named", ()):
        effect = str(entry["effect"])
        own = {p.name for p in EFFECTS[effect].parameters} if effect in EFFECTS else {SAMPLES}
        if unknown := [name for name in entry["parameters"] if name not in own]:
            yield f"gives '{effect}' the parameter '{unknown[0][:60]}'"
        elif entry["sentence"] not in _sentences(effect, _values(entry), channels):
            yield f"describes '{effect}' in words that are not its own"
    for entry in document.get("elements", ()):
        with suppress(KeyError, ValueError):
            sentence, removed = _element_texts(entry)
            if entry["sentence"] == sentence and entry["experiment"] in {removed, *every_experiment()}:
                continue
        yield "describes an element in words that are not its own"
    compared = document.get("gap_before", {}).get("channels", {})
    poles = [str(pole["channel"]) for pole in document.get("unnamed", ())]
    for channel in (*(c for c in poles if c != ALL), *compared):
        if channel not in channels:
            yield f"names a channel '{channel[:60]}', which no response has"


def _sentences(effect: str, values: Mapping[str, NamedValue], channels: Sequence[str]) -> set[str]:
    """Return every sentence of an effect with these values: of the library, or of a fault of the records, whose channel
    is not stated."""
    at = {name: v.value for name, v in values.items()}
    pairs = map(exchange_fault, permutations(channels, 2))
    late = [offset_fault(c, round(at[SAMPLES])) for c in channels] if at.keys() == {SAMPLES} else []
    every = [*map(dead_fault, channels), *map(sign_fault, channels), *pairs, *late]
    said = {fault.words for fault in every if fault.effect == effect and fault.parameters == at}
    if effect in EFFECTS and at.keys() == {p.name for p in EFFECTS[effect].parameters}:
        said |= EFFECTS[effect].sentences(at, {name: (v.hi - v.lo) / 2 for name, v in values.items()})
    return said


def _element_texts(entry: Mapping[str, Any]) -> tuple[str, str]:
    """Return the sentence and the next measurement of an element. What explains the records as well is no key of its
    own: it is read from the stated sentence. Raises KeyError or ValueError for what no analysis finds."""
    places = [FoundPlace(p["part"], p["against"], p["direction"], p["point_mm"]) for p in entry["places"]]
    if not places or not all(_is_place(p) for p in places):
        raise ValueError("an element at a place that no model has")
    kind, library, stated = entry["kind"], alike_in(entry["sentence"]), _values(entry)
    if not stated.keys() <= {*NAMES}:
        raise ValueError("a value that no element has")
    cause = causes_of(kind, PLACE_OF.get((places[0].part, places[0].against), ""))[0]
    values = {name: stated[name] for name in NAMES if name in stated}
    return element_sentence(kind, places, values, cause, library), element_experiment(kind, places, library)


def _is_place(p: FoundPlace) -> bool:
    """Return whether a model has a place, in its mechanics or in its signal path."""
    if not p.direction:
        return (p.part, p.against) in PATHS
    return (p.part, p.against) in PLACE_OF and p.direction in DIRECTIONS


def picture_again(name: str, panel: Panel, document: Mapping[str, Any]) -> Panel:
    """Return a panel of `gap_panels`, magnitude or residual by its name, made of the curves of `panel` and otherwise of
    gap.json, which is `document`. Raises ValueError if `panel` does not have these curves."""
    channel, _, kind = name.partition(" ")
    curves = [(item.x, item.y) for item in panel.items if isinstance(item, Line)]
    if kind == "magnitude":
        measured, before, after = curves
        return magnitude_panel(channel, measured, before, after)
    before, after = curves
    (allowed,) = ((item.x, item.hi) for item in panel.items if isinstance(item, Band))
    where = [(w["f_lo_Hz"], w["f_hi_Hz"]) for w in document["where"] if w["channel"] == channel]
    poles = [f for u in document["unnamed"] if u["channel"] == channel for f in u["poles_Hz"][:1]]
    return residual_panel(channel, allowed, before, after, where, poles)


def _values(entry: Mapping[str, Any]) -> dict[str, NamedValue]:
    return {name: NamedValue(v["value"], *v["ci95"]) for name, v in entry["parameters"].items()}
