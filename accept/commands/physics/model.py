"""`accept model`: the simulation's parameters, modes, responses, its fit to a unit, and sweeps of a parameter."""

import json
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Column, Table

from accept.analysis.model_export import save_state_space
from accept.base.atomic_files import write_atomic
from accept.base.console import clear_errors, say, stdout, tell
from accept.base.documents.answers import check_answer, wants_text
from accept.base.documents.listings import ModelList, ModelListed, ModelShown, ParameterShown
from accept.base.exit_codes import Exit
from accept.commands.options import JsonAnswer, ModelName
from accept.commands.physics.model_options import FrfOptions, ModesOptions, ParameterSweepOptions
from accept.models.model_file import open_model_file
from accept.pictures.draw import PictureError, picture
from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting import frf_panels
from checks.model import PUBLISHED_SWEEPS, Model, frequency_and_damping, frequency_grid, state_space, sweep_parameters
from checks.picture import Panel
from hw.records import csv_bytes, frd_mat, frf_bytes
from specs.model import builtin_models
from specs.units import RESPONSE_UNITS, unit_of


@clear_errors
def show_list(json: JsonAnswer = None) -> Exit:
    """List the models that come with the program, and what each is."""
    check_answer(json)
    listed = [
        ModelListed(name, path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# "))
        for name, path in builtin_models().items()
    ]
    if wants_text(json, ModelList(tuple(listed))):
        for one in listed:
            tell(*textwrap.wrap(f"{one.name:<14}  {one.about}", 80, subsequent_indent=" " * 16))
    return Exit.ACCEPTED


@clear_errors
def show(model: ModelName = "strut", json: JsonAnswer = None) -> Exit:
    """Show every parameter with its value, unit and prior."""
    check_answer(json)
    it = open_model_file(model)
    built = it.model
    parameters = [
        ParameterShown(name, _finite(value), unit_of(name), name in built.sds, _finite(built.sds.get(name)))
        for name, value in built.values.items()
    ]
    effects = [{"name": effect.name, **effect.parameters} for effect in it.spec.effects]
    shown = ModelShown(
        built.name, it.spec.apa.type, it.spec.sha256, built.tolerance, tuple(built.channels), tuple(parameters),
        tuple(effects),
    )  # fmt: skip
    if not wants_text(json, shown):
        return Exit.ACCEPTED
    stdout.print(f"{built.name}: APA '{it.spec.apa.type}', damping {built.damping}, sha256 {it.spec.sha256}")
    if it.spec.apa_file is not None:
        stdout.print(f"superelement {it.spec.apa_file}", soft_wrap=True)
    rows = Table(whole("parameter"), "value", "unit", "prior sd")
    for parameter, value in built.values.items():
        sd = built.sds.get(parameter)
        rows.add_row(parameter, f"{value:.6g}", unit_of(parameter), "" if sd is None else f"{sd:.3g}")
    stdout.print(rows)
    stdout.print(f"tolerance {100 * built.tolerance:g} % of |H|; channels {', '.join(built.channels)}")
    for effect in it.spec.effects:
        given = ", ".join(f"{key} = {value}" for key, value in effect.parameters.items())
        apart = " (not linear: not in the responses)" if effect.name in it.left_out else ""
        stdout.print(f"effect {effect.name}: {given}{apart}")
    return Exit.ACCEPTED


def _finite(value: float | None) -> float | None:
    return value if value is not None and np.isfinite(value) else None


@clear_errors
def modes(wanted: ModesOptions) -> Exit:
    """Compute poles, and the zeros of Vs, de and da, with their damping."""
    f_max = wanted.f_max
    if not 0.0 < f_max < np.inf:
        raise ModelError(f"--f-max {f_max:g}: expected a frequency above 0 Hz")
    model = open_model_file(wanted.model).model
    model = model.clamped() if wanted.clamped else model
    found = {"poles": _roots(model.poles(), f_max)}
    for channel in () if wanted.clamped else model.channels:
        found[f"zeros of {channel}"] = _roots(model.zeros(channel), f_max)
    if wanted.json is not None:
        _write_json(wanted.json, {"model": model.name, "roots": found})
    for title, roots in found.items():
        rows = Table(title, "damping [%]")
        for f, damping in roots:
            rows.add_row(f"{f:.2f} Hz", f"{100 * damping:.3f}")
        stdout.print(rows)
    return Exit.ACCEPTED


@clear_errors
def frf(wanted: FrfOptions) -> Exit:
    """Compute responses of Vs, de and da to Va. JSON on stdout if no file is named."""
    model = open_model_file(wanted.model).model
    f = frequency_grid(wanted.f_lo, wanted.f_hi, wanted.points)
    H = model.frf(f)
    if wanted.csv is not None:
        columns = {"f": f}
        for i, c in enumerate(model.channels):
            columns |= {f"{c}_real": H[:, i].real, f"{c}_imag": H[:, i].imag}
        write_atomic(wanted.csv, csv_bytes(columns))
        say(f"{wanted.csv}: written")
    units = {"Va": "V", "Vs": "V", "de": "m", "da": "m"}
    if wanted.mat is not None:
        write_atomic(wanted.mat, frd_mat(f, H, model.channels, "Va", units, {"Notes": model.name}))
        say(f"{wanted.mat}: written")
    if wanted.uff is not None:
        write_atomic(wanted.uff, frf_bytes(f, H, model.channels, "Va", units))
        say(f"{wanted.uff}: written")
    if wanted.plot is not None:
        draw_to(wanted.plot, list(frf_panels(f, H, model.channels).values()), columns=2)  # magnitude beside phase
    document = {
        "model": model.name,
        "f_Hz": f.tolist(),
        "channels": {
            c: {"unit": RESPONSE_UNITS[c], "real": H[:, i].real.tolist(), "imag": H[:, i].imag.tolist()}
            for i, c in enumerate(model.channels)
        },
    }
    if wanted.json is not None:
        _write_json(wanted.json, document)
    elif not any((wanted.csv, wanted.mat, wanted.uff, wanted.plot)):
        tell(json.dumps(document))
    return Exit.ACCEPTED


@clear_errors
def export(
    out: Annotated[Path, typer.Option(help="MATLAB file to write: A, B, C, D with names and units.")],
    model: ModelName = "strut",
) -> Exit:
    """Write the state space from Va to the channels as a MATLAB file."""
    found = state_space(open_model_file(model).model)
    save_state_space(found, out)
    tell(repr(found))
    say(f"{out}: written")
    return Exit.ACCEPTED


@clear_errors
def run_sweep(
    what: Annotated[str, typer.Argument(help="dy, dx, dz, kz, kR, cR, or a parameter's name.")],
    wanted: ParameterSweepOptions,
) -> Exit:
    """Compute poles and zeros over a row of values. Without --value the published ones."""
    model = open_model_file(wanted.model).model
    names, usual = PUBLISHED_SWEEPS.get(what, ((what,), ()))
    names = tuple(each for n in names for each in _both_joints(model, n))
    chosen = tuple(wanted.values or ()) or usual
    if not chosen:
        raise ModelError(
            f"no values for '{what}': name them with --value (the published ones: {', '.join(PUBLISHED_SWEEPS)})"
        )
    swept = sweep_parameters(model, names, chosen, wanted.channel, frequency_grid(10.0, wanted.f_hi, 1500))
    moved = " =\n".join(names)  # each on a line of its own: the table stays narrow
    rows = Table(moved, "poles [Hz]", "their damping [%]", f"zeros of {wanted.channel} [Hz]")
    for row in swept.rows:
        rows.add_row(
            f"{row.value:g}", _row_of(row.poles.f), _row_of(100.0 * row.poles.damping, ".2g"), _row_of(row.zeros.f)
        )
    stdout.print(rows)
    if wanted.json is not None:
        found = {"model": model.name, "parameters": names, "channel": wanted.channel, "rows": swept.table}
        _write_json(wanted.json, found)
    if wanted.plot is not None:
        draw_to(wanted.plot, list(swept.panels))
    return Exit.ACCEPTED


def whole(title: str) -> Column:
    """Return a column whose words are never cut."""
    return Column(title, no_wrap=True, overflow="ignore")


def draw_to(path: Path, drawn: Sequence[Panel], columns: int | None = None) -> None:
    """Draw panels into a file of the format that its ending names."""
    size = None if columns is None else (90.0 * columns, 62.0 * -(-len(drawn) // columns))
    try:
        content = picture(drawn, path.suffix.lstrip(".").lower(), size, columns)
    except PictureError as e:
        raise ModelError(f"{path}: {e}") from e
    write_atomic(path, content)
    say(f"{path}: written")


def _both_joints(model: Model, name: str) -> tuple[str, ...]:
    """Return the names behind `joint.X`: both ends if the model has two joints."""
    ends = tuple(name.replace("joint.", f"joint.{end}.", 1) for end in ("bottom", "top"))
    return ends if name not in model.values and all(e in model.values for e in ends) else (name,)


def _roots(roots: np.ndarray, f_max: float) -> list[tuple[float, float]]:
    f, damping = frequency_and_damping(roots)
    return [(float(a), float(b)) for a, b in zip(f, damping, strict=True) if a <= f_max]


def _row_of(values: Array, how: str = ".1f") -> str:
    return "  ".join(format(float(v), how) for v in values)


def _write_json(path: Path, document: Mapping[str, Any]) -> None:
    write_atomic(path, json.dumps(document, indent=1, allow_nan=False).encode() + b"\n")
    say(f"{path}: written")
