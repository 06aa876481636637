"""Measured responses of a three-storey frame that two other laboratories built from one drawing, and hidden effects put
upon them exactly. The data are read where they are and not part of the repository.

Southampton published complex accelerances per newton on floor 1. Swansea published magnitudes in dB to an unknown
reference: away from its resonances a response is real, and its sign changes at every resonance and antiresonance."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting import Dataset
from checks.gap.structures import LinearModel, Share, modal_dampers

MEASURED = Path(__file__).parents[3] / "shared" / "data" / "measured"
FLOORS = ("floor 1", "floor 2", "floor 3")
FLOOR_KG, LEG_N_PER_M = 5.201, 4 * 12 * 70e9 * (0.025 * 0.003**3 / 12) / 0.1533**3  # a storey has four legs
BAND = (5.5, 31.5)  # Hz: the three modes of the drawing, with a tenth below (softened) and above
# Legs: thickness to 0.05 mm and its cube; floors: the legs' own mass, bolts, sensors; sensors: their data sheets.
LEGS, MASSES, SENSORS, DAMPING = 0.05, 0.05, 0.03, 3.0
TOLERANCE = (
    0.12  # of three rigid floors on shear springs: what the frame as it stands leaves on each of its realisations
)
PAIRS = 8  # lines of a realisation are so far apart
SWANSEA_SIGNS = ((7.0, 14.8, 19.38, 27.8, 29.13), (7.0, 15.8, 19.38, 29.13), (7.0, 19.38, 29.13))
SWANSEA_PEAKS, BESIDE = (7.0, 19.38, 29.13), 0.4  # Hz
Z = Callable[[Complex], Complex]


def frame(factor: float = 1.0, gain_sd: float = SENSORS) -> LinearModel:
    """Return the frame of the drawing, driven at floor 1. factor: on the stiffness of all legs."""
    at = np.eye(3)
    storeys = [factor * LEG_N_PER_M * np.outer(r, r) for r in (at[0], at[1] - at[0], at[2] - at[1])]
    M, K = FLOOR_KG * at, np.sum(storeys, axis=0)
    dampers = modal_dampers(M, K, 0.002)
    shares = {f"legs {i + 1}": Share(LEGS, K=k) for i, k in enumerate(storeys)}
    shares |= {f"mass {i + 1}": Share(MASSES, M=FLOOR_KG * np.outer(r, r)) for i, r in enumerate(at)}
    shares |= {f"damping {i + 1}": Share(DAMPING, C=C) for i, C in enumerate(dampers)}
    rows = dict(zip(FLOORS, at, strict=True))
    return LinearModel(
        "three-storey frame",
        M,
        np.sum(dampers, axis=0),
        K,
        drive=at[0],
        sensors=rows,
        points={name: {"x": row} for name, row in rows.items()},
        order=2,
        shares=shares,
        families={"legs": ("legs 1", "legs 2", "legs 3"), "floors": ("mass 1", "mass 2", "mass 3")},
        gain_sd=gain_sd,
        tolerance=TOLERANCE,
    )


def southampton(which: int) -> tuple[Dataset, Dataset]:
    """Return two realisations of disjoint lines; which: 0 to 3, all of them disjoint."""
    rows = [[complex(x) for x in line.split(";")] for line in _text("southampton_complex.csv").splitlines()]
    every = np.array(rows)
    data = _dataset(every[:, 0].real, every[:, 1:], "Southampton")
    A, B = (data.at(slice(first, None, PAIRS)) for first in (which, which + PAIRS // 2))
    return A, B


def swansea(lines: Array | None = None) -> tuple[Dataset, Dataset]:
    """Return two realisations of disjoint lines, scaled so that floors 2 and 3 have the usual size of the drawing.
    lines: a permutation of the lines, every other one of the even ones."""
    every = np.loadtxt(MEASURED / "swansea_dB.csv", delimiter=",")
    f, size = every[:, 0], 10.0 ** (every[:, 1:] / 20.0)
    sign = np.array([[(-1.0) ** (1 + sum(x > np.array(at))) for at in SWANSEA_SIGNS] for x in f])
    data = _dataset(f, size * sign, "Swansea")
    data = data.at(np.all([np.abs(data.f - p) > BESIDE for p in SWANSEA_PEAKS], axis=0))
    ratio = np.exp(np.mean(np.log(np.abs(data.H / frame().frf(data.f)))[:, 1:]))
    data = replace(data, H=data.H / ratio, cov=data.cov / ratio**2)
    order = np.arange(data.f.size) if lines is None else lines
    A, B = (data.at(np.sort(order[first::2])) for first in (0, 1))
    return A, B


def with_element(data: Dataset, z: Z) -> Dataset:
    """Return the responses with an element of dynamic stiffness z(s) [N/m] on floor 1 against ground. Exact, because
    floor 1 was driven and measured: H / (1 + z G11) with the receptance G11."""
    s = 2j * np.pi * data.f
    factor = 1.0 / (1.0 + z(s) * data.H[:, 0] / s**2)
    return _times(data, np.repeat(factor[:, None], 3, axis=1))


def with_filter(data: Dataset, factors: Mapping[str, Z]) -> Dataset:
    """Return the responses with a factor on some channels."""
    s, one = 2j * np.pi * data.f, np.ones(data.f.size, complex)
    return _times(data, np.array([factors[c](s) if c in factors else one for c in data.channels]).T)


def exchanged(data: Dataset, a: int, b: int) -> Dataset:
    """Return the responses with two channels exchanged."""
    order = [b if i == a else a if i == b else i for i in range(3)]
    return replace(data, H=data.H[:, order], cov=data.cov[:, order][:, :, order])


def _times(data: Dataset, factor: Complex) -> Dataset:
    return replace(data, H=data.H * factor, cov=data.cov * factor[:, :, None] * factor[:, None].conj())


def _dataset(f: Array, H: Complex, name: str) -> Dataset:
    """Return the responses of the band. Their noise is the part of neighbouring lines that no parabola explains, its
    median over forty lines on either side: no coherence was published."""
    rough = np.abs(np.diff(H, 3, axis=0)) ** 2 / 20.0
    rough = np.pad(rough, ((1, 2), (0, 0)), mode="edge")
    noise = np.array([np.median(rough[max(0, i - 40) : i + 41], axis=0) / np.log(2.0) for i in range(f.size)])
    kept = (f >= BAND[0]) & (f <= BAND[1])
    cov = np.einsum("fc,cd->fcd", noise[kept], np.eye(3)).astype(complex)
    return Dataset(f[kept], H[kept].astype(complex), FLOORS, cov, np.full(int(kept.sum()), 40.0), TOLERANCE, name)


def _text(name: str) -> str:
    return (MEASURED / name).read_text()
