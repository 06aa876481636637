"""The task that all methods share: responses of a unit, the calibrated model, the library, and the form of an answer.

What is found without a search (a channel of the wrong sign, exchanged channels, whole samples, slow sines) is given to
every method: what is compared is how the rest is explained.
"""

import contextlib
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import accept
from checks.fitting import Dataset
from checks.gap import Inputs
from checks.gap.decision.build_result import named_effects
from checks.gap.modelling.augmented import Augmented, Values
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.thresholds import THRESHOLDS
from checks.gap.preparation.inputs import Problem, prepare
from checks.gap.search.candidates import Search
from checks.gap.statistics.projected_residual import Projected, judge, project

F_LO = 5.0  # Hz, as the method of this project
BINS = 250  # over log f
CI95 = 1.96  # standard deviations


@dataclass(frozen=True)
class Found:
    """An effect that a method names. values, sds: of its parameters."""

    effect: str
    values: Values
    sds: Values


@dataclass(frozen=True, eq=False)
class Task:
    """problem: of the unit, faults of the records corrected; data: the first realisation, thinned; response: the model
    without effects; at: its calibrated values."""

    problem: Problem
    data: Dataset
    response: Augmented
    at: Values

    @classmethod
    @lru_cache(maxsize=1)  # several methods in turn on one unit
    def of(cls, folder: Path, model: Path, without: frozenset[str] = frozenset()) -> "Task":
        """Read a unit and calibrate the model on it. Raises UnitError, RecordError, ModelError, GapRefused."""
        unit = accept.read_unit(folder)
        measured, own = accept.responses(unit, f_lo=F_LO), accept.open_model(model)
        A = replace(measured.first, tolerance=own.tolerance)
        B = A if measured.second is None else replace(measured.second, tolerance=own.tolerance)
        slow = unit.values("hysteresis").get("record") if "hysteresis" in unit.folder.sections else None
        fs = measured.records["low"].fs
        inputs = Inputs(own, A, B, fs, measured.merge_Hz, slow, without=without)
        problem = prepare(inputs, THRESHOLDS)
        data = problem.A.thinned(BINS)
        with contextlib.redirect_stderr(io.StringIO()):  # progress
            fitted = accept.fit_model(data, str(model), f_lo=F_LO, starts=1)
        response = Augmented(own)
        task = cls(problem, data, response, {p.name: fitted.fit.at.get(p.name, p.begin) for p in response.free()})
        own = task.search.refit(response, task.at)
        # so that no method has to explain a calibration that went astray
        return replace(task, at=(own if own.adequate else task.search.fit_elsewhere(own)).at)

    @cached_property
    def library(self) -> list[Effect]:
        """Return the effects that responses can show in this model."""
        shown = set(self.data.channels)
        return [e for e in self.problem.effects if e.fits(self.problem.inputs.model) and set(e.channels) & shown]

    @cached_property
    def residual(self) -> Projected:
        """Return the residual of the calibrated model without what its parameters can explain."""
        return project(self.response, self.data, self.at)

    @property
    def search(self) -> Search:
        """Return the least squares of the project, for fits from given starts."""
        return Search(self.data, self.data, tuple(self.library), THRESHOLDS, lambda _: None)

    def answer(self, found: Sequence[Found], ambiguous: Sequence[Sequence[str]] = ()) -> dict[str, Any]:
        """Return the answer in the form of gap.json, with what was found before the search."""
        free = [
            {"effect": n.effect, "parameters": {k: _value(v.value, v.lo, v.hi) for k, v in n.parameters.items()}}
            for n in named_effects((), None, self.problem.early, self.problem.in_slow, self.problem.inputs.model)  # type: ignore[arg-type]
        ]
        own = [
            {
                "effect": f.effect,
                "parameters": {
                    k: _value(v, v - CI95 * f.sds[k], v + CI95 * f.sds[k]) for k, v in f.values.items() if k in f.sds
                },
            }
            for f in found
        ]
        wrong = not judge(self.residual, THRESHOLDS.p_global).adequate(THRESHOLDS.p_global)
        verdict = "explained" if free or own else "ambiguous" if ambiguous else "unexplained"
        return {
            "verdict": verdict if free or own or ambiguous or wrong else "no_missing_effect",
            "named": [*free, *own],
            "ambiguous": [{"effects": list(names)} for names in ambiguous],
        }


def _value(value: float, lo: float, hi: float) -> Mapping[str, Any]:
    return {"value": float(value), "ci95": [float(lo), float(hi)]}


def standard_deviations(response: Augmented, data: Dataset, at: Values) -> dict[str, float]:
    """Return the standard deviation of every parameter of a response at values, noise, tolerance and priors taken
    together."""
    free = response.free()
    names = [p.name for p in free]
    unit = np.array([p.unit for p in free])
    rows = data.whitener(response.jacobian(data.f, names, at, data.channels)) * unit[:, None]
    prior = np.array([p.sd for p in free])
    P = np.diag(np.where(np.isfinite(prior), (unit / prior) ** 2, 0.0))
    cov = np.linalg.pinv(rows @ rows.T + P, hermitian=True)
    return dict(zip(names, (float(s) for s in np.sqrt(np.diag(cov)) * unit), strict=True))
