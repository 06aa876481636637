"""What calibrated values swallow: a stack whose force is gone in part, a stiffer joint, a mass that was left on. With
such values every channel agrees, and that is no agreement with the model if they leave what the part may have: by the
model's file, by its batch, or by a measurement of the part itself that narrows either."""

import numpy as np

from checks import distributions as stats
from checks.fitting.fit import Fit
from checks.gap.decision.result import Nameless
from checks.gap.modelling.unmodelled_modes import ALL
from checks.gap.search.explanation import Explanation
from checks.quantity import TWO_SIDED_95
from specs.units import model_label

PARTS = ("joint.", "encoder.", "bench.payload_kg", "constants.ga_", "constants.gs_")  # made, bought or weighed
FORCE = "constants.ga_"
# False alarms of one unit, one in a hundred together: a stack fails one way only, and more often than anything else.
FORCE_ALARMS, OTHER_ALARMS = 3e-3, 7e-3
BEYOND_BATCH = 4.5  # standard deviations: few units know their scatter badly
SHOWN = 3


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
