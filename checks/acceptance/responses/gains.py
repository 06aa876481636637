"""Quantities of the merged curves besides their resonances: gains, mass line, stiffness, constants, coherence."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from checks.acceptance.common.typed_value import stated_contribution, with_stated_accuracy
from checks.acceptance.responses.rules import (
    EXCUSED_POLE,
    EXCUSED_ZERO,
    OUTPUTS,
    STEPS,
    ResponseSettings,
    coherent_up_to,
)
from checks.cause import Cause, because
from checks.declare import Measured
from checks.errors import ModelError
from checks.fitting.constants import GS_BAND_HZ, Constant, fit_constants
from checks.model.build import build_model
from checks.model.model import Model
from checks.quantity import COVERAGE_FACTOR, Contribution, Quantity
from checks.record import motion_of
from checks.signals.spectral.frf import Frf
from specs.bench import STATIC_HZ
from specs.model import load_model
from specs.spec import CheckSpec
from specs.strict import SpecError

GAINS = {  # quantity -> channel, band [Hz] ([STB] 4.2.3), unit in the channel's unit
    "gain_de_um_per_V": ("de", STATIC_HZ, 1e-6),
    "gain_da_um_per_V": ("da", STATIC_HZ, 1e-6),
    "gain_Vs_V_per_V": ("Vs", GS_BAND_HZ, 1.0),
}
MEAN_SHARE = 0.25  # of the static gain, of a second resonance: anywhere from none to a half
MASS_BAND_HZ = (200.0, 350.0)
MASS_LINE_AT_HZ = 250.0
COHERENT = {f"coherent_{c}_Hz": c for c in OUTPUTS}
CONSTANTS = ("ga_N_per_V", "gs_V_per_m")
GAINS_OF = {"ga_N_per_V": (), "gs_V_per_m": ("Vs",)}  # channels whose gain they follow from, beside the motion's


def excused_bands(resonances_Hz: Sequence[float], zero_Hz: float) -> dict[str, list[tuple[float, float]]]:
    """Return the intervals [Hz] of each channel with low coherence: resonances, and for Vs its zero ([STB] 3.2.4)."""
    poles = [((1 - EXCUSED_POLE) * f, (1 + EXCUSED_POLE) * f) for f in resonances_Hz]
    zero = (1 - EXCUSED_ZERO) * zero_Hz, (1 + EXCUSED_ZERO) * zero_Hz
    return {c: [*poles, zero] if c == "Vs" else poles for c in OUTPUTS}


def mean_size(frf: Frf, channel: str, f_lo: float, f_hi: float) -> tuple[float, float] | None:
    """Return the mean of |H| over a band and its standard uncertainty; None if the band has no usable bin."""
    part = frf.select(channel).band(f_lo, f_hi)
    good = part.usable
    n = int(np.count_nonzero(good))
    if n == 0:
        return None
    independent = n / (1 + 2 * sum(part.correlation[: n - 1]))
    size = float(np.mean(np.abs(part.H[good, 0])))
    return size, math.sqrt(float(np.mean(part.var[good, 0])) / 2 / max(independent, 1.0))


def gain_quantities(frf: Frf, resonances_Hz: Sequence[float], spec: CheckSpec) -> list[Quantity]:
    """Return the static gain of de and da: their size over 10 to 20 Hz without the contribution of the axial resonance
    and of a second one beside it; and the mean size of Vs over 400 to 500 Hz."""
    return [_gain(name, frf, c, band, unit, resonances_Hz, spec) for name, (c, band, unit) in GAINS.items()]


def static_size(frf: Frf, channel: str, resonances_Hz: Sequence[float]) -> tuple[float, float] | None:
    """Return the size of a motion at 0 Hz and its standard uncertainty. One mode is 1 / (1 - (f / f0)^2) times as large
    at f, 1 to 5 percent from 10 to 20 Hz. The share of a second resonance is unknown but at most the first one's: a
    quarter is taken. None if the band has no usable bin."""
    per_Hz2 = [1.0 / f_Hz**2 for f_Hz in (resonances_Hz[0], resonances_Hz[-1])]
    factor = 1.0 - frf.f**2 * float(np.dot((1.0 - MEAN_SHARE, MEAN_SHARE), per_Hz2))
    return mean_size(
        replace(frf, H=frf.H * factor[:, None], cov=frf.cov * (factor**2)[:, None, None]), channel, *STATIC_HZ
    )


def _gain(
    name: str,
    frf: Frf,
    channel: str,
    band: tuple[float, float],
    unit: float,
    resonances_Hz: Sequence[float],
    spec: CheckSpec,
) -> Quantity:
    if channel not in frf.channels:
        return Quantity.missing(name, because(Cause.CHANNEL_MISSING, channel=channel))
    static = band == STATIC_HZ
    found = static_size(frf, channel, resonances_Hz) if static else mean_size(frf, channel, *band)
    if found is None:
        return Quantity.missing(name, because(Cause.BAND_NOT_MEASURED, channel=channel, lo=band[0], hi=band[1]))
    value, u = (x / unit for x in found)
    budget = [Contribution("scatter of the response", u, "A")]
    if static and len(resonances_Hz) > 1:
        spread = float(np.mean(np.square(STATIC_HZ))) * abs(1.0 / resonances_Hz[0] ** 2 - 1.0 / resonances_Hz[-1] ** 2)
        budget.append(Contribution("share of the second resonance", value * MEAN_SHARE * spread / math.sqrt(3)))
    return with_stated_accuracy(name, value, budget, stated_contribution(spec, value, name))


def payload(given: Measured | None, rules: ResponseSettings, spec: CheckSpec) -> tuple[float, Contribution | None, str]:
    """Return the payload [kg], its standard uncertainty if one is stated, and its source."""
    if given is not None and given.U is not None:
        return given.value, Contribution("payload, stated with it", given.U / COVERAGE_FACTOR), "stated with the unit"
    mass, words = (given.value, "stated with the unit") if given is not None else (rules.payload_kg, "as the spec says")
    return mass, stated_contribution(spec, mass, "payload_kg"), words


def check_against_payload(
    resonance: Quantity, given: Measured | None, rules: ResponseSettings, spec: CheckSpec
) -> Quantity:
    """Return the resonance. Its uncertainty is unknown, so that it cannot pass, if the payload is far from the limits'
    or the resonance would leave them with that payload: another payload means another stiffness. A resonance outside
    them still fails."""
    if given is None or resonance.reason is not None:
        return resonance
    ratio = given.value / rules.payload_kg
    if abs(ratio - 1) > rules.payload_within:
        return resonance.doubted(Cause.PAYLOAD_DIFFERS, expected=rules.payload_kg, value=given.value)
    limit = spec.limits.get(resonance.name)
    there_Hz = resonance.value * math.sqrt(ratio)
    if limit is None or limit.bounds[0] <= there_Hz <= limit.bounds[1]:
        return resonance
    return resonance.doubted(Cause.PAYLOAD_MOVES_IT, expected=rules.payload_kg, value=given.value, f_Hz=there_Hz)


def stiffness(resonance: Quantity, mass: float, u_mass: Contribution | None, words: str) -> Quantity:
    """Return k = m (2 pi f)^2 from payload and resonance ([STB] 3.1.7), without the strut's own moving mass."""
    name = "k_resonance_N_per_um"
    if resonance.reason is not None:
        return Quantity.missing(name, resonance.reason)
    k = mass * (2 * math.pi * resonance.value) ** 2 * 1e-6
    budget = [Contribution("resonance", 2 * k * math.hypot(*(c.u for c in resonance.budget)) / resonance.value, "A")]
    systematic = None if u_mass is None else Contribution(u_mass.source, k * u_mass.u / mass)
    return with_stated_accuracy(name, k, budget, systematic, note=f"payload {mass:g} kg, {words}")


def mass_line(
    frf: Frf, resonances_Hz: Sequence[float], mass: float, u_mass: Contribution | None, spec: CheckSpec
) -> list[Quantity]:
    """Return mass_line_um_per_V: |da| at 250 Hz if there were only the payload, from 200 to 350 Hz; and the payload
    that this line, the static gain and the resonance imply together ([STB] 3.2.3: the line of APA 7 is off).

    For one mode |da| (f^2 - f0^2) = g0 f0^2: the line measures force per volt over mass, whatever the stiffness. With a
    second mode the product falls with f towards its end, by the difference between its halves or, of a second
    resonance that carries at most as much as the first, by half of (f1^2 - f0^2) / (f^2 - f1^2)."""
    names = "mass_line_um_per_V", "mass_line_kg"
    resonance_Hz, last_Hz = resonances_Hz[0], resonances_Hz[-1]
    part = frf.select("da").band(*MASS_BAND_HZ)
    part = part.band(1.5 * resonance_Hz, math.inf)
    good = part.usable
    static = static_size(frf, "da", resonances_Hz)
    if np.count_nonzero(good) < 3 or static is None:
        why = because(Cause.BAND_NOT_MEASURED, channel="da", lo=MASS_BAND_HZ[0], hi=MASS_BAND_HZ[1])
        return [Quantity.missing(name, why) for name in names]
    each = np.abs(part.H[good, 0]) * (part.f[good] ** 2 - resonance_Hz**2)
    line, scatter = float(np.median(each)), float(np.std(each)) / math.sqrt(each.size)
    value = line / MASS_LINE_AT_HZ**2 * 1e6
    accuracy = stated_contribution(spec, value, names[0], "gain_da_um_per_V")
    lower, upper = np.array_split(each, 2)
    trend = abs(float(np.median(lower) - np.median(upper)))
    middle = float(np.median(part.f[good])) ** 2
    second = abs(last_Hz**2 - resonance_Hz**2) / 2 / (middle - last_Hz**2)
    along = {"scatter along the line": scatter / line, "trend along the line: other modes": trend / line}
    along |= {"second resonance": second / math.sqrt(3)} if len(resonances_Hz) > 1 else {}
    budget = [Contribution(words, value * share, "A") for words, share in along.items()]
    implied = mass * static[0] * resonance_Hz**2 / line
    more = [Contribution(words, implied * share, "A") for words, share in along.items()]
    more.append(Contribution("scatter of the static gain", implied * static[1] / static[0], "A"))
    payload_u = None if u_mass is None else Contribution(u_mass.source, implied * u_mass.u / mass)
    note = f"{implied / mass:.3f} times the payload: 1 where one mode carries the response"
    return [
        with_stated_accuracy(names[0], value, budget, accuracy),
        with_stated_accuracy(names[1], implied, more, payload_u, note=note),
    ]


def coherence_quantities(
    frf: Frf, allowed: dict[str, list[tuple[float, float]]], rules: ResponseSettings
) -> list[Quantity]:
    """Return the highest coherent frequency of each channel: the last coherent step; the end is below the next."""
    out = []
    for name, c in COHERENT.items():
        if c not in frf.channels:
            out.append(Quantity.missing(name, because(Cause.CHANNEL_MISSING, channel=c)))
            continue
        top = coherent_up_to(frf, c, allowed[c], rules)
        if top is None:
            out.append(Quantity.missing(name, because(Cause.NOT_COHERENT, channel=c, f_Hz=rules.coherence_Hz[c][0])))
            continue
        step = top * math.log(float(frf.f[-1]) / rules.coherence_Hz[c][0]) / STEPS
        out.append(Quantity.of(name, top, Contribution("steps of the search", step / math.sqrt(3))))
    return out


def constants(frf: Frf, mass: float, rules: ResponseSettings, spec: CheckSpec) -> list[Quantity]:
    """Return ga and gs in the bands of [STB] 4.2.3 on the spec's model; without a value if it has none."""
    if not rules.model:
        return [Quantity.missing(name, Cause.MODEL_NOT_SET) for name in CONSTANTS]
    try:
        model = _model(rules.model)
        H = {c: frf.H[:, i] for i, c in enumerate(frf.channels)}
        variance = {c: np.where(np.isfinite(v), v, 0.0) for c, v in zip(frf.channels, frf.var.T, strict=True)}
        found = fit_constants(model, frf.f, H, variance, {"bench.payload_kg": mass})
    except (ModelError, SpecError) as e:
        return [
            Quantity.missing(name, because(Cause.MODEL_UNUSABLE, model=rules.model, detail=str(e)))
            for name in CONSTANTS
        ]
    return [_constant(name, found.get(name), model, spec, motion_of(H)) for name in CONSTANTS]


@cache
def _model(name: str) -> Model:
    return build_model(load_model(name))


def _constant(name: str, found: Constant | None, model: Model, spec: CheckSpec, motion: str) -> Quantity:
    if found is None:
        return Quantity.missing(name, because(Cause.MODEL_WITHOUT_CONSTANT, model=model.name))
    budget = [
        Contribution("scatter of the response", found.u, "A"),
        Contribution(f"model {model.name}, as its tolerance says", abs(found.value) * model.tolerance),
        Contribution(f"uncertain parameters of model {model.name}", found.u_model),
    ]
    stated = [stated_contribution(spec, found.value, name)]
    if stated[0] is None:  # both follow from the gain of the motion, gs also from that of Vs
        gains = [gain for gain, (channel, *_) in GAINS.items() if channel in (motion, *GAINS_OF[name])]
        stated = [stated_contribution(spec, found.value, gain) for gain in gains]
    return Quantity.of(name, found.value, *budget, *stated, note=f"by {model.name}")
