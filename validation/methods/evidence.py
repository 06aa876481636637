"""Bayesian model selection over single effects, by the Bayesian information criterion ([SCHWARZ78]), which is Laplace's
approximation of the evidence with a prior worth one datum.

Every effect of the library is added to the model alone and fitted together with everything that is calibrated. The most
probable one is named if it is decisively more probable than none; with others as probable, all of them are a class.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from checks.errors import ModelError
from checks.gap.search.explanation import Explanation
from checks.gap.search.screen import screen
from validation.methods.task import Found, Task, standard_deviations

DECISIVE = 4.6  # of the logarithm of the Bayes factor: 100 to 1
STEPS = 15  # of a fit, the scatter of the modes at its optimum for every value of the rest
POLISH = 5  # with everything free
FITTED = 5  # effects that are fitted, the best of a linear look


@dataclass(frozen=True, eq=False)
class Model:
    """An effect added to the model and fitted. lnB: of the Bayes factor over the model without effects."""

    effect: str
    fit: Explanation
    lnB: float


def models(task: Task) -> list[Model]:
    """Return the models with one effect, the most probable first."""
    search = task.search
    base = search.begin(task.response, task.at)
    n = 2 * task.data.H.size
    scores = sorted((screen(task.residual, e) for e in task.library), key=lambda s: -s.gain)[:FITTED]
    out = []
    for score in scores:
        effect = score.member
        response = task.response.with_member(effect)
        fits = []
        for values in score.starts:
            own = {k: v for k, v in base.at.items() if k in {p.name for p in response.free()}}
            try:
                start = search.begin(
                    response.holding_scatter(own), own | {f"{effect.name}.{k}": v for k, v in values.items()}
                )
                fits.append(search.advance(search.free_scatter(search.advance(start, STEPS)), POLISH))
            except ModelError:  # the strut is not held there
                continue
        if fits:
            best = min(fits, key=lambda c: c.cost)
            lnB = base.cost - best.cost - len(effect.parameters) / 2 * np.log(n)
            out.append(Model(effect.name, best, float(lnB)))
    return sorted(out, key=lambda m: -m.lnB)


def run(folder: Path, model: Path, without: Sequence[str] = ()) -> dict[str, Any]:
    """Return the answer of the method on a unit."""
    task = Task.of(folder, model, frozenset(without))
    probable = [m for m in models(task) if m.lnB > DECISIVE]
    if not probable:
        return task.answer(())
    alike = [m for m in probable if m.lnB > probable[0].lnB - DECISIVE]
    if len(alike) > 1:
        return task.answer((), [[m.effect for m in alike]])
    c = probable[0].fit
    sds = standard_deviations(c.response, task.data, c.at)
    name = probable[0].effect
    values = c.response.of(c.at, name)
    return task.answer([Found(name, values, {k: sds[f"{name}.{k}"] for k in values})])
