"""Responses of record files, with coherence, variance and resonances: `accept frf` and `accept.frequency_response`."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from accept.base.console import say
from checks.acceptance import size_faults
from checks.arrays import Array
from checks.cause import together
from checks.errors import RecordError
from checks.record import Record
from checks.signals import Estimator, EstimatorSettings, RecordResponse
from hw.records import ResponseFile, load_bytes, record_by_input
from specs.bench import ChannelSource, channel_map

if TYPE_CHECKING:
    import pandas as pd

UNITS = {"t": "s", "Va": "V", "Vs": "V", "V": "V", "de": "m", "da": "m", "d": "m", "Track1": "N", "Track2": "rad"}
STEP = "Track1_X_Resolution"  # sampling time of files without a time vector
ENDINGS = ".csv", ".mat", ".uff", ".json"  # of the files of a response


OF_RECORDS = (Estimator.AUTO, Estimator.H1, Estimator.LPM)  # without hits to average over


@dataclass(frozen=True, eq=False)
class MeasuredResponse(RecordResponse):
    """A response and the records behind it; units of its channels, and the input's under its name.

    frf: f (F,) [Hz], H (F, C) complex, coherence (F, C), var (F, C); resonances: the largest of each channel, with
    f_Hz, damping_ratio and their standard uncertainties; faults: of the records, that judging refuses. `accept.plot`
    draws it; `to_pandas`, `to_xarray`, `to_control` convert it; `save` writes .csv, .mat, .uff or .json."""

    def to_pandas(self) -> "pd.DataFrame":
        """Return a frame over f_Hz with the complex response, the coherence and the variance of each channel.

        Its columns are (channel, "H"), (channel, "coherence"), (channel, "var")."""
        import pandas as pd  # loads slowly: only when it is asked for

        frf = self.frf
        parts = {"H": frf.H, "coherence": frf.coherence, "var": frf.var}
        columns = {(c, part): x[:, i] for i, c in enumerate(frf.channels) for part, x in parts.items()}
        return pd.DataFrame(columns, index=pd.Index(frf.f, name="f_Hz"))

    def to_xarray(self) -> Any:
        """Return a Dataset over f_Hz and channel: H, coherence, var; units as coordinates. Raises RecordError."""
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
        frf, good = self.frf, self.frf.known
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
        if place.suffix.lower() not in ENDINGS:
            raise RecordError(f"{place}: a response is written as {', '.join(ENDINGS)}")
        place.write_bytes(file_bytes(self, place.suffix.lower()))
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
    record = record_by_input(load_bytes(path), input, channel_map(channels), step_s, UNITS, mapped_only, STEP)
    for words in record.remarks:
        say(f"{words}; {record.t.size} samples, {record.fs:.6g} Hz")
    return record


def responses_of(records: Sequence[Record], wanted: EstimatorSettings) -> list[MeasuredResponse]:
    """Estimate the response of each record, or one of two records merged.

    Raises RecordError if it cannot be estimated."""
    for record in records:
        vet_sizes(record)
    return MeasuredResponse.of_records(records, wanted)


def vet_sizes(record: Record) -> None:
    """Raise RecordError for implausible sizes: a motion in nm, um or mm, a drive beyond any converter."""
    if wrong := size_faults(record):
        raise RecordError(together(wrong).within("", record.name))


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
        "resonances": [mode_json(c, mode) for c, mode in response.resonances.items()],
    }


def mode_json(channel: str, mode: Any) -> dict[str, Any]:
    """Return a resonance or a mode of a channel as its document states it."""
    names = ("f_Hz", "U_Hz", "damping_ratio", "U_damping")
    return {"channel": channel} | {name: getattr(mode, name) for name in names}


def _finite(values: Array) -> list[float | None]:
    return [v if math.isfinite(v) else None for v in values.tolist()]


def file_bytes(response: MeasuredResponse, ending: str) -> bytes:
    """Return the usable bins as a file: ".csv", ".mat" with the fields of a MATLAB frd object, ".uff" (data set 58), or
    ".json" with all bins as `accept frf --json` writes them. Raises RecordError if there is no usable bin."""
    if ending == ".json":
        return json.dumps({"responses": [to_json(response)]}, allow_nan=False).encode()
    frf, good = response.frf, response.frf.known
    usable = ResponseFile(
        file=response.title,
        sha256="",
        f=frf.f[good],
        H=frf.H[good],
        channels=frf.channels,
        input=frf.input,
        units=response.units,
        coherence=frf.coherence[good],
        var=frf.var[good],
        averages=float(np.min(frf.nu)) + 1.0 if np.isfinite(frf.nu).all() else None,
        said=" ".join(frf.notes),
    )
    return usable.to_bytes(ending)


def control_package() -> Any:
    """Return python-control. Raises RecordError if it is not installed."""
    try:
        import control
    except ImportError as e:
        raise RecordError("to_control needs the package control: pip install control") from e
    return control
