"""A model's uncertain parameters fitted to the responses of a unit: `accept model fit` and `accept.fit_model`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accept.analysis.given_responses import Given, responses_given
from accept.analysis.imported_response import import_response
from accept.base.console import say
from accept.gap import Responses, responses
from accept.models.model_file import OpenedModel, default_model, fit_record, open_model_file, write_model
from accept.units import LoadedUnit, loaded
from checks.errors import ModelError
from checks.fitting import F_HI, F_LO, ModelFit
from checks.model import frequency_grid
from specs.units import unit_of


@dataclass(frozen=True, eq=False)
class FittedModel(ModelFit):
    """A fit with the model file that it began with and the responses of the unit."""

    base: OpenedModel
    measured: Responses

    def __repr__(self) -> str:
        G = ", ".join(f"{c} {self.before[c].G:.2g} -> {gap.G:.2g}" for c, gap in self.after.items())
        end = f"; do not use the values: {self.doubt}" if self.doubt else ""
        return f"FittedModel({self.base.spec.name} to {self.measured.serial}; G, before -> after: {G}{end})"


def fit_unit(
    given: Path | LoadedUnit | Given,
    model: str | None = None,
    f_lo: float = F_LO,
    f_hi: float = F_HI,
    starts: int = 3,
) -> FittedModel:
    """Fit a model to the first realisation of a unit, or to responses, and compare it with the second if there are two.

    given: a unit's folder, a file of responses (`import_response`), or responses in memory.

    model: the built-in one of the unit's kind (of a strut for responses) if None, for a strut with uncertain modes, as
    for its misalignment, so that the two agree. f_lo, f_hi: band that is fitted [Hz]. starts: of the search. Raises
    UnitError, RecordError, SpecError, ModelError."""
    frequency_grid(f_lo, f_hi, 2)  # a range that no model has is refused before anything is read
    if starts < 1:
        raise ModelError(f"starts = {starts}: expected one or more")
    if isinstance(given, Path) and given.is_file():
        given = import_response(given)
    unit = given if isinstance(given, Given) else loaded(given)
    kind = unit.folder.kind if isinstance(unit, LoadedUnit) else unit.kind if isinstance(unit, Responses) else "strut"
    base = open_model_file(model or default_model(kind))
    if base.model.up_to_Hz < f_hi:
        f_hi = base.model.up_to_Hz
        say(f"fitted to {f_hi:.0f} Hz only: {base.spec.name} is valid up to there")
    if isinstance(unit, LoadedUnit):
        measured = responses(unit, base.model.tolerance, base.model.channels, f_lo, f_hi)
    else:
        measured = responses_given(unit, base.model.tolerance, f_lo, f_hi, base.model.channels)
    measured = measured.on_bench(base.model.learned)
    for words in measured.remarks:
        say(words)
    start = base.model
    if measured.payload_kg is not None:
        start = start.with_values({"bench.payload_kg": measured.payload_kg})
    if not start.sds:
        raise ModelError(f"{base.spec.name}: no value has an sd, so nothing is uncertain and nothing is fitted")
    say(f"{measured.serial}: fitting {len(start.sds)} parameters of {start.name} at {measured.first.f.size} bins")
    found = ModelFit.of(start, measured.first, measured.second, starts, say)
    return FittedModel(**vars(found), base=base, measured=measured)


def write_fitted(path: Path, fitted: FittedModel) -> None:
    """Write the fitted model as a file, with its covariance and where it came from."""
    fit, base = fitted.fit, fitted.base
    record = fit_record(
        fit,
        base,
        fitted.measured.serial,
        fitted.measured.inputs,
        G={c: g.G for c, g in fitted.after.items()},
        G_not_fitted={c: g.G for c, g in fitted.held_out.items()},
        doubt=fitted.doubt,
    )
    moved = {n: v for n, v in fitted.start.values.items() if v != base.model.values[n]}
    write_model(path, base.spec, moved | fit.at, fit.sds, damping=fitted.model.damping, record=record)


def document(fitted: FittedModel) -> dict[str, Any]:
    """Return the fit as a document for scripts."""
    fit = fitted.fit
    return {
        "serial": fitted.measured.serial,
        "model": fitted.base.spec.name,
        "damping": fitted.model.damping,
        "converged": fit.converged,
        "at_bound": list(fit.at_bound),
        "explains": fitted.explains,
        "doubt": fitted.doubt,
        "parameters": {
            n: {"value": v, "U": 2.0 * fit.sds[n], "unit": unit_of(n), "prior": p.prior, "prior_sd": p.sd}
            for (n, v), p in zip(fit.at.items(), fit.free, strict=True)
        },
        "gap_before": {c: gap.G for c, gap in fitted.before.items()},
        "gap_after": {c: gap.G for c, gap in fitted.after.items()},
        "gap_held_out": {c: gap.G for c, gap in fitted.held_out.items()},
        "constants_by_the_seed": dict(fitted.seed_constants),
        "constants": {n: {"value": c.value, "ci95": [c.lo, c.hi]} for n, c in fitted.constants.items()},
        "inputs": fitted.measured.inputs,
    }
