"""`accept model fit`: a model's uncertain parameters fitted to the responses of a unit."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from rich.table import Table
from typer import Argument

from accept.analysis.model_fit import FittedModel, document, fit_unit, write_fitted
from accept.base.atomic_files import check_places
from accept.base.exit_codes import Exit
from accept.base.progress import busy
from accept.commands.answer import Answer, File, Remark, command, picture, table
from accept.commands.physics.model import whole
from accept.commands.physics.model_options import FitOptions, FitOutputs
from accept.pictures.formats import format_of
from checks.rounding import rounded, with_U

COLUMNS = 3  # a row of panels per channel


@command
def run(
    unit: Annotated[
        Path, Argument(help="Unit folder with a section [frf], or a file of responses (.uff, .mat, .csv, .json).")
    ],
    wanted: FitOptions,
    outputs: FitOutputs,
) -> Answer:
    """Fit uncertain parameters to a unit's responses."""
    write, plot, as_json = outputs.places()
    check_places(plot, toml=write, json=as_json)  # said before the search, not after
    if plot is not None:
        format_of(plot)
    with busy("fitting the model"):
        fitted = fit_unit(unit, wanted.model, wanted.f_lo, wanted.f_hi, wanted.starts)
    if write is not None:
        write_fitted(write, fitted)
    return Answer(
        *_summary(fitted),
        _agreement(fitted),
        Remark(f"{write}: written" if write else ""),
        picture(plot, lambda: list(fitted.panels.values()), COLUMNS, announced=True),
        File(as_json, document(fitted), announced=True),
        exit=Exit.ACCEPTED if fitted.explains else Exit.INCOMPLETE,
    )


def _summary(fitted: FittedModel) -> Iterator[str | Table]:
    fit = fitted.fit
    shown = fit.determined
    rows = []
    for p in shown:
        away = (fit.at[p.name] - p.prior) / p.sd
        bound = ", at its bound" if p.name in fit.at_bound else ""
        now = with_U(fit.at[p.name], 2 * fit.sds[p.name])
        rows.append((p.name, with_U(p.prior, 2 * p.sd), now, f"{away:+.1f} sd{bound}"))
    yield table((whole("parameter"), "prior ± U (k = 2)", "fitted ± U (k = 2)", "from the prior"), rows)
    if len(shown) < len(fit.free):
        yield f"{len(fit.free) - len(shown)} factors on modes are not listed: these data do not determine them"
    gaps = []
    for channel, gap in fitted.after.items():
        held = fitted.held_out.get(channel)
        repeat = "" if held is None else f"{held.G:.3g}"
        gaps.append((channel, f"{fitted.before[channel].G:.3g}", f"{gap.G:.3g}", repeat))
    yield table(("channel", "G before", "G after", "G on the repeat"), gaps)
    for name, value in fitted.seed_constants.items():
        c = fitted.constants[name]
        half = (c.hi - c.lo) / 2
        by_formula = f"{rounded(value, half)} by the published formula"
        yield f"{name}: {by_formula}, {with_U(c.value, half)} by least squares (95 %, noise alone)"
    if fitted.model.damping != fitted.start.damping:
        yield f"damping '{fitted.model.damping}' fits better than '{fitted.start.damping}' and is used"


def _agreement(fitted: FittedModel) -> str:
    """Return the answer in one sentence: whether this model, fitted, explains the unit."""
    channel, G = fitted.worst
    of, serial = f"{fitted.base.spec.name}, fitted,", fitted.measured.serial
    if fitted.doubt is None:
        return f"{of} explains {serial}: G of {channel} is {G:.2g}, the largest; 1 or less agrees"
    return Remark(f"accept: {of} does not explain {serial}, do not use the values above: {fitted.doubt}")
