"""Contradictions of a fitted response with the data, band by band, or the priors of its parameters."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from checks import distributions as stats
from checks.arrays import Complex
from checks.cause import Cause, Reason, because
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit
from checks.fitting.goodness import gaps
from checks.fitting.response import Response
from specs.units import unit_of

FALSE_ALARM = 1e-3  # over all bands and channels
BANDS_HZ = (0.0, 60.0, 120.0, 170.0, 240.0, 340.0, 480.0, 700.0, 1000.0, 1400.0, 5000.0)  # about a strut's modes


@dataclass(frozen=True)
class Contradiction:
    """The worst band of a channel: G and the chance p of a G so large."""

    channel: str
    f_lo_Hz: float
    f_hi_Hz: float
    G: float
    p: float


def contradiction(response: Response, found: Fit, unseen: Dataset | None = None) -> Contradiction | None:
    """Return the band and channel that noise, tolerance and the uncertainty of the fit explain least, unless chance
    explains them. unseen: data that were not fitted, judged instead, at the fit's tolerance."""
    if unseen is None:
        return _worst(found.datasets, found.residuals, found.effective_parameters)
    data = replace(unseen, tolerance=found.datasets[0].tolerance)
    H = response.frf(data.f, found.at, data.channels)
    expected = replace(data.around(H), cov=data.cov + predict(response, found, data))
    return _worst((expected,), (data.H - H,), 0.0)


def predict(response: Response, found: Fit, data: Dataset) -> Complex:
    """Return the covariance (F, C, C) of the prediction after the fit."""
    J = response.jacobian(data.f, found.names, found.at, data.channels)
    p, F, C = J.shape
    half = np.linalg.cholesky(found.cov + 1e-14 * np.diag(np.diag(found.cov))).T @ J.reshape(p, F * C)
    half = half.reshape(p, F, C)
    return np.asarray(np.einsum("pfc,pfd->fcd", half, half.conj()))


def outside_priors(found: Fit) -> Iterator[Reason]:
    """Yield each parameter that is outside its prior, its chance corrected for the number of parameters."""
    with_prior = [(p, found.at[p.name]) for p in found.free if np.isfinite(p.sd)]
    if not with_prior:
        return
    p, value = max(with_prior, key=lambda pair: abs(pair[1] - pair[0].prior) / pair[0].sd)
    z = (value - p.prior) / p.sd
    if 2.0 * len(with_prior) * stats.norm.sf(abs(z)) < FALSE_ALARM:
        yield because(
            Cause.PRIOR_EXCEEDED,
            parameter=p.name,
            value=value,
            unit=unit_of(p.name),
            expected=p.prior,
            sd=p.sd,
            z=abs(z),
        )


def all_priors(found: Fit) -> Iterator[Reason]:
    """Yield the contradiction that all parameters together are too far from their priors, for those determined."""
    chi2 = 2.0 * found.prior_cost
    if stats.chi2.sf(chi2, max(found.effective_parameters, 1.0)) < FALSE_ALARM:
        yield because(Cause.PRIORS_EXCEEDED, chi2=chi2, told=found.effective_parameters)


def _worst(sets: Sequence[Dataset], residuals: Sequence[Complex], fitted: float) -> Contradiction | None:
    bands = [(lo, hi) for lo, hi in pairwise(BANDS_HZ) if any(((s.f >= lo) & (s.f < hi)).any() for s in sets)]
    looked = sum(len(s.channels) for s in sets[:1]) * len(bands)
    worst = None
    for lo, hi in bands:
        inside = [(s.f >= lo) & (s.f < hi) for s in sets]
        parts = [s.at(i) for s, i in zip(sets, inside, strict=True)]
        left = [r[i] for r, i in zip(residuals, inside, strict=True)]
        for channel, gap in gaps(parts, left, fitted / len(bands)).items():
            if not gap.p > (FALSE_ALARM / looked if worst is None else worst.p):
                worst = Contradiction(channel, lo, hi, gap.G, gap.p)
    return worst
