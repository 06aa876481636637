"""Effects that the data cannot distinguish from calibrated parameters: then a name rests on priors only ([GAP] 6).

Exact ones are known: a payload mass is a common scaling of force constant, stiffness and damping; a constant cross-talk
into Vs, in the 2-DoF APA, is another sensor constant with another split of the force.
"""

import numpy as np

from checks.arrays import Complex
from checks.gap.decision.gates import change_by
from checks.gap.decision.prediction import Prediction, shares
from checks.gap.modelling.effect import Effect
from checks.gap.search.candidate import Candidate

COUNTS = 0.1  # of the largest share in the imitation: parameters with less are not listed


def imitation(full: Candidate, effect: Effect) -> tuple[str, ...]:
    """Return the calibrated parameters that together imitate the effect, the largest share first; none if the part that
    they cannot imitate is seen: beyond 2 delta lnL of two distinguishable explanations. The modes of an APA are limited
    to their scatter, the paths of a bench to their size, because without that limit they would imitate anything; the
    latencies of a learned bench to what its units have in common, because that was measured."""
    share, rest = Prediction.of(full, [full.unseen]).imitated(effect)
    if rest > full.table.two_delta_lnL:
        return ()
    ranked = sorted(((abs(s), n) for n, s in share.items()), reverse=True)
    return tuple(n for s, n in ranked if s > COUNTS * ranked[0][0])


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
    priors = [1.0 / p.sd if np.isfinite(p.sd) else 0.0 for p in rest]

    def left(residual: Complex, columns: Complex) -> float:
        limits = np.array([*priors, *[0.0] * len(columns)])
        return shares(data.whitener(np.concatenate([J, columns])).T, data.whitener(residual), limits)[1]

    residual = data.H - H
    itself = left(residual, response.jacobian(data.f, own, full.at, data.channels))
    return left(residual + H * log * acts, terms) - itself < full.table.two_delta_lnL
