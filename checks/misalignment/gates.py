"""Gates of an estimated misalignment: the reasons why it is not an answer."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from checks import distributions as stats
from checks.arrays import Array, Complex
from checks.cause import Cause, Reason, because
from checks.fitting.agreement import all_priors, contradiction, outside_priors
from checks.fitting.common_drive import DrivenModel
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit
from checks.fitting.prior import prior_rows
from checks.misalignment.estimate_types import DX, DY, MisalignmentEstimate
from checks.misalignment.table import table_limits_um
from checks.model.free_apa_modes import ModalApa, mode_names
from checks.model.model import Model
from checks.model.structure.apa import ELASTIC_FROM

FALSE_ALARM = 1e-3  # of every kind of gate, over all its tests
KNOWN = 0.25  # relative noise of the ratio beyond which a bin is not informative
ZERO = 0.05  # a ratio below this is at a zero, where relative noise is meaningless
FROM_HZ, TO_HZ = 20.0, 650.0  # a misalignment shows from 60 Hz on, signs and gain below that; above, da fades
GAP, GAP_HZ = 0.05, 5.0  # of f, between informative bins: a mode could hide in a gap wider than both
PAYLOAD = "bench.payload_kg"
SENSOR_HZ, DEAD = (10.0, 30.0), 30.0  # below its zero; times too small for any scale
SIGNS_HZ = (10.0, 60.0)  # below the resonance, where de, da and the drive go together


def reason(found: MisalignmentEstimate) -> Reason | None:
    """Return the reason why the estimate is not an answer, or None if it is valid."""
    return next(_reasons(found), None)


def _reasons(found: MisalignmentEstimate) -> Iterator[Reason]:
    yield from _misfit(found)
    yield from outside_priors(found.fit)
    yield from _stiffness_off_prior(found)
    yield from all_priors(found.fit)
    if not found.fit.converged:
        yield because(Cause.NOT_CONVERGED, detail=found.fit.message)
    # An axis that the data do not determine at all has no edge, unless they determine neither.
    yield from (reason for axis, reason in list(_edges(found)) if axis not in found.unknown)
    for dx, dy in found.others:
        one, other = f"dx {found.dx.value:.0f}, dy {found.dy.value:.0f} um", f"dx {dx:.0f}, dy {dy:.0f} um"
        yield because(Cause.TWO_PLACES, places=f"{one} and {other}")


def data_reasons(model: Model, to_Hz: float, *given: Dataset | None) -> Iterator[Reason]:
    """Yield the reasons why data up to to_Hz do not determine the misalignment, whatever the model's parameters."""
    for data in given:
        if data is not None:
            yield from missing_bands(data, to_Hz)
            yield from _reversed_channels(data, model)


def ratio_noise(data: Dataset) -> Array:
    """Return (F,) noise of de - R da over the size of R da, R = de / da: channels de, da, correlated as they are."""
    de, da = data.H.T
    with np.errstate(divide="ignore", invalid="ignore"):
        R = de / da
        var = data.noise[:, 0] + np.abs(R) ** 2 * data.noise[:, 1] - 2.0 * (R.conj() * data.cov[:, 0, 1]).real
        relative = np.sqrt(np.maximum(var, 0.0)) / (np.maximum(np.abs(R), ZERO) * np.abs(da))
    return np.asarray(np.where(np.isfinite(relative), relative, np.inf))


def missing_bands(data: Dataset, to_Hz: float = TO_HZ) -> Iterator[Reason]:
    """Yield a reason if informative bins are too far apart anywhere."""
    f = data.f[ratio_noise(data) < KNOWN]
    f = np.concatenate([[FROM_HZ], f[(f > FROM_HZ) & (f < to_Hz)], [to_Hz]])
    wide = [f"{a:.4g} to {b:.4g} Hz" for a, b in pairwise(f) if b - a > max(GAP * a, GAP_HZ)]
    if wide:
        more = f" and {len(wide) - 2} more" if len(wide) > 2 else ""
        yield because(Cause.RATIO_UNKNOWN, record=data.name, bands=f"{', '.join(wide[:2])}{more}")


def _reversed_channels(data: Dataset, model: Model) -> Iterator[Reason]:
    low = data.band(*SIGNS_HZ)
    if not low.f.size:
        return
    if _is_opposed(low.H[:, 0], low.H[:, 1]):
        yield because(
            Cause.CHANNEL_REVERSED, record=data.name, channel="de", reference="da", found="against", expected="with"
        )
    elif _is_opposed(low.H[:, 1], model.frf(low.f, channels=("da",))[:, 0]):
        yield because(Cause.DRIVE_REVERSED, record=data.name)


def sensor_tells(data: Dataset, model: Model) -> bool:
    """Return whether Vs is recorded, alive and has the model's sign; a search with any other is long and useless."""
    if "Vs" not in data.channels:
        return False
    low = data.select(("Vs",)).band(*SENSOR_HZ)
    measured, modelled = low.H[:, 0], model.frf(low.f, channels=("Vs",))[:, 0]
    alive = bool(low.f.size) and float(np.median(np.abs(measured))) > float(np.median(np.abs(modelled))) / DEAD
    return alive and not _is_opposed(measured, modelled)


def _is_opposed(one: Complex, other: Complex) -> bool:
    return float(np.median((one * other.conj()).real)) < 0.0


def _misfit(found: MisalignmentEstimate) -> Iterator[Reason]:
    """Yield the worst band of a channel that noise, tolerance and the uncertainty of the fit do not explain."""
    worst = contradiction(DrivenModel(found.model), found.fit, found.repeat)
    if worst is not None:
        what = "data that were not fitted" if found.repeat is not None else "the fitted data"
        chance = f"p = {worst.p:.1g}" if worst.p > 0.0 else "p below 1e-300"
        at: dict[str, Any] = {"channel": worst.channel, "lo": worst.f_lo_Hz, "hi": worst.f_hi_Hz, "G": worst.G}
        yield because(Cause.MODEL_MISFIT, **at, data=what, chance=chance)


def _stiffness_off_prior(found: MisalignmentEstimate) -> Iterator[Reason]:
    """Yield a reason if the compliance of the APA along its axis is further off its prior than chance explains: an APA
    of uncertain modes can be softened until it rings with any payload at the measured frequency."""
    apa = found.model.apa
    if not isinstance(apa, ModalApa):
        return
    free, names = found.fit.free, set(mode_names(apa.modes)[0])
    at = np.array([i for i, p in enumerate(free) if p.name in names and np.isfinite(p.sd)], dtype=int)
    if not at.size:
        return
    slope = _compliance_slope(apa, found.fit, [free[i].name for i in at])
    with_prior = [i for i, p in enumerate(free) if np.isfinite(p.sd)]
    W = prior_rows(free, found.fit.joint)[np.ix_(with_prior, with_prior)]
    prior = np.linalg.inv(W.T @ W)[np.ix_(*[np.searchsorted(with_prior, at)] * 2)]
    off = float(slope @ (found.fit.values[at] - np.array([free[i].prior for i in at])))
    room = float(slope @ (prior - found.fit.cov[np.ix_(at, at)]) @ slope)
    if 2.0 * stats.norm.sf(abs(off) / np.sqrt(max(room, 1e-300))) < FALSE_ALARM:
        kg, how = found.fit.at.get(PAYLOAD, found.model.values[PAYLOAD]), "softer" if off > 0 else "stiffer"
        sd, percent = 100.0 * float(np.sqrt(slope @ prior @ slope)), 100.0 * abs(off)
        yield because(Cause.AXIAL_STIFFNESS, percent=percent, how=how, tolerance=sd, payload_kg=kg)


def _compliance_slope(apa: ModalApa, found: Fit, names: Sequence[str]) -> Array:
    """Return (m,) relative change of the APA's compliance along z by the factors on its modes' stiffness."""
    body = apa.body
    stretch = (body.top - body.bottom)[2, ELASTIC_FROM:] ** 2 / np.diag(body.K)[ELASTIC_FROM:]
    share = dict(zip(mode_names(apa.modes)[0], stretch / stretch.sum(), strict=True))
    return np.array([-share[n] / found.at[n] ** 2 for n in names])


def unobservable(found: MisalignmentEstimate) -> dict[str, Reason]:
    """Return the axis along which the data do not determine the misalignment, with the reason: its U is as wide as the
    table. The other axis is then known whatever the value along this one. Empty if they determine both, or neither."""
    wide = {axis: reason for axis, reason in _edges(found) if getattr(found, axis).U > _limits(found)[axis]}
    inside = not {DX, DY} & set(found.fit.at_bound)
    return wide if len(wide) == 1 and inside else {}


def _limits(found: MisalignmentEstimate) -> dict[str, float]:
    return dict(zip(("dx", "dy"), table_limits_um(found.model), strict=True))


def _edges(found: MisalignmentEstimate) -> Iterator[tuple[str, Reason]]:
    for axis, most in _limits(found).items():
        along = getattr(found, axis)
        if not abs(along.value) + along.U <= most:
            yield axis, because(Cause.TABLE_EDGE, parameter=axis, value=along.value, U=along.U, most=most)
