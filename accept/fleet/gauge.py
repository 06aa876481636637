"""Gauge studies from a table or from the store, and the uncertainty that a spec may state from one."""

from pathlib import Path

import numpy as np
import pandas as pd

from accept.fleet.errors import FleetError
from checks.arrays import Array
from checks.process_control.gauge_study import GaugeStudy, gauge_study

COLUMNS = ("part", "operator", "value")
COVERAGE = 2.0
LARGEST = 10_000_000  # bytes of a table: ten thousand times what a study holds


def read_table(path: Path) -> pd.DataFrame:
    """A CSV file with the columns part, operator, value. Raises FleetError naming the row or column that is wrong."""
    if not path.is_file():
        raise FleetError(f"{path}: is not a file")
    if path.stat().st_size > LARGEST:
        raise FleetError(f"{path}: {path.stat().st_size} bytes, expected at most {LARGEST}")
    try:
        frame = pd.read_csv(path, dtype=str, keep_default_na=False)
    except (ValueError, UnicodeDecodeError) as e:
        raise FleetError(f"{path}: is not a CSV table: {e}") from e
    missing = [name for name in COLUMNS if name not in frame.columns]
    if missing:
        raise FleetError(f"{path}: no column {', '.join(missing)}; expected {', '.join(COLUMNS)}")
    numbers = pd.to_numeric(frame["value"], errors="coerce")
    bad = ~np.isfinite(numbers.to_numpy(dtype=float))
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        raise FleetError(f"{path}, line {row + 2}: value '{frame['value'].iloc[row]}' is not a number")
    return frame.assign(value=numbers)[list(COLUMNS)]


def from_store(frame: pd.DataFrame) -> pd.DataFrame:
    """Judgements of one quantity as a study: serial is the part."""
    return frame.rename(columns={"serial": "part"})[list(COLUMNS)]


def crossed(frame: pd.DataFrame) -> Array:
    """(parts, operators, repeats). Raises FleetError where a part was not measured equally often by every operator."""
    counts = frame.groupby(["part", "operator"]).size().unstack(fill_value=0)
    if counts.shape[0] < 2 or counts.shape[1] < 2:
        have = f"{counts.shape[0]} part(s) and {counts.shape[1]} operator(s)"
        raise FleetError(f"a crossed study needs two or more parts and operators, this has {have}")
    repeats = int(counts.to_numpy().max())
    uneven = np.argwhere(counts.to_numpy() != repeats)
    if len(uneven):
        i, k = uneven[0]
        part, who = list(map(str, counts.index))[i], list(map(str, counts.columns))[k]
        raise FleetError(
            f"part {part} was measured {counts.to_numpy()[i, k]} times by {who}, others {repeats} times: "
            "every operator must measure every part equally often"
        )
    ordered = frame.sort_values(["part", "operator"], kind="stable")
    return ordered["value"].to_numpy(dtype=float).reshape(*counts.shape, repeats)


def study(frame: pd.DataFrame) -> GaugeStudy:
    """The study of a table. Raises FleetError."""
    if frame["value"].nunique() == 1:
        raise FleetError(
            f"all {len(frame)} readings are {frame['value'].iloc[0]:g}: the gauge shows nothing of its spread"
        )
    try:
        return gauge_study(crossed(frame))
    except ValueError as e:
        raise FleetError(str(e)) from e


def expanded_uncertainty(found: GaugeStudy) -> float:
    """U (k = 2) of one measurement by any operator: what a spec may state for values that are typed in. Calibration and
    other systematic parts come on top of it."""
    return COVERAGE * found.gauge
