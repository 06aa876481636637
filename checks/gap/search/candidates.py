"""Candidates of an explanation: which members of the library are tried, and from which start each is fitted."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import inf

from checks.errors import ModelError
from checks.fitting.calibrate import OTHER, of_damping
from checks.fitting.dataset import Dataset
from checks.fitting.fit import BEYOND_DOUBT, Led, lead
from checks.fitting.misplaced_modes import misplaced_modes
from checks.gap.modelling.augmented import Augmented, Member
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.search.candidate import Candidate
from checks.gap.search.refit import Refit, annealed, begin, go_on, released
from checks.gap.search.screen import Score, peaks, screen
from checks.gap.statistics.projected_residual import project
from checks.model.model import Model
from checks.model.parameters import is_mode_factor

FEW, MANY = 4, 30  # steps for every start, and for those that go on
GO_ON = 5  # starts of one round that go on
DRAWN = 2  # more starts of a calibration with scatter, if the first is not adequate
SAME = 0.3  # prior standard deviations: searches that end no further apart have found one place
NO_RIVAL = 30.0  # times the cost of the best: what is as far off is not followed
ALIKE = 0.1  # of log likelihood: or if they cost the same
POLISH = 8  # steps with all parameters free, if the scatter was held before
WORTH_A_FIT = 1e-2  # chance of a member's gain in the screen, above which no fit is begun
SURE, SMALL = 8, 0.1  # members of a round that are fitted: so many, and those with this share of the largest gain
BOTH_WAYS = 2  # candidates tried with the other form of damping
PLACES = 2  # of the largest residual that a mode is moved to
NEIGHBOURS = 3  # effects that are tried in the place of one that is there
FROM_FAR = 3  # candidates of a round begin once more at the priors, if no candidate is adequate
Say = Callable[[str], None]


@dataclass
class Effort:
    """Work of an analysis so far, in derivatives taken, and the most that it may take. Work and not time: the same
    records give the same answer on any machine, however busy."""

    most: float = inf
    spent: float = 0.0

    @property
    def over(self) -> bool:
        """Return whether the work is used up and the search must stop with what it has."""
        return self.spent > self.most


@dataclass(frozen=True, eq=False)
class Search:
    """The data and the library of a search. A, B: thinned datasets of the two realisations; library: members that may
    be added; effort: shared by all searches of one analysis."""

    A: Dataset
    B: Dataset
    library: tuple[Member, ...]
    table: Thresholds
    say: Say
    effort: Effort = field(default_factory=Effort)

    @property
    def over(self) -> bool:
        return self.effort.over

    def fitted(self, response: Augmented, start: Mapping[str, float], drawn: int = DRAWN) -> Candidate:
        """Return a response fitted to A to the end, from far away. drawn: more starts, if the model scatters and the
        one at `start` leads to no adequate fit."""
        if not response.model.scatters:
            return self._candidate(self.go_on(self._annealed(response, start), MANY))
        first = self._led(response, start)
        own = self._to_its_end(response, first)
        return own if own.adequate else self._elsewhere(response, start, first, own, drawn)

    def led_to_its_end(self, response: Augmented, start: Mapping[str, float]) -> Candidate:
        """Return a response fitted to A from one place."""
        return self._to_its_end(response, self._led(response, start))

    def elsewhere(self, c: Candidate) -> Candidate:
        """Return a candidate or, if a search from another place comes nearer, its result."""
        return self._elsewhere(c.response, {}, Led(tuple(c.response.free(c.at)), inf), c, DRAWN)

    def _elsewhere(
        self, response: Augmented, start: Mapping[str, float], first: Led, own: Candidate, drawn: int
    ) -> Candidate:
        """Return the nearest of fits from other starts, because a sharp mode far from its place is a false minimum.
        Those with a mode in another place come first, then drawn ones, until two end in one place."""
        places, found = [first], [own, *self.rearranged(own)]
        been = [*places, *([] if own.led is None else [own.led])]
        if any(c.adequate for c in found):
            return _nearest(found)
        for seed in range(1, drawn + 1):
            if self.over:
                break
            led = self._led(response, start, seed)
            if any(_same(led, other) for other in been):
                break
            if led.cost < min(p.cost for p in places):  # on few bins already no better: nothing to be found there
                found.append(self._to_its_end(response, led))
            places.append(led)
            been.append(led)
        return _nearest(found)

    def rearranged(self, c: Candidate) -> list[Candidate]:
        """Return candidates fitted from points at which a mode lies at a peak of the residual: the best few, or
        none."""
        if not c.response.model.scatters or self.over:
            return []
        places = peaks(project(c.response, self.A, c.at), self.A.channels)[:PLACES]
        r, f_hi = c.response, float(self.A.f[-1])
        ways = misplaced_modes(r.model, r.free(c.at), c.at, places, f_hi, r.changes)
        starts = [begin(r, self.A, at) for at in ways]
        few = sorted((self.go_on(r, 2 * FEW) for r in starts), key=lambda r: r.cost)
        return [self._candidate(self.go_on(r, 2 * MANY)) for r in few[:BOTH_WAYS]]

    def _led(self, response: Augmented, start: Mapping[str, float], seed: int = 0) -> Led:
        """Search on few bins, from `start` or, with a seed, from a draw about it."""
        free, joint = response.free(start), response.model.joint
        (found,) = lead(response, self.A, free, joint=joint, seed=seed, drawn=seed > 0)
        self.effort.spent += found.work
        return found

    def _to_its_end(self, response: Augmented, led: Led) -> Candidate:
        return replace(self._candidate(self.go_on(begin(response, self.A, led.at), MANY)), led=led)

    def go_on(self, refit: Refit, steps: int) -> Refit:
        """Take at most so many more steps and count their work."""
        done = go_on(refit, steps)
        self.effort.spent += done.work - refit.work
        return done

    def refitted(self, response: Augmented, at: Mapping[str, float]) -> Candidate:
        """Return a response fitted to A from values nearby."""
        return self._candidate(self.go_on(begin(response, self.A, at), MANY))

    def compared(self, response: Augmented, at: Mapping[str, float]) -> Candidate:
        """Return a response at values that were fitted elsewhere."""
        return self._candidate(begin(response, self.A, at))

    def _annealed(self, response: Augmented, start: Mapping[str, float]) -> Refit:
        done = annealed(response, self.A, start)
        self.effort.spent += done.work
        return done

    def _candidate(self, r: Refit) -> Candidate:
        return Candidate(r.response, r.at, r.cost, self.B, self.table)

    def extended(self, base: Candidate, known: Collection[frozenset[str]] = ()) -> list[Candidate]:
        """Add every member to a candidate and fit them jointly, from the candidate's values and from the priors: a
        calibration that lacked the effect may have gone astray. known: sets that are fitted already."""
        on_A = project(base.response, self.A, base.at)
        absent = [m for m in self.library if m.name not in base.names and base.names | {m.name} not in known]
        every = [screen(on_A, m) for m in absent]
        promising = _promising([s for s in every if s.p < WORTH_A_FIT])
        starts = [r for s in promising if not self.over for r in self._starts(base, s)]
        if base.gross:
            others = [s for s in every if s not in promising]
            starts += [r for s in others if not self.over for r in self._coarse_start(base, s)]
        return self._raced(starts)

    def damped_otherwise(self, c: Candidate) -> Candidate | None:
        """Return a candidate with the model's other form of damping; None if the model cannot have it. Which form the
        strut has shows only when little else is missing."""
        model = of_damping(c.response.model, OTHER[c.response.model.damping])
        if model is None:
            return None
        try:
            return self._candidate(self.go_on(begin(replace(c.response, model=model), self.A, c.at), MANY))
        except ModelError:
            return None

    def damped_best(self, c: Candidate) -> Candidate:
        """Return a candidate with the form of damping that is more likely beyond doubt."""
        other = self.damped_otherwise(c)
        return other if other is not None and other.cost < c.cost - BEYOND_DOUBT and other.adequate else c

    def _starts(self, base: Candidate, score: Score) -> list[Refit]:
        return [*self._coarse_start(base, score), *self._from_screen(base.response, base.at, score)]

    def _from_screen(self, base: Augmented, at: Mapping[str, float], score: Score) -> list[Refit]:
        response = base.with_member(score.member).holding_scatter(at)
        out = []
        taken = _stood_for(score.member, response)
        kept = {k: v for k, v in at.items() if k not in taken and not is_mode_factor(k)}
        for values in score.starts:
            start = {**kept, **{f"{score.member.name}.{k}": v for k, v in values.items()}}
            try:
                out.append(self.go_on(begin(response, self.A, start), FEW))
            except ModelError:
                continue
        return out

    def _coarse_start(self, base: Candidate, score: Score) -> list[Refit]:
        """Start as a calibration does, from the priors and on few bins: if the calibration without the effect is far
        off, only this start succeeds. All parameters are free, because modes that are held on the way lead
        elsewhere."""
        response, member = base.response.with_member(score.member), score.member
        if not isinstance(member, Effect):
            return []
        quick = replace(response, model=quicker(response.model))
        own = {k: v for k, v in base.at.items() if k.split(".")[0] in base.names}
        names = [f"{member.name}.{p.name}" for p in member.parameters]
        places = [
            (p.start, *(p.begins if base.gross else ())) if p.linear else (score.starts[0][p.name],)
            for p in member.parameters
        ]
        try:
            leads = [self._led(quick, own | dict(zip(names, place, strict=True))) for place in product(*places)]
            best = min(leads, key=lambda led: led.cost)
            return [self.go_on(begin(response, self.A, best.at), FEW)]
        except ModelError:
            return []

    def pruned(self, c: Candidate) -> Candidate:
        """Return a candidate without the members that it does not need (backward deletion); an adequate one stays
        adequate."""
        for member in c.response.counted:
            less = c.response.without(member.name)
            start = {k: v for k, v in c.at.items() if not k.startswith(f"{member.name}.")}
            simpler = self._candidate(self.go_on(begin(less, self.A, start), MANY))
            if (simpler.adequate or not c.adequate) and c.lnL - simpler.lnL < self.table.delta_lnL:
                return self.pruned(simpler)
        return c

    def swapped(self, c: Candidate) -> list[Candidate]:
        """Return the candidates in which an effect takes the place of a member, from the other values of the candidate.
        With more freedom than an effect, an unmodelled mode may have come in first (a lag whose gain turns round is
        nearly a delay); and a search for the right effect may have ended in a false minimum, although the search for
        its neighbour did not."""
        out = []
        for member in c.response.counted:
            less = c.response.without(member.name)
            implied = c.response.changes(c.at)  # of what the member stands for, and the model calibrates without it
            at = {p.name: c.at.get(p.name, implied.get(p.name, p.prior)) for p in less.free()}
            on_A = project(less, self.A, at)
            absent = [m for m in self.library if isinstance(m, Effect) and m.name not in c.response.names]
            scores = [screen(on_A, m) for m in absent if set(m.channels) & set(member.channels)]
            scores = sorted((s for s in scores if s.p < WORTH_A_FIT), key=lambda s: -s.gain)[:NEIGHBOURS]
            out += self._raced([r for s in scores for r in self._from_screen(less, at, s)], c.cost)
        return out

    def from_far(self, found: Sequence[Candidate]) -> list[Candidate]:
        """Return the best few fitted once more, the model from the priors and the members from their present values."""
        return [self._candidate(self._again(c)) for c in sorted(found, key=lambda c: c.cost)[:FROM_FAR]]

    def _again(self, c: Candidate) -> Refit:
        own = {k: v for k, v in c.at.items() if k.split(".")[0] in c.response.names}
        quick = replace(c.response, model=quicker(c.response.model))
        return self.go_on(begin(c.response, self.A, self._annealed(quick, own).at), MANY)

    def _to_the_end(self, refit: Refit) -> Refit:
        """Fit to the end, first with the scatter held, then with all parameters free."""
        done = self.go_on(refit, MANY)
        return self.go_on(freed(done), POLISH) if done.response.held else done

    def _raced(self, started: Sequence[Refit], adequate: float = inf) -> list[Candidate]:
        """Return the best start of every set, the most promising ones fitted to the end. adequate: cost of an adequate
        explanation; a start far above it is no rival and is not fitted further."""
        best: dict[frozenset[str], Refit] = {}
        for r in sorted(started, key=lambda r: r.cost):
            best.setdefault(frozenset(r.response.names), r)
        done = []
        for i, r in enumerate(best.values()):
            near = i < GO_ON and r.cost < NO_RIVAL * adequate
            done.append(self._candidate(self._to_the_end(r) if near else freed(r)))
            if adequate == inf and near and done[-1].adequate:
                adequate = done[-1].cost
        return sorted(done, key=lambda c: -c.score)


def _promising(scores: Sequence[Score]) -> list[Score]:
    """Return the scores by falling gain, without those that are small beside the largest: they explain too little to be
    added first, and are screened again once the rest is explained."""
    ranked = sorted(scores, key=lambda s: -s.gain)
    return [s for i, s in enumerate(ranked) if i < SURE or s.gain > SMALL * ranked[0].gain]


def _nearest(found: Sequence[Candidate]) -> Candidate:
    """Return the best of one response fitted from several places; only the adequate ones compete, if there are any."""
    return min([c for c in found if c.adequate] or found, key=lambda c: c.cost)


def _same(a: Led, b: Led) -> bool:
    alike = all(abs(p.begin - q.begin) < SAME * p.unit for p, q in zip(a.free, b.free, strict=True))
    return alike or abs(a.cost - b.cost) < ALIKE


def freed(refit: Refit) -> Refit:
    """Return a fit with the scatter of the modes free again."""
    return released(refit) if refit.response.held else refit


def quicker(model: Model) -> Model:
    """Return the model with modal damping if it can have it: the derivatives are quicker, and a start is as good."""
    return of_damping(model, "modal") or model


def _stood_for(member: Member, response: Augmented) -> set[str]:
    """Return the calibrated parameters that an effect stands for: they return to their priors when the effect is
    added."""
    return set(member.stands_for(response.model)) if isinstance(member, Effect) else set()
