"""What a unit was at every attempt, and what changed by more than the uncertainties explain."""

import numpy as np
import pandas as pd

SIGNIFICANT = 1.0  # En above one: the two results disagree ([ISO13528] 9.7; U with k = 2)


def changes(frame: pd.DataFrame) -> pd.DataFrame:
    """Rows of one unit with what each value differs by from the attempt before, in the order of the attempts.

    Adds change, En = change / sqrt(U1^2 + U2^2) and changed (True, False, or None where an uncertainty is unknown).
    """
    ordered = frame.sort_values(["quantity", "seq"], kind="stable")
    before = ordered.groupby("quantity")[["value", "U"]].shift()
    change = ordered["value"] - before["value"]
    with np.errstate(divide="ignore", invalid="ignore"):
        en = np.abs(change) / np.hypot(ordered["U"], before["U"])
    changed = pd.Series([None if np.isnan(e) else bool(e > SIGNIFICANT) for e in en], index=ordered.index, dtype=object)
    return ordered.assign(change=change, En=en, changed=changed).sort_values(["seq", "check"], kind="stable")
