"""When an estimated misalignment is no answer, and why."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import stats

from checks.arrays import Array, Complex
from checks.cause import Cause, Reason, because
from checks.fitting.common_drive import Driven
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit
from checks.fitting.goodness import gaps
from checks.misalignment.estimate_types import MisalignmentEstimate
from checks.misalignment.table import DX_MAX_UM, DY_MAX_UM
from checks.model.free_apa_modes import names
from checks.model.model import Model
from specs.units import unit_of

FALSE_ALARM = 1e-3  # of every kind of gate, over all that it looks at
KNOWN = 0.25  # relative noise of the ratio beyond which a bin tells nothing
ZERO = 0.05  # a ratio below this is at a zero, where relative noise says nothing
FROM_HZ, TO_HZ = 20.0, 650.0  # a misalignment shows from 60 Hz on, but signs and gain are told below; above, da fades
GAP, GAP_HZ = 0.05, 5.0  # of f, between bins that tell something: wider than both a mode could hide in it
UNIFORM = 0.5  # standard deviation of a real part that lies anywhere in a circle, of its radius; see `whitener`
PAYLOAD = "bench.payload_kg"
BANDS_HZ = (10.0, 60.0, 120.0, 170.0, 240.0, 340.0, 480.0, 700.0, 1000.0)  # about the modes at 86, 190, 280, 400, 840


def reason(found: MisalignmentEstimate) -> Reason | None:
    """Why the estimate is no answer; None when it is one."""
    return next(_reasons(found), None)


def _reasons(found: MisalignmentEstimate) -> Iterator[Reason]:
    yield from _inadequate(found)
    if not found.fit.converged:
        yield because(Cause.NOT_CONVERGED, detail=found.fit.message)
    yield from _outside_priors(found.fit)
    yield from _softer(found)
    yield from _at_the_edge(found)
    for dx, dy in found.others:
        one, other = f"dx {found.dx.value:.0f}, dy {found.dy.value:.0f} um", f"dx {dx:.0f}, dy {dy:.0f} um"
        yield because(Cause.TWO_PLACES, places=f"{one} and {other}")


def data_reasons(model: Model, *given: Dataset | None) -> Iterator[Reason]:
    """Why data cannot tell, whatever the model's parameters."""
    for data in given:
        if data is not None:
            yield from missing_bands(data)
            yield from _turned(data, model)


def ratio_noise(data: Dataset) -> Array:
    """(F,) noise of de - R da over the size of R da, R = de / da: channels de, da, correlated as they are."""
    de, da = data.H.T
    with np.errstate(divide="ignore", invalid="ignore"):
        R = de / da
        var = data.noise[:, 0] + np.abs(R) ** 2 * data.noise[:, 1] - 2.0 * (R.conj() * data.cov[:, 0, 1]).real
        relative = np.sqrt(np.maximum(var, 0.0)) / (np.maximum(np.abs(R), ZERO) * np.abs(da))
    return np.asarray(np.where(np.isfinite(relative), relative, np.inf))


def missing_bands(data: Dataset) -> Iterator[Reason]:
    """A reason when bins that tell something are too far apart anywhere."""
    f = data.f[ratio_noise(data) < KNOWN]
    f = np.concatenate([[FROM_HZ], f[(f > FROM_HZ) & (f < TO_HZ)], [TO_HZ]])
    wide = [f"{a:.4g} to {b:.4g} Hz" for a, b in pairwise(f) if b - a > max(GAP * a, GAP_HZ)]
    if wide:
        more = f" and {len(wide) - 2} more" if len(wide) > 2 else ""
        yield because(Cause.RATIO_UNKNOWN, record=data.name, bands=f"{', '.join(wide[:2])}{more}")


def _turned(data: Dataset, model: Model) -> Iterator[Reason]:
    low = data.band(BANDS_HZ[0], BANDS_HZ[1])
    if not low.f.size:
        return
    if _apart(low.H[:, 0], low.H[:, 1]):
        yield because(
            Cause.CHANNEL_REVERSED, record=data.name, channel="de", reference="da", found="against", expected="with"
        )
    elif _apart(low.H[:, 1], model.frf(low.f, channels=("da",))[:, 0]):
        yield because(Cause.DRIVE_REVERSED, record=data.name)


def _apart(one: Complex, other: Complex) -> bool:
    return float(np.median((one * other.conj()).real)) < 0.0


def _inadequate(found: MisalignmentEstimate) -> Iterator[Reason]:
    """The worst band of a channel that noise, tolerance and what the fit leaves unknown do not explain."""
    data, fitted = (found.data, len(found.fit.names)) if found.repeat is None else (found.repeat, 0)
    response = Driven(found.model)
    H = response.frf(data.f, found.fit.at, data.channels)
    expected = replace(data.around(H), cov=data.cov + _unknown(found, data))
    bands = [(lo, hi) for lo, hi in pairwise(BANDS_HZ) if ((data.f >= lo) & (data.f < hi)).any()]
    worst: tuple[float, dict[str, Any]] = (FALSE_ALARM / (len(bands) * len(data.channels)), {})
    for lo, hi in bands:
        inside = (data.f >= lo) & (data.f < hi)
        lost = fitted // len(bands)
        for channel, gap in gaps([expected.at(inside)], [(data.H - H)[inside]], lost).items():
            if not gap.p > worst[0]:
                worst = gap.p, {"channel": channel, "lo": lo, "hi": hi, "G": gap.G}
    if worst[1]:
        what = "data that were not fitted" if found.repeat is not None else "the fitted data"
        chance = f"p = {worst[0]:.1g}" if worst[0] > 0.0 else "p below 1e-300"
        yield because(Cause.MODEL_MISFIT, **worst[1], data=what, chance=chance)


def _unknown(found: MisalignmentEstimate, data: Dataset) -> Complex:
    """(F, C, C) covariance of the prediction that the fit leaves."""
    J = Driven(found.model).jacobian(data.f, found.fit.names, found.fit.at, data.channels)
    return np.asarray(np.einsum("pfc,pq,qfd->fcd", J, found.fit.cov, J.conj()))


def _outside_priors(found: Fit) -> Iterator[Reason]:
    """The parameter that had to leave what the model file allows, taking the number of parameters into account."""
    known = [(p, found.at[p.name]) for p in found.free if np.isfinite(p.sd)]
    if not known:
        return
    p, value = max(known, key=lambda pair: abs(pair[1] - pair[0].prior) / pair[0].sd)
    z = (value - p.prior) / p.sd
    if 2.0 * len(known) * stats.norm.sf(abs(z)) < FALSE_ALARM:
        yield because(
            Cause.PRIOR_EXCEEDED,
            parameter=p.name,
            value=value,
            unit=unit_of(p.name),
            expected=p.prior,
            sd=p.sd,
            z=abs(z),
        )


def _softer(found: MisalignmentEstimate) -> Iterator[Reason]:
    """An APA of free modes can be softened until it rings with any payload where the measured one does. Its stiffness
    along its axis is right to the model's tolerance, or the payload is not what it is said to be."""
    free = {n: 1.0 for n in found.fit.names if n in names()}
    if not free:
        return
    at = {n: v for n, v in found.fit.at.items() if n in found.model.values}
    softer = _compliance(found.model, at) / _compliance(found.model, {**at, **free}) - 1.0
    tolerance = found.data.tolerance
    if 2.0 * stats.norm.sf(abs(softer) / (UNIFORM * tolerance)) < FALSE_ALARM:
        kg, how = found.fit.at.get(PAYLOAD, found.model.values[PAYLOAD]), "softer" if softer > 0 else "stiffer"
        percent = 100 * abs(softer)
        yield because(Cause.AXIAL_STIFFNESS, percent=percent, how=how, tolerance=100 * tolerance, payload_kg=kg)


def _compliance(model: Model, values: Mapping[str, float]) -> float:
    """[m/N] at the payload, along z."""
    system = model.system(values)
    row = system.outputs[system.channels.index("da")]
    return float(row @ np.linalg.solve(system.K, row))


def _at_the_edge(found: MisalignmentEstimate) -> Iterator[Reason]:
    for name, along, most in (("dx", found.dx, DX_MAX_UM), ("dy", found.dy, DY_MAX_UM)):
        if not abs(along.value) + along.U <= most:
            yield because(Cause.TABLE_EDGE, parameter=name, value=along.value, U=along.U, most=most)
