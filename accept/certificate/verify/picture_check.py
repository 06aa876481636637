"""Comparison of the pictures with the attached records: they are data in the certificate, and judging it makes them
again."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from accept.certificate.contents.outcome import InvalidCertificate
from accept.certificate.verify.page_check import VERDICT_WORDS
from accept.certificate.verify.result_diff import same_words
from accept.gap import GAP_PICTURES
from accept.pictures.jsonform import panels_to_json
from accept.pictures.reduce import reduce_panel
from checks.picture import Panel

SEEN = 5e-3  # of what a curve spans: a difference below it is not seen; another processor's sums differ by 1e-6
FEW = 0.02  # of a curve's points: where two samples are as high, another processor may keep the other one
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
