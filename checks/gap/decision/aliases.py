"""Effects that the data cannot distinguish from calibrated parameters: then a name rests on priors only ([GAP] 6).

Exact ones are known: a payload mass is a common scaling of force constant, stiffness and damping; a constant cross-talk
into Vs, in the 2-DoF APA, is another sensor constant with another split of the force.
"""

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.dataset import Dataset
from checks.fitting.response import Response
from checks.gap.decision.gates import change_by
from checks.gap.modelling.effect import Effect, Values
from checks.gap.search.candidate import Candidate
from checks.model.channel_paths import LATENCIES
from checks.model.model import Model
from checks.model.parameters import is_mode_factor

COUNTS = 0.1  # of the largest share in the imitation: parameters with less are not listed


def imitation(full: Candidate, effect: Effect) -> tuple[str, ...]:
    """Return the calibrated parameters that together imitate the effect, the largest share first; none if the part that
    they cannot imitate is seen: beyond 2 delta lnL of two distinguishable explanations. The modes of an APA are limited
    to their scatter, the paths of a bench to their size, because without that limit they would imitate anything; the
    latencies of a learned bench to what its units have in common, because that was measured."""
    data, response = full.unseen, full.response
    less = response.without(effect.name)
    own = {t for p in effect.parameters for t in effect.targets(response.model, p.name)}  # is the effect itself
    names = tuple(p.name for p in less.free() if p.name in full.at and p.name not in own)
    change = by_its_size(effect, response.model, response, full.at, data)
    d = data.whitener(change_by(effect, response, full.at, data) if change is None else change)
    J = data.whitener(response.jacobian(data.f, names, full.at, data.channels)).T
    free = [p for p in less.free() if p.name in names]
    scatter = np.array([1.0 / p.sd if _is_limited(p.name, response.model) else 0.0 for p in free])
    J, d = np.vstack([J, np.diag(scatter)]), np.concatenate([d, np.zeros(len(names))])
    share, rest = shares(J, d)
    if float(rest @ rest) > full.table.two_delta_lnL:
        return ()
    ranked = sorted(zip(np.abs(share), names, strict=True), reverse=True)
    return tuple(n for s, n in ranked if s > COUNTS * ranked[0][0])


def _is_limited(name: str, model: Model) -> bool:
    """Return whether a parameter may imitate an effect only within its prior."""
    if name in LATENCIES.values():
        return model.learned is not None
    return is_mode_factor(name) or name.startswith("unnamed_path")


def any_lag_explains(full: Candidate, effect: Effect) -> bool:
    """Return whether a delay with a droop does as well in the place of a lag: exp(c1 s + c2 s^2 ...) with real c, as
    many as the effect has parameters. Then its order or its damping is not seen, because its corner lies too far above
    the band: a hold, a filter and a slow amplifier are one thing. Of a lag with one parameter that is the question
    whether it is a delay, which the search asks."""
    number = len(effect.parameters)
    if not effect.lags or number < 2:
        return False
    data, response = full.unseen, full.response
    H = response.frf(data.f, full.at, data.channels)
    factor = H / (H - change_by(effect, response, full.at, data))
    log = np.log(np.abs(factor)) + 1j * np.unwrap(np.angle(factor), axis=0)
    s = 2j * np.pi * data.f[:, None] / (2.0 * np.pi * data.f[-1])
    acts = np.array([c in effect.channels for c in data.channels])
    terms = np.array([H * s**n * acts for n in range(1, number + 1)])
    free = [p for p in response.free(full.at) if p.name in full.at]
    own = [p.name for p in free if p.name.split(".")[0] == effect.name]
    rest = [p for p in free if p.name not in own]
    J = response.jacobian(data.f, [p.name for p in rest], full.at, data.channels)
    priors = np.diag([1.0 / p.sd if np.isfinite(p.sd) else 0.0 for p in rest])

    def left(residual: Complex, columns: Complex) -> float:
        rows = data.whitener(np.concatenate([J, columns])).T
        rows = np.vstack([rows, np.hstack([priors, np.zeros((len(rest), len(columns)))])])
        _, over = shares(rows, np.concatenate([data.whitener(residual), np.zeros(len(rest))]))
        return float(over @ over)

    residual = data.H - H
    itself = left(residual, response.jacobian(data.f, own, full.at, data.channels))
    return left(residual + H * log * acts, terms) - itself < full.table.two_delta_lnL


def by_its_size(effect: Effect, model: Model, response: Response, at: Values, data: Dataset) -> Complex | None:
    """Return the change (F, C) of a response by an effect in it: its derivatives times its size, because an exact
    imitation turns with the parameters. None if its size is unknown."""
    off = effect.off(model)
    if not all(np.isfinite(v) for v in off.values()):
        return None
    names = [f"{effect.name}.{n}" for n in off]
    away = np.array([at[name] - nothing for name, nothing in zip(names, off.values(), strict=True)])
    return np.asarray(np.tensordot(away, response.jacobian(data.f, names, at, data.channels), 1))


def shares(J: Array, d: Array) -> tuple[Array, Array]:
    """Return the parts (p,) of d (n,) along the columns of J (n, p), in units of a column's length, and the rest (n,)
    of d."""
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    share, *_ = np.linalg.lstsq(J / size, d, rcond=1e-9)
    return share, np.asarray(d - (J / size) @ share)
