"""The quarter of `thirteen_weeks` as judgements of a store."""

import datetime
from collections import defaultdict

from accept.fleet.golden import name_golden
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
    # The stiffness of the quarter is that of another strut than the limits of `judgements` are for.
    renamed["k_closed_N_per_um"] += 1.4
    return judgement(serial, renamed, bench, lot, day)
