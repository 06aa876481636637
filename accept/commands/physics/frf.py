"""`accept frf`: responses of record files, with coherence and variance, as a table, JSON, universal file or picture.

The JSON: {"responses": [{"files": [names], "sha256": [hashes], "input", "estimator", "segments", "notes",
"units": {channel: unit}, "f_Hz": [F], "nu": [F], "correlation": [of neighbouring bins' errors],
"H": {channel: {"re": [F], "im": [F]}}, "coherence": {channel: [F]}, "var": {channel: [F]} (total complex variance of H,
null where the input had no power), "resonances": [{"channel", "f_Hz", "U_Hz", "damping_ratio", "U_damping"}]}]}.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from rich.table import Table

from accept.base.atomic_files import check_places, write_atomic
from accept.base.console import clear_errors, say, stdout
from accept.base.exit_codes import Exit
from accept.commands.physics.foreign_record import Unreadable, foreign_record
from accept.commands.physics.frf_options import Estimator, ResponseFiles, ResponseOptions
from accept.pictures.formats import format_of
from checks.declare import Series
from checks.errors import RecordError
from checks.picture import Panel
from checks.record import Record
from checks.rounding import fixed, rounded, rounded_U
from checks.signals.spectral.bode import bode
from checks.signals.spectral.frf import Frf, h1_record
from checks.signals.spectral.lpm import lpm_record
from checks.signals.spectral.merge import merge
from checks.signals.spectral.periodic import detect, periodic_frf
from checks.signals.spectral.poles import Transforms
from checks.signals.spectral.resonance import Resonance, find
from hw.records import list_channels, read
from hw.records.uff import frf_bytes

UNITS = {"t": "s", "Va": "V", "Vs": "V", "V": "V", "de": "m", "da": "m", "d": "m", "Track1": "N", "Track2": "rad"}
STEP = "Track1_X_Resolution"  # sampling time of files without a time vector
NEAR = 0.12  # of a peak: where its pole is fitted
COHERENT = 0.9  # above it the random error of a response stays below 24 % / sqrt(segments)
SIGNIFICANT = 4.0  # standard deviations: where nothing drives, a response is large by chance


@dataclass(frozen=True, eq=False)
class MeasuredResponse:
    """A response and the records behind it; units of its channels, and the input's under its name."""

    records: tuple[Record, ...]
    frf: Frf
    units: dict[str, str]
    resonances: dict[str, Resonance]

    def __repr__(self) -> str:
        f, seen = self.frf.f, ", ".join(f"{c} {mode.f_Hz:.2f} Hz" for c, mode in self.resonances.items())
        of = f"{', '.join(self.frf.channels)} over {self.frf.input}"
        return f"MeasuredResponse({of}; {f.size} bins from {f[0]:.4g} to {f[-1]:.4g} Hz; resonances: {seen or 'none'})"


@clear_errors
def run(
    records: Annotated[list[Path], typer.Argument(help="Record files (.mat, .csv, .txt, .uff, .tdms).")],
    wanted: ResponseOptions,
    files: ResponseFiles,
) -> Exit:
    """Compute frequency responses of records. With coherence, variance and the largest resonance."""
    as_json, plot, uff, html = files.json, files.plot, files.uff, files.html
    check_places(as_json, plot, uff, html)  # said before the work, not after
    format = None if plot is None else format_of(plot)
    channels = _mapping(files.map or ())
    responses = responses_of([read_any(path, wanted.input, channels, files.ts) for path in records], wanted)
    if uff is not None and len(responses) > 1:
        raise RecordError(f"{uff}: a universal file takes one response, not {len(responses)}; merge them or name one")
    for response in responses:
        stdout.print(summary(response))
        for note in response.frf.notes:
            say(f"{_title(response)}: {note}")
    if as_json is not None:
        write_atomic(as_json, json.dumps({"responses": [to_json(r) for r in responses]}, allow_nan=False).encode())
    if uff is not None:
        write_atomic(uff, _uff(responses[0]))
    if plot is not None and format is not None:
        write_atomic(plot, _drawn(responses, wanted.merge_Hz, format))
    if html is not None:
        from accept.pictures.interactive import page

        write_atomic(html, page(_panels(responses, wanted.merge_Hz), "Frequency responses"))
    return Exit.ACCEPTED


def _mapping(given: Sequence[str]) -> dict[str, str]:
    """`Va=AI0` as name here -> name in the file. Raises RecordError."""
    pairs = [word.partition("=") for word in given]
    if wrong := next((w for w, (a, sign, b) in zip(given, pairs, strict=True) if not (a and sign and b)), None):
        raise RecordError(f"--map {wrong}: expected HERE=THERE, such as Va=AI0")
    return {here.strip(): there.strip() for here, _, there in pairs}


def read_any(path: Path, input: str, channels: Mapping[str, str], step_s: float | None) -> Record:
    """A record as this bench writes it; else as other tools do, and then what was taken for what is said. Raises
    RecordError."""
    if not path.is_file():
        raise RecordError(f"{path}: {'is a folder, expected a record file' if path.is_dir() else 'no such file'}")
    if not channels and step_s is None:
        try:
            return _read(path, input)
        except RecordError as e:
            first = e
        try:
            record, words = foreign_record(path, input, channels, step_s, UNITS)
        except Unreadable as e:
            raise first from e
    else:
        record, words = foreign_record(path, input, channels, step_s, UNITS)
    say(words)
    return record


def _read(path: Path, input: str) -> Record:
    """Every vector of a file as long as its input."""
    shapes = list_channels(path)
    length = math.prod(shapes.get(input, (0,)))
    names = [n for n, s in shapes.items() if math.prod(s) == length and n not in ("t", STEP)]
    if input not in shapes or len(names) < 2:
        raise RecordError(f"{path.name}: needs the input '{input}' and an output; it has {', '.join(shapes)}")
    series = Series("record", "any record", {n: UNITS.get(n, "") for n in names}, step=STEP)
    return read(path, series)


def responses_of(records: Sequence[Record], wanted: ResponseOptions) -> list[MeasuredResponse]:
    """Responses, one a record, or one of two records merged. Raises RecordError for what cannot be estimated."""
    found = [_estimate(record, wanted) for record in records]
    if wanted.merge_Hz is None:
        return [_response((r,), f, wanted) for r, f in zip(records, found, strict=True)]
    if len(records) != 2:
        raise RecordError(f"--merge-Hz joins two records, low and high; {len(records)} given")
    try:
        both = merge(found[0], found[1], wanted.merge_Hz)
    except ValueError as e:
        raise RecordError(f"{records[0].name} and {records[1].name}: {e}") from e
    return [_response(tuple(records), _cut(both, wanted), wanted)]


def _estimate(record: Record, wanted: ResponseOptions) -> Frf:
    outputs = [name for name in record.channels if name != wanted.input]
    f_hi = record.fs / 2 if wanted.f_hi is None else wanted.f_hi
    try:
        if wanted.estimator is Estimator.LPM:
            return lpm_record(record, wanted.input, outputs, wanted.f_lo, f_hi)
        period = (
            detect(record[wanted.input]) if wanted.estimator is Estimator.AUTO and wanted.merge_Hz is None else None
        )
        if period is not None and period.count > 2:
            columns = {name: record[name] for name in outputs}
            return _cut(periodic_frf(record[wanted.input], columns, record.fs, period, input=wanted.input), wanted)
        frf = h1_record(record, wanted.input, outputs, wanted.segment_s)
        return frf if wanted.merge_Hz is not None else _cut(frf, wanted)
    except ValueError as e:
        raise RecordError(f"{record.name}: {e}") from e


def _cut(frf: Frf, wanted: ResponseOptions) -> Frf:
    part = frf.band(wanted.f_lo, math.inf if wanted.f_hi is None else wanted.f_hi)
    if part.f.size < 2:
        raise RecordError(f"no two frequencies lie in {wanted.f_lo:g}..{wanted.f_hi or frf.f[-1]:g} Hz")
    return part


def _response(records: tuple[Record, ...], frf: Frf, wanted: ResponseOptions) -> MeasuredResponse:
    units = {name: records[0].units.get(name, "") for name in (wanted.input, *frf.channels)}
    return MeasuredResponse(records, frf, units, {c: r for c in frf.channels if (r := _pole(records, frf, c, wanted))})


def _pole(records: tuple[Record, ...], frf: Frf, channel: str, wanted: ResponseOptions) -> Resonance | None:
    """The pole at the largest response of a channel, where it is one that decays."""
    part = frf.select(channel)
    good = part.usable & (part.f > 0)
    good[good] &= np.abs(part.H[good, 0]) ** 2 > SIGNIFICANT**2 * part.var[good, 0]
    if not good.any():
        return None
    at = float(part.f[good][np.argmax(np.abs(part.H[good, 0]))])
    high = len(records) > 1 and wanted.merge_Hz is not None and at > wanted.merge_Hz
    transforms = Transforms.of(records[-1] if high else records[0], wanted.input, (channel,))
    try:
        return find(transforms.window((1 - NEAR) * at, (1 + NEAR) * at), (1 - NEAR) * at, (1 + NEAR) * at)
    except ValueError:
        return None  # too short a record or too narrow a band to place a pole


def _title(response: MeasuredResponse) -> str:
    return " + ".join(r.name for r in response.records)


def summary(response: MeasuredResponse) -> Table:
    """A row per channel: where it is coherent, and its largest resonance."""
    frf = response.frf
    averages = f", {frf.segments} segments" if frf.segments else ""
    title = f"{_title(response)}: {frf.estimator}, {frf.f[0]:.4g} to {frf.f[-1]:.4g} Hz, {frf.f.size} bins{averages}"
    table = Table("output / input", "coherent [Hz]", "largest resonance [Hz]", "damping [%]", title=title)
    table.title_justify = "left"
    for c in frf.channels:
        mode = response.resonances.get(c)
        cells = (
            ("none seen", "") if mode is None else (with_U(mode.f_Hz, _U_Hz(mode)), f"{100 * mode.damping_ratio:.3g}")
        )
        table.add_row(f"{c} / {frf.input}", _coherent(frf, c), *cells)
    return table


U_CLOCK = 2e-4  # relative, k = 2, as the specs state it: nobody has compared the converters' clock with another
LEAST_U = 1e-4  # smaller ones are said to be below it


def with_U(value: float, U: float) -> str:
    """Both to the decimals that U has, 93.918 ± 0.023; a U below 0.0001 is said to be that."""
    if U >= LEAST_U:
        return f"{rounded(value, U)} ± {rounded_U(U)}"
    return f"{fixed(value, 4)} ± less than {LEAST_U:g}" if U > 0.0 else f"{value:.6g}"


def _U_Hz(mode: Resonance) -> float:
    """Scatter, model, and the clock by which the record was sampled."""
    return math.hypot(_U(mode.u_Hz, mode.u_Hz_model), U_CLOCK * mode.f_Hz)


def _U(u: float, u_model: float) -> float:
    return 2.0 * math.hypot(u, u_model)


def _coherent(frf: Frf, channel: str) -> str:
    """First and last frequency with a coherence above COHERENT, and how much of what is between has it."""
    good = frf.coherence[:, frf.index(channel)] >= COHERENT
    if not good.any():
        return "nowhere"
    at = np.flatnonzero(good)
    return f"{frf.f[at[0]]:.4g} to {frf.f[at[-1]]:.4g} ({100 * good[at[0] : at[-1] + 1].mean():.0f} % of it)"


def to_json(response: MeasuredResponse) -> dict[str, Any]:
    """See the module's docstring for the schema."""
    frf, columns = response.frf, list(enumerate(response.frf.channels))
    return {
        "files": [r.name for r in response.records],
        "sha256": [r.sha256 for r in response.records],
        "input": frf.input,
        "estimator": frf.estimator,
        "segments": frf.segments,
        "notes": list(frf.notes),
        "units": response.units,
        "f_Hz": frf.f.tolist(),
        "nu": frf.nu.tolist(),
        "correlation": list(frf.correlation),
        "H": {c: {"re": frf.H[:, i].real.tolist(), "im": frf.H[:, i].imag.tolist()} for i, c in columns},
        "coherence": {c: frf.coherence[:, i].tolist() for i, c in columns},
        "var": {c: _finite(frf.var[:, i]) for i, c in columns},
        "resonances": [_resonance_json(c, mode) for c, mode in response.resonances.items()],
    }


def _resonance_json(channel: str, mode: Resonance) -> dict[str, Any]:
    return {
        "channel": channel,
        "f_Hz": mode.f_Hz,
        "U_Hz": _U_Hz(mode),
        "damping_ratio": mode.damping_ratio,
        "U_damping": _U(mode.u_damping, mode.u_damping_model),
    }


def _finite(values: NDArray[np.float64]) -> list[float | None]:
    return [v if math.isfinite(v) else None for v in values.tolist()]


def _uff(response: MeasuredResponse) -> bytes:
    frf, good = response.frf, response.frf.usable
    try:
        return frf_bytes(frf.f[good], frf.H[good], frf.channels, frf.input, response.units)
    except ValueError as e:
        raise RecordError(f"{_title(response)}: {e}") from e


def _drawn(responses: Sequence[MeasuredResponse], merge_Hz: float | None, format: str) -> bytes:
    from accept.pictures.draw import picture  # loads matplotlib: only when wanted

    panels: list[Panel] = []
    for response in responses:
        drawn = bode(response.frf, _ratios(response), merge_Hz=merge_Hz)
        of = response.frf.channels
        panels += [drawn[f"{c} {part}"] for part in ("magnitude", "phase") for c in of]
        panels += [drawn["coherence"]] * (len(responses) == 1)
    columns = len(responses[0].frf.channels)
    alike = all(len(r.frf.channels) == columns for r in responses)
    return picture(panels, format, columns=columns if alike and columns <= 4 else 2)


def _panels(responses: Sequence[MeasuredResponse], merge_Hz: float | None) -> dict[str, Panel]:
    """Of all responses, by names that do not collide."""
    many = len(responses) > 1
    drawn = [(_title(r), bode(r.frf, _ratios(r), merge_Hz=merge_Hz)) for r in responses]
    return {f"{title}: {name}" if many else name: panel for title, found in drawn for name, panel in found.items()}


def _ratios(response: MeasuredResponse) -> dict[str, str]:
    per = response.units[response.frf.input]
    return {c: f"{response.units[c]}/{per}" if response.units[c] and per else "" for c in response.frf.channels}
