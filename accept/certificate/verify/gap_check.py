"""The gap analysis on a certificate: its search is not repeated, but the words and the pictures that its numbers give
are made again, and what it can be about is known without it."""

import tomllib
from collections.abc import Mapping
from typing import Any

from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.outcome import InvalidCertificate
from accept.certificate.verify.picture_check import texts
from accept.gap import GAP_PICTURES, REFUSED, on_certificate
from accept.pictures.jsonform import panels_to_json
from checks.acceptance import CHECKS
from checks.picture import Panel
from specs.model import builtin_models
from specs.units import RESPONSE_UNITS


def check_gap(has_responses: bool, gap: Mapping[str, Any] | None, panels: Mapping[str, Panel]) -> None:
    """Raise InvalidCertificate if a unit without responses states a gap analysis, if a sentence is not the one of the
    values beside it, or if a picture is not one of the analysis or shows more than its curves and what is stated."""
    if gap is not None and not has_responses:
        raise InvalidCertificate("it states a gap analysis, but the unit has no responses")
    if gap is not None:
        from checks.gap import contradictions  # loads the library: only for a unit with an analysis

        declared = (c for i in CHECKS["frf"].inputs.values() for c in getattr(i, "channels", ()))
        for said in contradictions(gap, sorted({*RESPONSE_UNITS, *declared})):
            raise InvalidCertificate(f"the gap analysis {said}")
    known = {f"{GAP_PICTURES}{name}" for name in (on_certificate(gap) if gap and "named" in gap else ())}
    for name, panel in panels.items():
        if name.startswith(GAP_PICTURES):
            if gap is None or name not in known:
                raise InvalidCertificate(f"the picture {name} is not of the stated gap analysis")
            _check_picture(name, panel, gap)


def _check_picture(name: str, panel: Panel, gap: Mapping[str, Any]) -> None:
    from checks.gap import picture_again  # as above

    try:
        again = picture_again(name.removeprefix(GAP_PICTURES), panel, gap)
    except ValueError as e:
        raise InvalidCertificate(f"the picture {name} does not have the curves of a gap analysis") from e
    stated, made = (panels_to_json({name: each}) for each in (panel, again))
    if stated != made:
        own = {*texts(made)}
        other = next((f"says '{text[:60]}'" for text in texts(stated) if text not in own), "")
        raise InvalidCertificate(f"the picture {name} {other or 'marks what the analysis does not state'}")


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
        from checks.gap import EFFECTS, every_experiment  # loads the library, as above

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
