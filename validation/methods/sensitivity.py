"""Classical sensitivity-based updating ([MOTTERSHEAD11]): Gauss and Newton on all parameters at once, those of the
model with their priors and those of every effect of the library, regularised by how much each may be expected to vary.
The effect whose parameter moved furthest beyond its uncertainty is named.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from checks.arrays import Array
from checks.errors import ModelError
from checks.gap import Parameter
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.effect import Effect
from checks.model import Model
from validation.methods.task import Found, Task

STEPS = 15
EXPECTED = 10.0  # steps of a parameter (`Parameter.scale`): 1 sd of what updating expects of it
BEYOND = 8.0  # standard deviations of its estimate from which on a parameter means an effect
UNUSUAL = 4.0  # and of the model file's, if the parameter differs from unit to unit anyway
FAR_HZ = 50e3  # first corner of a filter, of which nothing is known


@dataclass(frozen=True)
class Updated:
    """A parameter that is updated. off, sd: its expected x; begin: x from which updating goes; corner: x is one over
    the value, in which a filter fades to nothing."""

    name: str
    off: float
    sd: float
    lo: float
    hi: float
    begin: float
    corner: bool = False

    def value(self, x: float) -> float:
        v = 1.0 / max(x, 1e-9) if self.corner else x
        return float(np.clip(v, self.lo, self.hi))

    def slope(self, x: float) -> float:
        """Return the derivative of the value by x."""
        return -(self.value(x) ** 2) if self.corner else 1.0


def updated(effect: Effect, p: Parameter, model: Model) -> Updated:
    """Return a parameter of an effect as updating has it."""
    name, off = f"{effect.name}.{p.name}", effect.off(model)[p.name]
    if not np.isfinite(off):
        x = 1.0 / min(FAR_HZ, p.hi)
        return Updated(name, x, 1.0 / p.start, p.lo, p.hi, x, corner=True)
    return Updated(name, p.inside(off), EXPECTED * p.scale, p.lo, p.hi, p.inside(off))


def strengths(effect: Effect) -> list[str]:
    """Return the parameters that say how much of an effect is there."""
    return [p.name for p in effect.parameters if p.linear] or [effect.parameters[0].name]


def update(task: Task, response: Augmented, every: Sequence[Updated]) -> tuple[Array, Array]:
    """Return x (p,) and its covariance at the optimum, by damped steps of Gauss and Newton."""
    data, names = task.data, [u.name for u in every]
    off, sd = np.array([u.off for u in every]), np.array([u.sd for u in every])

    def cost(x: Array) -> tuple[float, Array, dict[str, float]]:
        at = {u.name: u.value(v) for u, v in zip(every, x, strict=True)}
        try:
            r = data.whitener(data.H - response.frf(data.f, at, data.channels))
        except ModelError:  # the strut is not held there
            return np.inf, np.zeros(0), at
        return 0.5 * float(r @ r + np.sum(((x - off) / sd) ** 2)), r, at

    x, damping = np.array([u.begin for u in every]), 1e-2
    now, r, at = cost(x)
    for _ in range(STEPS):
        slopes = np.array([u.slope(v) for u, v in zip(every, x, strict=True)]) * sd
        J = data.whitener(response.jacobian(data.f, names, at, data.channels)) * slopes[:, None]
        A, g = J @ J.T + np.eye(sd.size), J @ r - (x - off) / sd
        while damping < 1e6:
            new = x + sd * np.linalg.solve(A + damping * np.diag(np.diag(A)), g)
            there, r_there, at_there = cost(new)
            if there < now:
                break
            damping *= 5.0
        else:
            break
        gained, x, now, r, at, damping = now - there, new, there, r_there, at_there, damping / 5.0
        if gained < 1e-3 * max(now, 1.0):
            break
    return x, np.linalg.inv(A) * np.outer(sd, sd)


def run(folder: Path, model: Path, without: Sequence[str] = ()) -> dict[str, Any]:
    """Return the answer of the method on a unit."""
    task = Task.of(folder, model, frozenset(without))
    own = task.response.model
    response = Augmented(own, tuple(task.library))
    of_effects = [updated(e, p, own) for e in task.library for p in e.parameters]
    names = {u.name for u in of_effects}
    base = [Updated(p.name, p.prior, p.sd, p.lo, p.hi, task.at[p.name]) for p in response.free() if p.name not in names]
    every = [*base, *of_effects]
    x, cov = update(task, response, every)
    place = {u.name: k for k, u in enumerate(every)}
    moved = {}
    for e in task.library:
        at = [place[f"{e.name}.{n}"] for n in strengths(e)]
        away = x[at] - np.array([every[k].off for k in at])
        usual = [own.sds[t] for t in e.stands_for(own) if t in own.sds]
        moved[e.name] = float(np.sqrt(away @ np.linalg.solve(cov[np.ix_(at, at)], away))) / BEYOND
        if usual:
            moved[e.name] = min(moved[e.name], float(np.max(np.abs(away))) / max(usual) / UNUSUAL)
    furthest = max(moved, key=lambda name: moved[name])
    if moved[furthest] < 1.0:
        return task.answer(())
    values, sds = {}, {}
    for k, u in enumerate(every):
        if u.name.startswith(f"{furthest}."):
            short = u.name.removeprefix(f"{furthest}.")
            values[short], sds[short] = u.value(x[k]), float(np.sqrt(cov[k, k]) * abs(u.slope(x[k])))
    return task.answer([Found(furthest, values, sds)])
