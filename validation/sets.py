"""The sets of the challenge: how many units, of which kinds, on which shells, on which bench, with what the model file
states of them.

Every set is drawn from the seed and its own name, so it can be run alone and comes out the same.
"""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from validation.bench import draw_rough
from validation.benches import Bench, draw_benches
from validation.cases import DRAWN, SHARES, Case, draw_cases, draw_in_order, draw_weak
from validation.effects import LIBRARY
from validation.outsiders import OUTSIDERS
from validation.shell import draw_bias, draw_shell
from validation.strut import Flexible

Array = NDArray[np.float64]

DAMPING = 0.20  # 1 sd of every mode's damping ratio, wherever shells scatter
MIX = {"none": 0.30, "one": 0.45, "two": 0.10, "outside": 0.15}
LABORATORY = {"none": 0.30, "one": 0.45, "outsider": 0.25}
PLAIN = {"none": 0.30, "one": 0.70}
DX_LIMIT_UM, DY_LIMIT_UM = 50.0, 100.0  # of the built-in spec of a strut
ABOUT_UM = (-12.0, 15.0)  # about a limit
TO_LEARN = 10
BATCH = 10  # units that are judged with what was learned from others
LEARNED_ON_BENCH = 8
HIDING = 0.1  # share of the units to learn from on a bench that hide something
BENCHES = 12
GLUED = 0.01  # 1 sd of a bracket's frequency from unit to unit
OFTEN_MISALIGNED = (*DRAWN, "misalignment", "misalignment")  # so that limits of dx and dy are asked often enough
SIGNAL_PATH = (
    "loop_delay",
    "amplifier_bandwidth",
    "sensor_highpass",
    "crosstalk",
    "encoder_scale",
    "sensor_polarity",
)


@dataclass(frozen=True)
class Set:
    """units: how many in the full run. frequency: scatter of the modes, 1 sd; stated: the value that the model file
    states for it, or zero; bias: 1 sd of what is alike in a batch; lopsided: 1 sd of the coupling of modes; beside: the
    ruler is not read where the head is; learned: the model is learned from other units of the batch first; effects:
    those that it draws from; benches: how many, each with properties that its units share, 0: one without, or none: as
    before there were any; beams: joints and brackets bend as beams, alike in the units of a bench."""

    units: int
    shares: Mapping[str, float]
    frequency: float = 0.0
    stated: float = 0.0
    bias: float = 0.0
    lopsided: float = 0.0
    beside: bool = False
    rough: bool = False
    learned: bool = False
    effects: tuple[str, ...] = DRAWN
    seconds: float = 12.0
    benches: int | None = None
    beams: bool = False

    @property
    def exact(self) -> bool:
        return self.frequency == 0.0 and self.bias == 0.0


SETS: Mapping[str, Set] = {
    "exact": Set(60, SHARES, seconds=20.0),
    "scatter-0.5": Set(30, MIX, 0.005, 0.01),
    "scatter-1": Set(50, MIX, 0.01, 0.01, seconds=20.0),
    "scatter-2": Set(30, MIX, 0.02, 0.02),
    "batch": Set(40, MIX, 0.01, 0.01, bias=0.02, beside=True, learned=True),
    "rough": Set(20, PLAIN, 0.005, 0.01, rough=True, seconds=20.0),
    "three": Set(20, {"three": 1.0}, 0.01, 0.01, seconds=20.0),
    "limit": Set(30, {"limit": 1.0}, 0.01, 0.01),
    "faults": Set(12, {"fault": 1.0}, 0.01, 0.01),
    "lopsided": Set(8, {"none": 1.0}, 0.01, 0.01, lopsided=0.01),
    "laboratory": Set(
        144, LABORATORY, 0.01, 0.01, learned=True, effects=OFTEN_MISALIGNED, seconds=10.0, benches=BENCHES
    ),
    "laboratory-unlearned": Set(40, LABORATORY, 0.01, 0.01, effects=OFTEN_MISALIGNED, seconds=10.0, benches=BENCHES),
    "struts": Set(
        20,
        {"none": 0.4, "one": 0.6},
        0.01,
        0.01,
        learned=True,
        effects=SIGNAL_PATH,
        seconds=10.0,
        benches=2,
        beams=True,
    ),
    "outsiders": Set(2 * len(OUTSIDERS), {"outsider": 1.0}, 0.01, 0.01, seconds=10.0, benches=0),
}


@dataclass(frozen=True, eq=False)
class Batch:
    """Units that share a bias: those to learn from, where the set learns, and those to judge."""

    name: str
    learn: tuple[Case, ...]
    judge: tuple[Case, ...]


def draw_set(name: str, seed: int, units: int | None = None, weak: int = 0, *, of: Set | None = None) -> list[Batch]:
    """Return the units of a set, in batches; a set that does not learn is one batch without. units: default the full
    number. weak: how many units with one weak effect on top, in the exact set alone; of: the set where it differs from
    that of its name."""
    it = of or SETS[name]
    number, own = it.units if units is None else units, [seed, zlib.crc32(name.encode())]
    if it.benches is not None:
        return _on_benches(name, it, number, own)
    batches = []
    for k, size in enumerate(_sizes(number) if it.learned else [number]):
        rng = np.random.default_rng([*own, k])
        bias = draw_bias(rng, it.bias) if it.bias else None
        beside = _beside(rng) if it.beside else None
        prefix = f"{name}-{chr(65 + k)}" if it.learned else name
        judged = _drawn(it, size, [*own, k, 1], prefix)
        learn = (
            draw_cases(TO_LEARN, [*own, k, 2], f"{prefix}-L", {"none": 0.9, "one": 0.1}, it.effects)
            if it.learned
            else []
        )
        dressed = [[_dress(c, it, rng, bias, beside) for c in cases] for cases in (learn, judged)]
        batches.append(Batch(prefix, tuple(dressed[0]), tuple(dressed[1])))
    if weak and it.exact:
        batches.append(Batch("weak", (), tuple(draw_weak(weak, seed))))
    return batches


def _on_benches(name: str, it: Set, number: int, own: Sequence[int]) -> list[Batch]:
    """Return a batch for each bench. Judged units go from bench to bench, all of them in every round, so that the first
    so many are a fair mixture of kinds and benches."""
    rng = np.random.default_rng([*own, 0])
    benches = draw_benches(it.benches or 0, rng) or [None]
    bends = [_draw_flexible(rng) if it.beams else None for _ in benches]
    rounds = [rng.permutation(len(benches)) for _ in range(-(-number // len(benches)))]
    judged: list[list[Case]] = [[] for _ in benches]
    for case, k in zip(
        draw_in_order(number, [*own, 1], it.shares, it.effects, name), np.concatenate(rounds), strict=False
    ):
        judged[k].append(_on_bench(case, it, benches[k], bends[k]))
    batches = []
    for k, bench in enumerate(benches):
        prefix = f"{name}-{chr(65 + k)}"
        learn = _to_learn(it, [*own, 2, k], f"{prefix}-L") if it.learned else []
        batches.append(Batch(prefix, tuple(_on_bench(case, it, bench, bends[k]) for case in learn), tuple(judged[k])))
    return batches


def _to_learn(it: Set, own: Sequence[int], prefix: str) -> list[Case]:
    """Return the units that a bench's model is learned from; one in ten hides something."""
    hiding = int(np.sum(np.random.default_rng(own).random(LEARNED_ON_BENCH) < HIDING))
    shares = {"none": 1 - hiding / LEARNED_ON_BENCH, "one": hiding / LEARNED_ON_BENCH} if hiding else {"none": 1.0}
    return draw_cases(LEARNED_ON_BENCH, [*own, 1], prefix, shares, it.effects)


def _draw_flexible(rng: np.random.Generator) -> Flexible:
    """Return the design of a strut whose joints and brackets bend."""
    return Flexible(
        neck_m=float(rng.uniform(0.8e-3, 2.0e-3)),
        head_Hz=float(rng.uniform(900, 1800)),
        ruler_Hz=float(rng.uniform(900, 1800)),
        damping_ratio=float(rng.uniform(0.005, 0.015)),
    )


def _on_bench(case: Case, it: Set, bench: Bench | None, bends: Flexible | None) -> Case:
    """Put the unit on a shell as it is built, and on a bench."""
    rng = np.random.default_rng([case.seed, 1])
    strut = replace(case.strut, built=draw_shell(rng, it.frequency, DAMPING))
    if bends is not None:
        near = 1 + GLUED * rng.standard_normal(2)
        own = replace(bends, head_Hz=bends.head_Hz * near[0], ruler_Hz=bends.ruler_Hz * near[1])
        strut = replace(strut, flexible=own)
    setting = replace(case.setting, seconds=it.seconds)
    if bench is not None:
        setting = bench.record_with(setting)
    return replace(case, strut=strut, setting=setting, bench=bench, learned=it.learned)


def order_of(case: Case) -> int:
    """Return the place of a judged unit in its set, over all benches."""
    return int(case.serial.rpartition("-")[2])


def _sizes(number: int) -> list[int]:
    """Return the number of units of each batch."""
    return [min(BATCH, number - start) for start in range(0, number, BATCH)]


def _drawn(it: Set, number: int, seed: Sequence[int], prefix: str) -> list[Case]:
    special = {"limit": _about_a_limit, "fault": _faulty}
    for kind, change in special.items():
        if kind in it.shares:
            rng = np.random.default_rng([*seed, 9])
            plain = draw_cases(number, seed, prefix, {"none": 1.0})
            return [change(replace(case, kind=kind), k, rng) for k, case in enumerate(plain)]
    return draw_cases(number, seed, prefix, it.shares, it.effects)


def _dress(case: Case, it: Set, rng: np.random.Generator, bias: Array | None, beside: Array | None) -> Case:
    """Put the unit on a shell and a bench of its set."""
    strut = case.strut
    if not it.exact:
        strut = replace(strut, built=draw_shell(rng, it.frequency, DAMPING, bias, it.lopsided))
    if beside is not None:
        x, y = beside + 1e-4 * rng.standard_normal(2)
        strut = replace(strut, ruler_x=strut.arm_x + x, ruler_y=strut.arm_y + y)
    setting = draw_rough(rng, case.setting) if it.rough else case.setting
    return replace(case, strut=strut, setting=replace(setting, seconds=it.seconds))


def _beside(rng: np.random.Generator) -> Array:
    """Return the vector (2,) [m] from the reading point of the head to that of the ruler, which gluing makes equal
    within a batch."""
    return np.array([rng.normal(0.0, 0.3e-3), rng.choice([-1.0, 1.0]) * rng.uniform(0.5e-3, 1.5e-3)])


def _about_a_limit(case: Case, k: int, rng: np.random.Generator) -> Case:
    """Return the unit with a misalignment near the limit of dx and of dy in turns, on either side of it."""
    sign = rng.choice([-1.0, 1.0], 2)
    near = rng.uniform(*ABOUT_UM)
    if k % 2 == 0:
        dx, dy = DX_LIMIT_UM + near, rng.uniform(0, 50)
    else:
        dx, dy = rng.uniform(0, 25), DY_LIMIT_UM + near
    return replace(case, effects={"misalignment": {"dx_um": float(sign[0] * dx), "dy_um": float(sign[1] * dy)}})


def _faulty(case: Case, k: int, rng: np.random.Generator) -> Case:
    """Return the unit with a fault: Vs reversed, a channel without a signal, two channels exchanged, in turns."""
    match k % 3:
        case 0:
            return replace(case, effects={"sensor_polarity": LIBRARY["sensor_polarity"].draw(rng)})
        case 1:
            return replace(case, dead=str(rng.choice(["de", "da", "Vs"])))
        case _:
            pairs = (("de", "da"), ("da", "Vs"), ("de", "Vs"))
            return replace(case, exchanged=pairs[int(rng.integers(len(pairs)))])
