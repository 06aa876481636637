"""`accept frf`: responses of record files, with coherence and variance, as a table, JSON, universal file or picture.

The JSON is {"responses": [...]}, each as `accept.analysis.record_responses.to_json` returns it, for a hammer with what
`accept.analysis.hammer.hammer_json` returns.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from json import dumps
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from rich.table import Table
from typer import Argument, Option

from accept.analysis.hammer import ImpactResponse, hammer_json, hammer_responses
from accept.analysis.imported_response import ImportedResponse, ResponseDifference, differences, import_response
from accept.analysis.record_responses import (
    OF_RECORDS,
    MeasuredResponse,
    file_bytes,
    read_any,
    responses_of,
    to_json,
)
from accept.commands.answer import Answer, File, Remark, command, picture, table
from accept.commands.options import Csv, Json, Mat, Plot, Uff
from checks.errors import RecordError
from checks.picture import Line, Panel
from checks.record import Record
from checks.rounding import fixed, rounded, rounded_U
from checks.signals import Estimator, EstimatorSettings, Frf, ImpactRules, bode
from hw.records import Content
from specs.bench import ChannelSource, load_bench


@dataclass(frozen=True)
class SourceOptions:
    """Names of the channels in the files, and their time."""

    input: Annotated[
        str | None, Option(help="Channel that drives; all others are outputs. Default: Va, of a hammer Track1.")
    ] = None
    map: Annotated[
        list[str] | None, Option(help="Channel of the file under another name: Va=AI0. Repeat for more.")
    ] = None
    ts: Annotated[float | None, Option(help="Sampling time [s] where the file has no time vector.")] = None
    bench: Annotated[Path | None, Option(help="Bench file: channels, gains and sampling time of its [rig].")] = None


@dataclass(frozen=True)
class HammerOptions:
    """A hammer test, and the rules by which its hits are good: the defaults are those of the check spurious_modes."""

    hammer: Annotated[
        bool, Option("--hammer", help="Hits of a hammer: the average over all good ones of all records.")
    ] = False
    block_s: Annotated[float, Option(min=1e-3, help="Longest block after a hit [s].")] = 4.0
    window_decay: Annotated[
        float | None,
        Option(min=0.0, help="Decay rate [1/s] of the exponential window; default: what a cut decay needs."),
    ] = None
    double_hit_ms: Annotated[float, Option(min=0.0, help="A second peak within this many ms makes a double hit.")] = (
        100.0
    )
    double_hit_share: Annotated[
        float, Option(min=0.0, max=1.0, help="A second peak counts from this part of the first one.")
    ] = 0.03
    ringing_samples: Annotated[
        float, Option(min=0.0, help="Samples for which the analyser's filter rings after a hit.")
    ] = 5.0
    force_range_N: Annotated[
        float | None, Option("--force-range-N", help="Range of the force sensor: beyond, a hit is an overload.")
    ] = None


@dataclass(frozen=True)
class ResponseOptions:
    """Statements that a file of responses lacks, and a response to compare with."""

    averages: Annotated[float | None, Option(help="Averages behind the coherence that a file of responses states.")] = (
        None
    )
    noise: Annotated[float | None, Option(help="Relative noise of a response whose file states none: 0.005.")] = None
    against: Annotated[Path | None, Option(help="File of responses to compare with: .uff, .mat, .csv or .json.")] = None


@dataclass(frozen=True)
class FrfOutputs:
    """The files to write."""

    json: Json = None
    csv: Csv = None
    mat: Mat = None
    plot: Plot = None
    uff: Uff = None
    html: Annotated[Path | None, Option(help="Interactive plot, one page (extra `site`).")] = None


COHERENT = 0.9  # above it the random error of a response stays below 24 % / sqrt(segments)
FORCE = "Track1"  # of a hammer, as the analyser of the bench stores it
LEAST_U = 1e-4  # smaller ones are said to be below it
Panels = dict[str, Panel]  # of a response, by name


@command
def run(
    records: Annotated[
        list[Path], Argument(help="Record files (.mat, .csv, .txt, .uff, .tdms), or files of responses (.json too).")
    ],
    sources: SourceOptions,
    hits: HammerOptions,
    others: ResponseOptions,
    outputs: FrfOutputs,
    estimator: Annotated[
        Estimator, Option(help="auto: over the periods of a periodic input, else h1. Of a hammer: h1 (auto), h2 or hv.")
    ] = Estimator.AUTO,
    segment_s: Annotated[float, Option(min=1e-4, help="Length of the Hann segments of h1 [s].")] = 0.5,
    f_lo: Annotated[float, Option(min=0.0, help="Lowest frequency [Hz].")] = 0.0,
    f_hi: Annotated[
        float | None, Option(help="Highest frequency [Hz]; default half of the sampling's, of a hammer 1/2.56.")
    ] = None,
    merge_Hz: Annotated[
        float | None, Option("--merge-Hz", help="Join two records: the first up to here, the second above.")
    ] = None,
) -> Answer:
    """Compute frequency responses of records. With coherence, variance and resonances; with --hammer of hits."""
    single = {".csv": outputs.csv, ".mat": outputs.mat, ".uff": outputs.uff}
    input = sources.input or (FORCE if hits.hammer else "Va")
    settings = EstimatorSettings(estimator, segment_s, f_lo, f_hi, input, merge_Hz)
    responses = _estimate([_read(path, sources, others, input, hits.hammer) for path in records], settings, hits)
    if len(responses) > 1 and (place := next((p for p in single.values() if p is not None), None)):
        kind = "a universal file" if place == outputs.uff else "this file"
        raise RecordError(f"{place}: {kind} takes one response, not {len(responses)}; merge them or name one")
    against = None if others.against is None else _import(others.against, sources, others)
    compared = {} if against is None else {r.title: differences(r, against) for r in responses}

    def drawn() -> list[Panels]:
        return [_panels_of(response, merge_Hz, against) for response in responses]

    return Answer(
        *(part for response in responses for part in _about(response)),
        None if against is None else _comparison(compared, against),
        File(outputs.json, lambda: dumps(_document(responses, compared), allow_nan=False).encode()),
        *(File(place, partial(file_bytes, responses[0], ending)) for ending, place in single.items()),
        picture(outputs.plot, lambda: _sheet(responses, drawn()), _columns(responses)),
        File(outputs.html, lambda: _page(responses, drawn())),
    )


def _estimate(
    read: Sequence[Record | ImportedResponse], settings: EstimatorSettings, hits: HammerOptions
) -> list[MeasuredResponse]:
    """Return the responses of the records, of all hits with a hammer, and those that were read. Raises RecordError."""
    f_lo, f_hi = settings.f_lo, settings.f_hi
    imported = [replace(r, frf=r.frf.cut(f_lo, f_hi)) for r in read if isinstance(r, ImportedResponse)]
    taken = [r for r in read if isinstance(r, Record)]
    if settings.estimator not in OF_RECORDS and not hits.hammer:
        raise RecordError(f"--estimator {settings.estimator}: averages over hits; add --hammer, or use h1 or lpm")
    if imported and (hits.hammer or settings.merge_Hz is not None):
        raise RecordError(f"{imported[0].title}: holds a response; --hammer and --merge-Hz are for records")
    if hits.hammer:
        return [_of_hits(taken, settings, hits)]
    return [*responses_of(taken, settings), *imported] if taken else [*imported]


def _read(
    path: Path, sources: SourceOptions, others: ResponseOptions, input: str, only_records: bool
) -> Record | ImportedResponse:
    """Read a record with the channels of the bench file and of the command line, the latter first; else a response.

    Raises RecordError with the reason of the reader that the content is for, of both if it has both axes."""
    rig = None if sources.bench is None else load_bench(sources.bench).rig
    if sources.bench is not None and rig is None:
        raise RecordError(f"{sources.bench}: has no [rig]")
    channels: dict[str, str | ChannelSource] = {**(rig.channels if rig else {}), **_mapping(sources.map)}
    try:
        return read_any(path, input, channels, sources.ts, rig is not None)
    except RecordError as e:
        content = Content.of(path, input)
        if content is Content.RECORD or only_records or sources.ts is not None:
            raise
        first = e
    try:
        return _import(path, sources, others)
    except RecordError as e:
        if content is Content.RESPONSE:
            raise
        raise RecordError(f"{first}; as a response: {e}") from e


def _import(path: Path, sources: SourceOptions, others: ResponseOptions) -> ImportedResponse:
    return import_response(path, sources.input or "", _mapping(sources.map), others.averages, others.noise)


def _of_hits(records: Sequence[Record], settings: EstimatorSettings, hits: HammerOptions) -> ImpactResponse:
    if settings.merge_Hz is not None:
        raise RecordError("--merge-Hz joins records of different drives; the hits of all records are averaged")
    rules = ImpactRules(
        double_hit_s=hits.double_hit_ms / 1e3,
        double_hit_share=hits.double_hit_share,
        ringing_samples=hits.ringing_samples,
        block_max_s=hits.block_s,
        force_range_N=hits.force_range_N,
        window_decay=hits.window_decay,
    )
    chosen = "h1" if settings.estimator is Estimator.AUTO else settings.estimator.value
    return hammer_responses(records, settings.input, chosen, settings.f_lo, settings.f_hi, rules)


def _document(
    responses: Sequence[MeasuredResponse], compared: Mapping[str, Sequence[ResponseDifference]]
) -> dict[str, Any]:
    shown = [to_json(r) | (hammer_json(r) if isinstance(r, ImpactResponse) else {}) for r in responses]
    return {"responses": shown} | (
        {"differences": [asdict(d) for found in compared.values() for d in found]} if compared else {}
    )


def _mapping(given: Sequence[str] | None) -> dict[str, str]:
    """Parse `Va=AI0` as name here -> name in the file. Raises RecordError."""
    found = {}
    for word in given or ():
        here, _, there = word.partition("=")
        if not (here and there):
            raise RecordError(f"--map {word}: expected HERE=THERE, such as Va=AI0")
        found[here.strip()] = there.strip()
    return found


def _about(response: MeasuredResponse) -> list[str | Table]:
    rows = hammer_summary(response) if isinstance(response, ImpactResponse) else summary(response)
    return [rows, *(Remark(f"{response.title}: {note}") for note in response.frf.notes)]


def summary(response: MeasuredResponse) -> Table:
    """Return a row per channel: the band in which it is coherent, and its largest resonance."""
    frf = response.frf
    averages = f", {frf.segments} segments" if frf.segments else ""
    none = "not searched" if isinstance(response, ImportedResponse) else "none seen"
    rows = []
    for c in frf.channels:
        mode = response.resonances.get(c)
        cells = (none, "") if mode is None else (with_U(mode.f_Hz, mode.U_Hz), f"{100 * mode.damping_ratio:.3g}")
        rows.append((f"{c} / {frf.input}", _coherent(frf, c), *cells))
    titles = ("output / input", "coherent [Hz]", "largest resonance [Hz]", "damping [%]")
    return table(titles, rows, title=_title(response) + averages)


def _title(response: MeasuredResponse) -> str:
    frf = response.frf
    return f"{response.title}: {frf.estimator}, {frf.f[0]:.4g} to {frf.f[-1]:.4g} Hz, {frf.f.size} bins"


def hammer_summary(response: ImpactResponse) -> Table:
    """Return a row per mode of each channel, with the band in which the channel is coherent over the hits."""
    frf = response.frf
    rows: list[tuple[str, ...]] = []
    for c in frf.channels:
        first = (f"{c} / {frf.input}", _coherent(frf, c))
        if not response.modes[c]:
            rows.append((*first, "none seen", ""))
        for k, mode in enumerate(response.modes[c]):
            damping = with_U(100 * mode.damping_ratio, 100 * mode.U_damping)
            rows.append((*(first if k == 0 else ("", "")), with_U(mode.f_Hz, mode.U_Hz), damping))
    titles = ("output / input", "coherent [Hz]", "mode [Hz]", "damping [%]")
    return table(titles, rows, title=f"{_title(response)}, {frf.segments} hits")


def with_U(value: float, U: float) -> str:
    """Return both to the decimals that U has, 93.918 ± 0.023; a U below 0.0001 is shown as "less than 0.0001"."""
    if U >= LEAST_U:
        return f"{rounded(value, U)} ± {rounded_U(U)}"
    return f"{fixed(value, 4)} ± less than {LEAST_U:g}" if U > 0.0 else f"{value:.6g}"


def _coherent(frf: Frf, channel: str) -> str:
    """Return the first and last frequency with a coherence above COHERENT, and the share of such bins between."""
    coherence = frf.coherence[:, frf.index(channel)]
    if np.isnan(coherence).all():
        return "not stated"
    good = coherence >= COHERENT
    if not good.any():
        return "nowhere"
    at = np.flatnonzero(good)
    return f"{frf.f[at[0]]:.4g} to {frf.f[at[-1]]:.4g} ({100 * good[at[0] : at[-1] + 1].mean():.0f} % of it)"


def _comparison(compared: Mapping[str, Sequence[ResponseDifference]], against: ImportedResponse) -> Table:
    titles = ("response", "channel", "bins", "median", "largest", "at [Hz]", "within both 95 % regions")
    rows = []
    for title, found in compared.items():
        for d in found:
            agreeing = "noise not stated" if d.agreeing is None else f"{100 * d.agreeing:.0f} %"
            sizes = (f"{100 * d.median:.3g} %", f"{100 * d.largest:.3g} %", f"{d.at_Hz:.5g}")
            rows.append((title, d.channel, str(d.bins), *sizes, agreeing))
    return table(titles, rows, title=f"apart from {against.title}, relative to it")


def _sheet(responses: Sequence[MeasuredResponse], of_each: Sequence[Panels]) -> list[Panel]:
    """Return the panels of a picture: a row of magnitudes above a row of phases for each response."""
    panels: list[Panel] = []
    for response, drawn in zip(responses, of_each, strict=True):
        of = response.frf.channels
        panels += [drawn[f"{c} {part}"] for part in ("magnitude", "phase") for c in of]
        panels += [drawn["coherence"]] if len(responses) == 1 and "coherence" in drawn else []
        panels += [panel for name, panel in drawn.items() if name.startswith("impacts of ")]
    return panels


def _columns(responses: Sequence[MeasuredResponse]) -> int:
    counts = {len(r.frf.channels) for r in responses}
    return max(counts) if len(counts) == 1 and max(counts) <= 4 else 2


def _page(responses: Sequence[MeasuredResponse], of_each: Sequence[Panels]) -> bytes:
    from accept.pictures.interactive import page

    pairs = [(f"{r.title}: " if len(responses) > 1 else "", of) for r, of in zip(responses, of_each, strict=True)]
    return page({title + name: panel for title, of in pairs for name, panel in of.items()}, "Frequency responses")


def _panels_of(response: MeasuredResponse, merge_Hz: float | None, against: ImportedResponse | None) -> Panels:
    panels = response.panels if isinstance(response, ImpactResponse) else None
    panels = panels or bode(response.frf, response.ratios, merge_Hz=merge_Hz)
    if against is None:
        return panels
    beside = bode(against.frf, against.ratios)
    for name, panel in panels.items():
        other = beside.get(name)
        if other is not None and name != "coherence":
            lines = [i for i in other.items if isinstance(i, Line) and i.role == "data"]
            panels[name] = replace(
                panel, items=(*panel.items, *(replace(i, role="model", label=against.title) for i in lines))
            )
    return panels
