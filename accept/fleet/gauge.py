"""Gauge studies from a table or from the store, and the uncertainty that a spec may state from one."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from accept.fleet.errors import FleetError, statistics
from accept.fleet.process_control.gauge_bias import BiasStudy, LinearityStudy, bias_study, linearity_study
from accept.fleet.process_control.gauge_study import STUDY_SIGMAS, GaugeStudy, averages_and_ranges, gauge_study
from accept.fleet.yields import bars, row_panel
from checks.arrays import Array
from checks.errors import RecordError
from checks.picture import Line, Mark, Panel, Text
from hw.records import load_bytes, read_text
from specs.units import parse_column

COLUMNS = ("part", "operator", "value")
NUMBERS = ("value", "reference")
COVERAGE = 2.0
_UPPER_RANGE = {2: 3.267, 3: 2.574, 4: 2.282, 5: 2.114}  # D4 of so many repeats ([AIAG-SPC] appendix E)
MAX_BYTES = 10_000_000  # of a table: ten thousand times what a study holds


def read_table(path: Path, columns: Sequence[str] = COLUMNS) -> pd.DataFrame:
    """Read a text table with these columns; value and reference are numbers, in one unit. attrs["remarks"]: how it was
    read. Raises FleetError naming the wrong line or column."""
    try:
        source = load_bytes(path, MAX_BYTES)
        table = read_text(source.file, source.raw, open_end=True)
        names = [parse_column(head)[0].lower() for head in table.layout.heads]
        missing = [name for name in columns if name not in names]
        if missing:
            raise RecordError(f"{source.file}: no column {', '.join(missing)}; it has {', '.join(names)}")
        twice = [name for name in columns if names.count(name) > 1]
        if twice:
            raise RecordError(f"{source.file}: two columns have the name '{twice[0]}'; keep one")
        numeric = [name for name in columns if name in NUMBERS]
        places = {name: names.index(name) for name in columns}
        units = {name: table.layout.units[places[name]] for name in numeric}
        if len(set(units.values())) > 1:
            stated = ", ".join(f"{name} in '{unit}'" for name, unit in units.items())
            raise RecordError(f"{source.file}: {stated}; expected one unit for both")
        values = dict(zip(numeric, table.numbers([places[name] for name in numeric]), strict=True))
        texts = {name: table.texts(places[name]) for name in columns if name not in numeric}
    except RecordError as e:
        raise FleetError(str(e)) from e
    for name, x in values.items():
        if not np.isfinite(x).all():
            row = int(np.flatnonzero(~np.isfinite(x))[0])
            raise FleetError(f"{path.name}: row {row + 1} below the header: column '{name}' holds {x[row]}")
    frame = pd.DataFrame({name: values.get(name, texts.get(name)) for name in columns})
    frame.attrs["remarks"] = [f"{source.file}: {words}" for words in table.layout.remarks]
    return frame


def from_store(frame: pd.DataFrame) -> pd.DataFrame:
    """Return judgements of one quantity as a study: the serial is the part."""
    return frame.rename(columns={"serial": "part"})[list(COLUMNS)].astype({"part": object, "operator": object})


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
    with statistics():
        return gauge_study(crossed(frame))


def document(found: GaugeStudy, tolerance: float | None, frame: pd.DataFrame) -> dict[str, Any]:
    """Return the study of a table as a document: table of variances, components, shares, categories, verdict, and U
    (k = 2) of one measurement by any operator, which a spec may state for typed values; systematic contributions add to
    it. averages_and_ranges: components by that method, null if the study is too large for it."""
    total = found.components["total"].sigma
    return {
        "readings": len(frame),
        "averages_and_ranges": averages_and_ranges(crossed(frame)),
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
        "U": COVERAGE * found.components["gauge"].sigma,
        "verdict": found.verdict(tolerance),
        "decided_by": found.decided_by(tolerance),
    }  # fmt: skip


def bias(frame: pd.DataFrame, reference: float, tolerance: float | None) -> BiasStudy:
    """Return the study of readings of a single part. Raises FleetError."""
    with statistics():
        return bias_study(frame["value"].to_numpy(dtype=float), reference, tolerance)


def linearity(frame: pd.DataFrame) -> LinearityStudy:
    """Return the study of readings of several parts with their references. Raises FleetError."""
    with statistics():
        return linearity_study(frame["reference"].to_numpy(dtype=float), frame["value"].to_numpy(dtype=float))


def bias_document(found: BiasStudy, reference: float, tolerance: float | None) -> dict[str, Any]:
    """Return a study of type 1 as a document."""
    stated = {"reference": reference, "tolerance": tolerance, "capable": found.capable}
    return {**asdict(found), "bias": _estimate(found.bias), **stated}


def linearity_document(found: LinearityStudy) -> dict[str, Any]:
    """Return a study of linearity as a document."""
    rows = zip(found.references, found.biases, strict=True)
    return {
        "n": found.n,
        "slope": _estimate(found.slope),
        "intercept": _estimate(found.intercept),
        "sigma": found.sigma,
        "r_squared": found.r_squared,
        "references": [{"reference": reference, **_estimate(each)} for reference, each in rows],
        "linear": found.linear,
    }


def _estimate(estimate: Any) -> dict[str, Any]:
    values = {name: value if np.isfinite(value) else None for name, value in asdict(estimate).items()}
    return values | {"significant": estimate.significant}


def bias_panels(frame: pd.DataFrame, found: BiasStudy, reference: float) -> list[Panel]:
    """Return the readings in order, with their mean and the reference."""
    values = frame["value"].to_numpy(dtype=float)
    items = (
        Line(np.arange(1.0, values.size + 1), values, "reading", "points", "data"),
        Mark(reference, "y", "reference", "limit"),
        Mark(found.mean, "y", "mean", "model"),
    )
    return [Panel("readings of one part", "reading", "value", items)]


def linearity_panels(frame: pd.DataFrame, found: LinearityStudy) -> list[Panel]:
    """Return the bias of every reading against its reference, the mean of each and the line."""
    at = frame["reference"].to_numpy(dtype=float)
    ends = np.array([at.min(), at.max()])
    means = np.array([each.value for each in found.biases])
    items = (
        Line(at, frame["value"].to_numpy(dtype=float) - at, "reading", "points", "data"),
        Line(np.array(found.references), means, "mean", "points", "bad"),
        Line(ends, found.intercept.value + found.slope.value * ends, "line", role="model"),
        Mark(0.0, "y", "no bias", "quiet"),
    )
    return [Panel("bias against reference", "reference", "bias", items)]


def panels(frame: pd.DataFrame, found: GaugeStudy) -> list[Panel]:
    """Return the six pictures of a crossed study: components, ranges and means of the cells by operator, values by part
    and by operator, and the means of every operator over the parts."""
    x = crossed(frame)
    parts, operators, repeats = x.shape
    cells, ranges = x.mean(axis=2), np.ptp(x, axis=2)
    cell, part = (np.arange(1.0, n + 1) for n in (cells.size, parts))
    limit = float(ranges.mean()) * _UPPER_RANGE.get(repeats, 2.0)
    half = 3.0 * found.components["repeatability"].sigma / np.sqrt(repeats)
    upper, middle = Mark(limit, "y", "upper limit", "bad"), float(x.mean())
    limits = (Mark(middle - half, "y", "limits of repeatability", "bad"), Mark(middle + half, "y", "", "bad"))
    of_part = Line(np.repeat(part, operators * repeats), x.reshape(-1), "value", "points", "data")
    names = sorted(frame["operator"].astype(str).unique())
    across = "part, operator after operator"
    return [
        _shares(found),
        Panel("ranges", across, "range", (Line(cell, ranges.T.reshape(-1), "range"), upper)),
        Panel("means", across, "mean", (Line(cell, cells.T.reshape(-1), "mean"), *limits)),
        Panel("values by part", "part", "value", (of_part, Line(part, cells.mean(axis=1), "mean", role="model"))),
        _by_operator(x, names),
        Panel("interaction", "part", "mean", tuple(Line(part, cells[:, k], name) for k, name in enumerate(names))),
    ]  # fmt: skip


def _by_operator(x: Array, names: list[str]) -> Panel:
    """Return the values (parts, operators, repeats) of each operator in a row with its name, the first one above."""
    rows = np.arange(len(names), 0.0, -1.0) - 1.0
    values = np.moveaxis(x, 1, 0).reshape(len(names), -1)
    points = Line(values.reshape(-1), np.repeat(rows, values.shape[1]), "value", "points", "data")
    words = (Text(float(x.min()), row + 0.2, name, "limit") for row, name in zip(rows, names, strict=True))
    items: list[Line | Text] = [points, Line(values.mean(axis=1), rows, "mean", role="model"), *words]
    return row_panel("values by operator", "value", items, len(names), None)


def _shares(found: GaugeStudy) -> Panel:
    names = ("gauge", "repeatability", "reproducibility", "parts")
    share = [100.0 * found.components[name].sigma / found.components["total"].sigma for name in names]
    words = [f"{name}: {each:.1f} %" for name, each in zip(names, share, strict=True)]
    return row_panel("share of the total spread", "% of the study", bars(np.array(share), words, "good"), 4, 105.0)
