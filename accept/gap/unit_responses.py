"""The measured responses of a unit, from the records that its folder names under [frf]."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from accept.units import unit_folder as units
from accept.units.loaded_unit import LoadedUnit, loaded
from accept.units.unit_folder import UnitError, UnitFolder
from checks.acceptance import CHECKS, record_faults
from checks.cause import together
from checks.declare import Measured, Scalar, Values
from checks.errors import RecordError
from checks.fitting import CHANNELS, F_HI, F_LO, Dataset, dataset_from_records
from checks.model import LearnedBench
from checks.record import Record
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
        return dataset_from_records(
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
