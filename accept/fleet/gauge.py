"""Gauge studies from a table or from the store, and the uncertainty that a spec may state from one."""

from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from accept.fleet.errors import FleetError
from checks.arrays import Array
from checks.process_control.gauge_study import STUDY_SIGMAS, GaugeStudy, gauge_study

COLUMNS = ("part", "operator", "value")
COVERAGE = 2.0
LARGEST = 10_000_000  # bytes of a table: ten thousand times what a study holds


def read_table(path: Path) -> pd.DataFrame:
    """Read a CSV file with the columns part, operator, value. Raises FleetError naming the wrong row or column."""
    if not path.is_file():
        raise FleetError(f"{path}: is not a file")
    if path.stat().st_size > LARGEST:
        raise FleetError(f"{path}: {path.stat().st_size} bytes, expected at most {LARGEST}")
    try:
        text = path.read_text("utf-8-sig")
        semicolons = ";" in text.split("\n", 1)[0]  # as spreadsheets of half of Europe write it
        frame = pd.read_csv(StringIO(text), dtype=str, keep_default_na=False, sep=";" if semicolons else ",")
    except (ValueError, UnicodeDecodeError) as e:
        raise FleetError(f"{path}: is not a CSV table: {e}") from e
    frame = frame.rename(columns=lambda name: str(name).strip().lower()).map(str.strip)
    if semicolons and "value" in frame.columns:
        frame = frame.assign(value=frame["value"].str.replace(",", "."))
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
    """Return judgements of one quantity as a study: the serial is the part."""
    return frame.rename(columns={"serial": "part"})[list(COLUMNS)]


def crossed(frame: pd.DataFrame) -> Array:
    """Return values (parts, operators, repeats). Raises FleetError if the study is not balanced."""
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
    """Return the study of a table. Raises FleetError."""
    if frame["value"].nunique() == 1:
        raise FleetError(f"all {len(frame)} readings are {frame['value'].iloc[0]:g}; repeatability cannot be estimated")
    try:
        return gauge_study(crossed(frame))
    except ValueError as e:
        raise FleetError(str(e)) from e


def expanded_uncertainty(found: GaugeStudy) -> float:
    """Return U (k = 2) of one measurement by any operator: what a spec may state for values that are typed in.

    Calibration and other systematic parts come on top of it.
    """
    return COVERAGE * found.components["gauge"].sigma


def document(found: GaugeStudy, tolerance: float | None, readings: int) -> dict[str, Any]:
    """Return a study as a document: table of variances, components, shares, categories, U for a spec, verdict."""
    total = found.components["total"].sigma
    return {
        "readings": readings,
        "table": [
            {"source": name, "degrees": row.degrees, "squares": row.squares, "mean_square": row.mean_square,
             "F": row.F if row.F is None or np.isfinite(row.F) else None, "p": row.p}
            for name, row in found.table.items()
        ],
        "components": [
            {"source": name, "sigma": part.sigma, "lo": part.lo, "hi": part.hi,
             "percent_of_study": 100.0 * part.sigma / total,
             "percent_of_variance": 100.0 * (part.sigma / total) ** 2,
             **({} if tolerance is None else {"percent_of_tolerance": 100.0 * STUDY_SIGMAS * part.sigma / tolerance})}
            for name, part in found.components.items()
        ],
        "interaction_pooled": found.pooled,
        "distinct_categories": found.distinct_categories,
        "percent_of_study": found.percent_of_study,
        "percent_of_tolerance": None if tolerance is None else found.percent_of_tolerance(tolerance),
        "degrees": found.degrees,
        "U": expanded_uncertainty(found),
        "verdict": found.verdict(tolerance),
    }  # fmt: skip
