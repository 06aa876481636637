"""The class of a claim: all that explains the records as well, each a whole explanation that can predict responses
under a changed condition ([GAP] 11). Library effects and elements of the mechanics are members alike; other values of
calibrated parameters are one without a fit of its own."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from checks.gap.decision.evidence import SMALL_BESIDE
from checks.gap.decision.gates import Claim
from checks.gap.decision.result import Ambiguous
from checks.gap.effects import EFFECTS
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.element import GenericElement
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.modelling.unmodelled_modes import UnmodelledMode
from checks.gap.search.explanation import Alternative, Explanation

Unnamed = GenericElement | UnmodelledMode  # by place, kind and values in place of a name
OTHER_VALUES = "other values of"


def needed_apart(claim: Claim, others: Iterable[Effect], table: Thresholds) -> float:
    """Return the difference in twice the log-likelihood from which on an explanation with other members is worse than
    one with a claim's effect. Places of elements of one kind are distinguished by a model that is right to its
    tolerance only, and small differences of large gains are beyond that."""
    kinds = {e.of_kind for e in others if isinstance(e, GenericElement)}
    elsewhere = isinstance(claim.effect, GenericElement) and claim.effect.of_kind in kinds
    return max(table.two_delta_lnL, 2.0 * SMALL_BESIDE * claim.delta_lnL if elsewhere else 0.0)


@dataclass(frozen=True, eq=False)
class Alternatives:
    """A claim and its rivals. claim: the best; rivals: all that cannot be distinguished; fitted: other adequate
    explanations, with rivals among them; whole: the explanation with the claim."""

    claim: Claim
    rivals: Sequence[Ambiguous]
    fitted: Sequence[Explanation]
    whole: Explanation

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Return the names of the effects that do as well as the claim."""
        own = self.claim.effect.name
        return tuple(sorted({n for a in self.rivals if own in a.effects for n in a.effects} - {own}))

    @cached_property
    def members(self) -> tuple[Alternative[Effect], ...]:
        """Return the claim, then what does as well and was fitted, the best first."""
        best: dict[str, Alternative[Effect]] = {}
        others = {*self.names} - (self.whole.names - {self.claim.effect.name})
        for c in sorted(self.fitted, key=lambda c: -c.score):
            for e in c.response.effects:
                if e.name in others:
                    best.setdefault(e.name, Alternative(e, c))
        return (Alternative(self.claim.effect, self.whole), *best.values())

    @property
    def elements(self) -> list[Alternative[Unnamed]]:
        """Return the members, without the claim, that are no effects of the library."""
        return [Alternative(m.member, m.whole) for m in self.members[1:] if isinstance(m.member, Unnamed)]

    @property
    def without_fit(self) -> tuple[str, ...]:
        """Return the names of effects that were not fitted: lags of another form, which no experiment changes."""
        return tuple(n for n in self.names if n in EFFECTS and n not in {m.member.name for m in self.members})

    @property
    def request(self) -> str:
        """Return the experiment that is predicted to separate the class, "" if none is."""
        own = (a for a in self.rivals if self.claim.effect.name in a.effects and a.separation is not None)
        return next((a.experiment for a in own), "")

    @property
    def other_values(self) -> bool:
        """Return whether other values of calibrated parameters do as well."""
        return any(n.startswith(OTHER_VALUES) for n in self.names)
