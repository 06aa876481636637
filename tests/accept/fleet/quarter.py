"""A quarter of 520 units whose faults are known, as judgements of a store: two operators with a meter each, a number
that one of them copied, units that are held, and a golden unit every Monday.

Run by hand: `ACCEPT_HOME=... python tests/accept/fleet/quarter.py`, then ask it with `accept trend`, `yield` or `site`.
"""

import datetime
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[3]))
from accept.fleet.golden import name_golden
from accept.store import NewEvent, Store, open_store
from tests.accept.fleet.judgements import add, judgement

FIRST, WEEKS, A_WEEK = datetime.date(2026, 7, 6), 13, 40
GOLDEN = "APA-GOLD"
COPIED, COPIED_SINCE = 4.95, datetime.date(2026, 8, 10)
HELD = {"APA-0101": "Interface: a scratch", "APA-0202": "Wires: cut short"}
COPY = "APA-0303"
FAILED = {
    "APA-0050": {"stroke_um": 290.0},
    "APA-0151": {"stroke_um": 295.0, "flatness_um": 14.0},
    "APA-0252": {"flatness_um": 12.0},
    "APA-0353": {"flatness_um": 11.5},
    "APA-0404": {"sensor_uF": 1.575},
}
NOT_MEASURED = "APA-0455"


def fill(store: Store) -> None:
    """Add the quarter to a store; seeded."""
    rng, of_day = np.random.default_rng(2026), dict[tuple[datetime.date, str], list[NewEvent]]()
    for n in range(WEEKS * A_WEEK):
        week, place = divmod(n, A_WEEK)
        day = FIRST + datetime.timedelta(days=7 * week + place // 8)
        ben = bool(n % 2)
        judged = of_day.setdefault((day, "Ben" if ben else "Ann"), [])
        if place == 0:
            judged.append(judgement(GOLDEN, {"stroke_um": 362.0, "sensor_uF": 5.2}, "LCR-1", day=day))
        sensor = 5.1 + 0.13 * rng.standard_normal()
        values: dict[str, float | None] = {
            "sensor_uF": round(sensor + 0.015, 2) if ben else round(sensor, 3),
            "stroke_um": round(360.0 + 4.0 * rng.standard_normal(), 1),
            "flatness_um": round(float(np.exp(1.2 + 0.25 * rng.standard_normal())), 2),
        }
        serial = f"APA-{n + 1:04d}"
        if ben and day >= COPIED_SINCE:
            values["sensor_uF"] = COPIED
        values |= FAILED.get(serial, {}) | ({"stroke_um": None} if serial == NOT_MEASURED else {})
        made = judgement(serial, values, f"LCR-{1 + ben}", f"L{1 + week // 3}", day)
        judged.append(_held(made, serial))
    for (day, who), events in of_day.items():
        add(store, events, who=who, at=datetime.datetime.combine(day, datetime.time(16), datetime.UTC))
    name_golden(store, GOLDEN, "accepted", "Grace")


def _held(made: NewEvent, serial: str) -> NewEvent:
    """Return a judgement as a nonconformance or a copied recording leaves it."""
    result: dict[str, Any] = made.payload["result"]
    if serial in HELD:
        result |= {"nonconformances": [HELD[serial]], "verdict": "conditional"}
        result["findings"] = [f | {"verdict": "conditional", "reason": "held"} for f in result["findings"]]
    if serial == COPY:
        bare = {"value": None, "U": None, "verdict": "no_result", "reason": "holds the same data as APA-0001"}
        copy = {"sample": "capacitance/values", "with": [{"serial": "APA-0001", "sample": "capacitance/values"}]}
        result |= {"copies": [copy | {"withheld": True, "resolved": None}], "verdict": "incomplete"}
        result["findings"] = [f | bare for f in result["findings"]]
    return made


if __name__ == "__main__":
    with open_store() as opened:
        fill(opened)
