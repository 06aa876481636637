"""Which accepted units fit into one machine."""

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from accept.fleet.errors import FleetError, statistics
from accept.fleet.measurements import GOLDEN, in_order_of_measurement, is_between, latest
from accept.fleet.process_control.matching import MatchedSets, ideal_replacement, match
from accept.fleet.reading_alarms import equal_values
from accept.fleet.trend import whose
from checks.arrays import Array
from specs.files import read_bounded

COLUMNS = (  # what a pool is made of
    "seq", "serial", "kind", "unit_verdict", "quantity", "value", "U", "unit", "simulated", GOLDEN,
    "time", "measured", "batch", "place", "operator", "bench", "lot",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Pool:
    """Units to choose from: serials (N,), values (N, Q) of `quantities` in `units`, U (Q,) the median of each.
    left_out: why -> serials of the others."""

    serials: tuple[str, ...]
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    U: Array
    left_out: Mapping[str, Sequence[str]]


@dataclass(frozen=True)
class Chosen:
    """Which units are asked about: serials, None: all; a lot; first and last day of their last measurement."""

    serials: frozenset[str] | None = None
    lot: str | None = None
    days: tuple[datetime.date | None, datetime.date | None] = (None, None)

    def of(self, rows: pd.DataFrame) -> pd.DataFrame:
        keep = is_between(rows, *self.days)
        if self.serials is not None:
            keep &= rows["serial"].isin(list(self.serials))
        return rows[keep if self.lot is None else keep & (rows["lot"] == self.lot)]


ALL = Chosen()


def serials_in(file: Path) -> frozenset[str]:
    """Return the serials in a file, one on each line. Raises FleetError for a file that is empty or cannot be read."""
    try:
        found = frozenset(filter(None, map(str.strip, read_bounded(file).decode().splitlines())))
    except (OSError, ValueError) as e:
        raise FleetError(f"{file}: cannot be read as a list of serials ({e})") from e
    if not found:
        raise FleetError(f"{file}: holds no serial; write one on each line")
    return found


def pool(frame: pd.DataFrame, kind: str, by: Sequence[str], chosen: Chosen = ALL) -> Pool:
    """Return the accepted units of a kind by their last judgement, without simulated and golden ones and values that
    were not measured one by one. Raises FleetError for a quantity that no unit has."""
    last = chosen.of(latest(frame[~frame["simulated"] & ~frame[GOLDEN]]))
    accepted = last[(last["kind"] == kind) & (last["unit_verdict"] == "accepted")]
    if accepted.empty and chosen != ALL:
        raise FleetError(f"no accepted unit of kind {kind} in the store is one of those that are asked about")
    if accepted.empty:
        others = ", ".join(sorted(set(last.loc[last["unit_verdict"] == "accepted", "kind"])))
        hint = f"; of kind {others} there are: --kind {others.split(', ')[0]}" if others else ""
        raise FleetError(f"no accepted unit of kind {kind} in the store{hint}")
    known = accepted.loc[accepted["value"].notna(), "quantity"].unique()
    missing = [name for name in by if name not in set(known)]
    if missing:
        raise FleetError(f"no accepted {kind} has {', '.join(missing)}; there are: {', '.join(sorted(known))}")
    serials, left_out = set(accepted["serial"].unique()), dict[str, Sequence[str]]()
    if absent := sorted((chosen.serials or frozenset()).difference(serials)):
        left_out[f"no accepted {kind} that is asked about by its last judgement"] = absent
    accepted = accepted[accepted["quantity"].isin(by)].astype({"serial": object, "quantity": object})
    known_values = accepted
    for name in by:
        rows = in_order_of_measurement(accepted[(accepted["quantity"] == name) & accepted["value"].notna()])
        for run in equal_values(rows):
            equal = rows.iloc[run.at]
            words = f"{len(equal)} equal values of {name} in a row: {equal['value'].iloc[0]:g} {equal['unit'].iloc[0]}"
            left_out[f"{words},{whose(run.place)}"] = sorted(equal["serial"])
            accepted = accepted[~((accepted["quantity"] == name) & accepted["serial"].isin(equal["serial"]))]
    wide = accepted.pivot_table(index="serial", columns="quantity", values="value", aggfunc="last")
    whole = wide.reindex(columns=list(by)).dropna()
    spread = [known_values[known_values["quantity"] == name] for name in by]
    U = np.array([rows["U"].median() for rows in spread])
    unknown = [name for name, u in zip(by, U, strict=True) if not (np.isfinite(u) and u > 0)]
    if unknown:
        raise FleetError(f"{', '.join(unknown)}: no uncertainty is known, so widths cannot be compared")
    units = tuple(str(rows["unit"].iloc[0]) for rows in spread)
    if missing := sorted(serials.difference(whole.index, *left_out.values())):
        left_out["a value is missing"] = missing
    return Pool(tuple(map(str, whole.index)), tuple(by), units, whole.to_numpy(dtype=float), U, left_out)


def choose(units: Pool, size: int, sets: int) -> MatchedSets:
    """Return sets of `size`, the best first. Raises FleetError if there are too few units."""
    with statistics():
        return match(units.values, units.U, size, sets)


def advice(units: Pool, members: Sequence[int], cost: float) -> str:
    """Return the values that one more unit would need to improve the set."""
    worst, then, lo, hi = ideal_replacement(units.values, units.U, members)
    wanted = ", ".join(
        f"{name} {a:.5g} to {b:.5g} {unit}"
        for name, unit, a, b in zip(units.quantities, units.units, lo, hi, strict=True)
    )
    return (
        f"one more unit with {wanted} in place of {units.serials[worst]} lowers the cost from {cost:.3g} to {then:.3g}"
    )
