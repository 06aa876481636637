"""The measured responses of a unit, from the records that its folder names under [frf]; and two realisations of
everything measured, one to fit and one to judge with: of a unit as it is and under every condition of its experiments.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from accept import units
from accept.units import LoadedUnit, UnitError, UnitFolder, loaded
from checks.acceptance import CHECKS, record_faults
from checks.arrays import Array
from checks.cause import together
from checks.declare import Measured, Scalar, Values
from checks.errors import RecordError
from checks.fitting import CHANNELS, F_HI, F_LO, Dataset
from checks.gap import ConditionTrial, GapRefused
from checks.model import LearnedBench
from checks.record import Record
from checks.signals import ModeShift
from specs.plugins import product_named

_SHARED = CHECKS["frf"].inputs["merge_Hz"]
USED = ("low", "high", "low_repeat", "high_repeat")
DEFAULT_MERGE_HZ = _SHARED.default if isinstance(_SHARED, Scalar) else None


@dataclass(frozen=True, eq=False)
class Responses:
    """first: to fit; second: another realisation of the same, to judge with, or None. payload_kg: as stated in the
    folder. records: by input name; inputs: file name -> sha256."""

    serial: str
    kind: str
    first: Dataset
    second: Dataset | None
    merge_Hz: float
    payload_kg: float | None = None
    payload_U_kg: float | None = None
    records: dict[str, Record] = field(default_factory=dict)
    inputs: dict[str, str] = field(default_factory=dict)

    @property
    def remarks(self) -> list[str]:
        """Return notes on columns of the records that were not read as they are."""
        return [words for record in self.records.values() for words in record.remarks]

    def on_bench(self, learned: LearnedBench | None) -> "Responses":
        """Return the dataset with the scatter of a learned bench between units, if the model has one."""
        second = None if self.second is None else self.second.on_bench(learned)
        return replace(self, first=self.first.on_bench(learned), second=second)

    def __repr__(self) -> str:
        second = "no second realisation" if self.second is None else "with a second realisation"
        return f"Responses({self.serial}, {self.kind}: {self.first!r}, {second})"


def responses(
    given: Path | UnitFolder | LoadedUnit,
    tolerance: float = 0.0,
    channels: Sequence[str] | None = None,
    f_lo: float = F_LO,
    f_hi: float = F_HI,
) -> Responses:
    """Return the responses of a unit over f_lo..f_hi [Hz]. tolerance: of the model they will be compared with.
    channels: those of the unit's product if None.

    Raises UnitError for the folder or a missing [frf], RecordError for records that cannot be used, for the same causes
    as judging."""
    held = loaded(given)
    unit, values = held.folder, _values(held)
    records = records_of(values)
    refuse_faults({key: records[key] for key in USED if key in records})
    merge_Hz = _number(values.get("merge_Hz"), DEFAULT_MERGE_HZ)
    if "low" not in records or merge_Hz is None:
        raise UnitError(unit.path / units.UNIT_FILE, ["[frf] names no record 'low'"])

    def dataset(low: str, high: str) -> Dataset:
        return Dataset.from_records(
            records[low],
            records.get(high),
            merge_Hz,
            tolerance=tolerance,
            channels=channels or channels_of(unit.kind),
            f_lo=f_lo,
            f_hi=f_hi if high in records else min(f_hi, merge_Hz),
            name=f"{unit.serial} {low}",
        )

    return Responses(
        serial=unit.serial,
        kind=unit.kind,
        first=dataset("low", "high"),
        second=dataset("low_repeat", "high_repeat") if "low_repeat" in records else None,
        merge_Hz=merge_Hz,
        payload_kg=_number(values.get("payload_kg"), None),
        payload_U_kg=payload.U if (payload := values.get("payload_kg")) is not None else None,
        records=records,
        inputs={record.name: record.sha256 for record in records.values()},
    )


def channels_of(kind: str) -> tuple[str, ...]:
    """Return the channels of the responses of a product. Raises ProductError."""
    return tuple(c for c in CHANNELS if c not in product_named(kind).absent)


def refuse_faults(records: Mapping[str, Record]) -> None:
    """Raise RecordError for records with faults that no model explains, as judging refuses them: a channel in another
    unit, clipped, held, with samples missing or of scattered times. records: by input name."""
    found = [r.within(key, record.name) for key, record in records.items() for r in record_faults(record)]
    if found:
        raise RecordError(together(found))


def records_of(values: Values) -> dict[str, Record]:
    """Return the records among values, by input name."""
    return {name: value for name, value in values.items() if isinstance(value, Record)}


def _values(held: LoadedUnit) -> Values:
    unit = held.folder
    if "frf" not in unit.sections:
        raise UnitError(unit.path / units.UNIT_FILE, ["has no section [frf]: no responses were measured"])
    try:
        return held.values("frf")
    except RecordError as e:
        raise RecordError(f"{unit.serial}: [frf] {e}") from e


def _number(given: Measured | None, default: float | None) -> float | None:
    return default if given is None else given.value


SEARCH_LO = 5.0  # [Hz] below [STB]'s 10 Hz: the sensor's high-pass shows there, and the noise says how little it counts
RESISTOR = ("sensor_highpass", "resistor_ohm")  # section and key of unit.toml with the unit's own resistor
DRIFT, SURE = 3e-3, 6.0  # of a gain from record to record, and standard deviations, from which on it is said
OFF = 10.0  # standard deviations of one bin beyond which the modes of its band are compared
ASIDE = 0.25  # of its frequency about a mode that moved: bins in which a gain is not looked for
HALVES = "a single realisation: one half of it is fitted, the other half judged, so the sensitivity is reduced"


def realisations(measured: Responses, tolerance: float) -> tuple[Dataset, Dataset, tuple[str, ...]]:
    """Return A to fit, B to judge with, and notes: a single realisation is cut in two halves, and a note states it."""
    if measured.second is not None:
        shifts = _mode_shifts(measured.first, measured.second, measured)
        notes = (*_shift_notes(shifts), *gain_notes(measured.first, measured.second, shifts))
        return measured.first, measured.second, notes
    A, B = _halves(measured, measured.records, tolerance)
    return A, B, (HALVES,)


def gain_notes(A: Dataset, B: Dataset, shifts: Sequence[ModeShift] = ()) -> tuple[str, ...]:
    """Return a note on channels whose gain differs between the realisations, as a drifting gain makes it: by a real
    factor at all frequencies, estimated by weighted least squares, beyond noise and `DRIFT`. shifts: of modes between
    the two; about these nothing is compared, and twice their size may be the stiffness that moved them."""
    if A.H.shape != B.H.shape:
        return ()
    apart = np.all([np.abs(A.f / m.f_Hz - 1.0) > ASIDE for m in shifts], axis=0) if shifts else np.ones(A.f.size, bool)
    weight = apart[:, None] / (A.noise + B.noise)
    power, change = np.sum(weight * np.abs(A.H) ** 2, axis=0), gain_change(A, B, weight)
    least = DRIFT + 2.0 * max((abs(m.relative) for m in shifts), default=0.0)
    significant = np.abs(change) > np.maximum(least, SURE / np.sqrt(power))
    parts = [f"{c} {100 * x:+.1f} %" for c, x, told in zip(A.channels, change, significant, strict=True) if told]
    return (f"gain of the second realisation over the first: {', '.join(parts)}",) if parts else ()


def gain_change(A: Dataset, B: Dataset, weight: Array) -> Array:
    """Return by which part (C,) each channel of B is larger than in A."""
    power = np.sum(weight * np.abs(A.H) ** 2, axis=0)
    return np.asarray(np.sum(weight * (A.H.conj() * (B.H - A.H)).real, axis=0) / power)


def _mode_shifts(A: Dataset, B: Dataset, measured: Responses) -> tuple[ModeShift, ...]:
    """Return the modes that moved between the realisations, of the encoder if it was recorded. Only bands are looked at
    in which they differ by more than a gain."""
    channel = next((c for c in ("de", "da", "Vs") if c in A.channels), None)
    if channel is None or A.H.shape != B.H.shape:
        return ()
    k, noise = A.channels.index(channel), A.noise + B.noise
    change = gain_change(A, B, 1.0 / noise)
    off = np.abs(B.H[:, k] - (1.0 + change[k]) * A.H[:, k]) > OFF * np.sqrt(noise[:, k])
    low, repeat = measured.records["low"], measured.records["low_repeat"]
    return ModeShift.between(low, repeat, channel, A.f[off & (A.f <= measured.merge_Hz)], measured.merge_Hz)


def _shift_notes(shifts: Sequence[ModeShift]) -> tuple[str, ...]:
    each = [f"{100.0 * m.relative:+.2g} % ({m.f_Hz:.2f} to {m.to_Hz:.2f} Hz)" for m in shifts]
    return (f"modes shifted between the records of the two realisations: {', '.join(each)}",) if shifts else ()


def trials_of(
    unit: LoadedUnit, measured: Responses, tolerance: float
) -> tuple[tuple[ConditionTrial, ...], tuple[str, ...]]:
    """Return the unit's experiments, and the reasons why some cannot be used."""
    trials, lost = [], []
    for name in unit.folder.experiments:
        try:
            trials.append(_trial(unit, name, measured, tolerance))
        except (RecordError, GapRefused) as e:
            lost.append(f"experiment {name} cannot be used: {e}")
    return tuple(trials), tuple(lost)


def _trial(unit: LoadedUnit, name: str, measured: Responses, tolerance: float) -> ConditionTrial:
    """Return an experiment of a unit with two realisations, of two records or of the halves of a single record."""
    records = records_of(unit.experiment(name))
    refuse_faults(records)
    if "low_repeat" in records:
        A = _dataset(records["low"], records.get("high"), measured, tolerance)
        B = _dataset(records["low_repeat"], records.get("high_repeat"), measured, tolerance)
    else:
        A, B = _halves(measured, records, tolerance)
    section = unit.folder.experiments[name]
    kind = section.declared
    value = section.number(kind.value.name) if kind.value else None
    return ConditionTrial.of_records(name, kind, value, A, B, _own_resistor(unit))


def _own_resistor(unit: LoadedUnit) -> float | None:
    section = unit.folder.sections.get(RESISTOR[0])
    stated = None if section is None else section.number(RESISTOR[1])
    return stated if stated and stated > 0.0 else None


def _halves(measured: Responses, records: Mapping[str, Record], tolerance: float) -> tuple[Dataset, Dataset]:
    low, high = records["low"], records.get("high")
    first, second = (
        _dataset(_half(low, later), None if high is None else _half(high, later), measured, tolerance)
        for later in (False, True)
    )
    return first, second


def _half(record: Record, second: bool) -> Record:
    n = record.t.size // 2
    part = slice(n, 2 * n) if second else slice(0, n)
    return replace(record, t=record.t[part], channels={k: v[part] for k, v in record.channels.items()})


def _dataset(low: Record, high: Record | None, measured: Responses, tolerance: float) -> Dataset:
    """Return a dataset with the channels and the frequencies of the unit's own responses."""
    return Dataset.from_records(
        low,
        high,
        measured.merge_Hz,
        tolerance=tolerance,
        channels=measured.first.channels,
        f_lo=SEARCH_LO,
        f_hi=measured.first.f[-1] + 1e-9 if high is not None else measured.merge_Hz,
        name=f"{measured.serial} {low.name}",
    )
