"""Responses of record files, with coherence, variance and resonances: `accept frf` and `accept.frequency_response`."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from accept.base.console import say
from checks.acceptance.responses.rules import unusable_sizes
from checks.arrays import Array
from checks.cause import Reason, together
from checks.errors import RecordError
from checks.record import Record
from checks.signals.sampling_faults import sampling_faults
from checks.signals.spectral.frf import Frf, Mask, h1_record
from checks.signals.spectral.lpm import lpm_record
from checks.signals.spectral.merge import merge
from checks.signals.spectral.periodic import detect, periodic_frf
from checks.signals.spectral.poles import Transforms
from checks.signals.spectral.resonance import Resonance, find
from checks.signals.spectral.transient import concentration, is_broadband, is_transient
from hw.records import frd_mat, frf_bytes, load_bytes, record_by_input, response_csv
from specs.bench import ChannelSource, channel_map

if TYPE_CHECKING:
    import pandas as pd

UNITS = {"t": "s", "Va": "V", "Vs": "V", "V": "V", "de": "m", "da": "m", "d": "m", "Track1": "N", "Track2": "rad"}
STEP = "Track1_X_Resolution"  # sampling time of files without a time vector
NEAR = 0.12  # of a peak: where its pole is fitted
SIGNIFICANT = 4.0  # standard deviations: where nothing drives, a response is large by chance
U_CLOCK = 2e-4  # relative, k = 2, as the specs state it: the converters' clock has not been compared with another


class Estimator(StrEnum):
    """Estimators of responses; H2 and HV are averages over the hits of a hammer."""

    AUTO = "auto"
    H1 = "h1"
    LPM = "lpm"
    H2 = "h2"
    HV = "hv"


OF_RECORDS = (Estimator.AUTO, Estimator.H1, Estimator.LPM)  # without hits to average over


@dataclass(frozen=True)
class EstimatorSettings:
    """Settings of an estimate. segment_s: length of the Hann segments of h1 [s]; f_lo, f_hi: the band kept [Hz], to
    half the sampling frequency without f_hi; input: the channel that drives; merge_Hz: two records become one response,
    the first up to here and the second above."""

    estimator: Estimator = Estimator.AUTO
    segment_s: float = 0.5
    f_lo: float = 0.0
    f_hi: float | None = None
    input: str = "Va"
    merge_Hz: float | None = None


@dataclass(frozen=True, eq=False)
class MeasuredResponse:
    """A response and the records behind it; units of its channels, and the input's under its name.

    frf: f (F,) [Hz], H (F, C) complex, coherence (F, C), var (F, C); resonances: the largest of each channel, with
    f_Hz, damping_ratio and their standard uncertainties; faults: of the records, that judging refuses. `accept.plot`
    draws it; `to_pandas`, `to_xarray`, `to_control` convert it; `save` writes .csv, .mat, .uff or .json."""

    records: tuple[Record, ...]
    frf: Frf
    units: dict[str, str]
    resonances: dict[str, Resonance]
    faults: tuple[Reason, ...] = field(default=(), kw_only=True)

    @property
    def title(self) -> str:
        """Return the names of the records."""
        return " + ".join(self.inputs)

    @property
    def inputs(self) -> dict[str, str]:
        """Return the hash of each file by its name."""
        return {r.name: r.sha256 for r in self.records}

    @property
    def ratios(self) -> dict[str, str]:
        """Return the unit of each channel over that of the input, "" if either is unknown."""
        per = self.units.get(self.frf.input, "")
        return {c: f"{self.units[c]}/{per}" if self.units[c] and per else "" for c in self.frf.channels}

    def to_pandas(self) -> "pd.DataFrame":
        """Return a frame over f_Hz with the complex response, the coherence and the variance of each channel.

        Its columns are (channel, "H"), (channel, "coherence"), (channel, "var")."""
        import pandas as pd  # loads slowly: only when it is asked for

        frf = self.frf
        parts = {"H": frf.H, "coherence": frf.coherence, "var": frf.var}
        columns = {(c, part): x[:, i] for i, c in enumerate(frf.channels) for part, x in parts.items()}
        return pd.DataFrame(columns, index=pd.Index(frf.f, name="f_Hz"))

    def to_xarray(self) -> Any:
        """Return a Dataset over f_Hz and channel: H, coherence, var; units as coordinates. Raises RecordError without
        xarray."""
        try:
            import xarray as xr
        except ImportError as e:
            raise RecordError("to_xarray needs the package xarray: pip install xarray") from e
        frf, over = self.frf, ("f_Hz", "channel")
        return xr.Dataset(
            {"H": (over, frf.H), "coherence": (over, frf.coherence), "var": (over, frf.var)},
            coords={
                "f_Hz": frf.f,
                "channel": list(frf.channels),
                "unit": ("channel", [self.ratios[c] for c in frf.channels]),
            },
            attrs={"input": frf.input, "estimator": frf.estimator, "records": self.title},
        )

    def to_control(self) -> Any:
        """Return a `control.FrequencyResponseData` over the usable bins [rad/s]: one input, an output per channel, with
        their names. Raises RecordError if the package control is not installed."""
        frf, good = self.frf, known(self.frf)
        return control_package().FrequencyResponseData(
            frf.H[good].T[:, None, :],
            2.0 * np.pi * frf.f[good],
            inputs=[frf.input],
            outputs=list(frf.channels),
            name=re.sub(r"\W", "_", self.title),
        )

    def save(self, file: str | Path) -> Path:
        """Write the response: .csv with real and imaginary parts, .mat with the fields of a MATLAB frd object, .uff
        (data set 58) or .json; `read_response` reads each of them. Raises RecordError for another ending."""
        place = Path(file)
        writers = {".csv": table_file, ".mat": matlab_file, ".uff": universal_file, ".json": json_file}
        if place.suffix.lower() not in writers:
            raise RecordError(f"{place}: a response is written as {', '.join(writers)}")
        place.write_bytes(writers[place.suffix.lower()](self))
        return place

    def __repr__(self) -> str:
        f, seen = self.frf.f, ", ".join(f"{c} {mode.f_Hz:.2f} Hz" for c, mode in self.resonances.items())
        of = f"{', '.join(self.frf.channels)} over {self.frf.input}"
        faults = "".join(f"; {reason}" for reason in self.faults)
        return (
            f"MeasuredResponse({of}; {f.size} bins from {f[0]:.4g} to {f[-1]:.4g} Hz; resonances: {seen or 'none'}"
            f"{faults})"
        )


def read_any(
    path: Path,
    input: str,
    channels: Mapping[str, str | ChannelSource],
    step_s: float | None,
    mapped_only: bool = False,
) -> Record:
    """Read a record, and report the mapping and conversion of its columns. mapped_only: read the channels of `channels`
    only. Raises RecordError."""
    if not path.is_file():
        raise RecordError(f"{path}: {'is a folder, expected a record file' if path.is_dir() else 'no such file'}")
    record = record_by_input(load_bytes(path), input, channel_map(channels), step_s, UNITS, mapped_only, STEP)
    for words in record.remarks:
        say(f"{words}; {record.t.size} samples, {record.fs:.6g} Hz")
    return record


def responses_of(records: Sequence[Record], wanted: EstimatorSettings) -> list[MeasuredResponse]:
    """Estimate the response of each record, or one of two records merged.

    Raises RecordError if it cannot be estimated."""
    for record in records:
        vet_sizes(record)
    found = [_estimate(record, wanted) for record in records]
    if wanted.merge_Hz is None:
        return [_response((r,), f, wanted) for r, f in zip(records, found, strict=True)]
    if len(records) != 2:
        raise RecordError(f"--merge-Hz joins two records, low and high; {len(records)} given")
    try:
        both = merge(found[0], found[1], wanted.merge_Hz)
    except ValueError as e:
        raise RecordError(f"{records[0].name} and {records[1].name}: {e}") from e
    return [_response(tuple(records), cut(both, wanted.f_lo, wanted.f_hi), wanted)]


def vet_sizes(record: Record) -> None:
    """Raise RecordError for implausible sizes: a motion that can only be in nm, um or mm, a drive beyond any
    converter."""
    if wrong := unusable_sizes(record):
        raise RecordError(together(wrong).within("", record.name))


def _estimate(record: Record, wanted: EstimatorSettings) -> Frf:
    outputs = [name for name in record.channels if name != wanted.input]
    f_hi = record.fs / 2 if wanted.f_hi is None else wanted.f_hi
    u = record[wanted.input]
    if is_transient(u):
        share = 100 * concentration(u)
        raise RecordError(
            f"{record.name}: 90 % of the energy of {wanted.input} lies in {share:.2g} % of the record. It looks like a "
            "hammer: use --hammer (in Python accept.hammer_response); averages over time and local polynomials are for "
            "a lasting drive"
        )
    try:
        if wanted.estimator is Estimator.LPM:
            return lpm_record(record, wanted.input, outputs, wanted.f_lo, f_hi)
        period = detect(u) if wanted.estimator is Estimator.AUTO and wanted.merge_Hz is None else None
        if period is not None and period.count > 2:
            columns = {name: record[name] for name in outputs}
            return cut(periodic_frf(u, columns, record.fs, period, input=wanted.input), wanted.f_lo, wanted.f_hi)
        frf = h1_record(record, wanted.input, outputs, wanted.segment_s)
        return frf if wanted.merge_Hz is not None else cut(frf, wanted.f_lo, wanted.f_hi)
    except ValueError as e:
        raise RecordError(f"{record.name}: {e}") from e


def cut(frf: Frf, f_lo: float, f_hi: float | None, notes: tuple[str, ...] | None = None) -> Frf:
    """Return the bins from f_lo to f_hi [Hz], with other notes if given. Raises RecordError for fewer than two."""
    part = frf.band(f_lo, math.inf if f_hi is None else f_hi)
    if part.f.size < 2:
        raise RecordError(f"no two frequencies lie in {f_lo:g}..{f_hi or frf.f[-1]:g} Hz")
    return part if notes is None else replace(part, notes=notes)


def _response(records: tuple[Record, ...], frf: Frf, wanted: EstimatorSettings) -> MeasuredResponse:
    faults = tuple(_faults(records, wanted.input))
    notes = [str(r if len(records) > 1 else replace(r, file="")) for r in faults]  # the title names a single record
    frf = replace(frf, notes=(*frf.notes, *notes))
    units = {name: records[0].units.get(name, "") for name in (wanted.input, *frf.channels)}
    poles = {c: r for c in frf.channels if (r := _pole(records, frf, c, wanted))}
    return MeasuredResponse(records, frf, units, poles, faults=faults)


def _faults(records: Sequence[Record], input: str) -> list[Reason]:
    """Return the faults of sampling that judging refuses: values clipped or held, samples lost, scattered times. They
    show against a drive of many frequencies; other records are not examined."""
    return [
        reason.within("", record.name)
        for record in records
        if input in record.channels and not is_transient(record[input]) and is_broadband(record[input])
        for reason in sampling_faults(record, input, [c for c in record.channels if c != input])
    ]


def _pole(records: tuple[Record, ...], frf: Frf, channel: str, wanted: EstimatorSettings) -> Resonance | None:
    """Estimate the pole at the largest response of a channel, None if it does not decay."""
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


def U_Hz(mode: Resonance) -> float:
    """Return U of a resonance [Hz] (k = 2) from scatter, model, and the clock by which the record was sampled."""
    return math.hypot(_U(mode.u_Hz, mode.u_Hz_model), U_CLOCK * mode.f_Hz)


def _U(u: float, u_model: float) -> float:
    return 2.0 * math.hypot(u, u_model)


def to_json(response: MeasuredResponse) -> dict[str, Any]:
    """Return the response as a document for scripts. {"files": [names], "sha256": [hashes], "input", "estimator",
    "segments", "notes", "units": {channel: unit}, "f_Hz": [F], "nu": [F], "correlation": [of neighbouring bins'
    errors], "H": {channel: {"re": [F], "im": [F]}}, "coherence": {channel: [F]}, "var": {channel: [F]} (total complex
    variance of H, null if the input had no power or the file that was read states none), "resonances": [{"channel",
    "f_Hz", "U_Hz", "damping_ratio", "U_damping"}]}."""
    frf, columns = response.frf, list(enumerate(response.frf.channels))
    return {
        "files": list(response.inputs),
        "sha256": list(response.inputs.values()),
        "input": frf.input,
        "estimator": frf.estimator,
        "segments": frf.segments,
        "notes": list(frf.notes),
        "units": response.units,
        "f_Hz": frf.f.tolist(),
        "nu": _finite(frf.nu),
        "correlation": list(frf.correlation),
        "H": {c: {"re": frf.H[:, i].real.tolist(), "im": frf.H[:, i].imag.tolist()} for i, c in columns},
        "coherence": {c: _finite(frf.coherence[:, i]) for i, c in columns},
        "var": {c: _finite(frf.var[:, i]) for i, c in columns},
        "resonances": [
            {
                "channel": c,
                "f_Hz": mode.f_Hz,
                "U_Hz": U_Hz(mode),
                "damping_ratio": mode.damping_ratio,
                "U_damping": _U(mode.u_damping, mode.u_damping_model),
            }
            for c, mode in response.resonances.items()
        ],
    }


def _finite(values: Array) -> list[float | None]:
    return [v if math.isfinite(v) else None for v in values.tolist()]


def universal_file(response: MeasuredResponse) -> bytes:
    """Return the response as a universal file, data set 58, with coherence, variance and averages if they are known.

    Raises RecordError if it has no usable bin."""
    frf, good = response.frf, known(response.frf)
    averages = float(np.min(frf.nu)) + 1.0 if np.isfinite(frf.nu).all() else None
    more = (frf.coherence[good], frf.var[good], averages)
    try:
        return frf_bytes(frf.f[good], frf.H[good], frf.channels, frf.input, response.units, *more)
    except ValueError as e:
        raise RecordError(f"{response.title}: {e}") from e


def table_file(response: MeasuredResponse) -> bytes:
    """Return the response as CSV: f, real and imaginary part of each channel, coherence and, if known, variance."""
    frf, good = response.frf, known(response.frf)
    more = {"coherence": frf.coherence[good], "var": frf.var[good]}
    return response_csv(frf.f[good], frf.H[good], frf.channels, response.ratios, more)


def matlab_file(response: MeasuredResponse) -> bytes:
    """Return the response as a MATLAB file with a struct `response` of the fields of an frd object."""
    frf, good = response.frf, known(response.frf)
    more = {"Coherence": frf.coherence[good].T, "Variance": frf.var[good].T, "Notes": " ".join(frf.notes)}
    averages = {} if not np.isfinite(frf.nu).all() else {"Averages": float(np.min(frf.nu)) + 1.0}
    return frd_mat(frf.f[good], frf.H[good], frf.channels, frf.input, response.units, {**more, **averages})


def json_file(response: MeasuredResponse) -> bytes:
    """Return the response as the JSON that `accept frf --json` writes."""
    return json.dumps({"responses": [to_json(response)]}, allow_nan=False).encode()


def known(frf: Frf) -> Mask:
    """Return the bins (F,) that hold a response: driven, or of a file that states no variance."""
    return np.asarray(~np.isinf(frf.var).any(axis=1))


def control_package() -> Any:
    """Return python-control. Raises RecordError if it is not installed."""
    try:
        import control
    except ImportError as e:
        raise RecordError("to_control needs the package control: pip install control") from e
    return control
