"""Which accepted units fit into one machine."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from accept.fleet.errors import FleetError
from accept.fleet.measurements import latest
from checks.arrays import Array
from checks.process_control.matching import MatchedSets, ideal_replacement, match

COLUMNS = (
    "seq",
    "serial",
    "kind",
    "unit_verdict",
    "quantity",
    "value",
    "U",
    "unit",
    "simulated",
)  # what a pool is made of


@dataclass(frozen=True, eq=False)
class Pool:
    """Units to choose from: serials (N,), values (N, Q) of `quantities` in `units`, U (Q,) the median of each."""

    serials: tuple[str, ...]
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    U: Array
    left_out: tuple[str, ...]


def pool(frame: pd.DataFrame, kind: str, by: Sequence[str]) -> Pool:
    """Return the accepted units of a kind, but for simulated ones, by their last judgement. Raises FleetError for a
    quantity that no unit has."""
    last = latest(frame[~frame["simulated"]])
    accepted = last[(last["kind"] == kind) & (last["unit_verdict"] == "accepted")]
    if accepted.empty:
        others = ", ".join(sorted(set(last.loc[last["unit_verdict"] == "accepted", "kind"])))
        hint = f"; of kind {others} there are: --kind {others.split(', ')[0]}" if others else ""
        raise FleetError(f"no accepted unit of kind {kind} in the store{hint}")
    known = accepted.loc[accepted["value"].notna(), "quantity"].unique()
    missing = [name for name in by if name not in set(known)]
    if missing:
        raise FleetError(f"no accepted {kind} has {', '.join(missing)}; there are: {', '.join(sorted(known))}")
    serials = set(accepted["serial"].unique())
    accepted = accepted[accepted["quantity"].isin(by)].astype({"serial": object, "quantity": object})
    wide = accepted.pivot_table(index="serial", columns="quantity", values="value", aggfunc="last")
    whole = wide[list(by)].dropna()
    spread = [accepted[accepted["quantity"] == name] for name in by]
    U = np.array([rows["U"].median() for rows in spread])
    unknown = [name for name, u in zip(by, U, strict=True) if not (np.isfinite(u) and u > 0)]
    if unknown:
        raise FleetError(f"{', '.join(unknown)}: no uncertainty is known, so widths cannot be compared")
    units = tuple(str(rows["unit"].iloc[0]) for rows in spread)
    left = tuple(sorted(serials - set(whole.index)))
    return Pool(tuple(map(str, whole.index)), tuple(by), units, whole.to_numpy(dtype=float), U, left)


def choose(units: Pool, size: int, sets: int) -> MatchedSets:
    """Return sets of `size`, the best first. Raises FleetError if there are too few units."""
    try:
        return match(units.values, units.U, size, sets)
    except ValueError as e:
        raise FleetError(str(e)) from e


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
