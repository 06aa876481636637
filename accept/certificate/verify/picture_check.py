"""Comparison of the pictures with the attached records: they are data in the certificate, and judging it makes them
again. The search of the gap analysis is not repeated, but the words and the pictures that its numbers give are made
again, and what it can be about is known without it."""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from accept.base.documents.analyses import GAP_PICTURES, REFUSED, GapDocument, on_certificate
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.outcome import InvalidCertificate
from accept.certificate.verify.page_check import VERDICT_WORDS
from accept.certificate.verify.result_diff import same_words
from accept.pictures.jsonform import panels_to_json
from accept.pictures.reduce import reduce_panel
from checks.acceptance import CHECKS
from checks.picture import Panel
from specs.model import builtin_models
from specs.units import RESPONSE_UNITS

SEEN = 5e-3  # of what a curve spans: a difference below it is not seen; another processor's sums differ by 1e-6
FEW = 0.02  # of a curve's points: where two samples are as high, another processor may keep the other one
_OF_GAP = {"start", "model_sha256", "improved", "reason"}  # beside gap.json, of which the serial is left out
BESIDE = 3  # points of a curve on either side: a run of samples keeps four, its ends, its lowest and its highest


def check_pictures(attached: Mapping[str, Panel], again: Mapping[str, Panel]) -> None:
    """Compare the panels on the page with those made again from the attached records, without the records that were too
    large to attach.

    attached: as they are on the page. again: made from the attached records. The panels of the gap workflow, which is
    not run again, must not name a verdict. Raises InvalidCertificate.
    """
    there = {panel["name"]: panel for panel in panels_to_json(attached)}
    here = {panel["name"]: panel for panel in panels_to_json({name: reduce_panel(p) for name, p in again.items()})}
    for name, panel in there.items():
        if name.startswith(GAP_PICTURES):
            if said := VERDICT_WORDS.findall(" ".join(texts(panel))):
                raise InvalidCertificate(f"the picture {name} says '{said[0]}'")
        elif name not in here or not _same(panel, here[name]):
            raise InvalidCertificate(f"the picture {name} does not show the attached records")
    if missing := here.keys() - there.keys():
        raise InvalidCertificate(f"the picture {min(missing)} was left out")


def _same(one: Any, other: Any) -> bool:
    if one == other:
        return True  # the same machine: no point is looked at by itself
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, str) and isinstance(other, str):
        return same_words(one, other)
    if not isinstance(one, list) or not isinstance(other, list):
        return _near([one], [other]) if _numbers([one, other]) else one == other
    if _numbers(one) and _numbers(other):
        return _near(one, other)
    if _map(one) and _map(other):
        return len(one) == len(other) and _near([*chain(*one)], [*chain(*other)])
    return len(one) == len(other) and all(_same(a, b) for a, b in zip(one, other, strict=True))


def _numbers(values: Sequence[Any]) -> bool:
    return all((isinstance(v, int | float) and not isinstance(v, bool)) or v in ("nan", "inf", "-inf") for v in values)


def _map(values: Sequence[Any]) -> bool:
    return all(isinstance(row, list) and _numbers(row) for row in values)


def _near(one: Sequence[Any], other: Sequence[Any]) -> bool:
    """Return whether two curves look the same: all points but a few agree within a small part of the curve's span, and
    those few lie between the points beside them, as another sample of their run does."""
    a, b = (np.array([float(v) for v in values]) for values in (one, other))
    if a.shape != b.shape:
        return False
    real = b[np.isfinite(b)]
    span = float(np.ptp(real)) if real.size > 1 else 0.0
    allowed = max(SEEN * span, 1e-6 * float(np.abs(real).max(initial=0.0)))
    far = np.flatnonzero(~np.isclose(a, b, rtol=0.0, atol=allowed, equal_nan=True))
    if far.size > FEW * a.size:
        return False
    runs = [(a[n], b[max(n - BESIDE, 0) : n + BESIDE + 1]) for n in far]
    return all(run.min() - allowed <= value <= run.max() + allowed for value, run in runs)


def texts(panel: Any) -> Iterator[str]:
    """Yield the texts of a picture, at any depth."""
    if isinstance(panel, str):
        yield panel
    elif isinstance(panel, Mapping):
        for key, value in panel.items():
            yield from () if key == "type" else texts(value)
    elif isinstance(panel, list):
        for value in panel:
            yield from texts(value)


def check_gap(has_responses: bool, gap: Mapping[str, Any] | None, panels: Mapping[str, Panel]) -> None:
    """Raise InvalidCertificate if a unit without responses states a gap analysis, if a sentence is not the one of the
    values beside it, or if a picture is not one of the analysis or shows more than its curves and what is stated."""
    if gap is not None and not has_responses:
        raise InvalidCertificate("it states a gap analysis, but the unit has no responses")
    if gap is not None:
        from checks.gap import contradictions  # loads the library: only for a unit with an analysis

        if unknown := sorted(gap.keys() - {*GapDocument.__annotations__, *_OF_GAP}):
            raise InvalidCertificate(f"the gap analysis states '{unknown[0][:60]}', which this program does not write")
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
