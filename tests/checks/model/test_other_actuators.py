"""Matrices as other programs export them, and an actuator without amplification: a plain stack between its ends."""

from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
from scipy import sparse

from accept.models.model_file import open_model
from checks.errors import ModelError
from checks.model.structure.superelement import Nodes
from hw.superelement import read_superelement
from tests.checks.model.test_beam import STEEL, chain

NODES = Nodes(0, 3, (1, 2), (0, 3))  # of a stack: it pushes on its ends, a part of it senses
PLAIN = {"K", "M", "int_xyz"}


@pytest.fixture(scope="module")
def stack() -> dict[str, np.ndarray]:
    """A steel bar of 30 mm along z in three elements, with its nodes from bottom to top."""
    K, M, points = chain(3, length=0.03, turn=-np.pi / 2)
    return {"K": K, "M": M, "int_xyz": points - points.mean(axis=0)}


def written_73(path: Path, content: dict[str, np.ndarray], packed: bool) -> Path:
    with h5py.File(path, "w", userblock_size=512) as f:
        for name, x in content.items():
            if not packed or name == "int_xyz":
                f[name] = x.T
                continue
            columns = sparse.csc_array(x)
            group = f.create_group(name)
            group.attrs["MATLAB_sparse"] = np.uint64(x.shape[0])
            group["data"], group["ir"], group["jc"] = columns.data, columns.indices, columns.indptr
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    return path


def test_sparse_matrices_and_newer_files_give_the_same(tmp_path: Path, stack: dict[str, np.ndarray]) -> None:
    scipy.io.savemat(tmp_path / "plain.mat", stack)
    packed = {name: x if name == "int_xyz" else sparse.csc_matrix(x) for name, x in stack.items()}
    scipy.io.savemat(tmp_path / "sparse.mat", packed)
    first = read_superelement(tmp_path / "plain.mat")
    others = [tmp_path / "sparse.mat", written_73(tmp_path / "new.mat", stack, False)]
    others.append(written_73(tmp_path / "new_sparse.mat", stack, True))
    for path in others:
        found = read_superelement(path)
        for one, other in ((first.K, found.K), (first.M, found.M), (first.xyz, found.xyz)):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("newer", [False, True])
def test_matrices_under_other_names(tmp_path: Path, stack: dict[str, np.ndarray], newer: bool) -> None:
    """Same poles as under the usual names; a model that leaves the names out says how they are given."""
    names = {"K": "Kred", "M": "Mred", "int_xyz": "nodes"}
    other = {names[name]: x for name, x in stack.items()}
    if newer:
        written_73(tmp_path / "other.mat", other, packed=False)
    else:
        scipy.io.savemat(tmp_path / "other.mat", other)
    scipy.io.savemat(tmp_path / "stack.mat", stack)
    stated = 'names = { K = "Kred", M = "Mred", int_xyz = "nodes" }\n'
    usual, called = (stack_model(tmp_path, *of) for of in (("stack.mat", ""), ("other.mat", stated)))
    np.testing.assert_array_equal(open_model(usual).poles(), open_model(called).poles())
    with pytest.raises(ModelError, match=r"has no K and no M and no int_xyz.*\[apa\] names"):
        open_model(stack_model(tmp_path, "other.mat", ""))


def stack_model(folder: Path, file: str, names: str) -> Path:
    """Write the model file of the stack between a guide and a payload."""
    path = folder / f"stack-{len(list(folder.glob('*.toml')))}.toml"
    path.write_text(
        f'name = "stack"\n[apa]\ntype = "superelement"\nfile = "{file}"\n{names}'
        "nodes = { bottom = 1, top = 4, sensor = [2, 3], actuator = [1, 4] }\ndamping_ratio = 0.01\n"
        "[bench]\npayload_kg = 5.0\n[constants]\namplifier_gain = 20.0\nga_N_per_V = 1.0\ngs_V_per_m = 1e6\n"
    )
    return path


def test_a_newer_file_without_matrices_is_refused(tmp_path: Path) -> None:
    written_73(tmp_path / "x.mat", {"K": np.eye(12)}, False)
    with pytest.raises(ModelError, match="has no M and no int_xyz"):
        read_superelement(tmp_path / "x.mat")


def test_a_plain_stack_is_a_bar(tmp_path: Path, stack: dict[str, np.ndarray]) -> None:
    """Actuator nodes at the ends: it moves a payload as the stretch of the bar under its own force pair."""
    scipy.io.savemat(tmp_path / "stack.mat", stack)
    model = open_model(stack_model(tmp_path, "stack.mat", ""))
    poles = np.sort(np.abs(model.poles())) / (2 * np.pi)
    area = 4e-3 * 2e-3
    k = STEEL.E * area / 0.03
    assert poles[0] == pytest.approx(np.sqrt(k / (5.0 + STEEL.rho * area * 0.03 / 3.0)) / (2 * np.pi), rel=1e-3)
    H = model.frf([1.0])[0]
    assert np.abs(H[model.channels.index("da")]) == pytest.approx(20.0 / k, rel=1e-3)
