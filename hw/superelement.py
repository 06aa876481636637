"""Superelements from files: .mat with K, M and int_xyz, or the Ansys export (K and M as CSV, nodes as text)."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from checks.arrays import Array
from checks.errors import ModelError
from checks.model import Superelement, file_nodes
from hw.records.source import SIGNATURE, USERBLOCK_BYTES
from specs.files import read_bounded
from specs.model import ModelSpec
from specs.model_sections import ApaSuperelement, MatrixNames

NAMES = MatrixNames()
MAX_BYTES = 200_000_000  # of one file; the report's largest export is some 10 MB


def read_superelement(path: Path, names: MatrixNames = NAMES) -> Superelement:
    """Return the superelement from a .mat file that holds its matrices under these names, or from `NAME_K.CSV` with
    `NAME_M.CSV` and `NAME_out_nodes_3D.txt` beside it (the files of [STB] 7.3; `NAME_mat_K.CSV` goes with
    `NAME_out_nodes_3D.txt` too).

    Raises ModelError naming the file if it is missing or unreadable; the model that is built of the matrices checks
    that they are those of a free body.
    """
    if path.suffix.lower() == ".mat":
        K, M, xyz = _mat(path, names)
    else:
        file_K, file_M, file_nodes = files_of(path)
        K, M, xyz = _table(file_K), _table(file_M), _interface_nodes(file_nodes)
    return Superelement(K, M, xyz, name=path.name)


def matrices_of(spec: ModelSpec, folder: Path | None = None) -> Superelement | None:
    """Return the superelement of a model file with its nodes; None if it names none. folder: of its files, by default
    as the model file states. Raises ModelError."""
    if spec.apa_file is None or not isinstance(spec.apa, ApaSuperelement):
        return None
    file = spec.apa_file if folder is None else folder / spec.apa_file.name
    return replace(read_superelement(file, spec.apa.names), nodes=file_nodes(spec))


def _mat(path: Path, names: MatrixNames) -> tuple[Array, Array, Array]:
    from scipy import io  # loads slowly: only when wanted

    wanted = (names.K, names.M, names.int_xyz)
    try:
        raw = read_bounded(path, MAX_BYTES)
        if raw.startswith(SIGNATURE) or raw.startswith(SIGNATURE, USERBLOCK_BYTES):
            content = _hdf5(path, raw, wanted)
        else:
            content = io.loadmat(BytesIO(raw), variable_names=wanted)
    except FileNotFoundError as e:
        raise ModelError(f"{path}: no such file") from e
    except (OSError, ValueError, NotImplementedError, TypeError, KeyError) as e:
        raise ModelError(f"{path}: is not a readable .mat file: {e}") from e
    missing = [name for name in wanted if name not in content]
    if missing:
        others = "" if names != NAMES else "; other names are given by [apa] names"
        raise ModelError(
            f"{path}: has no {' and no '.join(missing)}; expected {names.K}, {names.M} and {names.int_xyz}{others}"
        )
    K, M, xyz = (_real(path, content[name]) for name in wanted)
    return K, M, xyz


def _hdf5(path: Path, raw: bytes, wanted: Sequence[str]) -> dict[str, Any]:
    """Return the matrices of a MATLAB 7.3 file, which stores columns first, sparse ones as their non-zero entries."""
    import h5py  # loads slowly: only when wanted
    from scipy.sparse import csc_array

    from hw.records.mat73 import vet_stored

    def numbers(node: Any) -> Any:
        vet_stored(path.name, node, len(raw))
        if node.nbytes > MAX_BYTES:
            raise ModelError(f"{path}: '{node.name}' has {node.nbytes} bytes; at most {MAX_BYTES} are read")
        return node[()]

    found: dict[str, Any] = {}
    with h5py.File(BytesIO(raw), "r") as file:
        for name in wanted:
            node = file.get(name)
            if isinstance(node, h5py.Group) and "MATLAB_sparse" in node.attrs:
                columns = numbers(node["jc"])
                shape = (int(node.attrs["MATLAB_sparse"]), columns.size - 1)
                found[name] = csc_array((numbers(node["data"]), numbers(node["ir"]), columns), shape=shape)
            elif isinstance(node, h5py.Dataset):
                found[name] = numbers(node).T
    return found


def _real(path: Path, values: Any) -> Array:
    if hasattr(values, "toarray"):  # sparse, as finite-element programs export
        if 8 * values.shape[0] * values.shape[1] > MAX_BYTES:
            raise ModelError(
                f"{path}: a sparse matrix of shape {values.shape} is too large; reduce it to its interfaces"
            )
        values = values.toarray()
    array = np.asarray(values)
    if array.dtype.kind not in "fiu" or array.ndim != 2:
        raise ModelError(f"{path}: expected a real matrix, got {array.dtype} of shape {array.shape}")
    return np.array(array, dtype=float)


def files_of(path: Path) -> list[Path]:
    """Return every file that `read_superelement` reads for this one."""
    if path.suffix.lower() == ".mat":
        return [path]
    stem = path.stem.removesuffix("_K").removesuffix("_M")
    tables = [path.with_name(f"{stem}_{which}{path.suffix}") for which in "KM"]
    return [*tables, path.with_name(f"{stem.removesuffix('_mat')}_out_nodes_3D.txt")]


def contents_of(path: Path) -> dict[str, bytes]:
    """Return file name -> bytes of every file that `read_superelement` reads for this one. Raises OSError."""
    return {file.name: read_bounded(file, MAX_BYTES) for file in files_of(path)}


def _table(path: Path) -> Array:
    try:
        return np.loadtxt(BytesIO(read_bounded(path, MAX_BYTES)), delimiter=",", ndmin=2)
    except OSError as e:
        raise ModelError(f"{path}: cannot be read: {e}") from e
    except ValueError as e:
        raise ModelError(f"{path}: is not a table of numbers separated by commas: {e}") from e


def _interface_nodes(path: Path) -> Array:
    """Return coordinates (p, 3) [m] of the nodes in the list `NODE DOF`, from the list `NODE X Y Z`, by number."""
    try:
        lines = iter(read_bounded(path, MAX_BYTES).decode("utf-8", "replace").splitlines())
    except OSError as e:
        raise ModelError(f"{path}: cannot be read: {e.strerror}") from e
    places: dict[int, list[float]] = {}
    kept: set[int] = set()
    for line in lines:
        words = line.split()
        if words[:4] == ["NODE", "X", "Y", "Z"]:
            places.update({int(row[0]): [float(v) for v in row[1:4]] for row in _numbered_rows(lines, path, 4)})
        elif words[:2] == ["NODE", "DOF"]:
            kept.update(int(row[0]) for row in _numbered_rows(lines, path, 2))
    absent = sorted(kept - places.keys())
    if not kept or absent:
        raise ModelError(
            f"{path}: expected lists 'NODE X Y Z' and 'NODE DOF'; nodes without a place: {absent or 'all'}"
        )
    return np.array([places[node] for node in sorted(kept)])


def _numbered_rows(lines: Iterator[str], path: Path, width: int) -> Iterator[list[str]]:
    """Yield rows of a list, each beginning with a node's number, up to the first line that does not."""
    for line in lines:
        row = line.split()
        if not row or not row[0].isdigit():
            return
        if len(row) < width:
            raise ModelError(f"{path}: '{line.strip()}' holds {len(row)} columns, expected {width}")
        yield row
