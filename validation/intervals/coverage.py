"""Coverage of each quantity of each check over repeated simulated units."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from checks.acceptance import CHECKS
from checks.acceptance.responses import gains
from checks.acceptance.responses.rules import rules_of
from checks.declare import Values
from checks.quantity import Quantity
from specs.spec import CheckSpec, load
from validation.intervals import parts, responses
from validation.intervals.parts import Draw, Simulated

SEED = 20261123


@dataclass(frozen=True)
class Section:
    """A check by its spec, how a unit for it is simulated, and what measures it if not the whole check."""

    check: str
    simulated: Callable[[Draw], Simulated]
    spec: str = "apa"
    part: Callable[[Values, CheckSpec], Sequence[Quantity]] | None = None

    def measure(self, values: Values) -> Sequence[Quantity]:
        """Return the quantities of a simulated unit."""
        asked = load(self.spec).checks[self.check]
        return (self.part or (lambda v, s: CHECKS[self.check].measure(v, s).quantities))(values, asked)


def constants(values: Values, asked: CheckSpec) -> Sequence[Quantity]:
    """Return ga and gs of a response, by the model of the spec."""
    return gains.constants(values["frf"], values["payload_kg"].value, rules_of(asked), asked)


SECTIONS: dict[str, Section] = {
    **{
        name: Section(name, getattr(parts, name))
        for name in ("flatness", "capacitance", "stroke", "stiffness", "hysteresis", "sensor_highpass")
    },
    "spurious_modes": Section("spurious_modes", responses.spurious_modes),
    "frf of an APA": Section("frf", partial(responses.responses_of, "apa")),
    "frf with a second resonance": Section("frf", partial(responses.responses_of, "apa", second=True)),
    "frf of a strut": Section("frf", partial(responses.responses_of, "strut"), "strut"),
    "constants of a strut": Section("frf", responses.constants, "strut", constants),
}
WITHOUT_U = ("hysteresis_amplitude_V", "hysteresis_gain_um_per_V", "sensor_gain_V_per_V")
BY_OTHER_PROOFS = dict.fromkeys(("dx_um", "dy_um"), "the blind tests, `make challenge`")


@dataclass
class Score:
    """What the intervals of one quantity held. errors: (value - truth) / U of each repeat; relative: U / |truth|;
    missing: repeats without a value or without U."""

    errors: list[float] = field(default_factory=list)
    relative: list[float] = field(default_factory=list)
    missing: int = 0

    @property
    def covered(self) -> int:
        return sum(abs(e) <= 1.0 for e in self.errors)


def scores(section: str, repeats: int, seed: int = SEED) -> dict[str, Score]:
    """Return quantity -> score over so many units of a section."""
    found: dict[str, Score] = {}
    for k in range(repeats):
        unit = SECTIONS[section].simulated(np.random.default_rng((seed, k)))
        measured = {q.name: q for q in SECTIONS[section].measure(unit.values)}
        for quantity, truth in unit.truth.items():
            score, q = found.setdefault(quantity, Score()), measured[quantity]
            if q.U is None or not math.isfinite(q.value):
                score.missing += 1
                continue
            score.errors.append((q.value - truth) / q.U)
            score.relative.append(q.U / abs(truth))
    return found


def table(section: str, found: dict[str, Score]) -> Iterator[str]:
    """Yield a row of the table of each quantity."""
    for quantity, score in found.items():
        n = len(score.errors)
        mean, size = float(np.mean(score.errors)), 100.0 * float(np.median(score.relative))
        rest = f"{score.missing} without a value" if score.missing else ""
        yield f"| {section} | `{quantity}` | {score.covered} of {n} | {size:.2g} % | {mean:+.2f} U | {rest} |"
