"""Responses of records by the estimator that suits the drive, with their resonances and faults."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Self

import numpy as np

from checks.cause import Reason
from checks.errors import RecordError
from checks.record import Record
from checks.signals.sampling_faults import sampling_faults
from checks.signals.spectral.frf import Frf, h1_record
from checks.signals.spectral.lpm import lpm_record
from checks.signals.spectral.merge import merge
from checks.signals.spectral.periodic import detect, periodic_frf
from checks.signals.spectral.poles import Transforms
from checks.signals.spectral.resonance import Resonance, find
from checks.signals.spectral.transient import concentration, is_broadband, is_transient

NEAR = 0.12  # of a peak: where its pole is fitted
SIGNIFICANT = 4.0  # standard deviations: where nothing drives, a response is large by chance


class Estimator(StrEnum):
    """Estimators of responses; H2 and HV are averages over the hits of a hammer."""

    AUTO = "auto"
    H1 = "h1"
    LPM = "lpm"
    H2 = "h2"
    HV = "hv"


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
class RecordResponse:
    """A response and the records behind it; units of its channels, and the input's under its name. resonances: the
    largest of each channel; faults: what judging refuses in the records."""

    records: tuple[Record, ...]
    frf: Frf
    units: dict[str, str]
    resonances: dict[str, Resonance]
    faults: tuple[Reason, ...] = field(default=(), kw_only=True)

    @classmethod
    def of_records(cls, records: Sequence[Record], wanted: EstimatorSettings) -> list[Self]:
        """Estimate the response of each record, or one of two records merged.

        Raises RecordError if it cannot be estimated."""
        found = [_estimate(record, wanted) for record in records]
        if wanted.merge_Hz is None:
            return [cls._of((r,), f, wanted) for r, f in zip(records, found, strict=True)]
        if len(records) != 2:
            raise RecordError(f"--merge-Hz joins two records, low and high; {len(records)} given")
        try:
            both = merge(found[0], found[1], wanted.merge_Hz)
        except ValueError as e:
            raise RecordError(f"{records[0].name} and {records[1].name}: {e}") from e
        return [cls._of(tuple(records), both.cut(wanted.f_lo, wanted.f_hi), wanted)]

    @classmethod
    def _of(cls, records: tuple[Record, ...], frf: Frf, wanted: EstimatorSettings) -> Self:
        faults = tuple(_faults(records, wanted.input))
        notes = [str(r if len(records) > 1 else replace(r, file="")) for r in faults]  # the title names a single record
        frf = replace(frf, notes=(*frf.notes, *notes))
        units = {name: records[0].units.get(name, "") for name in (wanted.input, *frf.channels)}
        poles = {c: r for c in frf.channels if (r := _pole(records, frf, c, wanted))}
        return cls(records, frf, units, poles, faults=faults)

    @property
    def title(self) -> str:
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
            frf = periodic_frf(u, columns, record.fs, period, input=wanted.input)
            return frf.cut(wanted.f_lo, wanted.f_hi)
        frf = h1_record(record, wanted.input, outputs, wanted.segment_s)
        return frf if wanted.merge_Hz is not None else frf.cut(wanted.f_lo, wanted.f_hi)
    except ValueError as e:
        raise RecordError(f"{record.name}: {e}") from e


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
