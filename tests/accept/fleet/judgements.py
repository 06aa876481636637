"""Stores with judgements whose values are drawn, for tests of what is asked of many units."""

import datetime
from collections.abc import Mapping
from typing import Any

from accept.store import NewEvent, Store
from accept.store import store as store_module

LIMITS: dict[str, tuple[float | None, float | None]] = {
    "sensor_uF": (4.4, 5.5), "actuator_uF": (8.8, 11.0), "stroke_um": (304.0, None), "k_closed_N_per_um": (2.4, 4.0),
    "flatness_um": (None, 10.0),
}  # fmt: skip
CHECK = {
    "sensor_uF": "capacitance", "actuator_uF": "capacitance", "stroke_um": "stroke", "k_closed_N_per_um": "stiffness",
    "flatness_um": "flatness",
}  # fmt: skip
UNIT = {"sensor_uF": "uF", "actuator_uF": "uF", "stroke_um": "um", "k_closed_N_per_um": "N/um", "flatness_um": "um"}
U = {"sensor_uF": 0.02, "actuator_uF": 0.045, "stroke_um": 0.5, "k_closed_N_per_um": 0.02, "flatness_um": 0.02}


def finding(name: str, value: float | None, U_: float | None = None) -> dict[str, Any]:
    """A finding as results.json has it, judged simply against `LIMITS`."""
    lower, upper = LIMITS[name]
    ok = value is not None and (lower is None or value >= lower) and (upper is None or value <= upper)
    verdict = "no_result" if value is None else "pass" if ok else "fail"
    return {
        "check": CHECK[name], "quantity": name, "value": value, "unit": UNIT[name], "U": U_ or U[name],
        "lower": lower, "upper": upper, "rule": "simple", "verdict": verdict, "p_false_accept": 0.0,
        "reason": None if ok else "not measured" if value is None else "outside", "required": True,
    }  # fmt: skip


def judgement(
    serial: str,
    values: Mapping[str, float | None],
    bench: str | None = None,
    lot: str | None = None,
    day: datetime.date | None = None,
    simulated: bool = False,
) -> NewEvent:
    """The event of a judged APA. day: of measurement, if it is stated."""
    findings = [finding(name, value) for name, value in values.items()]
    verdicts = {f["verdict"] for f in findings}
    verdict = "rejected" if "fail" in verdicts else "incomplete" if "no_result" in verdicts else "accepted"
    result: dict[str, Any] = {
        "serial": serial, "kind": "apa", "verdict": verdict, "findings": findings, "information": [],
        "not_judged": [], "notes": [], "parts": {}, "inputs": {"unit.toml": "0" * 64},
    }  # fmt: skip
    if simulated:
        result["simulated"] = True
    if bench is not None:
        result["calibration"] = {"bench": bench, "sha256": "1" * 64, "on": "2026-01-01", "instruments": []}
    if lot is not None:
        result["origin"] = {"lot": lot}
    if day is not None:
        result["measured"] = {CHECK[name]: day.isoformat() for name in values}
    payload = {"path": f"/units/{serial}", "inputs": result["inputs"], "spec_sha256": "2" * 64, "code_sha256": "3" * 64}
    return NewEvent("unit_judged", serial, payload | {"result": result}, "apa-basic@" + "2" * 64)


def add(store: Store, events: list[NewEvent], who: str = "Ann", at: datetime.datetime | None = None) -> None:
    """Append judgements, at a day of choice where one is given."""
    if at is None:
        store.append_many(events, who=who)
        return

    class Clock(datetime.datetime):
        @classmethod
        def now(cls, tz: datetime.tzinfo | None = None) -> datetime.datetime:
            return at.astimezone(tz)

    kept = store_module.datetime
    store_module.datetime = Clock
    try:
        store.append_many(events, who=who)
    finally:
        store_module.datetime = kept
