"""Scores of a blind test: pure functions of the truth and the answers. The targets are those of the gap method.

An outcome that is missing, an error or not a number counts against the workflow, never for it.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

Json = Mapping[str, Any]

WILSON = 0.95
IDENTIFIABLE = 5.0  # standard deviations beyond what calibration could do; less is a matter of power
G_MOST = 1.1
REFUSALS = ("GapRefused", "RecordError", "UnitError", "ModelError", "NoResult")
OPEN = ("unexplained", "ambiguous", "partly_explained")
SHUFFLES = 400


@dataclass(frozen=True)
class Outcome:
    """One unit. truth: of the sealed file; gap: gap.json, or empty with the reason in `error`; without: effects that
    were taken out of the library; seconds of processor: of wall too on a free core, as it is one process; wall: as it
    was, beside the other worker and whatever else ran. misalign: the document of `accept misalign`, if it was run;
    memory_MB: the most that the analysis took, misalign_...: the same two of `accept misalign`."""

    serial: str
    truth: Json
    gap: Json = field(default_factory=dict)
    seconds: float = nan
    error: str | None = None
    without: tuple[str, ...] = ()
    wall: float = nan
    misalign: Json | None = None
    memory_MB: float | None = None
    misalign_seconds: float | None = None
    misalign_memory_MB: float | None = None

    @property
    def refused(self) -> bool:
        """Return whether the workflow refused these records, as opposed to a crash."""
        return self.error is not None and self.error.partition(":")[0] in REFUSALS

    @property
    def kind(self) -> str:
        return str(self.truth["kind"])

    @property
    def true(self) -> set[str]:
        return set(self.truth["effects"])

    @property
    def verdict(self) -> str:
        return "error" if self.error else str(self.gap.get("verdict", "error"))

    @property
    def named(self) -> list[str]:
        return [each["effect"] for each in self.gap.get("named", ())]

    @property
    def false_names(self) -> list[str]:
        return [n for n in self.named if n not in self.true and n not in self.truth.get("alike", ())]

    @property
    def unnamed(self) -> bool:
        """Return whether something is missing and has no name."""
        return not self.named and self.verdict in OPEN

    @property
    def label(self) -> str:
        """Return the first answer, in one word."""
        if self.verdict == "error":
            return "error"
        if self.named:
            return self.named[0]
        words = {"no_missing_effect": "nothing", "ambiguous": "ambiguous"}
        return words.get(self.verdict, "unnamed")

    @property
    def identifiable(self) -> bool:
        """Return whether the effect is large enough to be identified. One that is not linear has no detectability; it
        was drawn large enough to be seen."""
        seen = float(self.truth.get("detectability") or nan)
        return not isfinite(seen) or seen >= IDENTIFIABLE

    def sizes(self, effect: str) -> list[int]:
        """Return the size of each reported class that holds the effect; a name is a class of one."""
        alone = [1] if effect in self.named else []
        return alone + [len(c["effects"]) for c in self.gap.get("ambiguous", ()) if effect in c["effects"]]


@dataclass(frozen=True)
class Lesson:
    """What came of learning on one bench: the model's file, or the reason why there is none; the number of units it was
    given, seconds of processor, and the most memory."""

    batch: str
    model: Path
    units: int
    seconds: float
    memory_MB: float
    error: str | None


@dataclass(frozen=True)
class Score:
    """value: not a number if nothing was measured, and then not met. n: number of cases behind it; lo, hi: interval."""

    name: str
    value: float
    n: int
    lo: float
    hi: float
    target: str
    met: bool


Outcomes = Sequence[Outcome]
Judge = Callable[[float], bool]


def wilson(hits: int, n: int, level: float = WILSON) -> tuple[float, float]:
    """Return the interval of a proportion ([WILSON27]); without counts, 0..1."""
    if n == 0:
        return 0.0, 1.0
    z, p = float(stats.norm.ppf((1 + level) / 2)), hits / n
    middle, half = p + z * z / (2 * n), z * sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return max((middle - half) / (1 + z * z / n), 0.0), min((middle + half) / (1 + z * z / n), 1.0)


def share(name: str, hits: Iterable[bool], target: str, good: Judge) -> Score:
    counted = [bool(h) for h in hits]
    n, k = len(counted), sum(counted)
    value = k / n if n else nan
    return Score(name, value, n, *wilson(k, n), target, n > 0 and good(value))


def middle(name: str, values: Iterable[float], target: str, good: Judge, of: Callable[..., float] = np.median) -> Score:
    """Return a median (or another number `of`) with the smallest and the largest beside it. Anything not finite spoils
    it."""
    counted = [float(v) for v in values]
    whole = bool(counted) and all(isfinite(v) for v in counted)
    value = float(of(counted)) if whole else nan
    lo, hi = (min(counted), max(counted)) if whole else (nan, nan)
    return Score(name, value, len(counted), lo, hi, target, whole and good(value))


def least(limit: float) -> Judge:
    return lambda v: v >= limit


def most(limit: float) -> Judge:
    return lambda v: v <= limit


def of_kind(outcomes: Outcomes, kind: str) -> list[Outcome]:
    return [o for o in outcomes if o.kind == kind]


def single(outcomes: Outcomes) -> list[tuple[Outcome, str]]:
    """Return the units with one identifiable effect, and that effect."""
    return [(o, next(iter(o.true))) for o in of_kind(outcomes, "one") if o.identifiable]


def right(outcomes: Outcomes) -> Iterator[tuple[str, Json, Json]]:
    """Yield every effect that was named correctly: its name, its reported parameters, its true parameters."""
    for o in outcomes:
        for each in o.gap.get("named", ()):
            if each["effect"] in o.true:
                yield each["effect"], each["parameters"], o.truth["effects"][each["effect"]]


def errors(said: Json, true: Json) -> list[float]:
    """Return the relative errors; the two of a misalignment together, since one of them may be near zero."""
    off = {p: said[p]["value"] - v if p in said else nan for p, v in true.items()}
    if set(true) == {"dx_um", "dy_um"}:
        return [float(np.hypot(*off.values()) / np.hypot(*true.values()))]
    return [abs(off[p] / v) for p, v in true.items()]


def covered(said: Json, true: Json) -> list[bool]:
    return [p in said and said[p]["ci95"][0] <= v <= said[p]["ci95"][1] for p, v in true.items()]


def closed(o: Outcome) -> bool:
    """Return whether the gap is closed on unseen records: in every channel, and around every mode if that is
    reported."""
    after = o.gap.get("gap_after") or {}
    around = [float(each["G"]) for each in after.get("modes", ())]
    channels = [float(g) for g in (after.get("channels") or {}).values()]
    return bool(channels) and all(g <= G_MOST for g in channels + around)


def coverage(outcomes: Outcomes) -> Score:
    hits = [h for _, said, true in right(outcomes) for h in covered(said, true)]
    lo, hi = (np.array(stats.binom.interval(0.999, len(hits), 0.95)) / len(hits)) if hits else (nan, nan)
    return share("95 % intervals cover", hits, f"in {lo:.3f}..{hi:.3f}", lambda v: bool(lo <= v <= hi))


def misalignment(outcomes: Outcomes, axis: str) -> Score:
    off = [
        said[axis]["value"] - true[axis] if axis in said else nan
        for effect, said, true in right(outcomes)
        if effect == "misalignment"
    ]
    return middle(f"misalignment {axis}: RMS error", off, "<= 3", most(3.0), rms)


def rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def slowest(values: Sequence[float]) -> float:
    """Return the value that 95 % stay below."""
    return float(np.quantile(values, 0.95))


def scores(outcomes: Outcomes) -> list[Score]:
    """Return the table of the method, row by row. Units with weak effects are excluded."""
    outcomes = [o for o in outcomes if o.kind != "weak"]
    nothing, outside, two = (of_kind(outcomes, kind) for kind in ("none", "outside", "two"))
    one = single(outcomes)
    alarms = [o.verdict != "no_missing_effect" for o in nothing]
    sizes = [min(o.sizes(e), default=99) for o, e in one]
    off = [each for _, said, true in right(outcomes) for each in errors(said, true)]
    explained = [o for o in outcomes if o.verdict == "explained"]
    return [
        share("errors, all cases", [o.verdict == "error" for o in outcomes], "0 %", most(0.0)),
        share("false alarm, nothing missing", alarms, "<= 1 %", most(0.01)),
        share("a false name, all cases", [bool(o.false_names) for o in outcomes], "<= 3 %", most(0.03)),
        share("outside: called unnamed", [o.unnamed for o in outside], ">= 90 %", least(0.90)),
        share("outside: falsely named", [bool(o.false_names) for o in outside], "<= 5 %", most(0.05)),
        share("one effect: first name right", [o.named[:1] == [e] for o, e in one], ">= 95 %", least(0.95)),
        share("one effect: in the class", [bool(o.sizes(e)) for o, e in one], ">= 97 %", least(0.97)),
        middle("one effect: median class", sizes, "1", most(1.0)),
        share("two effects: exact set", [set(o.named) == o.true for o in two], ">= 75 %", least(0.75)),
        coverage(outcomes),
        middle("parameter error, median", off, "<= 5 %", most(0.05)),
        share("G after <= 1.1, of the explained", [closed(o) for o in explained], ">= 90 %", least(0.90)),
        misalignment(outcomes, "dx_um"),
        misalignment(outcomes, "dy_um"),
        middle("seconds, 95 % of the units", [o.seconds for o in outcomes], "<= 15 s", most(15.0), slowest),
    ]


def details(outcomes: Outcomes) -> list[Score]:
    """Return the details behind the table: the gap by channel and about modes, intervals and errors by effect, time."""
    outcomes = [o for o in outcomes if o.kind != "weak"]
    after = [o.gap.get("gap_after") or {} for o in outcomes if o.verdict == "explained"]
    by_channel: dict[str, list[float]] = {}
    for a in after:
        for channel, G in (a.get("channels") or {}).items():
            by_channel.setdefault(channel, []).append(float(G))
    about = [max((float(m["G"]) for m in a["modes"]), default=0.0) for a in after if "modes" in a]
    rows = [_plain(f"G after, {c}: share <= {G_MOST}", [G <= G_MOST for G in G_s]) for c, G_s in by_channel.items()]
    rows += [_number(f"G after, {c}: median", G_s) for c, G_s in by_channel.items()]
    rows += [_plain(f"G within 5 Hz of every mode: share <= {G_MOST}", [G <= G_MOST for G in about])]
    rows += [_number("G within 5 Hz of the worst mode: median", about)]
    for effect in sorted({e for e, _, _ in right(outcomes)}):
        pairs = [(said, true) for e, said, true in right(outcomes) if e == effect and true]
        if pairs:
            rows.append(_plain(f"{effect}: intervals cover", [h for s, t in pairs for h in covered(s, t)]))
            rows.append(_number(f"{effect}: median parameter error", [x for s, t in pairs for x in errors(s, t)]))
    rows.append(_number("seconds of processor per unit, median", [o.seconds for o in outcomes]))
    return [*rows, _number("seconds of wall per unit, median", [o.wall for o in outcomes])]


def _plain(name: str, hits: Iterable[bool]) -> Score:
    return share(name, hits, "", least(0.0))


def _number(name: str, values: Iterable[float]) -> Score:
    return middle(name, values, "", least(-inf))


def controls(outcomes: Outcomes, removed: Outcomes) -> list[Score]:
    """Return the scores of the controls, which must fail because the truth is removed: the effect from the library, the
    labels from the units."""
    true, shuffled, chance = shuffled_labels(outcomes)
    weak = of_kind(outcomes, "weak")
    drop, n = f"chance, {chance:.1%}", len(single(outcomes))
    mixed = Score("labels shuffled: first name right", shuffled, n, chance, true, drop, shuffled < chance + 0.02)
    return [
        share("effect not in the library: unnamed", [o.unnamed for o in removed], ">= 90 %", least(0.90)),
        share("effect not in the library: a false name", [bool(o.false_names) for o in removed], "<= 5 %", most(0.05)),
        mixed,
        share("weak effects: a false name", [bool(o.false_names) for o in weak], "<= 3 %", most(0.03)),
    ]


def shuffled_labels(outcomes: Outcomes, seed: int = 1) -> tuple[float, float, float]:
    """Return the share of right first names with the true labels, with shuffled ones (mean of many), and by chance."""
    pairs = [(o.named[0] if o.named else o.label, e) for o, e in single(outcomes)]
    if not pairs:
        return nan, nan, nan
    said, true = (np.array(column) for column in zip(*pairs, strict=True))
    rng = np.random.default_rng(seed)
    mixed = float(np.mean([np.mean(said == rng.permutation(true)) for _ in range(SHUFFLES)]))
    both, n = (Counter(said), Counter(true)), len(pairs)
    return float(np.mean(said == true)), mixed, sum(both[0][k] * both[1][k] for k in both[1]) / n**2


def confusion(outcomes: Outcomes) -> dict[str, Counter[str]]:
    """Return the number of first answers of each kind by truth (a single effect, one outside the library, nothing)."""
    table: dict[str, Counter[str]] = {}
    for o in outcomes:
        strange = sorted(o.truth.get("outside", ()))
        truth = {"none": ["nothing"], "one": sorted(o.true), "outside": strange, "outsider": strange}.get(o.kind)
        if truth:
            table.setdefault(truth[0], Counter())[o.label] += 1
    return dict(sorted(table.items()))


def power(outcomes: Outcomes, groups: int = 6) -> list[tuple[float, float, Score]]:
    """Return the power on single effects, weak ones too, by detectability in groups of one size: from, to, share in
    which something was seen."""
    single = [*of_kind(outcomes, "weak"), *of_kind(outcomes, "one")]
    seen = [o for o in single if isfinite(float(o.truth["detectability"] or nan))]
    seen.sort(key=lambda o: float(o.truth["detectability"]))
    parts = [[seen[k] for k in row] for row in np.array_split(np.arange(len(seen)), groups) if row.size]
    return [
        (
            float(part[0].truth["detectability"]),
            float(part[-1].truth["detectability"]),
            share("seen", [o.verdict in (*OPEN, "explained") for o in part], "", least(0.0)),
        )
        for part in parts
    ]
