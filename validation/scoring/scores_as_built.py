"""Scores of the sets of struts as they are built, each against its target.

Pure functions of the truth and the answers. What is missing, an error or not a number counts against the workflow,
never for it.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite, nan, sqrt
from typing import Any

import numpy as np
from scipy import stats

from validation.effects import LIBRARY
from validation.scoring.scores import (
    Json,
    Outcome,
    Outcomes,
    Score,
    covered,
    least,
    middle,
    most,
    of_kind,
    right,
    rms,
    share,
    slowest,
)
from validation.sets import DX_LIMIT_UM, DY_LIMIT_UM, SETS

COVERS = (0.90, 0.987)
RISK = 0.01  # chance of so many wrong acceptances, were the stated probabilities right
U_FACTOR = 2.0
HUM_HZ, PERIOD_SHARE = 0.3, 0.15  # how near a sentence has to come
LIMITS_UM = {"dx_um": DX_LIMIT_UM, "dy_um": DY_LIMIT_UM}
RMS_UM = {"exact": (3.0, 3.0), "scatter-0.5": (5.0, 3.0), "scatter-1": (5.0, 3.0), "batch": (5.0, 3.0)}
# of a set: what nothing is to be called nothing, and one effect by its name, at least
TARGETS: Mapping[str, tuple[float, float]] = {
    "exact": (0.99, 0.95),
    "scatter-0.5": (0.95, 0.90),
    "scatter-1": (0.95, 0.90),
    "scatter-2": (0.90, 0.80),
    "batch": (0.90, 0.90),
}


def scores_of(name: str, outcomes: Outcomes) -> list[Score]:
    """Return the scores of a set."""
    failed = [o.error is not None and not (name == "faults" and o.refused) for o in outcomes]
    rows = [
        share("errors, or refused", failed, "0 %", most(0.0)),
        share("a false name, all cases", [bool(o.false_names) for o in outcomes], "<= 3 %", most(0.03)),
        share("named, and a channel's G grows", [grows(o) for o in outcomes if o.named], "0 %", most(0.0)),
        *_by_kind(name, outcomes),
        *_own(name, outcomes),
        *(misalignment(name, outcomes) if name != "faults" else ()),
    ]
    seconds = [o.seconds for o in outcomes]
    rows.append(middle("seconds of one core, median", seconds, "<= 5 s", most(5.0)))
    rows.append(middle("seconds of one core, worst", seconds, "<= 30 s", most(30.0), max))
    return rows


def _by_kind(name: str, outcomes: Outcomes) -> Iterator[Score]:
    if name not in TARGETS:
        return
    nothing, named = TARGETS[name]
    ones = [(o, next(iter(o.true))) for o in of_kind(outcomes, "one")]
    seen = [(o, e) for o, e in ones if above_limit(o, e)]
    none = [o.verdict == "no_missing_effect" for o in of_kind(outcomes, "none")]
    yield share("nothing missing: said so", none, f">= {nothing:.0%}", least(nothing))
    right_names = [o.named[:1] == [e] for o, e in seen]
    yield share("one effect above its limit: first name right", right_names, f">= {named:.0%}", least(named))
    yield share("one effect: below its stated limit", [not above_limit(o, e) for o, e in ones], "", least(0.0))
    yield share("one effect: in the class", [bool(o.sizes(e)) for o, e in ones], "", least(0.0))
    yield share("outside: called unnamed", [o.unnamed for o in of_kind(outcomes, "outside")], ">= 90 %", least(0.90))
    exact = [set(o.named) == o.true for o in of_kind(outcomes, "two")]
    yield share("two effects: exact set", exact, ">= 75 %" if name == "exact" else "", least(0.75))
    hits = [h for _, said, true in right(outcomes) for h in covered(said, true)]
    yield share("95 % intervals of what is named cover", hits, "90 .. 98.7 %", lambda v: COVERS[0] <= v <= COVERS[1])


def _own(name: str, outcomes: Outcomes) -> Iterator[Score]:
    """Yield the scores that only one set has."""
    if name == "rough":
        one = [o.named[:1] == [next(iter(o.true))] for o in of_kind(outcomes, "one")]
        yield share("one effect: first name right", one, ">= 90 %", least(0.90))
        yield share("nothing missing: a name", [bool(o.named) for o in of_kind(outcomes, "none")], "0 %", most(0.0))
        yield share("hum said by its frequency", [says_hum(o) for o in outcomes], ">= 90 %", least(0.90))
        yield share("interpolation said by its period", [says_period(o) for o in outcomes], ">= 90 %", least(0.90))
    if name == "three":
        yield share("three effects: exact set", [set(o.named) == o.true for o in outcomes], ">= 60 %", least(0.60))
    if name == "faults":
        yield share("fault: named or refused, no other name", [faulty_right(o) for o in outcomes], "100 %", least(1.0))
    if name == "limit":
        yield wrong_acceptances(outcomes)


def above_limit(o: Outcome, effect: str) -> bool:
    """Return whether the effect is at least as large as the detection limit of the unit's own answer; without a limit
    it has to be seen."""
    if o.verdict != "no_missing_effect":
        return True
    limits = o.gap.get("detection_limits", {}).get(effect, {})
    true, hidden = o.truth["effects"][effect], LIBRARY[effect]
    sizes = [p for p in true if p in limits and p in (*hidden.grows, *hidden.fades)] or [p for p in true if p in limits]
    if not sizes:
        return True
    return any(
        true[p] <= limits[p] if p in hidden.fades else abs(true[p] - hidden.off) >= abs(limits[p] - hidden.off)
        for p in sizes
    )


def grows(o: Outcome) -> bool:
    """Return whether a channel is worse with what was named than without."""
    before, after = ((o.gap.get(k) or {}).get("channels") or {} for k in ("gap_before", "gap_after"))
    return not after or any(float(after[c]) > float(before.get(c, nan)) * (1 + 1e-9) for c in after)


def says_hum(o: Outcome) -> bool:
    hum = o.truth["bench"]["mains_lines"][0][0]
    return any(abs(f - hum) <= HUM_HZ for f in _numbers(o.gap, r"Hz"))


def says_period(o: Outcome) -> bool:
    period = 1e6 * o.truth["bench"]["period_m"]
    return any(abs(p / period - 1) <= PERIOD_SHARE for p in _numbers(o.gap, r"(?:um|µm)"))


def _numbers(gap: Json, unit: str) -> list[float]:
    """Return every number with that unit in the notes and words of a result."""
    words = " ".join(str(w) for w in (*gap.get("notes", ()), *(u.get("words", "") for u in gap.get("unnamed", ()))))
    return [float(x) for x in re.findall(rf"(\d+(?:\.\d+)?)\s*{unit}\b", words)]


def faulty_right(o: Outcome) -> bool:
    """Return whether a fault was named correctly or the unit was refused, without any other name."""
    return o.refused or (o.error is None and not o.false_names)


def misalignment(name: str, outcomes: Outcomes) -> Iterator[Score]:
    """Yield the scores of `accept misalign` on every unit that hides nothing else."""
    asked = [o for o in outcomes if o.misalign is not None]
    if not asked:
        return
    answered = [o for o in asked if answered_um(o, "dx_um") is not None]
    yield share("misalignment: answered", [o in answered for o in asked], ">= 90 %", least(0.90))
    for axis, limit in zip(("dx_um", "dy_um"), RMS_UM.get(name, (nan, nan)), strict=True):
        off = [(error_um(o, axis), float(o.misalign[axis]["U"])) for o in answered if o.misalign]
        inside = [abs(d) <= U for d, U in off]
        yield share(f"misalignment {axis}: within U", inside, "90 .. 98.7 %", lambda v: COVERS[0] <= v <= COVERS[1])
        yield rms_row(f"misalignment {axis}: RMS error", [d for d, _ in off], limit)
        yield middle(f"misalignment {axis}: median U", [U for _, U in off], "", least(0.0))


def rms_row(name: str, off: Sequence[float], limit: float) -> Score:
    """Return the root mean square with its 95 % interval, of errors that are normal; a limit that is not a number sets
    no target."""
    n = len(off)
    value = rms(off) if n else nan
    lo, hi = (value * sqrt(n / x) for x in stats.chi2.ppf([0.975, 0.025], n)) if n else (nan, nan)
    if not isfinite(limit):
        return Score(name, value, n, lo, hi, "", True)
    return Score(name, value, n, lo, hi, f"<= {limit:g} um", n > 0 and value <= limit)


def answered_um(o: Outcome, axis: str) -> float | None:
    """Return the offset that `accept misalign` states, or none."""
    value = ((o.misalign or {}).get(axis) or {}).get("value")
    return None if value is None else float(value)


def error_um(o: Outcome, axis: str) -> float:
    """Return what the stated offset is off by, or not a number."""
    value = answered_um(o, axis)
    return nan if value is None else value - true_um(o, axis)


def true_um(o: Outcome, axis: str) -> float:
    return float(o.truth["effects"].get("misalignment", {}).get(axis, 0.0))


def acceptances(outcomes: Outcomes) -> list[tuple[float, bool]]:
    """Return for every unit that a guarded limit of dx and dy accepts the stated probability that it is outside
    nevertheless, and whether it is."""
    out = []
    for o in outcomes:
        said: Any = o.misalign or {}
        if any(answered_um(o, axis) is None for axis in LIMITS_UM):
            continue
        accepted = all(abs(said[a]["value"]) + said[a]["U"] <= limit for a, limit in LIMITS_UM.items())
        if accepted:
            chances = [inside(said[a]["value"], said[a]["U"], limit) for a, limit in LIMITS_UM.items()]
            out.append((1 - chances[0] * chances[1], any(abs(true_um(o, a)) > limit for a, limit in LIMITS_UM.items())))
    return out


def inside(value: float, U: float, limit: float) -> float:
    """Return the probability that what is measured as a value with U lies inside a limit on either side of zero."""
    sd = max(U / U_FACTOR, 1e-12)
    return float(stats.norm.cdf((limit - value) / sd) - stats.norm.cdf((-limit - value) / sd))


def wrong_acceptances(outcomes: Outcomes) -> Score:
    """Return the number of accepted units that are outside, compared with the stated probabilities."""
    accepted = acceptances(outcomes)
    stated = np.array([p for p, _ in accepted])
    n = len(accepted)
    if not n:
        return Score("accepted, and outside", 0.0, 0, 0.0, 1.0, "no more than stated", False)
    allowed = int(stats.poisson.ppf(1 - RISK, stated.sum()))  # above the sum of unequal chances' own quantile
    return share("accepted, and outside", [w for _, w in accepted], f"<= {allowed} of {n}", lambda v: v * n <= allowed)


def time_of_all(outcomes: Outcomes) -> list[Score]:
    """Return the scores of time over all sets."""
    seconds = [o.seconds for o in outcomes]
    return [
        middle("seconds of one core, median", seconds, "<= 5 s", most(5.0)),
        middle("seconds of one core, 95 % of the units", seconds, "", most(30.0), slowest),
        middle("seconds of one core, worst", seconds, "<= 30 s", most(30.0), max),
    ]


if unknown := set(TARGETS) - set(SETS):
    raise KeyError(f"targets for sets that are never drawn: {sorted(unknown)}")
