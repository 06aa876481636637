"""Where an element would have to attach, before what it is; then its kind, and values to begin a fit from.

An element of dynamic stiffness z along v changes every response by reach z / (1 + z own), at each frequency by itself
(`checks.model.structure.attached`). One unknown complex number for each frequency serves all channels. With
orthonormal columns A (n, 2F) along the reach, a residual r and an orthonormal basis Q of all that smooth errors and
calibrated parameters may do within their priors, the gain of the best number at every frequency is b' (I - B' B)^-1 b,
b = A' r, B = Q' A. A channel with any factor, or all of them with the same, is a rival on the same footing: another
reach.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg

from checks.arrays import Array, Complex
from checks.fitting.prior import prior_rows
from checks.gap.modelling.element import (
    JOINT,
    KINDS,
    RESONATOR,
    ROCKING,
    UNITS,
    Direction,
    GenericElement,
    directions,
    element,
    joint,
    kinds_at,
    rocking,
)
from checks.gap.search.screen import Score, peaks, screen
from checks.gap.statistics.projected_residual import Projected
from checks.model.structure.attached import PlaceReceptances

FOLLOWED = 8  # directions whose kinds are fitted: the best by any dynamic stiffness, and by a simple one
STEPS, LARGEST = 40, 2.0  # of Gauss and Newton; of the logarithm of a resonator's value
SETTLED = 0.05  # of twice the log-likelihood
POLES = 14  # where a resonator is looked for, beside the peaks of the residual
BEGUN = 2  # of these, that a fit begins from
RATIO = 0.03  # damping ratio there
CENTRE_MM = 4.0  # where the centre of a payload that rocks is begun beside the axis
EQUAL = 1e-6  # of a gain: of one channel alone every factor and every place explain the same

NOTHING_KNOWN: Mapping[str, float] = {}
Stiffness = Callable[[Array], tuple[Complex, Complex]]  # values (k,) -> dynamic stiffness (F,) and its slopes (k, F)


@dataclass(frozen=True, eq=False)
class Places:
    """The share of a projected residual that elements at every place, and factors on channels, could explain."""

    projected: Projected

    @cached_property
    def receptances(self) -> PlaceReceptances:
        p = self.projected
        return p.response.places(p.data.f, p.at, p.data.channels)

    @property
    def left(self) -> float:
        """Return the projected residual, squared: twice a log-likelihood."""
        return float(self.projected.left @ self.projected.left)

    @property
    def _s(self) -> Complex:
        return np.asarray(2j * np.pi * self.projected.data.f, dtype=np.complex128)

    def along(self, d: Direction) -> tuple[Complex, Complex]:
        """Return reach (F, C) and own (F,) of a direction."""
        return self.receptances.along(d.place, d.direction, (1e-3 * d.point[0], 1e-3 * d.point[1]))

    @cached_property
    def gains(self) -> dict[Direction, float]:
        """Return the gain in twice the log-likelihood of every direction with any dynamic stiffness."""
        return {d: self.gain_of(self.along(d)[0]) for d in directions(self.receptances.places)}

    @property
    def largest(self) -> float:
        """Return the largest of these gains."""
        return max(self.gains.values(), default=0.0)

    @property
    def in_signal_path(self) -> bool:
        """Return whether any factor on one channel explains as much as any dynamic stiffness at the best place: what is
        missing may then lie in the path of that channel. Each has one complex number for each frequency."""
        return max(self.factors.values()) > (1.0 - EQUAL) * self.largest

    @cached_property
    def factors(self) -> dict[str, float]:
        """Return the same gain for any factor on each channel."""
        H, channels = self.projected.modelled, self.projected.data.channels
        return {c: self.gain_of(H * one) for c, one in zip(channels, np.eye(H.shape[1]), strict=True)}

    @cached_property
    def ranked(self) -> list[Direction]:
        """Return every direction of a place at its best point, by falling gain."""
        best: dict[tuple[str, str], Direction] = {}
        for d in sorted(self.gains, key=lambda d: -self.gains[d]):
            best.setdefault((d.place, d.direction), d)
        return [*best.values()]

    def simple_gain(self, d: Direction) -> float:
        """Return the gain of a small spring, damper and mass along a direction. Any dynamic stiffness explains the
        noise at every frequency too, beside which places of a weak element do not differ."""
        reach, s = self.along(d)[0], self._s
        rows = self.projected.rows(np.array([reach * (s**power)[:, None] for power in range(3)]))
        Q, _ = np.linalg.qr((rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)).T)
        return float(np.sum((Q.T @ self.projected.left) ** 2))

    def gain_of(self, reach: Complex) -> float:
        """Return the gain of a change along reach (F, C) by any complex number at each frequency."""
        r, Q = self._residual
        a = self.projected.data.whitener.independent(np.array([reach, 1j * reach]))
        F, C = reach.shape
        A = a.reshape(2, C, F, 2)
        A = A / np.maximum(np.sqrt(np.einsum("kcfr,kcfr->kf", A, A)), 1e-300)[:, None, :, None]
        r, Q = r.reshape(C, F, 2), Q.reshape(C, F, 2, -1)
        b = np.einsum("kcfr,cfr->kf", A, r).ravel()
        B = np.einsum("kcfr,cfrp->pkf", A, Q).reshape(Q.shape[-1], -1)
        # b' (I - B' B)^-1 b by the smaller of the two matrices
        Bb, inner = B @ b, np.eye(len(B)) - B @ B.T
        return float(b @ b + Bb @ linalg.lstsq(inner, Bb, cond=1e-10)[0])

    @cached_property
    def _residual(self) -> tuple[Array, Array]:
        """Return the data's rows of the residual (n,) with all taken out that correlated errors and parameters may do,
        and those of a basis (n, p) of that."""
        p = self.projected
        data, response = p.data, p.response
        white = data.whitener
        free = response.free()
        names = [f.name for f in free]
        unit = np.array([f.unit for f in free])
        W = prior_rows(free, response.model.joint) * unit
        J = white.independent(response.jacobian(data.f, names, p.at, data.channels)).T * unit
        smooth = np.sqrt(1.0 / np.maximum(1.0 - white.shrink, 1e-12) ** 2 - 1.0)
        rows = white.independent(data.H - p.modelled)
        away = np.array([(p.at[f.name] - f.prior) / f.unit for f in free])
        N = np.block([
            [white.U * smooth, J],
            [np.eye(smooth.size), np.zeros((smooth.size, len(free)))],
            [np.zeros((len(W), smooth.size)), -W],
        ])  # fmt: skip
        N = N / np.maximum(np.linalg.norm(N, axis=0), 1e-300)
        Q, _ = np.linalg.qr(N)
        r = np.concatenate([rows, np.zeros(smooth.size), W @ away])
        n = rows.size
        return (r - Q @ (Q.T @ r))[:n], Q[:n]

    def scores(self, kinds: Sequence[str] = KINDS, known: Mapping[str, float] = NOTHING_KNOWN) -> list[Score]:
        """Return the best kinds at the best places, by falling gain. known: values at another place, to begin from
        too: what is large is not found from nothing."""
        out: dict[str, Score] = {}
        # on the axis too: the best point beside it with any stiffness may be one of no kind
        best = [*self.ranked[:FOLLOWED], *sorted(self.ranked, key=self.simple_gain, reverse=True)[:FOLLOWED]]
        for d in dict.fromkeys(e for b in best for e in (b, Direction(b.place, b.direction))):
            for kind in kinds_at(d.place, kinds):
                e = element(d.place, d.direction, kind)
                if self._has(e):
                    continue
                for values, gain in self._fits(e, d, known):
                    if e.name not in out or gain > out[e.name].gain:
                        out[e.name] = Score(e, gain, len(e.sizes), len(self.gains), (values,))
        if ROCKING in kinds:
            out |= {score.member.name: score for score in self._rocking(known)}
        ends = [joint(place) for place in ("bottom_joint", "top_joint") if place in self.receptances.places]
        for e in (e for e in ends if JOINT in kinds and not self._has(e)):  # small changes, each along its directions
            out[e.name] = replace(screen(self.projected, e), looked=len(self.gains))
        return sorted(out.values(), key=lambda s: -s.gain)

    def _rocking(self, known: Mapping[str, float]) -> Iterator[Score]:
        """Yield the scores of a payload that rocks, begun from what does the same along the axis: a mass that hangs,
        the share m e^2 / (J + m e^2) of the payload's mass m, whose centre lies e beside the axis."""
        places = self.receptances.places
        if "top_joint" not in places or places["payload"][3:].any() or self._has(rocking()):
            return
        fits = self._fits(element("payload", "z", RESONATOR), Direction("payload", "z"), known)
        hung, gain = max(fits, key=lambda fit: fit[1], default=({}, 0.0))
        m = self.projected.response.payload(self.projected.at)
        if not 0.0 < (share := hung.get("m_kg", 0.0) / m) < 1.0:
            return
        J = m * (1e-3 * CENTRE_MM) ** 2 * (1.0 - share) / share
        alike = {"J_kg_m2": J, "f_Hz": hung["f_Hz"] / np.sqrt(1.0 - share), "damping_ratio": hung["damping_ratio"]}
        at = [CENTRE_MM * np.array([np.cos(a), np.sin(a)]) for a in np.pi * np.array([0.25, 0.75, 1.25, 1.75])]
        starts = tuple(alike | {"x_mm": float(x), "y_mm": float(y), "read_share": 1.0} for x, y in at)
        for e in (rocking(), rocking(read=True)):
            own = tuple({q.name: q.inside(start[q.name]) for q in e.parameters} for start in starts)
            yield Score(e, gain, len(e.sizes), len(self.gains), own)

    def _has(self, e: GenericElement) -> bool:
        """Return whether the model has an element there already, whose values it calibrates."""
        return any(t in self.projected.response.model.elements for q in e.sizes for t in q.sets)

    def _fits(
        self, e: GenericElement, d: Direction, known: Mapping[str, float]
    ) -> Iterator[tuple[dict[str, float], float]]:
        """Yield values and gain of an element, its dynamic stiffness at its best from every start."""
        s = self._s
        reach, own = self.along(d)
        if not np.median(np.abs(own)) > 0.0:  # nothing moves there in this model
            return
        point = {"x_mm": d.point[0], "y_mm": d.point[1]}
        names = [q.name for q in e.parameters if q.name not in point]
        if e.kind != RESONATOR:
            powers = {"k": 0, "c": 1, "m": 2, "J": 2}
            basis = np.array([UNITS.get(n, 1.0) * s ** powers[n[0]] for n in names])
            size = 1.0 / (np.median(np.abs(own)) * np.abs(basis[:, s.size // 2]))
            starts = [np.zeros(len(names))]

            def z_of(x: Array) -> tuple[Complex, Complex]:
                return (x * size) @ basis, basis * size[:, None]
        else:
            size, starts = np.ones(3), self._poles(reach)

            def z_of(x: Array) -> tuple[Complex, Complex]:
                return _hung(s, x)

        if all(n in known for n in names):
            begin = np.array([known[n] for n in names])
            starts.append(np.log(np.abs(begin)) if e.kind == RESONATOR else begin / size)
        for start in starts:
            x, gain = self._descend(z_of, start, reach, own)
            values = np.exp(x) if e.kind == RESONATOR else x * size
            found = dict(zip(names, (float(v) for v in values), strict=True)) | point
            yield {q.name: q.inside(found[q.name]) for q in e.parameters}, gain

    def _poles(self, reach: Complex) -> list[Array]:
        """Return the logarithms of mass, frequency and damping ratio of small resonators that explain most."""
        p, s = self.projected, self._s
        f = np.unique([*np.geomspace(2.0 * p.data.f[0], 0.9 * p.data.f[-1], POLES), *peaks(p, p.data.channels)])
        tried = [np.log([1e-3, f_Hz, RATIO]) for f_Hz in f]
        rows = p.rows(np.array([reach * _hung(s, x)[0][:, None] for x in tried]))
        along = rows @ p.left
        gains = np.maximum(along, 0.0) ** 2 / np.maximum(np.einsum("ij,ij->i", rows, rows), 1e-300)
        share = gains / np.maximum(along, 1e-300)
        best = [k for k in np.argsort(-gains)[:BEGUN] if gains[k] > 0.0]
        return [tried[k] + [np.log(np.clip(share[k], 1e-2, 1e4)), 0.0, 0.0] for k in best]

    def _descend(self, z_of: Stiffness, x: Array, reach: Complex, own: Complex) -> tuple[Array, float]:
        """Return the values (k,) of a dynamic stiffness at their best from x, and the gain."""
        p = self.projected

        def at(x: Array) -> tuple[float, Array, Array]:
            z, slopes = z_of(x)
            known = 1.0 + z * own
            rows = p.rows(reach * np.concatenate([(z / known)[None], slopes / known**2])[:, :, None])
            r = p.left - rows[0]
            return float(r @ r), r, rows[1:]

        cost, r, J = at(x)
        damp = 1e-3
        for _ in range(STEPS):
            A = J @ J.T
            step = np.linalg.lstsq(A + damp * np.diag(np.diag(A)), J @ r, rcond=None)[0]
            new = at(x + np.clip(step, -LARGEST, LARGEST))
            if not new[0] < cost:
                damp *= 30.0
                continue
            x, damp, done = x + np.clip(step, -LARGEST, LARGEST), 0.2 * damp, cost - new[0] < SETTLED
            cost, r, J = new
            if done:
                break
        return x, float(p.left @ p.left) - cost


def _hung(s: Complex, x: Array) -> tuple[Complex, Complex]:
    """Return the dynamic stiffness (F,) of a mass on a spring and its slopes (3, F) by the logarithms x of mass,
    frequency and damping ratio."""
    m, f, ratio = np.exp(np.clip(x, -20.0, 10.0))
    w = 2.0 * np.pi * f
    link, own = w * w + 2.0 * ratio * w * s, s * s + 2.0 * ratio * w * s + w * w
    z, by_link = np.asarray(m * link * s * s / own), m * s * s * s * s / own**2
    return z, np.array([z, by_link * (2.0 * w * w + 2.0 * ratio * w * s), by_link * 2.0 * ratio * w * s])
