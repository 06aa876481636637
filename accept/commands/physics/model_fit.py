"""`accept model fit`: a model's uncertain parameters fitted to the responses of a unit."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from accept.base.atomic_files import check_places, write_atomic
from accept.base.console import clear_errors, say, stdout
from accept.base.exit_codes import Exit
from accept.base.progress import busy
from accept.commands.physics.model import draw_to, grid, model_for, whole
from accept.commands.physics.model_options import FitOptions, FitOutputs
from accept.gap.responses import Responses, responses
from accept.models.model_file import Opened, write_model
from accept.pictures.formats import format_of
from accept.units.loaded_unit import LoadedUnit, loaded
from checks.errors import ModelError
from checks.fitting.calibrate import calibrate
from checks.fitting.constants import Constant, fit_constants, seed_constants
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit, free_of
from checks.fitting.fit_panels import fit_panels
from checks.fitting.goodness import Gap, gaps
from checks.model.model import Model, frequencies
from checks.model.parameters import is_mode_factor
from checks.rounding import rounded, with_U
from specs.model_sections import FitRecord
from specs.units import unit_of

HELD = 0.9  # of its prior's sd: a factor on a mode that the data leave with more is not listed
AGREES = 1.1  # of G: 1 within the scatter of some hundred bins
COLUMNS = 3  # a row of panels per channel


@dataclass(frozen=True, eq=False)
class FittedModel:
    """A fit with what it began from. before, after: G of the model at its file's tolerance; held_out: G
    of the fitted model on the second realisation, empty without one."""

    base: Opened
    start: Model
    model: Model
    fit: Fit
    measured: Responses
    before: Mapping[str, Gap]
    after: Mapping[str, Gap]
    held_out: Mapping[str, Gap]
    seed_constants: Mapping[str, float]
    constants: Mapping[str, Constant]

    def __repr__(self) -> str:
        G = ", ".join(f"{c} {self.before[c].G:.2g} -> {gap.G:.2g}" for c, gap in self.after.items())
        end = "" if self.fit.converged else "; did not converge: do not use the values"
        return f"FittedModel({self.base.spec.name} to {self.measured.serial}; G, before -> after: {G}{end})"


@clear_errors
def run(
    unit: Annotated[Path, typer.Argument(help="Unit folder with a section [frf].")],
    wanted: FitOptions,
    outputs: FitOutputs,
) -> Exit:
    """Fit uncertain parameters to a unit's responses."""
    write, plot, as_json = outputs.places()
    check_places(write, plot, as_json)  # said before the search, not after
    if plot is not None:
        format_of(plot)
    with busy("fitting the model"):
        fitted = fit_unit(unit, wanted)
    _print(fitted)
    if write is not None:
        write_fitted(write, fitted)
        say(f"{write}: written")
    if plot is not None:
        draw_to(plot, list(pictures(fitted).values()), COLUMNS)
    if as_json is not None:
        write_atomic(as_json, json.dumps(document(fitted), indent=1, allow_nan=False).encode() + b"\n")
        say(f"{as_json}: written")
    return Exit.ACCEPTED if fitted.fit.converged else Exit.INCOMPLETE


def fit_unit(folder: Path | LoadedUnit, wanted: FitOptions) -> FittedModel:
    """A model fitted to the first realisation of a unit and compared with the second; without a name a strut is fitted
    with uncertain modes, as for its misalignment, so that the two agree. Raises UnitError, RecordError, SpecError,
    ModelError."""
    f_lo, f_hi = wanted.f_lo, wanted.f_hi
    grid(f_lo, f_hi, 2)  # a range that no model has is refused before anything is read
    frequencies([f_lo, f_hi])
    unit = loaded(folder)
    base = model_for(wanted.model, unit.folder.kind)
    if base.model.up_to_Hz < f_hi:
        f_hi = base.model.up_to_Hz
        say(f"fitted to {f_hi:.0f} Hz only: {base.spec.name} is valid up to there")
    measured = responses(unit, base.model.tolerance, base.model.channels, f_lo, f_hi)
    start = base.model
    if measured.payload_kg is not None:
        start = start.with_values({"bench.payload_kg": measured.payload_kg})
    if not start.sds:
        raise ModelError(f"{base.spec.name}: no value has an sd, so nothing is uncertain and nothing is fitted")
    say(f"{measured.serial}: fitting {len(start.sds)} parameters of {start.name} at {measured.first.f.size} bins")
    found = calibrate(start, measured.first, free_of(start), unseen=measured.second, starts=wanted.starts)
    at = found.model.with_values(found.fit.at)
    return FittedModel(
        base=base,
        start=start,
        model=at,
        fit=found.fit,
        measured=measured,
        before=_gaps(start, measured.first),
        after=found.fit.gaps_at(start.tolerance),
        held_out={} if measured.second is None else _gaps(at, measured.second),
        **_constants(at, measured.first),
    )


def _gaps(model: Model, data: Dataset) -> dict[str, Gap]:
    """G of a model on data that it was not fitted to."""
    H = model.frf(data.f, channels=data.channels)
    return gaps([data.around(H)], [data.H - H])


def _constants(model: Model, data: Dataset) -> dict[str, Any]:
    """ga and gs by the formulas of [STB] 4.2.1 and by least squares; empty where a band of theirs was not measured."""
    H = {c: data.H[:, i] for i, c in enumerate(data.channels)}
    variance = {c: data.noise[:, i] for i, c in enumerate(data.channels)}
    de = H.get("de", H["da"])
    try:
        by_seed = seed_constants(model, data.f, de, H["Vs"])
        return {"seed_constants": by_seed, "constants": fit_constants(model, data.f, H, variance)}
    except ModelError as e:
        say(f"no constants by the published formulas: {e}")
        return {"seed_constants": {}, "constants": {}}


def write_fitted(path: Path, fitted: FittedModel) -> None:
    """The fitted model as a file, with its covariance and where it came from."""
    fit, base = fitted.fit, fitted.base
    record = FitRecord(
        names=list(fit.names),
        covariance=[[float(v) for v in row] for row in fit.cov],
        model=base.spec.name,
        model_sha256=base.model.sha256,
        serial=fitted.measured.serial,
        inputs=fitted.measured.inputs,
        G={c: g.G for c, g in fitted.after.items()},
    )
    moved = {n: v for n, v in fitted.start.values.items() if v != base.model.values[n]}
    write_model(path, base.spec, moved | fit.at, fit.sds, damping=fitted.model.damping, record=record)


def pictures(fitted: FittedModel) -> dict[str, Any]:
    """Panels of every channel: magnitude, phase, residual."""
    data = fitted.fit.datasets[0]
    before, after = (m.frf(data.f, channels=data.channels) for m in (fitted.start, fitted.model))
    return dict(fit_panels(data, before, after))


def document(fitted: FittedModel) -> dict[str, Any]:
    """What a script reads."""
    fit = fitted.fit
    return {
        "serial": fitted.measured.serial,
        "model": fitted.base.spec.name,
        "damping": fitted.model.damping,
        "converged": fit.converged,
        "at_bound": list(fit.at_bound),
        "parameters": {
            n: {"value": v, "U": 2.0 * fit.sds[n], "unit": unit_of(n), "prior": p.prior, "prior_sd": p.sd}
            for (n, v), p in zip(fit.at.items(), fit.free, strict=True)
        },
        "gap_before": _plain(fitted.before),
        "gap_after": _plain(fitted.after),
        "gap_held_out": _plain(fitted.held_out),
        "constants_by_the_seed": dict(fitted.seed_constants),
        "constants": {n: {"value": c.value, "ci95": [c.lo, c.hi]} for n, c in fitted.constants.items()},
        "inputs": fitted.measured.inputs,
    }


def _plain(found: Mapping[str, Gap]) -> dict[str, float]:
    return {channel: gap.G for channel, gap in found.items()}


def _print(fitted: FittedModel) -> None:
    fit = fitted.fit
    rows = Table(whole("parameter"), "prior ± sd", "fitted ± U (k = 2)", "from the prior")
    told = [p for p in fit.free if not (is_mode_factor(p.name) and fit.sds[p.name] > HELD * p.sd)]
    for p in told:
        away = (fit.at[p.name] - p.prior) / p.sd
        bound = ", at its bound" if p.name in fit.at_bound else ""
        now = with_U(fit.at[p.name], 2 * fit.sds[p.name])
        rows.add_row(p.name, f"{p.prior:.5g} ± {p.sd:.2g}", now, f"{away:+.1f} sd{bound}")
    stdout.print(rows)
    if len(told) < len(fit.free):
        stdout.print(f"{len(fit.free) - len(told)} factors on modes are not listed: these data do not determine them")
    gap_rows = Table("channel", "G before", "G after", "G on the repeat")
    for channel, gap in fitted.after.items():
        held = fitted.held_out.get(channel)
        gap_rows.add_row(
            channel, f"{fitted.before[channel].G:.3g}", f"{gap.G:.3g}", "" if held is None else f"{held.G:.3g}"
        )
    stdout.print(gap_rows)
    for name, value in fitted.seed_constants.items():
        c = fitted.constants[name]
        half = (c.hi - c.lo) / 2
        by_formula = f"{rounded(value, half)} by the published formula"
        stdout.print(f"{name}: {by_formula}, {with_U(c.value, half)} by least squares (95 %, noise alone)")
    if fitted.model.damping != fitted.start.damping:
        stdout.print(f"damping '{fitted.model.damping}' fits better than '{fitted.start.damping}' and is used")
    if not fit.converged:
        say(f"accept: the fit did not converge; do not use the values above: {fit.message}")
    _print_agreement(fitted)


def _print_agreement(fitted: FittedModel) -> None:
    """The answer in one sentence: whether this model, fitted, explains the unit."""
    by_channel = fitted.held_out or fitted.after
    if not by_channel or not fitted.fit.converged:
        return
    worst = max(by_channel, key=lambda c: by_channel[c].G)
    where, serial = f"G of {worst} is {by_channel[worst].G:.2g}", fitted.measured.serial
    if by_channel[worst].G > AGREES:
        say(f"{where}: this model does not explain {serial}; run `accept gap` to find the cause")
    else:
        stdout.print(f"{fitted.base.spec.name}, fitted, explains {serial}: {where}, the largest; 1 or less agrees")
