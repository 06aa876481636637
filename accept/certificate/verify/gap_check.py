"""The gap analysis on a certificate: its search is not repeated, but what it can be about, what it names and what its
pictures say is known without it."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.errors import InvalidCertificate
from accept.gap.start_model import applies
from accept.gap.text import GAP_PICTURES, REFUSED, on_certificate
from accept.pictures.jsonform import panels_to_json
from accept.units.unit_folder import UnitFolder
from checks.acceptance import CHECKS
from checks.picture import Panel
from specs.model import builtin_models
from specs.units import RESPONSE_UNITS

_NUMBER = r"-?(?:[0-9.]{1,20}(?:e[-+]?[0-9]{1,3})?|nan|inf)"  # as an effect writes it
ELEMENT_KINDS = {"spring", "mass", "damper", "resonator", "joint"}
_NOT_SHOWN = {"name", "type", "style", "role", "axis", "kind"}


@cache
def _channel() -> str:
    """Return the pattern of a response's channel. The check is loaded for it, so it is made when a gap is read."""
    return "|".join(
        sorted({*RESPONSE_UNITS, *(c for i in CHECKS["frf"].inputs.values() for c in getattr(i, "channels", ()))})
    )


@cache
def _words() -> re.Pattern[str]:
    """Return every text of the pictures that `checks.gap.decision.panels` draws."""
    c = _channel()
    return re.compile(
        rf"|({c}) / Va|\|({c}) / Va\| \[({'|'.join(RESPONSE_UNITS.values())}|)\]|({c}): what is left"
        r"|\|data - model\| / \|data\||frequency \[Hz\]"
        r"|measured|model before|model after|before|after|disagrees, before|95 % of noise and tolerance|pole [0-9.]+ Hz"
        r"|nan|inf|-inf"
    )


@cache
def _fault() -> re.Pattern[str]:
    """Return the faults of the records, which are found before the search."""
    c = _channel()
    return re.compile(
        rf"({c}) does not answer the drive\.|({c}) comes -?[0-9]+ samples late\."
        rf"|({c}) has the wrong sign\.|({c}) and ({c}) are exchanged\."
    )


def check_gap(unit: UnitFolder, gap: Mapping[str, Any] | None, panels: Mapping[str, Panel]) -> None:
    """Raise InvalidCertificate if a unit without responses states a gap analysis, if an effect is described in other
    words than those of the library, or if a picture is not one of the analysis or says anything else."""
    if gap is not None and not applies(unit):
        raise InvalidCertificate("it states a gap analysis, but the unit has no responses")
    for named in (gap or {}).get("named", ()):
        if not _is_sentence(str(named["effect"]), str(named["sentence"])):
            raise InvalidCertificate(f"the gap analysis describes '{named['effect']}' in words that are not its own")
        if unknown := _other_parameters(str(named["effect"]), named["parameters"]):
            raise InvalidCertificate(f"the gap analysis gives '{named['effect']}' the parameter '{unknown[0][:60]}'")
    for one in (gap or {}).get("elements", ()):
        if not _is_element(one):
            raise InvalidCertificate("the gap analysis describes an element in words that are not its own")
    compared = (gap or {}).get("gap_before", {}).get("channels", {})
    for channel in (*(str(pole["channel"]) for pole in (gap or {}).get("unnamed", ())), *compared):
        if not re.fullmatch(_channel(), channel):
            raise InvalidCertificate(f"the gap analysis names a channel '{channel[:60]}', which no response has")
    known = {f"{GAP_PICTURES}{name}" for name in (on_certificate(gap) if gap and "named" in gap else ())}
    for panel in panels_to_json({name: p for name, p in panels.items() if name.startswith(GAP_PICTURES)}):
        if panel["name"] not in known:
            raise InvalidCertificate(f"the picture {panel['name']} is not of the stated gap analysis")
        if (other := next((t for t in _texts(panel) if not _words().fullmatch(t)), None)) is not None:
            raise InvalidCertificate(f"the picture {panel['name']} says '{other[:60]}'")


def own_words(contents: CertificateContent) -> list[str]:
    """Return the fields of the gap analysis whose words neither the library nor an attached model has: only a store or
    a list shows that the bench's analysis wrote them."""
    gap = contents.result.get("gap")
    if gap is None:
        return []
    found = [] if _names_its_model(gap, contents) else ["start"]
    if gap["verdict"] == REFUSED:
        return [f"gap.{field}" for field in (*found, "reason")]
    if gap["ambiguous"]:
        from checks.gap import (
            EFFECTS,
            every_experiment,  # loads the library, as `_is_sentence`
        )

        known = every_experiment()
        if any(a["experiment"] not in known or not set(a["effects"]) <= EFFECTS.keys() for a in gap["ambiguous"]):
            found.append("ambiguous")
    if any(pole.get("words") for pole in gap["unnamed"]):
        found.append("unnamed")
    return [f"gap.{field}" for field in found]


def _names_its_model(gap: Mapping[str, Any], contents: CertificateContent) -> bool:
    """Return whether the model that the responses were compared with is built in or attached, and has this name."""
    start, shipped = str(gap["start"]), builtin_models()
    if start in contents.models:
        text = next(iter(contents.models[start].values()), b"")
    elif start in shipped:
        text = shipped[start].read_bytes()
    else:
        return False
    return gap.get("model") in (None, tomllib.loads(text.decode()).get("name"))


def _other_parameters(effect: str, stated: Mapping[str, Any]) -> list[str]:
    """Return the parameters that the effect does not have; of the faults of the records some have `samples`."""
    from checks.gap import EFFECTS  # as `_is_sentence`

    own = {p.name for p in EFFECTS[effect].parameters} if effect in EFFECTS else {"samples"}
    return [name for name in stated if name not in own]


def _is_sentence(effect: str, text: str) -> bool:
    """Return whether this is the sentence of a fault of the records, or of an effect of the library, with any
    numbers."""
    from checks.gap import EFFECTS  # loads the library: only for a unit whose responses were searched

    if _fault().fullmatch(text):
        return True
    if effect not in EFFECTS:
        return False
    templates = (EFFECTS[effect].sentence, EFFECTS[effect].below, *EFFECTS[effect].earlier)
    patterns = (_NUMBER.join(map(re.escape, re.split(r"\{[^}]*\}", t))) for t in templates if t)
    return any(re.fullmatch(pattern, text) for pattern in patterns)


def _is_element(one: Mapping[str, Any]) -> bool:
    """Return whether an element is described in the words of the analysis, with any numbers."""
    from checks.gap import element_words  # as `_is_sentence`

    stated = zip(element_words(), ("sentence", "experiment"), strict=True)
    return one["kind"] in ELEMENT_KINDS and all(re.fullmatch(own, str(one[key])) for own, key in stated)


def _texts(panel: Any) -> Iterator[str]:
    """Yield what a picture shows in words, at any depth."""
    if isinstance(panel, str):
        yield panel
    elif isinstance(panel, Mapping):
        for key, value in panel.items():
            if key not in _NOT_SHOWN:
                yield from _texts(value)
    elif isinstance(panel, list):
        for value in panel:
            yield from _texts(value)
