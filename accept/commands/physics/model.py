"""`accept model`: the simulation's parameters, modes, responses, its fit to a unit, and sweeps of a parameter."""

import json as jsonlib
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
from rich.table import Column
from typer import Argument, Option

from accept.analysis.model_export import save_state_space
from accept.base.documents.listings import EffectList, EffectListed, ModelList, ModelListed, ModelShown, ParameterShown
from accept.commands.answer import Answer, File, Remark, command, picture, table
from accept.commands.options import JsonAnswer, ModelName
from accept.commands.physics.model_options import FrfOptions, ModesOptions, ParameterSweepOptions
from accept.models.model_file import OpenedModel, open_model_file
from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting import frf_panels
from checks.gap import EFFECTS
from checks.model import PUBLISHED_SWEEPS, Model, StateSpace, frequency_and_damping, frequency_grid, sweep_parameters
from hw.records import ResponseFile, csv_bytes
from specs.model import builtin_models
from specs.units import RESPONSE_UNITS, unit_of


@command
def show_list(json: JsonAnswer = None) -> Answer:
    """List the models that come with the program, and what each is."""
    listed = [
        ModelListed(name, path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# "))
        for name, path in builtin_models().items()
    ]
    wrapped = (textwrap.wrap(f"{one.name:<14}  {one.about}", 80, subsequent_indent=" " * 16) for one in listed)
    return Answer(File(json, ModelList(tuple(listed))), *(line for lines in wrapped for line in lines))


@command
def show(model: ModelName = "strut", json: JsonAnswer = None) -> Answer:
    """Show every parameter with its value, unit and prior."""
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
    rows = (
        (name, f"{value:.6g}", unit_of(name), "" if (sd := built.sds.get(name)) is None else f"{sd:.3g}")
        for name, value in built.values.items()
    )
    return Answer(
        File(json, shown),
        f"{built.name}: APA '{it.spec.apa.type}', damping {built.damping}, sha256 {it.spec.sha256}",
        None if it.spec.apa_file is None else f"superelement {it.spec.apa_file}",
        table((whole("parameter"), "value", "unit", "prior sd"), rows),
        f"tolerance {100 * built.tolerance:g} % of |H|; channels {', '.join(built.channels)}",
        *_effect_lines(it),
    )


def _effect_lines(it: OpenedModel) -> Iterator[str]:
    for effect in it.spec.effects:
        given = ", ".join(f"{key} = {value}" for key, value in effect.parameters.items())
        apart = " (not linear: not in the responses)" if effect.name in it.left_out else ""
        yield f"effect {effect.name}: {given}{apart}"


def _finite(value: float | None) -> float | None:
    return value if value is not None and np.isfinite(value) else None


@command
def modes(wanted: ModesOptions) -> Answer:
    """Compute poles, and the zeros of Vs, de and da, with their damping."""
    f_max = wanted.f_max
    if not 0.0 < f_max < np.inf:
        raise ModelError(f"--f-max {f_max:g}: expected a frequency above 0 Hz")
    model = open_model_file(wanted.model).model
    model = model.clamped() if wanted.clamped else model
    found = {"poles": _roots(model.poles(), f_max)}
    for channel in () if wanted.clamped else model.channels:
        found[f"zeros of {channel}"] = _roots(model.zeros(channel), f_max)
    tables = (
        table((title, "damping [%]"), ((f"{f:.2f} Hz", f"{100 * damping:.3f}") for f, damping in roots))
        for title, roots in found.items()
    )
    return Answer(File(wanted.json, {"model": model.name, "roots": found}, announced=True), *tables)


@command
def frf(wanted: FrfOptions) -> Answer:
    """Compute responses of Vs, de and da to Va. JSON on stdout if no file is named."""
    model = open_model_file(wanted.model).model
    f = frequency_grid(wanted.f_lo, wanted.f_hi, wanted.points)
    H = model.frf(f)
    columns = {"f": f}
    for i, c in enumerate(model.channels):
        columns |= {f"{c}_real": H[:, i].real, f"{c}_imag": H[:, i].imag}
    units = {"Va": "V", "Vs": "V", "de": "m", "da": "m"}
    document = {
        "model": model.name,
        "f_Hz": f.tolist(),
        "channels": {
            c: {"unit": RESPONSE_UNITS[c], "real": H[:, i].real.tolist(), "imag": H[:, i].imag.tolist()}
            for i, c in enumerate(model.channels)
        },
    }
    unknown = np.full(H.shape, np.nan)  # coherence and variance: nothing was measured
    written = ResponseFile(model.name, "", f, H, model.channels, "Va", units, unknown, unknown, said=model.name)
    files = wanted.json, wanted.csv, wanted.mat, wanted.uff, wanted.plot
    return Answer(
        File(wanted.csv, lambda: csv_bytes(columns), announced=True),
        File(wanted.mat, lambda: written.to_bytes(".mat"), announced=True),
        File(wanted.uff, lambda: written.to_bytes(".uff"), announced=True),
        picture(wanted.plot, lambda: list(frf_panels(f, H, model.channels).values()), columns=2, announced=True),
        File(wanted.json, document, announced=True),
        None if any(files) else jsonlib.dumps(document),
    )


@command
def export(
    out: Annotated[Path, Option(help="MATLAB file to write: A, B, C, D with names and units.")],
    model: ModelName = "strut",
) -> Answer:
    """Write the state space from Va to the channels as a MATLAB file."""
    found = StateSpace.of(open_model_file(model).model)
    save_state_space(found, out)
    return Answer(repr(found), Remark(f"{out}: written"))


@command
def run_sweep(
    what: Annotated[str, Argument(help="dy, dx, dz, kz, kR, cR, or a parameter's name.")], wanted: ParameterSweepOptions
) -> Answer:
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
    rows = (
        (f"{row.value:g}", _row_of(row.poles.f), _row_of(100.0 * row.poles.damping, ".2g"), _row_of(row.zeros.f))
        for row in swept.rows
    )
    found = {"model": model.name, "parameters": names, "channel": wanted.channel, "rows": swept.table}
    return Answer(
        table((moved, "poles [Hz]", "their damping [%]", f"zeros of {wanted.channel} [Hz]"), rows),
        File(wanted.json, found, announced=True),
        picture(wanted.plot, lambda: list(swept.panels), announced=True),
    )


def whole(title: str) -> Column:
    """Return a column whose words are never cut."""
    return Column(title, no_wrap=True, overflow="ignore")


def _both_joints(model: Model, name: str) -> tuple[str, ...]:
    """Return the names behind `joint.X`: both ends if the model has two joints."""
    ends = tuple(name.replace("joint.", f"joint.{end}.", 1) for end in ("bottom", "top"))
    return ends if name not in model.values and all(e in model.values for e in ends) else (name,)


def _roots(roots: np.ndarray, f_max: float) -> list[tuple[float, float]]:
    f, damping = frequency_and_damping(roots)
    return [(float(a), float(b)) for a, b in zip(f, damping, strict=True) if a <= f_max]


def _row_of(values: Array, how: str = ".1f") -> str:
    return "  ".join(format(float(v), how) for v in values)


WIDTH, INDENT = 80, "    "


@command
def effects(json: JsonAnswer = None) -> Answer:
    """List the effects that `accept gap` can name as missing. Where each shows, and the measurement that shows it
    alone."""
    listed = [
        EffectListed(
            effect.name, effect.title, tuple(p.name for p in effect.parameters), tuple(effect.channels), effect.sign,
            effect.experiment.value, tuple(effect.sources),
        )
        for effect in EFFECTS.values()
    ]  # fmt: skip
    lines = (line for name in EFFECTS for line in _about_effect(name))
    return Answer(File(json, EffectList(tuple(listed))), *lines)


def _about_effect(name: str) -> list[str]:
    effect = EFFECTS[name]
    parameters = ", ".join(p.name for p in effect.parameters)
    said = (
        f"shows on {', '.join(effect.channels)}: {effect.sign}",
        f"alone: {effect.experiment.value}",
        f"source: {', '.join(effect.sources)}",
    )
    wrapped = (textwrap.wrap(line, WIDTH, initial_indent=INDENT, subsequent_indent=2 * INDENT) for line in said)
    head = f"{effect.name}{f' ({parameters})' if parameters else ''}: {effect.title}"
    return [head, *(line for lines in wrapped for line in lines)]
