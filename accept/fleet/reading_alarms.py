"""What the values of a quantity show beside their chart: populations, a coarse meter, exchanged digits, offsets."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from accept.fleet.findings_file import NOT_STATED
from accept.fleet.measurements import first_attempts, in_order_of_measurement
from accept.fleet.process_control.control_chart import FALSE_ALARM, GROSS_SIGMAS, LEAST, MIXTURE, OFFSET, UNLIKE, Alarm
from accept.fleet.process_control.equal_runs import EqualRun, Labels, equal_runs
from accept.fleet.process_control.offsets import largest_offset
from accept.fleet.process_control.reading_quality import (
    AGREES,
    exchanged,
    likelier,
    residuals,
    step_of,
    two_populations,
)
from accept.fleet.process_control.scale import from_scale, scale_of, scales_of, to_scale
from accept.fleet.process_control.spread import most_sigmas, moving_range_sigma, robust_sigma
from accept.pictures.labels import label_of
from checks.arrays import Array

PRESENT = 0.2  # share of the units that have a quantity which predicts others
CHANCE = 0.001  # that any value of a sound process, of all quantities, is unlike the others of its unit
EXPLAINS = 0.95  # share of the values that the labels of a factor put into the right one of two populations
COARSE = 0.6  # step over standard deviation: the meter shows less than a tenth of the process, 6 sigma ([AIAG-MSA])
NO_CHANCE = 4.0  # 1 in 10^4 that so many readings of a finer meter stand on the steps of a coarser one
PLACES = ("bench", "operator", "instrument", "lot", "supplier", "shift", "spec")  # what a shift may be confined to
OF_OFFSET = 0.005  # chance that a chart in control has an offset: a difference that never changes is no hurry
KNOWN = 4.0  # standard deviations between two means, above which 2 % of values are taken for those of the other one
METERS = ("instrument", "bench", "operator")


def equal_values(rows: pd.DataFrame, shared: float = FALSE_ALARM) -> list[EqualRun]:
    """Return the runs of equal values among rows of one quantity in the order of measurement, by their positions."""
    return equal_runs(rows["value"].to_numpy(), labels_of(rows), shared)


def labels_of(rows: pd.DataFrame) -> dict[str, NDArray[np.object_]]:
    """Return place -> label of each row, "" for one that is not stated."""
    known = [column for column in PLACES if column in rows]
    return {column: np.where(rows[column] == NOT_STATED, "", rows[column]).astype(object) for column in known}


@dataclass(frozen=True, eq=False)
class Mixture:
    """Two populations: what tells them apart, "" for no known factor; the alarm; which of them each value (N,) is of,
    all 0 if they are not so far apart that this is known."""

    by: str
    alarm: Alarm
    part: NDArray[np.intp]


def mixture(
    values: Array, level: Array, scale: str, labels: Mapping[str, Labels], unit: str, shared: float
) -> Mixture | None:
    """Return the two populations of values (N,), None for one. level (N,): of the chart, so that a shift or drift is no
    population; gross values are left out. shared: chance of two that ring."""
    y = to_scale(values, scale)
    about = y - to_scale(level, scale)
    kept = np.flatnonzero(np.abs(about - np.median(about)) <= 2.0 * GROSS_SIGMAS * robust_sigma(about))
    found = two_populations(about[kept])
    of_logs = two_populations(np.log(values[kept])) if found and values.min() > 0.0 else found
    if found is None or of_logs is None:
        return None  # skewed values are two populations as measured, and one on a logarithmic scale
    middle = np.median(to_scale(level, scale))
    low, high = (float(from_scale(middle + np.array(mean), scale)) for mean in found.means)
    by = next((c for c, of in labels.items() if _share(of[kept], found.upper) >= EXPLAINS), "")
    explained = f"; {by} tells them apart" if by else "; no bench, meter, operator, lot or spec tells them apart"
    words = (
        f"the values have two populations, {low:.4g} and {high:.4g} {unit} ({100 * found.upper_share:.0f} % in the "
        f"upper one), {(found.means[1] - found.means[0]) / found.sigma:.1f} of their standard deviations apart"
        f"{explained}; log likelihood ratio {found.ratio / 2.0:.0f}, of one population above 10 in less than 1 of 1000"
    )
    rings = min(found.ratio, of_logs.ratio) > likelier(shared)
    alarm = Alarm(MIXTURE, 0, values.size - 1, high - low, 0.0, values.size, evidence=words, rings=rings)
    is_known = by not in METERS and found.means[1] - found.means[0] > KNOWN * found.sigma
    return Mixture(by, alarm, (about > sum(found.means) / 2.0).astype(np.intp) * is_known)


def offset(
    rows: pd.DataFrame, level: Array, scale: str, part: NDArray[np.intp], labels: Mapping[str, Labels], shared: float
) -> Alarm | None:
    """Return the alarm of a bench, meter or person that reads otherwise than others on the same day, of the same kind,
    lot and population; None without one. shared: chance of one that rings."""
    values = rows["value"].to_numpy()
    y = to_scale(values, scale)
    blocks = rows.groupby(["day", "lot", "kind", part], observed=True, sort=False).ngroup().to_numpy().astype(np.intp)
    found = largest_offset(y - to_scale(level, scale), labels, blocks)
    if found is None or found.chance > OF_OFFSET:
        return None
    middle = float(np.median(y))
    usual, off, beyond = from_scale(middle + np.array([0.0, found.size, found.size + 2.0 * found.error]), scale)
    U, ends = abs(float(beyond - off)), (int(found.at[0]), int(found.at[-1]))
    return Alarm(OFFSET, *ends, float(off - usual), U, found.at.size, found.place, rings=found.chance <= shared)


def _share(labels: Labels, upper: Array) -> float:
    """Return the share of values that go with their label, if each label belongs to the population that most of its
    values are of; 0 with fewer than two labels of `LEAST` values."""
    names, of = np.unique(labels.astype(str), return_inverse=True)
    counts = np.bincount(of)
    ups = np.bincount(of, weights=upper)
    return (
        float(np.maximum(ups, counts - ups).sum() / upper.size) if (counts >= LEAST).sum() > 1 and len(names) else 0.0
    )


def coarse_meters(values: Array, labels: Mapping[str, Labels], unit: str) -> Iterator[str]:
    """Yield which meter shows values in steps that others do not have, or in steps too coarse for the process."""
    if values.size < LEAST or (sigma := moving_range_sigma(values)) == 0.0:
        return
    column = next((name for name in METERS if name in labels and len(set(labels[name]) - {""}) > 1), None)
    parts = {"": values} if column is None else {str(n): values[labels[column] == n] for n in set(labels[column])}
    steps = {name: step for name, part in sorted(parts.items()) if part.size >= LEAST and (step := step_of(part))}
    finest = min(steps.values(), default=0.0)
    for name, step in steps.items():
        power = parts[name].size * float(np.log10(step / finest))  # by chance: 1 in 10 to it
        if step > COARSE * sigma or power >= NO_CHANCE:
            whose = f"{column} {name}" if name else "the meter"
            others = f", others in {finest:g} {unit} (by chance 1 in 10^{power:.0f})" if step > finest else ""
            rounding = step / np.sqrt(12.0)
            yield (
                f"{whose} shows steps of {step:g} {unit}{others}: rounding adds {rounding:.2g} {unit} (1 sd), "
                f"{100.0 * rounding / sigma:.0f} % of the spread within"
            )


def unlike_values(frame: pd.DataFrame) -> dict[str, dict[str, Alarm]]:
    """Return quantity -> serial -> alarm, at no index, of each value that the other quantities of its unit contradict.

    frame: rows of all quantities. Equal values in a row predict nothing; quantities that four of five units do not have
    are left out. Of a unit whose quantities contradict each other, the wrong one is that which agrees with two digits
    exchanged, else the farthest off."""
    first = in_order_of_measurement(first_attempts(frame[frame["value"].notna()]))
    parts = [rows for _, rows in first.groupby("quantity", observed=True)]
    equal = [i for rows in parts for run in equal_values(rows) for i in rows.index[run.at]]
    serials = first["serial"].astype(object).drop_duplicates()
    first = first.drop(index=equal).astype({"serial": object, "quantity": object})
    table = first.pivot(index="serial", columns="quantity", values="value").reindex(serials)
    table = table.loc[:, (table.notna().mean() >= PRESENT) & (table.nunique() > LEAST)]
    names = list(map(str, table))
    if len(names) < 2:
        return {}
    scales = [scale_of(table[name].dropna().to_numpy()) for name in names]
    y = np.column_stack([to_scale(table[name].to_numpy(), scale) for name, scale in zip(names, scales, strict=True)])
    rest, sigmas = residuals(y)
    n = int(np.isfinite(rest).sum())
    most = most_sigmas(max(n, 1), max(n - 2, 1), CHANCE)
    gross = np.abs(rest) > most * sigmas
    for q in np.flatnonzero(gross.any(axis=0)).tolist():  # gross on each scale that the values do not contradict
        for scale in scales_of(table[names[q]].dropna().to_numpy()):
            again, its = residuals(
                np.column_stack([y[:, :q], to_scale(table[names[q]].to_numpy(), scale), y[:, q + 1 :]])
            )
            gross[:, q] &= np.abs(again[:, q]) > most * its[:, q]
    found = dict[str, dict[str, Alarm]]()
    for i in np.flatnonzero(gross.any(axis=1)).tolist():
        expected, off = y[i] - rest[i], np.abs(rest[i]) / sigmas[i]
        swaps = {
            (abs(float(to_scale(np.array(swap), scales[q])) - expected[q]) / sigmas[i, q], q): swap
            for q in np.flatnonzero(gross[i]).tolist()
            if (step := step_of(table[names[q]].dropna().to_numpy()))
            for swap in exchanged(float(table[names[q]].iloc[i]), step)
        }
        nearest, wrong = min(swaps, default=(np.inf, 0))
        if nearest > AGREES:
            wrong = int(np.nanargmax(off))
        quantity = names[wrong]
        value, ends = float(table[quantity].iloc[i]), expected[wrong] + sigmas[i, wrong] * np.array([0.0, 2.0])
        middle, beyond = from_scale(ends, scales[wrong]).tolist()
        near = f"; with two digits exchanged, {swaps[nearest, wrong]:g}, it agrees" if nearest <= AGREES else ""
        words = (
            f"{value:g} is {off[wrong]:.1f} standard deviations from {middle:.4g}, which the other quantities of the "
            f"unit give ({', '.join(label_of(name) for name in names if name != quantity)}){near}"
        )
        alarm = Alarm(UNLIKE, 0, 0, value - middle, abs(beyond - middle), 1, evidence=words, rings=True)
        found.setdefault(quantity, {})[str(table.index[i])] = alarm
    return found
