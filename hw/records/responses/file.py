"""Responses of a file in common form, their making from the statements of each format, and their writing."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import RecordError
from hw.records.responses.units import fraction, variance
from hw.records.source import Source
from hw.records.uff.units import kind_of
from hw.records.uff.write import frf_bytes
from hw.records.writers import cells, struct_bytes

# Names of functions of two channels, or of one, that are no response.
SPECTRUM = re.compile(
    r"cross|spec|psd|asd|csd|auto|power|fft|^(?:pxx|pxy|pyy|pyx|sxx|sxy|syx|syy|sff|sxf|sfx|gxx|gxy|gyy)", re.I
)
INPUTS = {"voltage": "", "force": "force"}  # an input by its kind, if neither file nor user names it


@dataclass(frozen=True, eq=False)
class ResponseFile:
    """Responses of a file over one input. f (F,) [Hz], rising; H (F, C) in the units of the file; coherence, var (F,
    C), NaN if not stated; units: of channels and input, "" if not stated; averages: None if not stated; said: a
    sentence on how the content was mapped."""

    file: str
    sha256: str
    f: Array
    H: Complex
    channels: tuple[str, ...]
    input: str
    units: Mapping[str, str]
    coherence: Array
    var: Array
    averages: float | None = None
    said: str = ""

    def to_bytes(self, ending: str) -> bytes:
        """Return a file of them: ".csv", ".mat" with the fields of an frd object, ".uff" (data set 58). What is not
        known is left out. Raises RecordError if the format cannot hold them."""
        write = {".csv": self._table, ".mat": self._frd, ".uff": self._universal}
        try:
            return write[ending]()
        except ValueError as e:
            raise RecordError(f"{self.file}: {e}") from e

    def _table(self) -> bytes:
        """Return f [Hz] and of each channel its real and imaginary part, with its unit over that of the input in the
        header."""
        columns: dict[str, Array] = {"f [Hz]": self.f}
        per = self.units.get(self.input, "")
        for i, c in enumerate(self.channels):
            unit = f" [{self.units[c]}/{per}]" if self.units.get(c) and per else ""
            columns |= {f"{c}_re{unit}": self.H[:, i].real, f"{c}_im{unit}": self.H[:, i].imag}
            more = {"coherence": self.coherence[:, i], "var": self.var[:, i]}
            columns |= {f"{c}_{name}": x for name, x in more.items() if np.isfinite(x).all()}
        rows = zip(*(x.tolist() for x in columns.values()), strict=True)
        lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
        return ("\n".join(lines) + "\n").encode("utf-8")

    def _frd(self) -> bytes:
        """Return a struct `response`: ResponseData (C, 1, F), Frequency (F,) [Hz], Coherence and Variance (C, F)."""
        quality = {"Coherence": self.coherence, "Variance": self.var}
        fields: dict[str, Any] = {
            "ResponseData": self.H.T[:, None, :],
            "Frequency": self.f[:, None],
            "FrequencyUnit": "Hz",
            "InputName": cells([self.input]),
            "OutputName": cells(self.channels),
            "InputUnit": cells([self.units.get(self.input, "")]),
            "OutputUnit": cells([self.units.get(c, "") for c in self.channels]),
            **{name: x.T for name, x in quality.items() if not np.isnan(x).all()},
            "Notes": self.said,
            **({} if self.averages is None else {"Averages": self.averages}),
        }
        return struct_bytes({"response": fields})

    def _universal(self) -> bytes:
        more = self.coherence, self.var, self.averages
        return frf_bytes(self.f, self.H, self.channels, self.input, self.units, *more)


@dataclass(frozen=True, eq=False)
class Curve:
    """One response of a file. H (F,); unit: of the channel, per: of the input, "" if not stated; coherence, var: values
    (F,) and their stated unit, None without."""

    name: str
    H: Complex
    unit: str = ""
    per: str = ""
    coherence: tuple[Array, str] | None = None
    var: tuple[Array, str] | None = None


def response_file(
    source: Source,
    f: Array,
    curves: Sequence[Curve],
    input: str,
    said: Iterable[str],
    averages: float | None = None,
) -> ResponseFile:
    """Return the responses of a file, vetted and in rising order. input: its name, "" if neither file nor user states
    one; said: how the content was mapped. Raises RecordError."""
    file, words = source.file, list(said)
    per = {c.per for c in curves if c.per}
    if len(per) > 1:
        raise RecordError(f"{file}: has responses per {' and per '.join(sorted(per))}; one input is expected")
    unit = per.pop() if per else ""
    called = input or (INPUTS.get(kind_of(unit), "input") if unit else "")
    empty = np.full(f.size, np.nan)
    coherence, var = [], []
    for c in curves:
        quality, more = fraction(file, f"the coherence of {c.name}", *c.coherence) if c.coherence else (empty, [])
        noise, less = variance(file, f"the variance of {c.name}", *c.var, (c.unit, c.per)) if c.var else (empty, [])
        coherence.append(quality)
        var.append(noise)
        words += more + less
    found = ResponseFile(
        file=file,
        sha256=source.sha256,
        f=f,
        H=np.stack([np.asarray(c.H, complex) for c in curves], axis=1),
        channels=tuple(c.name for c in curves),
        input=called,
        units={**{c.name: c.unit for c in curves}, called: unit},
        coherence=np.stack(coherence, axis=1),
        var=np.stack(var, axis=1),
        averages=averages,
        said="; ".join(dict.fromkeys(words)),
    )
    return _vet_bins(found)


def _vet_bins(r: ResponseFile) -> ResponseFile:
    """Return responses in rising order. Raises RecordError for bins that are not finite, negative, or come twice."""
    if r.f.size < 2 or not np.isfinite(r.f).all():
        raise RecordError(f"{r.file}: has {r.f.size} frequencies; two or more finite ones are expected")
    order = np.argsort(r.f, kind="stable")
    f, H = r.f[order], r.H[order]
    if f[0] < 0.0:
        raise RecordError(
            f"{r.file}: its frequencies run from {f[0]:.6g} to {f[-1]:.6g} Hz: it is two-sided; save the half from "
            "0 Hz on"
        )
    if not (np.diff(f) > 0).all():
        twice = f[:-1][np.diff(f) <= 0][0]
        raise RecordError(
            f"{r.file}: the frequency {twice:.6g} Hz comes twice; frequencies must rise, none of them twice"
        )
    if not np.isfinite(H).all():
        bad = f[~np.isfinite(H).all(axis=1)][0]
        raise RecordError(f"{r.file}: the response at {bad:.6g} Hz is NaN or infinite; leave that row out")
    if len(set(r.channels)) < len(r.channels):
        raise RecordError(f"{r.file}: two responses have one name: {', '.join(r.channels)}; use --map HERE=THERE")
    if not (np.diff(r.f) > 0).all():
        r = replace(r, said=f"{r.said}; sorted by frequency")
    return replace(r, f=f, H=H, coherence=r.coherence[order], var=r.var[order])
