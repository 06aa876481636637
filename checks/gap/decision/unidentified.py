"""What is missing and has no name ([GAP] 12): unidentified effects, and what calibrated values swallow - a stack whose
force is gone in part, a stiffer joint, a mass that was left on. With such values every channel agrees, and that is no
agreement with the model if they leave what the part may have: by the model's file, by its batch, or by a measurement of
the part itself that narrows either."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from checks import distributions as stats
from checks.arrays import Array
from checks.fitting.fit import Fit
from checks.gap.decision.gates import Claim
from checks.gap.decision.result import Nameless
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.modelling.unmodelled_modes import ALL, MODE, on_channel
from checks.gap.search.explanation import Explanation
from checks.gap.search.screen import screen
from checks.quantity import TWO_SIDED_95
from specs.units import model_label

POLE_STEPS = 30  # of the fit of a pole to what is left
EDGE = 1.05  # times an end of the band: as near, a pole is not distinguished from a slope
PARTS = ("joint.", "encoder.", "bench.payload_kg", "constants.ga_", "constants.gs_")  # made, bought or weighed
FORCE = "constants.ga_"
# False alarms of one unit, one in a hundred together: a stack fails one way only, and more often than anything else.
FORCE_ALARMS, OTHER_ALARMS = 3e-3, 7e-3
BEYOND_BATCH = 4.5  # standard deviations: few units know their scatter badly
SHOWN = 3


def unidentified_effects(
    full: Explanation, final: Fit, claims: Sequence[Claim], slow: Slow | None, table: Thresholds
) -> tuple[Nameless, ...]:
    """Return the unidentified effects of an explanation: its unmodelled modes, and, if it still does not fit, a mode
    fitted to the residual of the worst window of every channel; failing those, the refused claims, because what they
    explain is missing all the same; failing everything, the channel with the largest gap."""
    out = []
    level = slow is not None and slow.is_bent(table)
    for mode in full.response.unmodelled_modes:
        values, f = full.of(mode.name), full.unseen.f
        poles, zeros = mode.poles_and_zeros(values)
        intervals = tuple(final.interval(f"{mode.name}.f_Hz") for _ in poles)
        at_edge = any(_at_edge(pole, *ends, f) for pole, ends in zip(poles, intervals, strict=True))
        numbers = ", ".join(f"{p.symbol} {values[p.name]:.4g} {p.unit}".rstrip() for p in mode.parameters)
        words = f"{mode.channel} times a {mode.shape.name} ({numbers}) would explain it"
        out.append(Nameless(mode.channel, tuple(poles), tuple(zeros), level, words, intervals, at_edge))
    channels = {n.channel for n in out}
    if not full.adequate:
        for w in full.adequacy.windows:
            if w.channel not in channels:
                channels.add(w.channel)
                out.append(_from_window(full, w.channel, level))
    refused = [c for c in claims if c.reasons]
    words = "; ".join(f"{c.effect.name} was not named: it {c.reasons[0]}" for c in refused)
    if not out:
        for claim in refused:
            values = full.of(claim.effect.name)
            poles = [values["f_Hz"]] if "f_Hz" in values else []
            acting = full.acting_on(claim.effect) or claim.effect.channels
            out.append(Nameless(acting[0], tuple(poles), (), level))
    if not out and not full.adequate:
        worst = max(full.channel_G, key=lambda c: full.channel_G[c])
        out.append(Nameless(worst, (), (), level, "the remaining misfit lies in no single band"))
    return tuple(replace(n, words="; ".join(w for w in (n.words, words) if w)) for n in out)


def static_bend(slow: Slow | None, table: Thresholds) -> tuple[Nameless, ...]:
    """Return the bend of the static curve between drive and displacement, and loops that open otherwise than those of a
    hysteresis of the drive, as unidentified effects; the library has no effect for them."""
    if slow is None:
        return ()
    found = []
    if slow.is_bent(table):
        share = f"the cubic part of the curve is {slow.bends.value:.3f} of the straight one"
        found.append(f"under slow sines {slow.channel} bends: {share}")
    if slow.opens(table) and not slow.is_of_drive:
        found.append(
            f"under slow sines loops of {slow.channel} open, but not as those of the drive's hysteresis: a friction?"
        )
    return tuple(Nameless(slow.channel, (), (), True, words) for words in found)


def _from_window(full: Explanation, channel: str, level: bool) -> Nameless:
    """Return the pole, with its interval, and the zero of a mode that would explain most of a channel's residual."""
    mode, seen = on_channel(MODE, channel), full.seen
    start = {"ratio": 0.0, "damping_ratio": 0.01, **screen(seen, mode, starts=1).starts[0]}
    data, c = seen.data, seen.data.channels.index(channel)
    names = [p.name for p in mode.parameters]
    lo, hi = (np.array([getattr(p, end) for p in mode.parameters]) for end in ("lo", "hi"))
    s = np.asarray(2j * np.pi * data.f, dtype=np.complex128)

    def left(x: Array) -> Array:
        change = np.zeros_like(data.H)
        change[:, c] = seen.modelled[:, c] * (mode.shape.factor(dict(zip(names, x, strict=True)), s) - 1.0)
        return np.asarray(seen.left - seen.rows(change))

    x = np.clip([start[n] for n in names], lo * (1 + 1e-9), hi * (1 - 1e-9))
    scale = np.array([p.scale for p in mode.parameters])
    end = least_squares(left, x, bounds=(lo, hi), x_scale=scale, max_nfev=POLE_STEPS)
    spread = max(1.0, 2.0 * end.cost / max(seen.left.size, 1))  # what the mode leaves counts as its noise
    sd = float(np.sqrt(max(np.linalg.pinv(end.jac.T @ end.jac, hermitian=True)[0, 0], 0.0) * spread))
    values = dict(zip(names, (float(v) for v in end.x), strict=True))
    poles, zeros = mode.poles_and_zeros(values)
    ends = (values["f_Hz"] - TWO_SIDED_95 * sd, values["f_Hz"] + TWO_SIDED_95 * sd)
    return Nameless(
        channel, tuple(poles), tuple(zeros), level, ci95=(ends,), at_edge=_at_edge(values["f_Hz"], *ends, data.f)
    )


def _at_edge(pole: float, lo: float, hi: float, f: Array) -> bool:
    """Return whether a pole, or its interval, reaches an end of the band."""
    return bool(min(pole, lo) < f[0] * EDGE or max(pole, hi) > f[-1] / EDGE)


def all_channels_agree(c: Explanation) -> bool:
    """Return whether chance and tolerance explain every channel, wherever the calibrated values lie."""
    return c.adequate or (c.worst_G < c.table.G and not c.adequacy.windows)


def beyond_parts(full: Explanation, fit: Fit) -> tuple[Nameless, ...]:
    """Return the values that leave what their part may have, in one statement, each as the responses alone give it.
    fit: of the explanation."""
    free = {p.name: p for p in full.response.free()}
    far = values_beyond(full)
    said = []
    for name in sorted(far, key=lambda n: -abs(far[n]))[:SHOWN]:
        p = free[name]
        told = 1.0 - (fit.sds[name] / p.sd) ** 2  # share of the data alone: the value is what they say
        ratio = 1.0 + (fit.at[name] / p.prior - 1.0) / told
        half, may = (TWO_SIDED_95 * sd / abs(p.prior) for sd in (fit.sds[name] / np.sqrt(told), p.sd))
        said.append(
            f"{model_label(name)} {ratio:.3g} times what is stated (95 %: {ratio - half:.3g} to {ratio + half:.3g}), "
            f"where {1 - may:.3g} to {1 + may:.3g} is allowed"
        )
    words = f"all channels agree, but only with {' and '.join(said)}: measure the part, or find what acts like it"
    return (Nameless(ALL, (), (), False, words),) if said else ()


def values_beyond(full: Explanation) -> dict[str, float]:
    """Return the values of parts that lie further off than chance explains, by how many of the standard deviations that
    they may have: an error of the model's form moves them less than their pulls. Dampings have no range."""
    prior = {p.name: p.prior for p in full.response.free()}
    off = {n: z for n, z in full.off_file.items() if n.startswith(PARTS) and ".c" not in n and prior[n]}
    if full.response.model.joint is not None:
        return {n: z for n, z in off.items() if abs(z) > BEYOND_BATCH}
    others = {n: z for n, z in off.items() if not n.startswith(FORCE)}
    most, weak = stats.norm.isf(OTHER_ALARMS / (2 * max(len(others), 1))), stats.norm.isf(FORCE_ALARMS)
    lost = {n: z for n, z in off.items() if n not in others and -z * np.sign(prior[n]) > weak}
    return lost | {n: z for n, z in others.items() if abs(z) > most}
