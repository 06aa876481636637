"""`accept lookup`: the precomputed tables of the misalignment."""

import time
from pathlib import Path
from typing import Annotated

from typer import Option

from accept.base.cluster.connect import connected
from accept.base.console import say
from accept.base.documents.listings import TableList, TableListed
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.commands.answer import Answer, File, Remark, command, table
from accept.commands.options import ClusterAt, JsonAnswer, ModelName
from accept.commands.physics.model import whole
from accept.models.lookup_cache import Plan, TableError, build, open_table, read_table
from accept.models.model_file import open_model
from checks.misalignment import table_limits_um
from checks.model import Model


@command
def run_build(
    model: ModelName = "strut-as-built",
    nx: Annotated[int, Option(min=3, max=999, help="Places along dx.")] = 41,
    ny: Annotated[int, Option(min=3, max=999, help="Places along dy.")] = 41,
    workers: Annotated[int | None, Option(min=1, help="Processes; without it as many as there are cores.")] = None,
    cluster: ClusterAt = None,
    force: Annotated[bool, Option("--force", help="Build it even if it is there.")] = False,
) -> Answer:
    """Tabulate the ratio de / da over dx, dy. Goes on where an earlier build was stopped."""
    opened = open_model(model)
    plan = Plan.of(opened, nx, ny)
    if not force:
        try:
            read_table(plan)
            return Answer(f"{plan.path}: there already, of model {opened.name} as it is")
        except FileNotFoundError:
            pass
        except TableError as e:
            say(f"{e}; rebuilding the table")
    start = time.perf_counter()
    with connected(cluster, say) as far:
        built = build(plan, say, workers, far)
    took = f"{nx} x {ny} places, {built.f.size} frequencies in {time.perf_counter() - start:.1f} s"
    return Answer(Remark(took), str(plan.path), *dz_words(opened))


@command
def run_info(
    model: Annotated[str | None, Option("--model", help="Say which table is this model's.")] = None,
    json: JsonAnswer = None,
) -> Answer:
    """Show the tables that are there, and whether they are whole."""
    folder = home() / "tables"
    files = sorted(folder.glob("*.npz"))
    if not files:
        words = Remark(f"{folder}: no table yet; `accept lookup build` makes one")
        return Answer(File(json, TableList(())), words, exit=Exit.INCOMPLETE if model else Exit.ACCEPTED)
    opened = None if model is None else open_model(model)
    states = [_about(path, opened) for path in files]
    listed = [TableListed(path.name, *state) for path, state in zip(files, states, strict=True)]
    titles = (whole("table"), "model", "dx x dy", f"of {opened.name} now" if opened else "state")
    return Answer(
        File(json, TableList(tuple(listed))),
        table(titles, ((path.name, *state) for path, state in zip(files, states, strict=True))),
        *(dz_words(opened) if opened else ()),
        exit=Exit.ACCEPTED if opened is None or any(s[-1] == "yes" for s in states) else Exit.INCOMPLETE,
    )


def _about(path: Path, model: Model | None) -> tuple[str, str, str]:
    of = size = "?"
    try:
        table = open_table(path)
        of, size = table.model, f"{table.dx.size} x {table.dy.size}"
        if model is None:
            return of, size, "whole"
        read_table(Plan.of(model, table.dx.size, table.dy.size), path)
    except TableError as e:
        return of, size, f"no: {str(e).removeprefix(f'{path}: ')}"
    return of, size, "yes"


def dz_words(model: Model) -> list[str]:
    """Return the effect of dz, which the table neglects because it is not observable ([STB] 6.2)."""
    import numpy as np

    f = np.geomspace(20.0, 700.0, 600)
    H = [model.frf(f, {"misalignment.dz_um": dz}, ("de", "da")) for dz in (0.0, 200.0)]
    flat, lifted = (h[:, 0] / h[:, 1] for h in H)
    apart = 100.0 * np.median(np.abs(lifted / flat - 1.0))
    dx, dy = table_limits_um(model)
    return [
        f"the table spans |dx| <= {dx:.4g} um and |dy| <= {dy:.4g} um; "
        f"dz = 200 um would change the ratio by {apart:.2g} % (median)"
    ]
