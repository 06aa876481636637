"""The free shell as it is built: every mode differs from its matrices in frequency and damping, and a shell that is not
symmetric lets them exchange energy. The matrices are the public finite-element ones, or those of beams where they are
absent.

The super-element's 156 elastic modes make up its whole stiffness, so what each of them lacks the statics lack as well.
"""

import io
import os
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import scipy.io
from numpy.typing import NDArray
from scipy import linalg

from validation.data.beam_shell import beam_shell

Array = NDArray[np.float64]

BESIDE = Path(__file__).parents[2] / "shared" / "data" / "superelements" / "APA300ML.mat"
FETCHED = Path(__file__).parent / "data" / "APA300ML.mat"  # by `python -m validation.data.fetch`
PUBLIC = BESIDE if BESIDE.exists() else FETCHED
BEAMS = Path(__file__).parent / "data" / "beams.mat"  # drawn where the public ones are absent
NODES = {"bottom": 0, "top": 1, "sensor_left": 2, "sensor_right": 3, "actuator_left": 4, "actuator_right": 6}
RIGID_BELOW_HZ = 20.0  # six modes of the free shell are rigid, 0..0.6 Hz by rounding; elastic ones start at 1.9 kHz
LOPSIDED_MODES = 40
LEAST = 0.2  # of a factor: none may be drawn through zero


@dataclass(frozen=True, eq=False)
class Built:
    """How one shell differs. frequency, damping (m,): factors of each elastic mode, rising from the lowest; coupling
    (m, m): of each pair, symmetric, in parts of the geometric mean of their stiffnesses, zero on the diagonal."""

    frequency: Array
    damping: Array
    coupling: Array


def matrices() -> Path:
    """Return the file of the shell's matrices: the public one or, if it is absent, that of the project's own shell."""
    return PUBLIC if PUBLIC.exists() else _drawn()


@cache
def _drawn() -> Path:
    """Write the matrices of the shell of beams, unless they are there, and return their file."""
    K, M, places = beam_shell()
    held = io.BytesIO()
    scipy.io.savemat(held, {"K": K, "M": M, "int_xyz": places})
    content = b"MATLAB 5.0 MAT-file: a shell of beams".ljust(116) + held.getvalue()[116:]  # no date: a hash tells it
    if not (BEAMS.exists() and BEAMS.read_bytes() == content):
        part = BEAMS.with_name(f"beams-{os.getpid()}.mat")
        part.write_bytes(content)
        part.replace(BEAMS)  # at once, as others read it
    return BEAMS


@cache
def _elastic() -> tuple[Array, Array, Array, Array, Array]:
    """Return the matrices K, M of the file, angular frequencies (m,), M V (n, m) and V (n, m) of the elastic modes."""
    content = scipy.io.loadmat(matrices())
    K, M = (np.asarray((content[k] + content[k].T) / 2, dtype=float) for k in "KM")
    w2, shapes = linalg.eigh(K, M)
    elastic = w2 > (2 * np.pi * RIGID_BELOW_HZ) ** 2
    return K, M, np.sqrt(w2[elastic]), M @ shapes[:, elastic], shapes[:, elastic]


def require_matrices() -> None:
    """End the program with what to do if the public matrices are not there: what is reported is about them."""
    if not PUBLIC.exists():
        sys.exit(
            f"{PUBLIC} is not there: `python -m validation.data.fetch` gets the matrices from their public repository"
        )


def count() -> int:
    """Return the number of elastic modes of the free shell."""
    return int(_elastic()[2].size)


def across(size: int) -> Array:
    """Return the row (size,) that reads the elongation of the sensor stack."""
    pick = np.zeros(size)
    pick[6 * NODES["sensor_right"]], pick[6 * NODES["sensor_left"]] = 1.0, -1.0
    return pick


def free_shell(built: Built | None) -> tuple[Array, Array, Array, float]:
    """Return K, M, C for a damping ratio of one (n, n), and the stiffness across the sensor stack, of a free shell."""
    K, M, omega, MV, V = _elastic()
    pick = across(K.shape[0]) @ V
    if built is None:
        return K, M, MV @ (2 * omega[:, None] * MV.T), float(1 / np.sum((pick / omega) ** 2))
    w = omega * built.frequency
    modal = w[:, None] * (np.eye(w.size) + built.coupling) * w
    C = MV @ ((2 * w * built.damping)[:, None] * MV.T)
    return MV @ modal @ MV.T, M, C, float(1 / (pick @ np.linalg.solve(modal, pick)))


def draw_shell(
    rng: np.random.Generator, frequency: float, damping: float, bias: Array | None = None, lopsided: float = 0.0
) -> Built:
    """Return a shell whose frequencies scatter by `frequency` and damping ratios by `damping` (1 sd, relative), about
    what is alike in its batch, bias (m,); lopsided: 1 sd of the coupling of each pair of the lowest modes."""
    m = count()
    common = np.ones(m) if bias is None else bias
    coupling = np.zeros((m, m))
    few = min(LOPSIDED_MODES, m)
    upper = np.triu(rng.normal(0.0, 1.0, (few, few)), 1)
    coupling[:few, :few] = lopsided * (upper + upper.T)
    return Built(
        frequency=np.maximum(common * (1 + frequency * rng.standard_normal(m)), LEAST),
        damping=np.maximum(1 + damping * rng.standard_normal(m), LEAST),
        coupling=coupling,
    )


def draw_bias(rng: np.random.Generator, sd: float) -> Array:
    """Return the error (m,) that all shells of a batch have in common: the model is wrong by it for each of them."""
    return np.maximum(1 + sd * rng.standard_normal(count()), LEAST)
