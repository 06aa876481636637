"""How many units pass, at the first attempt and in the end, and what stops the others."""

import numpy as np
import pandas as pd
from scipy.special import ndtri

from accept.fleet.measurements import attempts

GROUPS = ("month", "bench", "operator", "kind", "spec")
CONFIDENCE = 0.95


def yields(frame: pd.DataFrame, by: str) -> pd.DataFrame:
    """Per group: units, passed at the first attempt, passed in the end, and the share of the first with its interval.

    A unit counts in the group of its first attempt. Wilson intervals: they hold for few units and for all passing.
    """
    judged = attempts(frame).assign(month=lambda f: f["time"].dt.strftime("%Y-%m"))
    first = judged.sort_values("seq").drop_duplicates("serial")
    last = judged.sort_values("seq").drop_duplicates("serial", keep="last").set_index("serial")["unit_verdict"]
    units = first.assign(first=first["unit_verdict"] == "accepted", finally_=first["serial"].map(last).eq("accepted"))
    grouped = units.groupby(by, sort=True).agg(
        units=("serial", "size"), first=("first", "sum"), last=("finally_", "sum")
    )
    lo, hi = wilson(grouped["first"].to_numpy(), grouped["units"].to_numpy())
    share = grouped["first"] / grouped["units"]
    return grouped.assign(first_pass=share, lo=lo, hi=hi).reset_index()


def pareto(frame: pd.DataFrame) -> pd.DataFrame:
    """What stopped units at their first attempt: check, quantity, verdict, number of units; the most frequent first."""
    first = frame[frame["attempt"] == 1]
    bad = first[first["verdict"] != "pass"]
    counted = bad.groupby(["check", "quantity", "verdict"])["serial"].nunique().rename("units").reset_index()
    ordered = counted.sort_values(["units", "check", "quantity"], ascending=[False, True, True], ignore_index=True)
    return ordered.assign(share=ordered["units"] / max(1, first["serial"].nunique()))


def wilson(hits: np.ndarray, of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interval of a share by Wilson's score ([Wilson])."""
    z = float(ndtri(0.5 + CONFIDENCE / 2.0))
    n = np.maximum(of, 1).astype(float)
    p = hits / n
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return np.clip(middle - half, 0, 1), np.clip(middle + half, 0, 1)
