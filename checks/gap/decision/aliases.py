"""Effects that the data cannot tell from calibrated parameters: then a name rests on priors alone ([GAP] 6).

Exact ones are known: a payload mass is a common scaling of force constant, stiffness and damping; a constant cross-talk
into Vs, in the 2-DoF APA, is another sensor constant with another split of the force.
"""

import numpy as np

from checks.arrays import Complex
from checks.gap.modelling.effect import Effect
from checks.gap.search.forward import Candidate
from checks.model.parameters import is_mode_factor

COUNTS = 0.1  # of the largest share in the imitation: parameters with less are not said


def imitation(full: Candidate, effect: Effect) -> tuple[str, ...]:
    """Calibrated parameters that together do to the data what the effect does, the largest share first; none where what
    they cannot imitate is seen: beyond 2 delta lnL of two explanations that are told apart. The modes of an APA imitate
    within their scatter only: free of it, they would do anything."""
    data, response = full.unseen, full.response
    less = response.without(effect.name)
    own = {t for p in effect.parameters for t in effect.targets(response.model, p.name)}  # is the effect itself
    names = tuple(p.name for p in less.free() if p.name in full.at and p.name not in own)
    d = data.whitener(_change(full, effect))
    J = data.whitener(response.jacobian(data.f, names, full.at, data.channels)).T
    scatter = np.array([1.0 / p.sd if is_mode_factor(p.name) else 0.0 for p in less.free() if p.name in names])
    J, d = np.vstack([J, np.diag(scatter)]), np.concatenate([d, np.zeros(len(names))])
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    share, *_ = np.linalg.lstsq(J / size, d, rcond=1e-9)
    rest = d - (J / size) @ share
    if float(rest @ rest) > full.table.two_delta_lnL:
        return ()
    told = sorted(zip(np.abs(share), names, strict=True), reverse=True)
    return tuple(n for s, n in told if s > COUNTS * told[0][0])


def _change(full: Candidate, effect: Effect) -> Complex:
    """(F, C) of the response by the effect: its derivatives times its size, because an imitation that is exact turns
    with the parameters; as it is, where there is no size to take."""
    data, response = full.unseen, full.response
    off = effect.off(response.model)
    away = {n: full.at[f"{effect.name}.{n}"] - nothing for n, nothing in off.items()}
    if all(np.isfinite(v) for v in away.values()):
        D = response.jacobian(data.f, [f"{effect.name}.{n}" for n in away], full.at, data.channels)
        return np.asarray(np.tensordot(np.array(list(away.values())), D, 1))
    less = response.without(effect.name)
    at = {p.name: full.at.get(p.name, p.begin) for p in less.free()}
    return response.frf(data.f, full.at, data.channels) - less.frf(data.f, at, data.channels)
