"""Usual values: what the last units of a kind showed, so that a drift of the bench is seen at the bench."""

from collections import defaultdict
from statistics import median

from accept.judging.superseded import measured_values
from accept.store import Store
from accept.store.payloads import UnitJudged

UNITS = 20  # of which the median is usual
FEWEST = 5  # values; fewer say nothing
_LOOKED_AT = 60  # judgements: some are of the same unit, or of another kind


def usual_values(store: Store, kind: str, but: str = "") -> dict[str, float]:
    """Return the median of each quantity over the last judgements of units of a kind, each unit once. but: serial of
    the unit that is compared with them. Raises StoreError."""
    values, serials = defaultdict[str, list[float]](list), {but}
    for event in store.newest(UnitJudged.KIND, _LOOKED_AT):
        if event.subject in serials or len(serials) > UNITS:
            continue
        result = UnitJudged.of(event).result
        if result.kind == kind:
            serials.add(event.subject)
            for quantity, value in measured_values(result).items():
                values[quantity].append(value)
    return {quantity: median(found) for quantity, found in values.items() if len(found) >= FEWEST}
