"""The piezo's hysteresis: a loop between drive and displacement whose width grows with the amplitude and does not
depend on the rate ([STB] 3.1.6; [BERTOTTI98] 2.3 for Rayleigh's loops).

It is not linear, so no response names it: the slow sines do, if their loops open in proportion to the amplitude and get
steeper as they open. Loops of a guide that sticks and slips do not (`slow_sines`)."""

import numpy as np

from checks import distributions as stats
from checks.gap.modelling.effect import Effect, Parameter, SlowFinding, SlowRecord
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.slow_sines import BEYOND_NOISE, Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.model.time.hysteresis_creep import loops_of
from checks.quantity import TWO_SIDED_95

WIDTH = "relative_width"
SHAPE = 0.01  # of the width: loops are not quite Rayleigh's


def _named(slow: Slow, table: Thresholds) -> SlowFinding | None:
    grows = slow.grows
    if not (slow.opens(table) and slow.is_of_drive):
        return None
    half, z = TWO_SIDED_95 * float(np.hypot(grows.u, SHAPE * grows.value)), grows.value / grows.u
    return SlowFinding({WIDTH: grows.value}, {WIDTH: half}, 0.5 * z * z, float(2.0 * stats.norm.sf(z)))


def _limit(slow: Slow, table: Thresholds) -> dict[str, float]:
    return {WIDTH: max(table.loop_width, BEYOND_NOISE * slow.grows.u)}


EFFECT = Effect(
    name="hysteresis",
    title="Hysteresis of the drive",
    does="a loop on the drive voltage that does not depend on the rate",
    parameters=(Parameter(WIDTH, lo=0.0, hi=0.5, off=0.0, start=0.0, scale=0.01),),
    channels=("de",),
    sign="the loop under slow sines opens in proportion to the amplitude, and its slope grows by twice as much",
    sentence="The drive has hysteresis: loops open by {relative_width} of the stroke at the largest amplitude.",
    sources=("[STB] 3.1.6", "[BERTOTTI98] 2.3"),
    experiment=Experiment.LEVEL,
    slow=SlowRecord(named=_named, limit=_limit),
    bends=lambda values, amplitude: loops_of(values[WIDTH], amplitude),
)
