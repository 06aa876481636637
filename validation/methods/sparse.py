"""Plain sparse regression: orthogonal matching pursuit ([TROPP07]) on the effects linearised at the calibrated model.

An atom is one effect at one place of its grid: the change of the response by it, whitened, without what calibrated
parameters can explain. The atom that explains most is taken, all sizes are solved for again, and so on until the next
one gains too little.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from checks.arrays import Array
from checks.errors import ModelError
from checks.gap.modelling.effect import Effect
from checks.gap.search.screen import directions
from validation.methods.task import Found, Task

MOST = 4  # effects of one unit, as in the search of the project
GAIN = 12.5  # of log-likelihood, as a name needs there


@dataclass(frozen=True, eq=False)
class Atom:
    """rows (k, n): the change by each linear parameter, or by the effect as a whole at `shape`."""

    effect: Effect
    shape: dict[str, float]
    rows: Array

    def found(self, sizes: Array, sds: Array) -> Found:
        """Return the effect with values: the linear parameters, or as much of the way from no effect to the place."""
        linear = [p.name for p in self.effect.parameters if p.linear]
        if linear:
            values = self.shape | dict(zip(linear, map(float, sizes), strict=True))
            return Found(self.effect.name, values, dict(zip(linear, map(float, sds), strict=True)))
        p, share, sd = self.effect.parameters[0], float(sizes[0]), float(sds[0])
        place = self.shape[p.name]
        if np.isfinite(p.off):
            span = place - p.off
            return Found(self.effect.name, self.shape | {p.name: p.off + share * span}, {p.name: abs(span) * sd})
        value = place / max(share, 1e-6)  # an effect of a corner fades as one over its frequency
        return Found(self.effect.name, self.shape | {p.name: value}, {p.name: value * sd / max(abs(share), 1e-6)})


def atoms(task: Task) -> Iterator[Atom]:
    """Yield every effect of the library at every place of its grid that the model can hold."""
    for effect in task.library:
        shapes = [p for p in effect.parameters if not p.linear]
        off = effect.off(task.response.model)
        for places in product(*(p.places or (off[p.name],) for p in shapes)):
            shape = dict(zip((p.name for p in shapes), map(float, places), strict=True))
            sizes = {p.name: 0.0 for p in effect.parameters if p.linear}
            try:
                rows = directions(task.residual, effect, shape | sizes)
            except (ModelError, ValueError):
                continue
            if np.isfinite(rows).all() and (np.linalg.norm(rows, axis=1) > 0.0).all():
                yield Atom(effect, shape, rows)


def pursue(every: Sequence[Atom], r: Array, gain: float = GAIN) -> list[Atom]:
    """Return the atoms that explain a residual r (n,), one of each effect at most."""
    chosen: list[Atom] = []
    left = r
    while len(chosen) < MOST:
        taken = {a.effect.name for a in chosen}
        room = [a for a in every if a.effect.name not in taken]
        gains = [float(np.sum((np.linalg.lstsq(a.rows.T, left, rcond=None)[0] @ a.rows) ** 2)) / 2 for a in room]
        if not gains or max(gains) < gain + 3.0 * (len(room[int(np.argmax(gains))].rows) - 1):
            break
        chosen.append(room[int(np.argmax(gains))])
        left = r - _solve(chosen, r)[0] @ np.vstack([a.rows for a in chosen])
    return chosen


def _solve(chosen: Sequence[Atom], r: Array) -> tuple[Array, Array]:
    """Return sizes and their standard deviations."""
    D = np.vstack([a.rows for a in chosen])
    cov = np.linalg.pinv(D @ D.T, hermitian=True)
    return cov @ (D @ r), np.sqrt(np.diag(cov))


def run(folder: Path, model: Path, without: Sequence[str] = ()) -> dict[str, Any]:
    """Return the answer of the method on a unit."""
    task = Task.of(folder, model, frozenset(without))
    r = task.residual.left
    chosen = pursue(list(atoms(task)), r)
    if not chosen:
        return task.answer(())
    sizes, sds = _solve(chosen, r)
    ends = np.cumsum([len(a.rows) for a in chosen])[:-1]
    parts = zip(chosen, np.split(sizes, ends), np.split(sds, ends), strict=True)
    return task.answer([a.found(size, sd) for a, size, sd in parts])
