"""The gates before a name ([GAP] 10): conditions that an effect of the best explanation has to meet.

Each gate is named and has a test of the evidence and a reason, the sentence if the test fails. One table judges every
effect of an explanation; some gates ask what only an explanation of everything can show, or only one that stands beside
its disagreement. Because the nearest member of a library is not the cause, four of these look at where an effect acts:
it explains most of the cells, makes none worse, what it changes most is explained, and the gap of one channel as a
whole becomes much smaller. An effect that fails any gate is not named; its reasons stand in gap.json.
"""

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, replace

from checks.fitting.fit import Fit
from checks.gap.decision.evidence import NameEvidence, chance_of_gain
from checks.gap.decision.result import Ambiguous
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import sharpest
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.search.candidates import Effort, Search
from checks.gap.search.disagreement import add_elements, add_one
from checks.gap.search.explanation import Explanation
from checks.gap.search.forward import ExplainingStep, SearchResult

LEFT = 1.0 / 3.0  # of the logarithms of Q over the cells where an effect acts: with more left, it is not the cause
LEFT_OF_CHANNEL = 0.2  # of a channel's G: an effect that leaves more of every channel is no cause of its gap
NOT_NEEDED = "is not needed: every channel agrees without it"
FAR_ABOVE = 10.0  # of Q in the cell that an effect changes most


@dataclass(frozen=True)
class Claim:
    """An effect that a search wants to name. delta_lnL, p: the gain in log-likelihood and its chance without the
    effect; reasons: of the gates that it did not pass."""

    effect: Effect
    delta_lnL: float
    p: float
    reasons: tuple[str, ...]


def accepted(claims: Sequence[Claim]) -> tuple[Claim, ...]:
    """Return the claims that passed every gate."""
    return tuple(c for c in claims if not c.reasons)


@dataclass(frozen=True)
class Gate:
    """A condition of a name. reason: what is wrong if the test fails, with attributes of the evidence `e` in braces;
    after: a gate that must pass before this one is tested, because it covers the same fault more severely; beside:
    whether it judges explanations beside a disagreement or those of everything, None: both."""

    name: str
    reason: str
    test: Callable[[NameEvidence], bool]
    _: KW_ONLY
    after: str = ""
    beside: bool | None = None


GATES: tuple[Gate, ...] = (
    Gate("gain", "explains too little of unseen records (gain {e.gain:.0f})", lambda e: e.gain > e.required_gain),
    Gate(
        "confirmed",
        "is not confirmed with the records exchanged (gain {e.exchanged_gain:.0f})",
        lambda e: e.exchanged_gain > e.required_gain,
        after="gain",
    ),
    Gate("needed", NOT_NEEDED, lambda e: not e.needless, beside=False),
    Gate(
        "share_left",
        "leaves {e.percent_left:.0f} % of the gap where it acts",
        lambda e: not e.cells.share > LEFT,
        beside=True,
    ),
    Gate(
        "no_cell_worse",
        "makes the gap wider in a band where it acts",
        lambda e: not e.cells.worse,
        after="share_left",
        beside=True,
    ),
    Gate(
        "worst_cell",
        "leaves G {e.cells.worst:.0f} in the band where it acts most",
        lambda e: not e.cells.worst > FAR_ABOVE,
        after="no_cell_worse",
        beside=True,
    ),
    Gate(
        "channel_left",
        "leaves more than a fifth of the gap of every channel",
        lambda e: e.left_of_channel < LEFT_OF_CHANNEL,
        beside=True,
    ),
    Gate(
        "mechanics",
        "stands beside other channels that the mechanics do not explain (G {e.unexplained_beside:.0f})",
        lambda e: not e.unexplained_beside > FAR_ABOVE,
        beside=True,
    ),
    Gate("significant", "parameters not significant", lambda e: e.significant),
    Gate("within_limits", "{e.at_limit[0]} is at its physical limit", lambda e: not e.at_limit),
    Gate("causal", "comes before its drive, as no lag does", lambda e: not e.is_early),
    Gate(
        "share",
        "explains {e.percent:.1f} % of the gap beside an unidentified effect",
        lambda e: e.complete or not e.gain < e.table.share * e.gap,
        beside=False,
    ),
    Gate(
        "own_evidence",
        "explains the data only together with an unidentified effect",
        lambda e: not e.needs_unmodelled_mode,
        beside=False,
    ),
    Gate(
        "own_pole",
        "has the pole of an unidentified mode, with which it is one",
        lambda e: not e.shares_pole,
        beside=False,
    ),
    # Acting on one channel only, an effect of every channel is not distinguished from any filter there.
    Gate(
        "on_its_channels",
        "acts on {e.acting_on[0]} alone, and would show on {e.channels}",
        lambda e: not e.is_any_filter,
    ),
    Gate(
        "off_modes",
        "lies on a mode of the strut, which looks the same when its coupling is not that of the model",
        lambda e: not e.on_a_mode,
    ),
    Gate(
        "gap_left",
        "leaves too much unexplained, beside which its evidence does not stand",
        lambda e: not e.full.worst_G > e.table.G,
        beside=False,
    ),
    Gate(
        "residual_left",
        "leaves a residual where it acts",
        lambda e: not e.leaves_residual,
        after="gap_left",
        beside=False,
    ),
    Gate(
        "priors",
        "needs calibrated values that the model's file does not allow",
        lambda e: not e.far_from_priors,
        beside=True,
    ),
    Gate("slow_sines", "{e.contradiction}", lambda e: not e.contradiction),
    Gate(
        "measured",
        "must show on {e.missing_channels}, which was not measured",
        lambda e: not e.missing_channels,
        beside=False,
    ),
)


def gates_of(evidence: NameEvidence) -> list[Gate]:
    """Return the gates that judge the explanation of an evidence."""
    return [gate for gate in GATES if gate.beside in (None, evidence.best.beside)]


def failed_reasons(evidence: NameEvidence) -> tuple[str, ...]:
    """Return the reasons of the gates that fail, in order."""
    failed: set[str] = set()
    reasons = []
    for gate in gates_of(evidence):
        if gate.after in failed:
            failed.add(gate.name)
        elif not gate.test(evidence):
            failed.add(gate.name)
            reasons.append(gate.reason.format(e=evidence))
    return tuple(reasons)


def judge_claims(
    search: Search, result: SearchResult, final: Fit, full: Explanation, slow: Slow | None
) -> tuple[tuple[Claim, ...], tuple[Ambiguous, ...]]:
    """Judge every effect of the best explanation by the gates, and return the claims and, beside a disagreement, the
    rivals of those that pass. A claim is valid only with its whole explanation: of an explanation of everything, one
    that depends on another effect of the same channels that has to be refused is refused too."""
    claims: list[Claim] = []
    rivals: list[Ambiguous] = []
    beside = result.best.beside
    if beside:
        search = replace(search, effort=Effort())  # a few fits, whatever the search has spent
    steps = {step.member.name: step for step in result.steps}
    for effect in result.best.response.effects:
        evidence = NameEvidence(effect, search, result, result.best if beside else full, final, slow)
        reasons = failed_reasons(evidence)
        if beside and not reasons:
            alike, reasons = _compare_rivals(evidence, steps[effect.name])
            if alike:
                experiment = sharpest(e.experiment for e in (effect, *alike))
                names = sorted({effect.name, *(e.name for e in alike)})
                rivals.append(Ambiguous(tuple(names), experiment.value))
        claims.append(Claim(effect, evidence.gain, chance_of_gain(evidence.gain, effect), reasons))
    if not beside:
        claims = [_refused_with_others(c, claims, search.table) for c in claims]
    return tuple(claims), tuple(rivals)


def _compare_rivals(evidence: NameEvidence, step: ExplainingStep) -> tuple[list[Effect], tuple[str, ...]]:
    """Return the effects that do as well in the place of one, and why a member that does better takes its name."""
    best = evidence.best
    near = [r.added for r in step.near(best.names)]
    tried = add_one(evidence.search, evidence.without, near) if near else []
    if evidence.effect.rivals_elements:
        tried += add_elements(evidence.search, evidence.without)
    near = [c.added for c in tried if c.score > best.score - 0.5 * best.table.two_delta_lnL]
    better = [c.added for c in tried if c.score > best.score]
    alike = [member for member in near if not member.stands_in]
    return alike, tuple(f"explains less than {member.label}" for member in better if member.stands_in)


def _refused_with_others(claim: Claim, every: Sequence[Claim], table: Thresholds) -> Claim:
    for other in every:
        shared = set(other.effect.channels) & set(claim.effect.channels)
        refused = other.reasons not in ((), (NOT_NEEDED,))
        if not claim.reasons and refused and other.delta_lnL > table.delta_lnL and shared:
            return replace(claim, reasons=(f"stands beside {other.effect.name}, which could not be named",))
    return claim
