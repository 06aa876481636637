"""`accept compare`: a fleet of units side by side, and who does not belong.

The JSON: {"fleets": [{"kind", "serials", "too_few": [names], "outliers": {serial: [names]}, "compared": [{"name",
"unit", "curve": bool, "median", "scale", "members": [{"serial", "value", "U", "score", "p", "outlier"}]}]}]}. A curve's
value is its distance from the fleet's median in dB; its scale is that of the distances.
"""

from collections.abc import Sequence
from dataclasses import asdict
from json import dumps
from pathlib import Path
from typing import Annotated, Any

from rich.table import Column, Table
from rich.text import Text
from typer import Argument

from accept import units
from accept.base.console import say
from accept.base.documents.results import UnitRecord
from accept.base.progress import steps
from accept.batch import fleet_comparison
from accept.batch.fleet_comparison import Comparison, Fleet
from accept.batch.outliers import CHANCE, MIN_UNITS
from accept.commands.answer import SPACED, Answer, File, Remark, command, picture, table
from accept.commands.options import Json, Plot, SpecName
from accept.commands.units.batch import specs_for
from accept.judging import judge_unit, spec_for
from accept.pictures.labels import label_and_name
from accept.units import UnitError
from checks.acceptance import CHECKS
from checks.picture import Panel


@command
def run(
    units: Annotated[list[Path], Argument(help="Unit folders, or parents of unit folders.")],
    spec: SpecName = None,
    json: Json = None,
    plot: Plot = None,
) -> Answer:
    """Compare units and find which stand out. Robust scores of quantities and curves, overlays of curves."""
    results = measured(units, spec)
    kinds = dict.fromkeys(r.kind for r in results)
    alike = [[r for r in results if r.kind == kind] for kind in kinds]
    fleets = [fleet_comparison.compare(same) for same in alike]
    document = dumps({"fleets": [to_json(f) for f in fleets]}, indent=1, allow_nan=False)
    return Answer(
        *(part for fleet in fleets for part in _about(fleet)),
        File(json, document.encode()),
        picture(plot, lambda: _panels(alike, fleets), columns=2),
    )


def measured(paths: Sequence[Path], spec: str | None) -> list[UnitRecord]:
    """Return results by serial. Raises UnitError for one that cannot be read, a serial twice, fewer than two."""
    specs = specs_for(spec)
    folders = dict.fromkeys(folder.resolve() for path in paths for folder in units.find(path))
    results: dict[str, UnitRecord] = {}
    for folder in steps(folders, "units measured"):
        one = units.read(folder)
        if one.serial in results:
            raise UnitError(folder / units.UNIT_FILE, [f"serial = '{one.serial}' is also that of another unit"])
        results[one.serial] = judge_unit(one, spec_for(one, specs))
        say(f"[{len(results)}/{len(folders)}] {one.serial}: measured")
    if len(results) < 2:
        raise UnitError(paths[0], ["holds one unit only; a comparison needs two or more"])
    return [results[serial] for serial in sorted(results)]


def _about(found: Fleet) -> list[str | Table]:
    if not found.compared:
        few = f"{len(found.serials)} units of kind {found.kind} are too few to find outliers"
        return [f"{few}: {MIN_UNITS} with the same quantity are needed"]
    out = [f"{serial} stands out: {'; '.join(map(_label, names))}" for serial, names in found.outliers.items()]
    few = f"fewer than {MIN_UNITS} units have these quantities, too few to find outliers: {', '.join(found.too_few)}"
    return [
        _table(found),
        *(out or [f"no {found.kind} stands out: no chance is below {CHANCE:g}"]),
        Remark(few if found.too_few else ""),
    ]


def _label(name: str) -> str:
    """Return `Misalignment dy (dy_um)`; a curve by its name."""
    return label_and_name(name) if any(name in check.quantities for check in CHECKS.values()) else name


def _table(found: Fleet) -> Table:
    titles = ("no", "quantity", "median", "farthest", "value", "score", "chance")
    left = ("quantity", "farthest")
    columns = (Column(title, no_wrap=True, justify="left" if title in left else "right") for title in titles)
    rows = ((Text(str(number)), *_row(compared)) for number, compared in enumerate(found.compared, 1))
    title = f"{len(found.serials)} units of kind {found.kind}"
    return table(columns, rows, title=title, **SPACED)


def _row(c: Comparison) -> list[Text]:
    far = min(c.members, key=lambda m: (m.p, -abs(m.score)))
    style = "bold red" if far.outlier else ""
    name = f"{c.name} [dB apart]" if c.curve else _label(c.name)
    chance = f"{far.p:.2g}" if far.p >= 1e-6 else "< 1e-06"  # of a value so far out in a fleet without an odd unit
    cells = (far.serial, f"{far.value:.4g}", f"{far.score:.1f}", chance)
    return [Text(name), Text(f"{c.median:.4g}"), *(Text(cell, style=style) for cell in cells)]


def to_json(found: Fleet) -> dict[str, Any]:
    """See the module's docstring for the schema."""
    return asdict(found) | {"outliers": found.outliers}


def _panels(alike: Sequence[Sequence[UnitRecord]], fleets: Sequence[Fleet]) -> list[Panel]:
    from accept.pictures.reduce import reduce_panel

    pairs = zip(alike, fleets, strict=True)
    return [reduce_panel(panel) for same, fleet in pairs for panel in fleet_comparison.pictures(same, fleet)]
