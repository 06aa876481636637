"""Actuator and sensor constants from responses: by the formulas of [STB] 4.2.1, or least squares with intervals."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from checks import distributions as stats
from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.model.model import Model, Values, frequencies
from specs.bench import STATIC_HZ

GS_BAND_HZ = (400.0, 500.0)  # [STB] 4.2.3: above it, before the next
SEED_GS_AT_HZ = 1000.0
NOTHING: Values = {}


@dataclass(frozen=True)
class Constant:
    """An estimate with its standard uncertainty u and its 95 % interval, in the unit of its name. u_model: standard
    uncertainty from the model's uncertain values, mainly its modes; not part of u and interval."""

    name: str
    value: float
    u: float
    lo: float
    hi: float
    u_model: float = 0.0


def seed_constants(model: Model, f: Array, de: Complex, Vs: Complex) -> dict[str, float]:
    """Return ga and gs by formulas (4.3) and (4.6) and the script of [STB] 4.2.3; the model supplies its responses with
    both constants equal to one.

    f (F,) [Hz], de (F,) [m/V] and Vs (F,) [V/V] to Va. ga is the mean of |de| over 10..20 Hz by the static gain; gs is
    the mean of |Vs| over 400..500 Hz by ga and the gain at 1 kHz. The published script takes sizes only and writes both
    signs by hand; here the sign is that of the real part beside the model's. Raises ModelError for an empty band."""
    unit, gs_name = _unit_model(model)
    ga = _signed_size(f, de, unit, "de", STATIC_HZ, reference_Hz=0.0)
    both = _signed_size(f, Vs, unit, "Vs", GS_BAND_HZ, reference_Hz=SEED_GS_AT_HZ)
    return {"ga_N_per_V": ga, gs_name: both / ga}


def _signed_size(
    f: Array, H: Complex, unit: Model, channel: str, band: tuple[float, float], reference_Hz: float
) -> float:
    inside = _band(f, band)
    alike = np.sum(unit.frf(f[inside], channels=(channel,))[:, 0].conj() * H[inside]).real
    size = float(np.mean(np.abs(H[inside]))) / abs(unit.frf([reference_Hz], channels=(channel,))[0, 0])
    return float(np.copysign(size, alike))


def fit_constants(
    model: Model,
    f: ArrayLike,
    H: Mapping[str, Complex],
    variance: Mapping[str, Array],
    changes: Values = NOTHING,
    bands: Mapping[str, tuple[float, float]] | None = None,
) -> dict[str, Constant]:
    """Return ga and gs by weighted least squares on the complex responses, sign included, with their 95 % intervals.

    f (F,) [Hz]; H and variance: channel -> (F,) complex response and its variance (total of both parts). ga from de (da
    if there is no de) within `bands`, default 10..20 Hz; gs from Vs, 400..500 Hz. The scatter counts if it exceeds the
    stated variance (Birge ratio), and u(ga) enters u(gs). Raises ModelError for an empty band."""
    f = frequencies(f)
    limits = {"ga": STATIC_HZ, "gs": GS_BAND_HZ} | dict(bands or {})
    unit, gs_name = _unit_model(model.with_values(changes))
    channel = "de" if "de" in H else "da"
    ga, u_ga, n_ga = _real_gain(f, H[channel], variance[channel], unit, channel, limits["ga"])
    both, u_both, n_gs = _real_gain(f, H["Vs"], variance["Vs"], unit, "Vs", limits["gs"])
    u_gs = abs(both / ga) * float(np.hypot(u_both / both, u_ga / ga))
    moved, moved_both = (
        _moved_by_parameters(unit, f[_band(f, limits[k])], c) for k, c in (("ga", channel), ("gs", "Vs"))
    )
    of_ga, of_gs = float(np.linalg.norm(moved)), float(np.linalg.norm(moved_both - moved))
    return {
        "ga_N_per_V": _constant("ga_N_per_V", ga, u_ga, n_ga, abs(ga) * of_ga),
        gs_name: _constant(gs_name, both / ga, u_gs, n_gs, abs(both / ga) * of_gs),
    }


def _moved_by_parameters(unit: Model, f: Array, channel: str) -> Array:
    """Return the relative change (P,) of a channel's gain over f when each uncertain parameter of the model moves by
    its standard deviation, linearised. The constants themselves are excluded, because they are sought."""
    names = [name for name in unit.sds if not name.startswith("constants.")]
    x = unit.frf(f, channels=(channel,))[:, 0]
    slopes = unit.jacobian(f, names, channels=(channel,))[:, :, 0]
    share = (slopes @ x.conj()).real / float(np.sum(np.abs(x) ** 2))
    return np.asarray(share * np.array([unit.sds[name] for name in names]))


def _unit_model(model: Model) -> tuple[Model, str]:
    """Return the model with ga = gs = 1, and the name of its sensor constant."""
    gs_name = "gs_V_per_N" if "constants.gs_V_per_N" in model.values else "gs_V_per_m"
    return model.with_values({"constants.ga_N_per_V": 1.0, f"constants.{gs_name}": 1.0}), gs_name


def _band(f: Array, band: tuple[float, float]) -> np.ndarray:
    inside = (f > band[0]) & (f < band[1])
    if inside.sum() < 2:
        raise ModelError(f"{int(inside.sum())} frequencies within {band[0]:g}..{band[1]:g} Hz; expected two or more")
    return inside


def _real_gain(
    f: Array, H: Complex, variance: Array, unit: Model, channel: str, band: tuple[float, float]
) -> tuple[float, float, int]:
    """Return the real factor between measured and unit response, its standard uncertainty and the number of bins."""
    inside = _band(f, band)
    y, x = H[inside], unit.frf(f[inside], channels=(channel,))[:, 0]
    if not (np.isfinite(y).all() and np.isfinite(variance[inside]).all() and (variance[inside] > 0).all()):
        raise ModelError(
            f"{channel}: response or variance within {band[0]:g}..{band[1]:g} Hz is not finite and positive"
        )
    weight = 2.0 / variance[inside]  # of each part: the variance is that of both
    power = float(np.sum(weight * np.abs(x) ** 2))
    g = float(np.sum(weight * (x.conj() * y).real)) / power
    scatter = float(np.sum(weight * np.abs(y - g * x) ** 2)) / (2 * inside.sum() - 1)
    return g, float(np.sqrt(max(1.0, scatter) / power)), int(inside.sum())


def _constant(name: str, value: float, u: float, n: int, u_model: float) -> Constant:
    half = float(stats.t.ppf(0.975, 2 * n - 1)) * u
    return Constant(name, value, u, value - half, value + half, u_model)
