"""Channels sampled by a clock of their own, told from what else changes within a record."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from checks.cause import Cause
from checks.record import Record
from checks.signals.clock_drift import clock_drifts
from checks.signals.sampling_faults import sampling_faults
from tests.shared.strut_records import NOISE, UNITS, drive, strut_record

KEPT = 0.99  # of the samples: the faster clock needs some beyond the last


def apart(record: Record, ppm: float, *channels: str) -> Record:
    n = int(KEPT * record.t.size)
    when = record.t[:n] * (1.0 + 1e-6 * ppm)
    moved = {k: CubicSpline(record.t, x)(when) if k in channels else x[:n] for k, x in record.channels.items()}
    return replace(record, t=record.t[:n], channels=moved)


@pytest.mark.parametrize("ppm", [20.0, -50.0, 200.0])
def test_a_clock_of_its_own_is_called_so(ppm: float) -> None:
    """Red before: nothing was said up to 200 parts per million."""
    (reason,) = sampling_faults(apart(strut_record(1), ppm, "de"))
    assert reason.cause is Cause.CLOCKS_APART
    assert (reason.parameters["channel"], reason.parameters["reference"]) == ("de", "Va")
    assert reason.parameters["ppm"] == pytest.approx(abs(ppm), rel=0.1)
    assert reason.parameters["grows_us"] == pytest.approx(abs(ppm) * 12.0 * KEPT, rel=0.1)


def test_a_drive_of_another_clock_is_said_once() -> None:
    (reason,) = sampling_faults(apart(strut_record(1), 50.0, "Va"))
    assert (reason.cause, reason.parameters["channel"]) == (Cause.CLOCKS_APART, "Va")


def moving(total: float) -> Record:
    """Every mode of the strut moves by a part over the record: six struts, each blended into the next."""
    u, many = drive(3), 6
    place, blended = np.linspace(0.0, many - 1.0, u.size), {c: np.zeros(u.size) for c in NOISE}
    for k in range(many):
        part, share = strut_record(3, 1.0 + total * k / (many - 1.0), Va=u), np.maximum(1.0 - np.abs(place - k), 0.0)
        for c in NOISE:
            blended[c] += share * part[c]
    return Record(strut_record(3).t, {"Va": u, **blended}, UNITS, "moving")


def changed(change: Callable[[np.ndarray], np.ndarray]) -> Record:
    record = strut_record(1)
    return replace(record, channels={k: x if k == "Va" else change(x) for k, x in record.channels.items()})


OTHERS: dict[str, Callable[[], Record]] = {
    "nothing": lambda: strut_record(2),
    "modes that move by 0.2 %": lambda: moving(2e-3),
    "a gain that drifts by 3 %": lambda: changed(lambda x: x * (1.0 + 0.03 * np.linspace(0.0, 1.0, x.size))),
    "a delay": lambda: changed(lambda x: np.interp(np.arange(x.size) - 2.3, np.arange(x.size), x)),
}


@pytest.mark.parametrize("name", OTHERS)
def test_nothing_else_is_called_a_clock(name: str) -> None:
    assert Cause.CLOCKS_APART not in {r.cause for r in sampling_faults(OTHERS[name]())}


def test_scatter_of_the_times_is_still_called_scatter() -> None:
    """White drive up to 2 kHz, as of the high record: 5 us."""
    rng = np.random.default_rng(4)
    record = strut_record(1, Va=0.3 * rng.standard_normal(drive(1).size))
    when = np.clip(record.t + 5e-6 * rng.standard_normal(record.t.size), record.t[0], record.t[-1])
    scattered = {k: CubicSpline(record.t, x)(when) for k, x in record.channels.items()}
    causes = {r.cause for r in sampling_faults(replace(record, channels=scattered))}
    assert Cause.CLOCKS_APART not in causes


def test_channels_looked_at_together_are_those_looked_at_alone() -> None:
    """To the last bit, though the transforms of the drive are shared."""
    record = apart(strut_record(1), 50.0, "de", "da")
    u, found = record["Va"], clock_drifts(record["Va"], record.channels)
    assert set(found) == {"de", "da"}
    assert found == {c: d for c, x in record.channels.items() for d in clock_drifts(u, {c: x}).values()}
