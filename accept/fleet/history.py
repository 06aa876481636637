"""The values of a unit at every attempt, and changes that the uncertainties do not explain."""

import numpy as np
import pandas as pd

from accept.pictures.labels import label_of
from checks.picture import Line, Mark, Panel

MOST_NAMED = 12  # attempts of a picture that are named each
SIGNIFICANT = 1.0  # En above one: the two results disagree ([ISO13528] 9.7; U with k = 2)


def changes(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of a unit with each value's difference from the attempt before, in the order of the attempts.

    An attempt that was declared void is compared with none. Adds change, En = change / sqrt(U1^2 + U2^2) and changed
    (True, False, or None if an uncertainty is unknown).
    """
    ordered = frame.sort_values(["quantity", "seq"], kind="stable")
    valid = ordered[ordered["voided"] == ""]
    before = valid.groupby("quantity", observed=True)[["value", "U"]].shift().reindex(ordered.index)
    change = ordered["value"] - before["value"]
    with np.errstate(divide="ignore", invalid="ignore"):
        en = np.abs(change) / np.hypot(ordered["U"], before["U"])
    changed = pd.Series([None if np.isnan(e) else bool(e > SIGNIFICANT) for e in en], index=ordered.index, dtype=object)
    return ordered.assign(change=change, En=en, changed=changed).sort_values(["seq", "check"], kind="stable")


def panels(changed: pd.DataFrame) -> list[Panel]:
    """Return a panel for each quantity that has a value: its value at every attempt, a bar of U to both sides, the
    limits of the last attempt. changed: as `changes` gives it."""
    parts = changed.groupby("quantity", sort=False, observed=True)
    return [_panel(str(name), rows.dropna(subset=["value"])) for name, rows in parts if rows["value"].notna().any()]


def _panel(quantity: str, rows: pd.DataFrame) -> Panel:
    at, value, U = (rows[name].to_numpy(dtype=float) for name in ("attempt", "value", "U"))
    bars = zip(at, value, np.nan_to_num(U), strict=True)
    items: list[Line | Mark] = [Line(np.array([v - u, v + u]), np.full(2, n), role="data") for n, v, u in bars]
    items.append(Line(value, at, "value, U (k = 2)", "points", "data"))
    moved = rows["changed"].eq(True).to_numpy()
    if moved.any():
        items.append(Line(value[moved], at[moved], "changed by more than both U", "points", "bad"))
    limits = {bound: float(rows[bound].iloc[-1]) for bound in ("lower", "upper")}
    items += [Mark(limit, "x", f"{bound} limit", "limit") for bound, limit in limits.items() if np.isfinite(limit)]
    last = int(at.max())
    few = last <= MOST_NAMED
    return Panel(
        label_of(quantity),
        f"{label_of(quantity)} [{rows['unit'].iloc[-1]}]",
        "" if few else "attempt",
        tuple(items),
        y_range=(0.3, last + 0.7 + 0.5 * few),  # room for the legend
        y_names=("", *(f"attempt {n}" for n in range(1, last + 1))) if few else (),
    )
