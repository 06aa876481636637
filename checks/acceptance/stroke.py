"""Stroke of the three stacks from -20 V to 150 V: one stack, the two others, and their sum ([STB] 2.3)."""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from checks.acceptance.common import stroke_ends as ends
from checks.acceptance.common.piezo_lag import vet_bend, vet_lag
from checks.acceptance.common.typed_value import of_record, stated_contribution, typed_quantity, with_stated_accuracy
from checks.arrays import Array
from checks.cause import Cause, NoResult, Reason, because, together
from checks.declare import Check, Form, Guide, Scalar, Series, Setting, Values
from checks.picture import Item, Line, Mark, Panel, PanelKind
from checks.quantity import Contribution, Outcome, Quantity
from checks.record import Record
from checks.signals.slow import loops
from checks.signals.slow.loops import Branch, ScalarEstimate
from specs.bench import STACK_V
from specs.spec import CheckSpec

UM = 1e-6
RECORDS = {"one_stack": "stroke_one_stack_um", "two_stacks": "stroke_two_stacks_um"}
WIDTHS = {"one_stack": "stroke_hysteresis_one_stack_percent", "two_stacks": "stroke_hysteresis_two_stacks_percent"}
START_V, TOP_V = STACK_V
TOLERANCE_V = 1.0  # of 170 V: 0.6 % of the range
END_ZONE = 0.02  # of the voltage span: over it a branch is a parabola
MIN_OVER_NOISE = 20.0  # a stroke so near the noise means a dead stack or gauge
MAX_UM = 2000.0  # six times the nominal stroke: no actuator, but a wrong unit
SHARE = {"one_stack": 1 / 3, "two_stacks": 2 / 3}  # of the three stacks, which are equal
ALIKE_WITHIN = 0.25  # stacks of one batch differ by a few percent; a damaged one by more
LOOP_PERCENT = 1.0  # loss of soft PZT at small signals ([DAMJANOVIC98]): a narrower loop is the drive
STUCK = 0.05  # of the voltage span: whatever the loop, no actuator stands still over so much of it
FIRST_RISE = "only one cycle: the loop contains the first rise and is wider than a settled one"


@dataclass(frozen=True)
class Range:
    """Voltages on the stacks [V] that the record must run through."""

    start: float
    top: float
    tolerance: float
    stroke_max: float = MAX_UM * UM  # of three stacks [m]
    loop_min_percent: float = LOOP_PERCENT

    @property
    def span(self) -> float:
        return self.top - self.start

    @property
    def middle(self) -> float:
        return (self.start + self.top) / 2


@dataclass(frozen=True, eq=False)
class Stroke:
    """Stroke in one record: stroke [m], the voltage missing from the range as a displacement [m], how far the gauge may
    have drifted [m], loop width at mid-voltage [m] or the reason why it is missing; drift_in_loop: of the gauge between
    its branches [m]; settled: whether that loop excludes the first rise; V, d : (N,) the record, d from its start."""

    stroke: ScalarEstimate
    short: float
    drift: float
    width: ScalarEstimate | Reason
    drift_in_loop: float
    settled: bool
    V: Array
    d: Array


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """Return the stroke [um] of one stack, of two and of all three; loop width at mid-voltage [percent of the stroke].

    Each stroke is max(d) minus d at the start, where the voltage is -20 V; both ends by a local fit, because the
    highest of many noisy samples is too high. The gauge is one and the same, so its stated errors add linearly."""
    if "stroke_um" in values:
        return _from_value(values, spec)
    parts = {key: partial(_plausible_stroke, wanted=_range(spec), share=share) for key, share in SHARE.items()}
    found = {key: of_record(values, key, stroke) for key, stroke in parts.items()}
    strokes = [_stroke_quantity(RECORDS[key], found[key], spec) for key in RECORDS]
    widths = [_width_quantity(WIDTHS[key], [found[key]]) for key in RECORDS]
    both = _width_quantity("stroke_hysteresis_percent", list(found.values()))
    good = {key: f for key, f in found.items() if isinstance(f, Stroke)}
    total = _check_stacks(_sum(strokes), strokes, float(spec.settings.get("alike_within", ALIKE_WITHIN)))
    return Outcome((total, *strokes, both, *widths), panels=_panels(good, _range(spec)) if good else {})


def _from_value(values: Values, spec: CheckSpec) -> Outcome:
    others = [name for name in CHECK.quantities if name != "stroke_um"]
    missing = (Quantity.missing(name, Cause.RECORD_NEEDED) for name in others)
    typed, most = typed_quantity(values, spec, "stroke_um"), _range(spec).stroke_max / UM
    if typed.value > most:
        entry = because(Cause.ENTRY_IMPLAUSIBLE, entry=typed.name, value=typed.value, unit=typed.unit, most=most)
        typed = Quantity.missing(typed.name, entry)
    return Outcome((typed, *missing))


def _range(spec: CheckSpec) -> Range:
    get = spec.settings.get
    most = get("stroke_max_um", MAX_UM) * UM
    ends_V = get("start_V", START_V), get("top_V", TOP_V), get("voltage_tolerance_V", TOLERANCE_V)
    return Range(*ends_V, most, get("loop_min_percent", LOOP_PERCENT))


def _plausible_stroke(record: Record, wanted: Range, share: float) -> Stroke:
    """Return the stroke of a share of the stacks. Raises as `stroke_of`, and NoResult for more than stacks make."""
    found = stroke_of(record, wanted)
    stroke = found.stroke.value
    if stroke > share * wanted.stroke_max:
        total, most = stroke / share / UM, wanted.stroke_max / UM
        raise NoResult(Cause.STROKE_IMPLAUSIBLE, channel="d", value=stroke / UM, total=total, most=most)
    return found


def stroke_of(record: Record, wanted: Range) -> Stroke:
    """Return the stroke of a record with channels V [V] and d [m]. Raises NoResult if the voltage does not run from the
    wanted start to the wanted top or the displacement does not follow it."""
    V, d = record["V"], record["d"]
    short = _check_range(V, wanted)
    _check_moving(V, d, wanted)
    smooth = max(1, V.size // 1000)  # samples averaged, only to find where the ends are
    V_smooth, d_smooth = ends.running_mean(V, smooth), ends.running_mean(d, smooth)
    top = int(np.argmax(d_smooth))
    if V_smooth[top] < wanted.top - 0.05 * wanted.span:
        raise NoResult(Cause.STROKE_AWAY, channel="d", value=V_smooth[top], expected=wanted.top)
    reach = END_ZONE * wanted.span
    start = ends.level(V - V[0], d, 0, np.abs(V_smooth - V_smooth[0]) <= reach, reach)
    tip = ends.highest(V, d, V_smooth >= V_smooth[top] - reach, reach)
    stroke = ScalarEstimate(tip.value - start.value, math.hypot(tip.u, start.u))
    noise = float(np.std(np.diff(d)))
    if stroke.value <= MIN_OVER_NOISE * noise:
        raise NoResult(Cause.STROKE_IN_NOISE, channel="d", value=stroke.value / UM, noise=noise / UM)
    found = loops.branches(V, wanted.middle, wanted.span / 2)
    width, settled = _width(V, d, found, wanted), len(found) > 2
    if isinstance(width, ScalarEstimate):
        vet_lag("d", "V", width, stroke.value, wanted.loop_min_percent)
    else:
        vet_bend("d", V, d, stroke.value, wanted.loop_min_percent)
    opening = abs(width.value) if isinstance(width, ScalarEstimate) else 0.0
    bottom = np.abs(V_smooth - V_smooth[0]) <= reach
    drift = ends.drift(V, d, bottom, start, stroke, reach, opening, settled)
    pair = loops.last_pair(found)
    apart = (pair[1].stop - pair[0].start) / 2 if pair and settled else 0.0  # samples between the middles of branches
    within = apart * ends.drift_rate(V, d, bottom, reach)
    return Stroke(
        stroke=stroke,
        short=short * stroke.value / wanted.span,
        drift=drift,
        width=width,
        drift_in_loop=within,
        settled=settled,
        V=V,
        d=d - start.value,
    )


def _check_range(V: Array, wanted: Range) -> float:
    """Return how far the ends of V are from the wanted ones, in sum [V]. Raises NoResult beyond the tolerance."""
    first, highest = float(V[0]), float(V.max())
    if not abs(first - wanted.start) <= wanted.tolerance:
        raise NoResult(Cause.VOLTAGE_START, value=first, expected=wanted.start, within=wanted.tolerance)
    if not abs(highest - wanted.top) <= wanted.tolerance:
        raise NoResult(Cause.VOLTAGE_TOP, value=highest, expected=wanted.top, within=wanted.tolerance)
    return abs(first - wanted.start) + abs(highest - wanted.top)


def _check_moving(V: Array, d: Array, wanted: Range) -> None:
    """Raise NoResult if d repeats one value while V moves: the probe sticks, or the reading was held."""
    at, passed = loops.longest_stand(V, d)
    if passed > STUCK * wanted.span:
        raise NoResult(Cause.CHANNEL_STUCK, channel="d", reference="V", sample=at, span=passed)


def _width(V: Array, d: Array, found: list[Branch], wanted: Range) -> ScalarEstimate | Reason:
    pair = loops.last_pair(found)
    if pair is None:
        return because(Cause.NO_LOOP, middle=wanted.middle)
    try:
        return loops.opening(V, d, pair, wanted.middle, wanted.span / 2)
    except ValueError as e:
        return because(Cause.CANNOT_ESTIMATE, detail=str(e))


def _stroke_quantity(name: str, found: Stroke | Reason, spec: CheckSpec) -> Quantity:
    if isinstance(found, Reason):
        return Quantity.missing(name, found)
    value = found.stroke.value / UM
    scatter = [Contribution("scatter of the record", found.stroke.u / UM, "A")]
    if found.short > 0:
        scatter.append(Contribution("voltage off its range", found.short / UM))
    if found.drift > 0:
        scatter.append(Contribution("drift of the gauge", found.drift / UM / math.sqrt(3)))
    return with_stated_accuracy(name, value, scatter, stated_contribution(spec, value, "d_um", "stroke_um"))


def _sum(parts: list[Quantity]) -> Quantity:
    """Return the stroke of three stacks. Scatter adds in square, contributions of one stated source linearly."""
    reasons = [q.reason for q in parts if q.reason]
    if reasons:
        return Quantity.missing("stroke_um", together(reasons))
    value = sum(q.value for q in parts)
    own: dict[str, list[Contribution]] = {}
    for c in (c for q in parts for c in q.budget):
        own.setdefault(c.source, []).append(c)
    sums = {s: math.hypot(*(c.u for c in cs)) if cs[0].kind == "A" else sum(c.u for c in cs) for s, cs in own.items()}
    budget = tuple(Contribution(source, u, own[source][0].kind) for source, u in sums.items())
    if any(q.U is None for q in parts):
        return Quantity("stroke_um", value, None, budget, note=parts[0].note)
    return Quantity.of("stroke_um", value, *budget)


def _check_stacks(total: Quantity, parts: list[Quantity], within: float) -> Quantity:
    """Return the sum. Its uncertainty is unknown, so that it cannot pass, if one of the three equal stacks does not
    move half as far as two: one is weak or another was driven. A sum outside the limits still fails."""
    one, two = (q.value for q in parts)
    if total.reason is not None or abs(two / 2 / one - 1) <= within:
        return total
    return total.doubted(Cause.STACKS_DIFFER, one=one, other_um=two / 2)


def _width_quantity(name: str, found: list[Stroke | Reason]) -> Quantity:
    """Return the loop width at mid-voltage [percent of the stroke] of one record, or of both added: the loop of three
    stacks. The gauge's scale error cancels in the ratio, its drift between the branches does not. By Rayleigh's law the
    width grows with the voltage, so a smaller range gives a smaller width."""
    stroke = width = variance = short = drift = 0.0
    for f in found:
        if isinstance(f, Reason):
            return Quantity.missing(name, f)
        if isinstance(f.width, Reason):
            return Quantity.missing(name, f.width)
        stroke += f.stroke.value
        width += f.width.value
        variance += f.width.u**2 + (f.width.value / f.stroke.value * f.stroke.u) ** 2
        short += abs(f.width.value) * f.short / f.stroke.value
        drift += f.drift_in_loop
    shares = {"voltage off its range": short, "drift of the gauge between the branches": drift}
    budget = [Contribution("scatter of the records", 100 * math.sqrt(variance) / stroke, "A")]
    budget += [Contribution(words, 100 * u / stroke) for words, u in shares.items() if u > 0]
    note = None if all(f.settled for f in found if isinstance(f, Stroke)) else FIRST_RISE
    return Quantity.of(name, 100 * width / stroke, *budget, note=note)


def _panels(found: dict[str, Stroke], wanted: Range) -> dict[str, Panel]:
    lines: list[Item] = [Line(loops.thin(f.V), loops.thin(f.d) / UM, key.replace("_", " ")) for key, f in found.items()]
    marks = [Mark(wanted.start, label=f"{wanted.start:g} V"), Mark(wanted.top, label=f"{wanted.top:g} V")]
    title = "Displacement against voltage"
    return {
        "loops": Panel(title, "voltage on the stacks [V]", "displacement [um]", (*lines, *marks), kind=PanelKind.CURVE)
    }


_CHANNELS = {"t": "s", "V": "V", "d": "m"}
PICTURE = """\
      ▼ gauge
   ┌──┴──┐    record 1   record 2
   │ top │    1 ─ amp    1 ─ short
 ┌─┴─────┴─┐  2 ─ short  2 ┐ amp
 │ 1  2  3 │  3 ─ short  3 ┘
 └─┬─────┬─┘
   └─────┘      -20 V ... 150 V"""

CHECK = Check(
    name="stroke",
    title="Stroke of the three stacks",
    short="Stroke",
    kinds=("apa",),
    forms=(
        Form("values", (Scalar("stroke_um", "stroke of the three stacks", lo=1.0, hi=2000.0),)),
        Form(
            "records",
            (
                Series("one_stack", "voltage on one stack", _CHANNELS, called="one stack"),
                Series("two_stacks", "voltage on the two other stacks", _CHANNELS, called="the two other stacks"),
            ),
        ),
    ),
    quantities={
        "stroke_um": "Stroke, three stacks",
        "stroke_one_stack_um": "Stroke, one stack",
        "stroke_two_stacks_um": "Stroke, two stacks",
        "stroke_hysteresis_percent": "Stroke hysteresis",
        "stroke_hysteresis_one_stack_percent": "Stroke hysteresis, one stack",
        "stroke_hysteresis_two_stacks_percent": "Stroke hysteresis, two stacks",
    },
    measure=measure,
    settings=(
        Setting("start_V", START_V, "voltage on the stacks where a record must start"),
        Setting("top_V", TOP_V, "voltage on the stacks that a record must reach"),
        Setting("voltage_tolerance_V", TOLERANCE_V, "tolerance of both voltages"),
        Setting("loop_min_percent", LOOP_PERCENT, "least loop at mid-voltage of a piezo stack, percent of its stroke"),
        Setting("alike_within", ALIKE_WITHIN, "part by which the stroke of one stack may differ from half that of two"),
        Setting("stroke_max_um", MAX_UM, "stroke of three stacks above which the data, not the unit, must be wrong"),
    ),
    stated=("stroke_um", "d_um"),
    failed="check that all three stacks are connected; if it stays, a stack does not move",
    guide=Guide(
        "Set the gauge on the top. Drive one stack from -20 V to 150 V and back, then the other two stacks. "
        "Load both records, or enter the stroke of all three stacks.",
        PICTURE,
        drive="start a slow sine at the DAC, -1 V to 7.5 V: -20 V to 150 V on the stacks",
        lit={"one_stack": ("record 1", "1 ─ amp"), "two_stacks": ("record 2", "2 ┐ amp", "3 ┘")},
    ),
)
