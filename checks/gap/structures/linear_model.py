"""Any linear structure M q'' + C q' + K q = b u with named points, as a model that can be fitted and searched.

    K = 5e4 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    dampers = modal_dampers(M := 5.0 * np.eye(2), K, ratio=0.01)
    at = {"floor 1": np.array([1.0, 0.0]), "floor 2": np.array([0.0, 1.0])}
    model = LinearModel(
        "frame", M, sum(dampers), K, drive=at["floor 1"], sensors=at, order=2,  # sensors of acceleration
        points={name: {"x": row} for name, row in at.items()}, shares={"legs": Share(0.05, K=K)},  # known to 5 %
    )
    model.frf(f)  # (F, 2) acceleration per unit of u

Parameters by flat name: `share.<name>` and `gain.<sensor>`, 1 as drawn, and those of attached elements
(`checks.model.structure.attached`). Places are the points, against ground, and every pair of them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.model.parameters import derivative_step, in_range, known
from checks.model.structure.attached import BETWEEN, DIRECTIONS, ELEMENT, PlaceReceptances, attached_of, row_of

Values = Mapping[str, float]
NOTHING: Values = {}


@dataclass(frozen=True, eq=False)
class Share:
    """A share of the matrices that is uncertain as a whole. sd: of the factor on it; M, C, K (n, n), None: nothing of
    that matrix."""

    sd: float
    M: Array | None = None
    C: Array | None = None
    K: Array | None = None

    def __post_init__(self) -> None:
        """Raise ModelError for a share of nothing."""
        if not self._powers:
            raise ModelError("a share has none of M, C and K")

    @property
    def _powers(self) -> list[tuple[int, Array]]:
        return [(k, A) for k, A in enumerate((self.K, self.C, self.M)) if A is not None]

    def stiffness(self, s: Complex) -> Complex:
        """Return its dynamic stiffness (F, n, n) at s (F,) [1/s]."""
        return np.asarray(sum(s[:, None, None] ** k * A for k, A in self._powers), dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class LinearModel:
    """M, C, K (n, n) in SI; drive (n,): force per unit of u; sensors: channel -> row (n,) of what it reads; points:
    name -> direction -> row (n,) of its motion; order: of the time derivative that the sensors read; shares: what is
    uncertain; families: name -> shares that may all be off by one factor; gain_sd: of a factor on every sensor, 0 if
    known; tolerance: relative model error too small to matter; changed: values other than as drawn."""

    name: str
    M: Array
    C: Array
    K: Array
    drive: Array
    sensors: Mapping[str, Array]
    points: Mapping[str, Mapping[str, Array]]
    order: int = 0
    shares: Mapping[str, Share] = field(default_factory=dict)
    families: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    gain_sd: float = 0.0
    tolerance: float = 0.0
    changed: Values = field(default_factory=dict)
    damping: str = "full"  # the form that C gives it: there is no other
    joint = None
    learned = None
    scatters = False

    def __post_init__(self) -> None:
        """Raise ModelError for matrices or rows of another size, a name with a dot, an unknown direction or share."""
        n = self.drive.size
        rows = {**self.sensors, **{f"{p} {d}": r for p, by in self.points.items() for d, r in by.items()}}
        shares = {f"{k} {a}": A for k, v in self.shares.items() for a in "MCK" if (A := getattr(v, a)) is not None}
        wrong = [a for a, A in {"M": self.M, "C": self.C, "K": self.K, **shares}.items() if A.shape != (n, n)]
        wrong += [name for name, row in rows.items() if row.shape != (n,)]
        if wrong:
            raise ModelError(f"{self.name}: {wrong[0]} has another size than the drive's {n} coordinates")
        if dotted := [name for name in (*self.sensors, *self.points, *self.shares) if "." in name]:
            raise ModelError(f"{self.name}: '{dotted[0]}' has a dot, which separates the parts of a parameter's name")
        if strange := [d for by in self.points.values() for d in by if d not in DIRECTIONS]:
            raise ModelError(f"{self.name}: no direction '{strange[0]}' (has: {', '.join(DIRECTIONS)})")
        known((f"share.{s}" for of in self.families.values() for s in of), self.values)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        return tuple(self.sensors)

    @cached_property
    def values(self) -> Values:
        """Return every parameter by flat name."""
        drawn = {f"share.{n}": 1.0 for n in self.shares} | {f"gain.{c}": 1.0 for c in self.sensors}
        return {**drawn, **self.changed}

    @cached_property
    def sds(self) -> Values:
        """Return the standard deviations of the uncertain parameters."""
        gains = {f"gain.{c}": self.gain_sd for c in self.sensors if self.gain_sd > 0.0}
        return {f"share.{n}": s.sd for n, s in self.shares.items()} | gains

    @property
    def elements(self) -> dict[str, float]:
        """Return the values of attached elements, by flat name."""
        return {n: v for n, v in self.changed.items() if n.startswith(ELEMENT)}

    def with_values(self, changes: Values) -> "LinearModel":
        """Return the same model at other values. Raises ModelError."""
        return replace(self, changed={**self.changed, **self._at(changes)})

    def with_elements(self, elements: Values) -> "LinearModel":
        """Return the same with these attached elements, and no others. Raises ModelError."""
        in_range(elements)
        bare = {n: v for n, v in self.changed.items() if not n.startswith(ELEMENT)}
        return replace(self, changed={**bare, **elements})

    def modal(self) -> None:
        """Raise ModelError: its damping has the form of C and no other."""
        raise ModelError(f"{self.name}: the damping is as C gives it")

    def frf(self, f: ArrayLike, changes: Values = NOTHING, channels: Iterable[str] | None = None) -> Complex:
        """Return the responses (F, C) at f (F,) [Hz]. Raises ModelError."""
        v, s = self._at(changes), _s(f)
        return np.asarray(self._solved(v, s, self.drive[:, None])[:, :, 0] @ self._sensors(v, channels).T) * self._by(s)

    def jacobian(
        self, f: ArrayLike, names: Iterable[str], changes: Values = NOTHING, channels: Iterable[str] | None = None
    ) -> Complex:
        """Return the derivatives (P, F, C) of `frf` by each named parameter."""
        v, s, names = self._at(changes), _s(f), tuple(names)
        known(names, v)
        sensors = self._sensors(v, channels)
        both = self._solved(v, s, np.column_stack([self.drive, sensors.T]))  # Z is symmetric
        x, y = both[:, :, 0], both[:, :, 1:] * self._by(s)[:, None]
        out = np.zeros((len(names), s.size, len(sensors)), dtype=np.complex128)
        for k, name in enumerate(names):
            kind, _, of = name.partition(".")
            if kind == "gain":
                one = [i for i, c in enumerate(self.channels if channels is None else channels) if c == of]
                out[k][:, one] = (x @ sensors[one].T) * self._by(s) / v[name]
            else:
                Zx = self.shares[of].stiffness(s) @ x[..., None] if kind == "share" else self._slope(name, v, s, x)
                out[k] = -np.einsum("fic,fi->fc", y, Zx[..., 0])
        return out

    def place_receptances(
        self, f: ArrayLike, changes: Values = NOTHING, channels: Iterable[str] | None = None
    ) -> PlaceReceptances:
        """Return the receptances between every place, drive and channels at f (F,) [Hz]."""
        v, s = self._at(changes), _s(f)
        G = np.moveaxis(self._solved(v, s, np.eye(self.drive.size)), 0, -1)
        seen = np.einsum("ci,ijf->jfc", self._sensors(v, channels), G) * self._by(s)
        return PlaceReceptances(self.places, G, np.tensordot(self.drive, G, 1), seen)

    @cached_property
    def places(self) -> dict[str, Array]:
        """Return the rows (6, n) that read the motion of every point, and of every point against another."""
        still = np.zeros(self.drive.size)
        points = {p: np.array([by.get(d, still) for d in DIRECTIONS]) for p, by in self.points.items()}
        pairs = {f"{p}{BETWEEN}{q}": points[p] - points[q] for p, q in combinations(points, 2)}
        return points | pairs

    def _at(self, changes: Values) -> dict[str, float]:
        known(changes, self.values)
        in_range(changes)
        return {**self.values, **changes}

    def _by(self, s: Complex) -> Complex:
        return (s**self.order)[:, None]

    def _sensors(self, v: Values, channels: Iterable[str] | None) -> Array:
        """Return the rows (C, n) that the channels read, with their gains."""
        wanted = self.channels if channels is None else tuple(channels)
        if unknown := [c for c in wanted if c not in self.sensors]:
            raise ModelError(f"{self.name}: no channel '{unknown[0]}' (it has {', '.join(self.channels)})")
        return np.array([v[f"gain.{c}"] * self.sensors[c] for c in wanted])

    def _solved(self, v: Values, s: Complex, loads: Array) -> Complex:
        """Return the motion (F, n, k) under loads (n, k)."""
        Z = Share(0.0, self.M, self.C, self.K).stiffness(s)
        for name, share in self.shares.items():
            Z += (v[f"share.{name}"] - 1.0) * share.stiffness(s)
        for e in attached_of(v):
            row = row_of(self.places, e.place, e.direction, e.point)
            Z += e.stiffness(s)[:, None, None] * np.outer(row, row)
        return np.asarray(np.linalg.solve(Z, loads[None].astype(complex)), dtype=np.complex128)

    def _slope(self, name: str, v: Values, s: Complex, x: Complex) -> Complex:
        """Return the derivative (F, n, 1), by a value of an element, of the force that moves it by x (F, n)."""
        h, head = derivative_step(name, v[name]), name.rpartition(".")[0]
        own = {n: x for n, x in v.items() if n.startswith(f"{head}.")}
        (above,), (below,) = (attached_of({**own, name: v[name] + d}) for d in (h, -h))
        row = row_of(self.places, above.place, above.direction, above.point)
        return np.outer((above.stiffness(s) - below.stiffness(s)) / (2.0 * h) * (x @ row), row)[..., None]


def modal_dampers(M: Array, K: Array, ratio: float) -> list[Array]:
    """Return the damping matrices (n, n) that give each real mode, by rising frequency, a damping ratio."""
    w2, P = linalg.eigh(K, M)
    return [2.0 * ratio * np.sqrt(w) * np.outer(M @ p, M @ p) for w, p in zip(np.maximum(w2, 0.0), P.T, strict=True)]


def _s(f: ArrayLike) -> Complex:
    return np.asarray(2j * np.pi * np.asarray(f, dtype=float), dtype=np.complex128)
