"""gap.json: the effects that the gap workflow found missing from the model of a unit ([DESIGN] 6); the misalignment of
a strut."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from accept.base.documents.document import Document, Number, only_if

REFUSED = "refused"  # stands in `verdict` where the workflow gave none; `reason` says why
GAP_PICTURES = "gap/"  # how their names begin among the pictures of a unit


@dataclass(frozen=True)
class GapAtMode(Document):
    """Gap about one mode."""

    f_Hz: Number
    G: Number


@dataclass(frozen=True)
class GapSize(Document):
    """Size of a gap: squared residual over variance, per degree of freedom; 1 or less is agreement."""

    G: Number
    channels: Annotated[Mapping[str, Number], "G of each channel"]
    modes: tuple[GapAtMode, ...] = ()


@dataclass(frozen=True)
class GapBand(Document):
    """A band in which model and data differ."""

    channel: str
    f_lo_Hz: Number
    f_hi_Hz: Number
    p: Annotated[Number, "probability of so much by chance"]
    excess_dB: Number


@dataclass(frozen=True)
class EffectValue(Document):
    """Value of a parameter of an effect."""

    value: Number
    ci95: Annotated[tuple[Number, Number], "interval of 95 %"]


@dataclass(frozen=True)
class Evidence(Document):
    """Evidence for an effect."""

    delta_lnL: Annotated[Number | None, "gain in log-likelihood; null for what a check before the search found"]
    p: Number


@dataclass(frozen=True)
class NamedEffect(Document):
    """An effect that was found."""

    effect: str
    parameters: Mapping[str, EffectValue]
    evidence: Evidence
    sentence: str = ""


@dataclass(frozen=True)
class AmbiguousEffects(Document):
    """Effects that the data cannot distinguish."""

    effects: tuple[str, ...]
    experiment: Annotated[str, "the measurement that decides between them"]


@dataclass(frozen=True)
class UnnamedEffect(Document):
    """A difference that no effect of the library explains."""

    channel: str
    poles_Hz: tuple[Number, ...]
    zeros_Hz: tuple[Number, ...]
    level_dependent: bool
    words: str = ""
    poles_ci95: Annotated[tuple[tuple[Number, Number], ...] | None, only_if(), "interval of each pole [Hz]"] = None
    at_edge: Annotated[bool | None, only_if(), "it lies at the end of the band"] = None


@dataclass(frozen=True)
class ElementPlace(Document):
    """A place where an element may sit."""

    part: Annotated[str, "such as `top interface`, `bottom joint`, `sensor stack`, `head`, `payload`"]
    against: Annotated[str, "`ground` or another part"]
    direction: Annotated[str, "`x`, `y`, `z`, `Rx`, `Ry` or `Rz`"]
    point_mm: Annotated[tuple[Number, Number, Number] | None, "beside the part's node; null where a place has none"]


@dataclass(frozen=True)
class ElementFound(Document):
    """Something in the mechanics that is no effect of the library."""

    kind: Annotated[str, "`spring`, `mass`, `damper`, `resonator`, `joint`, `payload` (that rocks) or `filter`"]
    places: Annotated[tuple[ElementPlace, ...], "all that explain the records as well, the best first"]
    parameters: Mapping[str, EffectValue]
    sentence: str
    looks_like: Annotated[tuple[str, ...], "likely causes, never a verdict"]
    experiment: Annotated[str, "the measurement that tells more"]


@dataclass(frozen=True)
class GapExperiment(Document):
    """A second measurement of `[[experiments]]`, compared with the explained model."""

    kind: str
    value: Number | str | None
    channels: Annotated[Mapping[str, Number], "G of each channel"]
    holds: bool
    level_dependent: tuple[str, ...]
    words: str | None


@dataclass(frozen=True)
class CandidateEffect(Document):
    """An effect that was tried."""

    effect: str
    delta_lnL: Number | None
    p: Number | None
    reason: Annotated[str, "why it was named or not"]


@dataclass(frozen=True)
class GapStep(Document):
    """The gap that is left after one more named effect."""

    effect: Annotated[str | None, "null for the model alone"]
    channels: Annotated[Mapping[str, Number], "G of each channel"]


@dataclass(frozen=True, kw_only=True)
class GapDocument(Document):
    """The effects that the gap workflow found missing from the model of a unit."""

    serial: str
    model: str
    verdict: Annotated[str, "`no_missing_effect`, `explained`, `ambiguous`, `partly_explained` or `unexplained`"]
    gap_before: GapSize
    where: tuple[GapBand, ...]
    named: Annotated[tuple[NamedEffect, ...], "in the order in which they were found"]
    ambiguous: tuple[AmbiguousEffects, ...]
    unnamed: tuple[UnnamedEffect, ...]
    elements: Annotated[tuple[ElementFound, ...] | None, only_if(), "elements in the mechanics"] = None
    candidates: Annotated[tuple[CandidateEffect, ...] | None, only_if(), "effects that were tried, the best first"] = (
        None
    )
    steps: Annotated[tuple[GapStep, ...] | None, only_if(), "the gap after each named effect"] = None
    detection_limits: Annotated[Mapping[str, Mapping[str, Number]], "smallest value that would have been found"]
    gap_after: Annotated[GapSize, "on records that were not fitted"]
    p_before: Number | None = None
    p_after: Number | None = None
    damping: str | None = None
    notes: tuple[str, ...] = ()
    experiments: tuple[GapExperiment, ...] = ()
    empirical: Annotated[tuple[Mapping[str, Any], ...] | None, only_if(), "elements that `--empirical` added"] = None


@dataclass(frozen=True)
class Offset(Document):
    """An offset of the APA along one axis."""

    value: Annotated[Number | None, "[um]; null without a result"] = None
    U: Annotated[Number | None, "expanded uncertainty (k = 2) [um]"] = None


@dataclass(frozen=True)
class MisalignmentDocument(Document):
    """Misalignment of the APA of a strut."""

    serial: str
    dx_um: Offset
    dy_um: Offset
    verdict: Annotated[str, "`pass` or `no_result`"]
    reason: Annotated[str | None, "why there is no result"]


def on_certificate(gap: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the pictures that a certificate shows: magnitude and residual, before and after, of the
    channel that fitted worst; none if nothing is missing or nothing was found."""
    from checks.gap import GapVerdict  # not for those who ask for the form of a document alone

    channels = {c: G for c, G in gap.get("gap_before", {}).get("channels", {}).items() if G is not None}
    if not channels or gap["verdict"] == GapVerdict.NO_MISSING:
        return ()
    worst = max(channels, key=lambda name: channels[name])
    return f"{worst} magnitude", f"{worst} residual"
