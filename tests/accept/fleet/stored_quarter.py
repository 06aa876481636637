"""The quarter of `thirteen_weeks` as judgements of a store."""

import datetime
from collections import defaultdict

import numpy as np
import pandas as pd

from accept.fleet.findings_file import NOT_STATED
from accept.fleet.golden import name_golden
from accept.fleet.measurements import COLUMNS, CONCEDED, VOIDED
from accept.fleet.measurements import GOLDEN as GOLDEN_COLUMN
from accept.store import NewEvent, Store
from tests.accept.fleet.judgements import add, judgement
from tests.accept.fleet.thirteen_weeks import Quarter

GOLDEN = "APA-GOLD"
NAMES = {"stiffness_N_um": "k_closed_N_per_um"}  # as a spec calls them; the others have the same name


def fill(store: Store, drawn: Quarter) -> None:
    """Add a quarter to a store, the golden unit named at its first Monday."""
    of_day = defaultdict[tuple[datetime.date, str], list[NewEvent]](list)
    for day, values in drawn.golden:
        of_day[day, "Ann"].append(event(GOLDEN, values, "LCR-1", None, day))
    for unit in drawn.units:
        of_day[unit.day, unit.operator].append(event(unit.serial, unit.values, unit.meter, unit.lot, unit.day))
    for n, ((day, who), events) in enumerate(sorted(of_day.items())):
        add(store, events, who=who, at=datetime.datetime.combine(day, datetime.time(16), datetime.UTC))
        if n == 0:
            name_golden(store, GOLDEN, "accepted", "Grace")


def event(serial: str, values: dict[str, float], bench: str, lot: str | None, day: datetime.date) -> NewEvent:
    renamed = {NAMES.get(name, name): value for name, value in values.items()}
    made = judgement(serial, renamed, bench, lot, day)
    # The limits of `judgements` are for the stiffness of another strut: this one is not judged by them.
    for finding in made.payload["result"]["findings"]:
        if finding["quantity"] == "k_closed_N_per_um":
            finding |= {"lower": None, "upper": None, "verdict": "pass", "reason": None}
    verdicts = {finding["verdict"] for finding in made.payload["result"]["findings"]}
    made.payload["result"]["verdict"] = "rejected" if "fail" in verdicts else "accepted"
    return made


def frame_of(drawn: Quarter) -> pd.DataFrame:
    """Return a quarter as `measurements` does, without a store: 200 of them are asked about."""
    rows = [
        {
            **dict.fromkeys(COLUMNS, NOT_STATED),
            "seq": n, "batch": n, "place": 0, "time": unit.day, "measured": unit.day, "operator": unit.operator,
            "bench": unit.meter, "instrument": unit.gauge, "lot": unit.lot, "serial": unit.serial, "kind": "apa",
            "attempt": 1, "unit_verdict": "accepted", "spec": "apa", "held_by": "", VOIDED: "", CONCEDED: "",
            "simulated": False, GOLDEN_COLUMN: False, "typed": True, "check": name, "quantity": name, "value": value,
            "unit": "um", "U": 1.0, "lower": 0.0, "upper": np.nan, "verdict": "pass", "reason": "", "required": True,
        }
        for n, unit in enumerate(drawn.units)
        for name, value in unit.values.items()
    ]  # fmt: skip
    frame = pd.DataFrame(rows, columns=COLUMNS)
    return frame.assign(**{name: pd.to_datetime(frame[name], utc=True) for name in ("time", "measured")})
