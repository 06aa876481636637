"""Candidates of an explanation: which members of the library are tried, and from which start each is fitted."""

import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import product
from math import inf

import numpy as np
from scipy.linalg import LinAlgWarning

from checks.errors import ModelError
from checks.fitting.calibrate import OTHER, quicker, with_damping
from checks.fitting.dataset import Dataset
from checks.fitting.descent import descend
from checks.fitting.fit import BEYOND_DOUBT, FitPoint, coarse_fits, work_of
from checks.fitting.misplaced_modes import misplaced_modes
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.element import (
    HOLDER,
    KINDRED,
    KINDS,
    RESONATOR,
    ROCKING,
    GenericElement,
    element,
    kind_of,
    on_the_other_side,
    parts_of,
    seems_to_hang,
)
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.modelling.unmodelled_modes import MODE, UnmodelledMode, on_channel
from checks.gap.search.explanation import Explanation, if_held
from checks.gap.search.places import NOTHING_KNOWN, Places
from checks.gap.search.residuals import SearchResiduals, scatter_of, with_tolerance
from checks.gap.search.screen import Score, peaks, screen
from checks.gap.statistics.projected_residual import Projected

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
MOVES = 4  # modes that are moved one after the other beside an effect
MOVED = 0.75  # of the cost: another mode is moved only if the one before leaves no more
NEIGHBOURS = 3  # effects that are tried in the place of one that is there
ELEMENTS_TRIED = 5  # of those that the screen of places finds
AS_GOOD = 0.5  # of what a member explains: an element that promises less is not tried in its place
FROM_FAR = 3  # candidates of a round begin once more at the priors, if no candidate is adequate
# A sharp peak only pulls the model's peak once they overlap, so a fit first runs with a model that may be far off,
# where peaks are broad in proportion, and then with less and less (found on drawn struts: 16 of 16 instead of 10 of
# 16).
WIDER_TOLERANCES = (0.3, 0.1, 0.03)
WIDER_STEPS = 5
REWEIGHTED = 2
RESERVED = 0.5  # of the work of an analysis: for each other search, however the first one ended
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
    be added; effort, failures: shared by all searches of one analysis, the latter the members that could not be
    evaluated, each with the reason; by_prediction: whether the tolerance is a fraction of what is predicted, from the
    first fit on."""

    A: Dataset
    B: Dataset
    library: tuple[Effect, ...]
    table: Thresholds
    say: Say
    effort: Effort = field(default_factory=Effort)
    failures: dict[str, str] = field(default_factory=dict)
    by_prediction: bool = False

    @property
    def over(self) -> bool:
        return self.effort.over

    def with_effort_of_its_own(self) -> "Search":
        """Return the same search with work to spend, whatever others have spent."""
        return replace(self, effort=Effort(RESERVED * self.table.effort))

    @property
    def exchanged(self) -> "Search":
        """Return the same search with the realisations exchanged: it fits to B and judges on A."""
        return replace(self, A=self.B, B=self.A)

    def on(self, data: Dataset) -> "Search":
        """Return the same search that fits to other data."""
        return replace(self, A=data)

    def weighted_by(self, candidates: Sequence[Explanation]) -> tuple["Search", list[Explanation]]:
        """Return the search with the tolerance by the prediction of the first of some candidates, and all of them
        fitted again; both as they are, unless it is `by_prediction`."""
        search, every = self, list(candidates)
        for _ in range(REWEIGHTED if self.by_prediction and every else 0):
            search = replace(search, A=every[0].around(search.A), B=every[0].around(search.B))
            every = [search.refit(c.response, c.at) for c in every]
        return search, every

    def is_complete(self, c: Explanation) -> bool:
        """Return whether chance explains what a candidate leaves, and no family of parts is off together by more than
        chance, though each of them may be so alone."""
        families = (m for m in self.library if isinstance(m, GenericElement) and m.name not in c.names)
        return not c.beside and c.adequate and not any(screen(c.seen, m).p < self.table.p_global for m in families)

    def begin(self, response: Augmented, start: Mapping[str, float]) -> Explanation:
        """Return a response at a start: values by name, others at their priors. Raises ModelError if the model cannot
        take these values."""
        residuals = SearchResiduals(response, self.A, response.free(start))
        x = residuals.begin()
        return Explanation(response, residuals.values(x), residuals.cost(x), self.B, self.table)

    def advance(self, c: Explanation, steps: int) -> Explanation:
        """Take at most so many damped steps (`checks.fitting.descent`) inside the physical bounds, and count their
        work."""
        if c.settled:
            return c
        residuals = SearchResiduals(c.response, self.A, c.response.free(c.at))
        with warnings.catch_warnings():
            # An effect has no prior to measure it by: its column may be huge, which harms no positive definite solve.
            warnings.simplefilter("ignore", LinAlgWarning)
            end = descend(residuals, residuals.begin(), steps)
        self.effort.spent += work_of(end.steps, len(residuals.names), self.A.H.size)
        return replace(c, at=residuals.values(end.x), cost=end.cost, settled=end.settled)

    def free_scatter(self, c: Explanation) -> Explanation:
        """Return a candidate whose scatter was held with the scatter free and at its optimum, or as near to it as the
        strut is held; a candidate without held scatter as it is."""
        if not c.response.held:
            return c
        error = self.A.H - c.response.frf(self.A.f, c.at, self.A.channels)
        best, held = scatter_of(c.response, self.A).best(self.A.whitener(error)), dict(c.response.held)
        response = replace(c.response, held=())
        for share in (1.0, 0.5, 0.0):
            freed = self.begin(response, c.at | {n: held[n] + share * (best[n] - held[n]) for n in held})
            if np.isfinite(freed.cost):
                break
        return freed

    def fit(self, response: Augmented, start: Mapping[str, float], drawn: int = DRAWN) -> Explanation:
        """Return a response fitted to A to the end, from far away. drawn: more starts, if the model scatters and the
        one at `start` leads to no adequate fit."""
        if not response.model.scatters:
            return self.advance(self._with_shrinking_tolerance(response, start), MANY)
        first = self._coarse_fit(response, start)
        own = self._fit_from(response, first)
        return own if own.adequate else self._fit_elsewhere(response, start, first, own, drawn)

    def fit_from_one_place(self, response: Augmented, start: Mapping[str, float]) -> Explanation:
        """Return a response fitted to A from one start."""
        return self._fit_from(response, self._coarse_fit(response, start))

    def fit_elsewhere(self, c: Explanation) -> Explanation:
        """Return a candidate or, if a search from another place comes nearer, its result."""
        here = FitPoint(tuple(c.response.free(c.at)), inf)
        return self._fit_elsewhere(c.response, {}, here, c, DRAWN)

    def _fit_elsewhere(
        self, response: Augmented, start: Mapping[str, float], first: FitPoint, own: Explanation, drawn: int
    ) -> Explanation:
        """Return the nearest of fits from other starts, because a sharp mode far from its place is a false minimum.
        Those with a mode in another place come first, then drawn ones, until two end in one place."""
        fits, costs = [own, *self.with_moved_modes(own)], [first.cost]
        known = [first] if own.coarse is None else [first, own.coarse]
        if drawn and not any(c.adequate for c in fits):
            moved = self._coarse_fit(response, start, moving=True)
            fits += [] if any(_is_same_place(moved, other) for other in known) else [self._fit_from(response, moved)]
        if not any(c.adequate for c in fits):
            for seed in range(1, drawn + 1):
                if self.over:
                    break
                point = self._coarse_fit(response, start, seed)
                if any(_is_same_place(point, other) for other in known):
                    break
                if point.cost < min(costs):  # on few bins already no better: nothing to be found there
                    fits.append(self._fit_from(response, point))
                known.append(point)
                costs.append(point.cost)
        return min([c for c in fits if c.adequate] or fits, key=lambda c: c.cost)

    def with_moved_modes(self, c: Explanation, most: int = 1) -> list[Explanation]:
        """Return candidates fitted from points at which a mode lies at a peak of the residual: the best few, or none.
        most: modes moved one after the other, because the next one shows only when the first is in its place."""
        out: list[Explanation] = []
        for _ in range(most):
            moved = self._with_one_moved_mode(c)
            out = [*moved, *out]
            best = min(moved, key=lambda m: m.cost, default=c)
            if best.adequate or best.cost > MOVED * c.cost:
                break
            c = best
        return out

    def _with_one_moved_mode(self, c: Explanation) -> list[Explanation]:
        if not c.response.model.scatters or self.over:
            return []
        places = peaks(c.on(self.A).seen, self.A.channels)[:PLACES]
        r, f_hi = c.response, float(self.A.f[-1])
        ways = misplaced_modes(r.model, r.free(c.at), c.at, places, f_hi, r.changes)
        starts = [self.begin(r, at) for at in ways]
        few = sorted((self.advance(moved, 2 * FEW) for moved in starts), key=lambda moved: moved.cost)
        return [self.advance(moved, 2 * MANY) for moved in few[:BOTH_WAYS]]

    def _coarse_fit(
        self,
        response: Augmented,
        start: Mapping[str, float],
        seed: int = 0,
        moving: bool = False,
        also: Sequence[Mapping[str, float]] = (),
    ) -> FitPoint:
        """Search on few bins, from `start` or, with a seed, from a draw about it. moving: modes that the ratio of data
        to model shows to be missing are moved there; also: values of some parameters to begin at too."""
        free, joint = response.free(start), response.model.joint

        def move(at: Mapping[str, float], places: Sequence[float]) -> list[dict[str, float]]:
            return misplaced_modes(response.model, free, at, places[:PLACES], float(self.A.f[-1]), response.changes)

        way = move if moving else None
        (point,) = coarse_fits(response, self.A, free, joint=joint, seed=seed, drawn=seed > 0, move=way, also=also)
        self.effort.spent += point.work
        return point

    def _fit_from(self, response: Augmented, point: FitPoint) -> Explanation:
        return replace(self.advance(self.begin(response, point.at), MANY), coarse=point)

    def refit(self, response: Augmented, at: Mapping[str, float]) -> Explanation:
        """Return a response fitted to A from values nearby."""
        return self.advance(self.begin(response, at), MANY)

    def _with_shrinking_tolerance(self, response: Augmented, start: Mapping[str, float]) -> Explanation:
        """Begin at the end of short fits from far away, with tolerances that shrink towards the data's own. Raises
        ModelError."""
        at = dict(start)
        for tolerance in WIDER_TOLERANCES:
            if tolerance > self.A.tolerance:
                blurred = self.on(with_tolerance(self.A, tolerance))
                at = blurred.advance(blurred.begin(response, at), WIDER_STEPS).at
        return self.begin(response, at)

    def screened(self, seen: Projected, members: Iterable[Effect]) -> list[Score]:
        """Return the scores of members on top of a calibrated response, and keep why some have none."""
        every = [screen(seen, m) for m in members]
        self.failures.update({s.member.name: s.failure for s in every if s.failure})
        return every

    def add_one(self, base: Explanation, known: Collection[frozenset[str]] = ()) -> list[Explanation]:
        """Add every member to a candidate and fit them jointly, from the candidate's values and from the priors: a
        calibration that lacked the effect may have gone astray. known: sets that are fitted already."""
        on_A = base.on(self.A).seen
        absent = [m for m in self.library if m.name not in base.names and base.names | {m.name} not in known]
        every = self.screened(on_A, absent)
        promising = _promising([s for s in every if s.p < WORTH_A_FIT])
        starts: list[Explanation] = []
        for s in promising:
            if not self.over:
                starts += [*self._coarse_start(base, s), *self._from_screen(base, s)]
        if base.gross:
            others = [s for s in every if s not in promising]
            starts += [c for s in others if not self.over for c in self._coarse_start(base, s)]
        return self._race(starts)

    def add_element(self, base: Explanation, in_path: bool = False) -> list[Explanation]:
        """Add each of the generic elements that promise most to a candidate, fitted jointly from its values; failing an
        adequate fit, the first and the best of them and what stands at the likeliest places from the priors too: a
        calibration that lacked an element may have gone astray, and then only the place is told. in_path: whether what
        may lie in the path of one channel counts too."""
        places = Places(base.on(self.A).seen)
        if places.in_signal_path and not in_path:
            return []
        scores = sorted(places.scores(), key=lambda s: -s.net)
        first = [s for s in scores if s.p < WORTH_A_FIT][:ELEMENTS_TRIED]
        starts = [c for s in first if not self.over for c in self._from_screen(base, s)]
        found = self._where_it_may_be(self._race(starts))
        if any(c.adequate and c.possible for c in found):
            return found
        if any(kind_of(s.member) == RESONATOR for s in first):  # what rocks moves the axis as what hangs does
            rocks = [s for s in scores if kind_of(s.member) == ROCKING and not self.over]
            rocking = self._race([c for s in rocks for c in self._from_screen(base, s)])
            if any(c.adequate for c in rocking):
                return best_of_each([*rocking, *found])
        tried = [*first[:FROM_FAR], *(next(s for s in first if s.member.name in c.names) for c in found[:FROM_FAR])]
        for d in places.ranked[:PLACES]:
            tried += [s for s in scores if s.member in {element(d.place, d.direction, k) for k in (HOLDER, RESONATOR)}]
        far = [c for s in {s.member: s for s in tried}.values() if not self.over for c in self._coarse_start(base, s)]
        found = best_of_each(self._where_it_may_be(self._race([*far, *found])))
        if self.over or not found or (found[0].adequate and found[0].possible):
            return found
        bare = self.refit(base.response, base.response.own_values(found[0].at))  # what led the calibration back?
        return self.add_element(bare, in_path) if bare.cost < MOVED * base.cost else found

    def _where_it_may_be(self, found: Sequence[Explanation]) -> list[Explanation]:
        """Return candidates, each whose last element takes something away beside the axis fitted from the other side,
        and from the priors: along the axis it does the opposite there."""
        out = []
        for c in found:
            own = c.of(c.added.name)
            turned = {f"{c.added.name}.{n}": v for n, v in on_the_other_side(c.added, own).items() if v != own[n]}
            near = turned and c.cost < NO_RIVAL * found[0].cost
            out += self.refit_from_priors([replace(c, at=c.at | turned)]) if near else [c]
        return sorted(out, key=lambda c: -c.score)

    def add_filter(self, base: Explanation, channel: str) -> list[Explanation]:
        """Add a mode of one channel's path to a candidate that is calibrated on the others, if these agree alone: a
        calibration on all may have followed it."""
        others = [c for c in self.A.channels if c != channel]
        if not others:
            return []
        alone = replace(self, A=self.A.select(others), B=self.B.select(others))
        sound = alone.fit_from_one_place(base.response, {})
        if not sound.adequate:
            return []
        bare, mode = self.begin(base.response, sound.at), replace(on_channel(MODE, channel), stands_in=False)
        return self._race(self._from_screen(bare, screen(bare.on(self.A).seen, mode, starts=FROM_FAR)))

    def with_other_damping(self, c: Explanation) -> Explanation | None:
        """Return a candidate with the model's other form of damping; None if the model cannot have it. Which form the
        strut has shows only when little else is missing."""
        model = with_damping(c.response.model, OTHER[c.response.model.damping])
        return None if model is None else if_held(lambda: self.refit(replace(c.response, model=model), c.at))

    def with_likelier_damping(self, c: Explanation) -> Explanation:
        """Return the candidate with the form of damping that is more likely beyond doubt."""
        other = self.with_other_damping(c)
        return other if other is not None and other.cost < c.cost - BEYOND_DOUBT else c

    def begun_with(
        self, base: Explanation, member: Effect, values: Mapping[str, float], steps: int
    ) -> Explanation | None:
        """Return an explanation with one more member, begun at values of its own beside those that are there (what it
        stands for returns to its prior), the scatter held; None if the strut is not held there."""
        response = base.response.with_member(member).holding_scatter(base.at)
        taken, own = member.stands_for(response.model), {f"{member.name}.{k}": v for k, v in values.items()}
        start = {k: v for k, v in base.at.items() if k not in taken} | own
        return if_held(lambda: self.advance(self.begin(response, start), steps))

    def _from_screen(self, base: Explanation, score: Score) -> list[Explanation]:
        begun = (self.begun_with(base, score.member, values, FEW) for values in score.starts)
        return [c for c in begun if c]

    def _coarse_start(self, base: Explanation, score: Score) -> list[Explanation]:
        """Start as a calibration does, from the priors and on few bins: if the calibration without the effect is far
        off, only this start succeeds. All parameters are free, because modes that are held on the way lead
        elsewhere."""
        response, member = base.response.with_member(score.member), score.member
        if isinstance(member, UnmodelledMode):
            return []
        quick = replace(response, model=quicker(response.model))
        own = {k: v for k, v in base.at.items() if k.split(".")[0] in base.names}
        named = {f"{member.name}.{p.name}": p for p in member.parameters}
        at_score = isinstance(member, GenericElement)
        own |= {n: p.start if p.linear and not at_score else score.starts[0][p.name] for n, p in named.items()}
        signs = {n: p.begins for n, p in named.items() if p.begins}
        also = [dict(zip(signs, place, strict=True)) for place in product(*signs.values())] if signs else []
        try:
            best = self._coarse_fit(quick, own, moving=bool(also), also=also)
            return [self.advance(self.begin(response, best.at), FEW)]
        except ModelError:
            return []

    def prune(self, c: Explanation) -> Explanation:
        """Return a candidate without the members that it does not need (backward deletion); an adequate one stays
        adequate."""
        for member in c.response.counted:
            less = c.without(member.name)
            simpler = self.refit(less.response, less.at)
            if (simpler.adequate or not c.adequate) and c.lnL - simpler.lnL < self.table.delta_lnL:
                return self.prune(simpler)
            for simpler in self.with_parts(c, member, parts_of(member)):
                if simpler.score > c.score and simpler.adequate >= c.adequate:
                    return self.prune(simpler)
        return c

    def with_parts(self, c: Explanation, member: Effect, parts: Sequence[GenericElement]) -> Iterator[Explanation]:
        """Yield a candidate with one part of an element's dynamic stiffness at a time in its place."""
        less, own = c.without(member.name), c.of(member.name)
        for part in parts:
            start = {f"{part.name}.{p.name}": own.get(p.name, p.start) for p in part.parameters}
            with suppress(ModelError):
                yield self.refit(less.response.with_member(part), {**less.at, **start})

    def swap_members(self, c: Explanation) -> list[Explanation]:
        """Return the candidates in which an effect takes the place of a member, from the other values of the candidate.
        With more freedom than an effect, an unmodelled mode may have come in first (a lag whose gain turns round is
        nearly a delay); and a search for the right effect may have ended in a false minimum, although the search for
        its neighbour did not."""
        out = []
        for member in c.response.counted:
            less = self._replacing(c, member)
            on_A = less.on(self.A).seen
            absent = [m for m in self.library if not m.stands_in and m.name not in c.response.names]
            scores = [screen(on_A, m) for m in absent if set(m.channels) & set(member.channels)]
            scores = sorted((s for s in scores if s.p < WORTH_A_FIT), key=lambda s: -s.gain)[:NEIGHBOURS]
            if member.rivals_elements:
                scores += self._elements_like(Places(on_A), c)
            found = self._race([r for s in scores for r in self._from_screen(less, s)], c.cost)
            out += found
            for r in (r for r in found if r.adequate):  # fewer values may do as well, as those of the member do
                out += self.with_parts(r, r.added, parts_of(r.added))
        return out

    def with_elements_elsewhere(self, c: Explanation) -> list[Explanation]:
        """Return the candidates in which a generic element of the same kind sits at another place."""
        out = []
        for member in (m for m in c.response.effects if isinstance(m, GenericElement)):
            less = self._replacing(c, member)
            kinds = KINDRED.get(member.kind, (member.kind,))
            known = c.of(member.name)
            known |= seems_to_hang(known, c.response.payload(c.at)) if member.kind == ROCKING else {}
            scores = self._elements_like(Places(less.on(self.A).seen), c, kinds, known)
            found = self._race([r for s in scores for r in self._from_screen(less, s)], c.cost)
            out += self._where_it_may_be(found)
        return out

    def _elements_like(
        self, places: Places, c: Explanation, kinds: Sequence[str] = KINDS, known: Mapping[str, float] = NOTHING_KNOWN
    ) -> list[Score]:
        """Return the elements that promise about as much as a candidate gained by the member that they would replace.
        Whether another place can do it shows before any kind is fitted."""
        needed = AS_GOOD * (places.left - 2.0 * c.cost)
        if places.largest < needed:
            return []
        absent = sorted((s for s in places.scores(kinds, known) if s.member.name not in c.names), key=lambda s: -s.net)
        # its score is that of what it is begun from: too little where da is read beside the axis
        rocks = [s for s in absent if kinds is not KINDS and kind_of(s.member) == ROCKING]
        return [s for s in absent if s.gain > needed and s not in rocks][:ELEMENTS_TRIED] + rocks

    def _replacing(self, c: Explanation, member: Effect) -> Explanation:
        """Return a candidate without a member that another is to replace, at all its other values: what the member
        stands for keeps its value, because the model calibrates that without it."""
        less, implied = c.response.without(member.name), c.response.changes(c.at)
        return replace(
            c, response=less, at={p.name: c.at.get(p.name, implied.get(p.name, p.prior)) for p in less.free()}
        )

    def refit_from_priors(self, candidates: Sequence[Explanation], far: float = inf) -> list[Explanation]:
        """Return the best few fitted once more, the model from the priors and the members from their present values.
        far: times the cost of the best, from which on such a start is no rival and is not fitted further."""
        out = []
        ranked = sorted(candidates, key=lambda c: c.cost)
        for c in ranked[:FROM_FAR]:
            own = {k: v for k, v in c.at.items() if k.split(".")[0] in c.response.names}
            quick = replace(c.response, model=quicker(c.response.model))
            with suppress(ModelError):  # the strut is not held at the priors with these
                begun = self.begin(c.response, self._with_shrinking_tolerance(quick, own).at)
                if begun.cost < far * ranked[0].cost:
                    out.append(self.advance(begun, MANY))
        return out

    def finish_to_the_end(self, c: Explanation) -> Explanation:
        """Fit to the end, first with the scatter held, then with all parameters free."""
        end = self.advance(c, MANY)
        return self.advance(self.free_scatter(end), POLISH) if end.response.held else end

    def _race(self, started: Sequence[Explanation], adequate: float = inf) -> list[Explanation]:
        """Return the best start of every set, the most promising ones fitted to the end. adequate: cost of an adequate
        explanation; a start far above it is no rival and is not fitted further."""
        done = []
        for i, c in enumerate(best_of_each(started, lambda c: c.cost)):
            near = i < GO_ON and c.cost < NO_RIVAL * adequate
            done.append(self.finish_to_the_end(c) if near else self.free_scatter(c))
            if adequate == inf and near and done[-1].adequate:
                adequate = done[-1].cost
        return sorted(done, key=lambda c: -c.score)


def best_of_each(
    candidates: Sequence[Explanation], key: Callable[[Explanation], float] | None = None
) -> list[Explanation]:
    """Return the first candidate of every set of members, by a key or by falling score."""
    best: dict[frozenset[str], Explanation] = {}
    for c in sorted(candidates, key=key or (lambda c: -c.score)):
        best.setdefault(c.names, c)
    return [*best.values()]


def _promising(scores: Sequence[Score]) -> list[Score]:
    """Return the scores by falling gain, without those that are small beside the largest: they explain too little to be
    added first, and are screened again once the rest is explained."""
    ranked = sorted(scores, key=lambda s: -s.gain)
    return [s for i, s in enumerate(ranked) if i < SURE or s.gain > SMALL * ranked[0].gain]


def _is_same_place(a: FitPoint, b: FitPoint) -> bool:
    """Return whether two searches ended at the same values, or at the same cost."""
    alike = all(abs(p.begin - q.begin) < SAME * p.unit for p, q in zip(a.free, b.free, strict=True))
    return alike or abs(a.cost - b.cost) < ALIKE
