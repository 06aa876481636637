"""Tables of the misalignment on disk: built on all cores, a row at a time, refused if they belong to another model.

A table is `tables/MODEL-KEY.npz` in the bench's folder, KEY a hash of model and grid. While it is built, each finished
row lies whole in `MODEL-KEY.rows`, so that an interrupted build can be resumed. Tables are per machine: the same file
of matrices gives a frame model that differs in the last bit elsewhere."""

import hashlib
import io
import json
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accept.base.atomic_files import write_atomic
from accept.base.home import home
from accept.base.progress import steps
from accept.base.runner import GivenUp, Processes, Workers
from checks.arrays import Array
from checks.misalignment import MisalignmentTable
from checks.model import Model
from specs.errors import AcceptError

Row = NDArray[np.complex64]
Talk = Callable[[str], None]

LAYOUT = 1  # of the file; one of another layout is not read
SAME = 1e-3  # relative, of a tabulated ratio computed again; single precision at a sharp zero leaves 1e-5
UNREADABLE = (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile)
PARTS = ("dx", "dy", "f", "R")
ROWS_WORTH_A_PROCESS = 8  # fewer take less time than a process takes to start


class TableError(AcceptError, ValueError):
    """A table that must not be used; the text names the file and why."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A table to be: of which model, over which grid (X,), (Y,) [um], at f (F,) [Hz]."""

    model: Model
    dx: Array
    dy: Array
    f: Array

    @classmethod
    def of(cls, model: Model, nx: int = 41, ny: int = 41) -> "Plan":
        """Return the plan of a model's table. Raises ModelError for a grid that is too small or a model without encoder
        or joints."""
        return cls(*MisalignmentTable.axes(model, nx, ny))

    @property
    def sha256(self) -> str:
        """Return the hash of the model, its values and the grid."""
        values = json.dumps({n: repr(v) for n, v in sorted(self.model.values.items())})
        parts = [self.model.sha256.encode(), self.model.damping.encode(), values.encode()]
        parts += [a.tobytes() for a in (self.dx, self.dy, self.f)]
        return hashlib.sha256(b"\0".join(parts)).hexdigest()

    @property
    def path(self) -> Path:
        name = "".join(c if c.isalnum() or c in "._-" else "_" for c in self.model.name)
        return home() / "tables" / f"{name}-{self.sha256[:12]}.npz"

    @property
    def rows(self) -> Path:
        return self.path.with_suffix(".rows")

    def row(self, i: int) -> Row:
        return MisalignmentTable.row(self.model, float(self.dx[i]), self.dy, self.f)

    def agrees(self, i: int, row: Row) -> bool:
        """Return whether the first entry of a stored row equals this program's."""
        if row.shape != (self.dy.size, self.f.size) or not np.isfinite(row).all():
            return False
        first = MisalignmentTable.row(self.model, float(self.dx[i]), self.dy[:1], self.f)[0]
        return bool(np.median(np.abs(row[0] / first - 1.0)) < SAME)


def table_for(model: Model, say: Talk, nx: int = 41, ny: int = 41, workers: int | None = None) -> MisalignmentTable:
    """Return the stored table of a model, built first if it is missing or stale. Raises ModelError, OSError."""
    plan = Plan.of(model, nx, ny)
    try:
        return read_table(plan)
    except FileNotFoundError:
        say(f"{plan.model.name}: computing its table of misalignments (once)")
    except TableError as e:
        say(f"{e}; rebuilding the table")
    return build(plan, say, workers)


def build(plan: Plan, say: Talk, workers: int | None = None, cluster: Workers | None = None) -> MisalignmentTable:
    """Compute the missing rows, on all cores or a cluster, and store the table. Raises TableError if a cluster's row
    differs."""
    ready = dict(_stored_rows(plan))
    missing = [i for i in range(plan.dx.size) if i not in ready]
    if ready:
        say(f"{plan.model.name}: table of misalignments: {len(ready)} of {plan.dx.size} rows are there, going on")
    for i, row in steps(_rows_from(cluster, plan, missing, workers), "rows of the table", len(missing)):
        write_atomic(_row_file(plan, i), _bytes(row=row))
        ready[i] = row
        if len(ready) % 5 == 0 or len(ready) == plan.dx.size:
            say(f"{plan.model.name}: table of misalignments: {len(ready)} of {plan.dx.size} rows")
    table = MisalignmentTable(
        plan.dx, plan.dy, plan.f, np.array([ready[i] for i in range(plan.dx.size)]), plan.model.name, plan.sha256
    )
    write_table(plan.path, table)
    shutil.rmtree(plan.rows, ignore_errors=True)
    return table


def write_table(path: Path, table: MisalignmentTable) -> None:
    """Store a table with the hash of its content."""
    arrays = {name: getattr(table, name) for name in PARTS}
    about = {"layout": LAYOUT, "model": table.model, "sha256": table.sha256, "content": _content(arrays)}
    write_atomic(path, _bytes(**arrays, about=np.frombuffer(json.dumps(about).encode(), dtype=np.uint8)))


def read_table(plan: Plan, path: Path | None = None) -> MisalignmentTable:
    """Return the stored table of a plan. Raises FileNotFoundError; TableError if it is damaged, of another model, or
    differs from this program's."""
    path = path or plan.path
    table = open_table(path)
    if table.sha256 != plan.sha256:
        raise TableError(f"{path}: a table of model {table.model}, not of {plan.model.name} as it is now")
    for i in (0, plan.dx.size // 2, plan.dx.size - 1):
        if not plan.agrees(i, table.R[i]):
            raise TableError(f"{path}: stale, model {plan.model.name} gives other ratios at dx = {plan.dx[i]:g} um")
    return table


def open_table(path: Path) -> MisalignmentTable:
    """Return a stored table, whosever. Raises FileNotFoundError, or TableError for a damaged one."""
    if not path.exists():
        raise FileNotFoundError(2, "no such table", str(path))
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in PARTS}
            about: dict[str, Any] = json.loads(stored["about"].tobytes())
    except UNREADABLE as e:
        raise TableError(f"{path}: cannot be read as a table ({e})") from e
    if about.get("layout") != LAYOUT:
        raise TableError(f"{path}: layout {about.get('layout')}, expected {LAYOUT}")
    if about.get("content") != _content(arrays):
        raise TableError(f"{path}: its content was changed (the hash differs)")
    return MisalignmentTable(**arrays, model=str(about.get("model")), sha256=str(about.get("sha256")))


def _content(arrays: dict[str, Any]) -> str:
    digest = hashlib.sha256()
    for name in PARTS:
        digest.update(f"{name}{arrays[name].dtype}{arrays[name].shape}".encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()


def _bytes(**arrays: Any) -> bytes:
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def _row_file(plan: Plan, i: int) -> Path:
    return plan.rows / f"row_{i:03d}.npz"


def _stored_rows(plan: Plan) -> Iterator[tuple[int, Row]]:
    for i in range(plan.dx.size):
        path = _row_file(plan, i)
        if not path.exists():
            continue
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
                row = stored["row"]
        except UNREADABLE:
            continue
        if plan.agrees(i, row):
            yield i, row


def _rows_from(
    cluster: Workers | None, plan: Plan, missing: list[int], workers: int | None
) -> Iterator[tuple[int, Row]]:
    here = Processes(min(workers or os.cpu_count() or 1, len(missing) // ROWS_WORTH_A_PROCESS))
    for i, row in (cluster or here).unordered(plan.row, missing):
        if isinstance(row, GivenUp) or (cluster and not plan.agrees(i, row)):
            words = str(row) if isinstance(row, GivenUp) else "a worker computes it otherwise"
            way = "without a cluster" if cluster else "again, with fewer workers"
            raise TableError(f"{plan.path.name}: row {i} of dx: {words}; build the table {way}")
        yield i, row
