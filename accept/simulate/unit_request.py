"""The request for a simulated unit."""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from accept.base.spelling import SERIAL
from accept.models.model_file import SIMULATED_MODEL
from accept.simulate.converters import Converters
from checks.arrays import Array
from checks.errors import ModelError
from checks.gap import EXPERIMENT_KINDS, ExperimentKind, effect_named, with_effects
from checks.model import Fractions, Model
from specs.errors import AcceptError
from specs.plugins import product_named

SHORTEST_S = 2.0
LONGEST_S = 120.0
SHORT_S = 10.5  # quick to simulate, and long enough: the specs ask for 10 s
FIGURES = "figures"  # properties of the unit, the same in every recording
APA_PAYLOAD_KG = 5.0  # [STB] 3.1.7; the models have a strut's payload


class UnitRequestError(AcceptError, ValueError):
    """An impossible request; the text names the wrong value and the possible ones."""


@dataclass(frozen=True)
class ExperimentRequest:
    """An experiment to simulate beside the unit's responses: its kind and the number that goes with it."""

    kind: ExperimentKind
    value: float | None = None

    @classmethod
    def of(cls, name: str, values: Mapping[str, float]) -> "ExperimentRequest":
        """Return an experiment. Raises UnitRequestError for an unknown kind and a missing or implausible number."""
        if name not in EXPERIMENT_KINDS:
            raise UnitRequestError(f"experiment '{name}': expected one of {', '.join(EXPERIMENT_KINDS)}")
        kind = EXPERIMENT_KINDS[name]
        wanted = {kind.value.name} if kind.value else set()
        if values.keys() != wanted:
            given = ", ".join(values) or "nothing"
            raise UnitRequestError(
                f"experiment '{name}' is given with {given}; expected {', '.join(wanted) or 'nothing'}"
            )
        if kind.value is None:
            return cls(kind)
        value = values[kind.value.name]
        if not kind.value.lo <= value <= kind.value.hi:
            raise UnitRequestError(
                f"experiment '{name}': {kind.value.name} = {value:g}: expected {kind.value.lo:g} to {kind.value.hi:g}"
            )
        return cls(kind, value)


@dataclass(frozen=True)
class UnitRequest:
    """A unit to simulate. seed: of excitation, noise and drawn figures; effects: (name, parameters) in order; fault: a
    name in `FAULTS`; hold: converter without a filter behind it; repeats: second realisations; low_s, high_s: length of
    the records of frequency responses; compact: files compressed, so that all fit into one certificate; experiments:
    the responses once more, under other conditions; take: number of earlier recordings of the same unit, whose noise,
    drive and hits were others."""

    serial: str
    kind: str
    model: Model
    seed: int = 0
    effects: tuple[tuple[str, Mapping[str, float]], ...] = ()
    fault: str | None = None
    converters: Converters = field(default_factory=Converters)
    hold: bool = False
    repeats: bool = True
    low_s: float = 20.0
    high_s: float = 20.0
    compact: bool = True
    experiments: tuple[ExperimentRequest, ...] = ()
    take: int = 0

    def __post_init__(self) -> None:
        if not SERIAL.fullmatch(self.serial):
            raise UnitRequestError(f"serial '{self.serial}': expected letters, digits, '.', '_' or '-'")
        if self.kind not in SIMULATED_MODEL:
            raise UnitRequestError(f"kind '{self.kind}': simulated can be {', '.join(SIMULATED_MODEL)}")
        if self.seed < 0:
            raise UnitRequestError(f"seed {self.seed}: expected 0 or more")
        for name, length in (("low", self.low_s), ("high", self.high_s)):
            if not SHORTEST_S <= length <= LONGEST_S:
                raise UnitRequestError(f"{name} record of {length:g} s: expected {SHORTEST_S:g} to {LONGEST_S:g} s")
        wanted = {"Vs", "de", "da"} - product_named(self.kind).absent.keys()
        if missing := wanted - set(self.model.channels):
            raise UnitRequestError(f"model '{self.model.name}' has no {', '.join(sorted(missing))}: nothing to record")
        if more := set(self.model.channels) - wanted:
            raise UnitRequestError(f"model '{self.model.name}' has {', '.join(sorted(more))}: it is no {self.kind}")
        jointed = any(name.startswith("joint.") for name in self.model.values)
        if jointed != (self.family == "strut"):
            has = "has joints" if jointed else "has no joints"
            raise UnitRequestError(f"model '{self.model.name}' {has}: it is no {self.kind}")
        self._vet_effects()

    @property
    def family(self) -> str:
        return product_named(self.kind).family

    def rng(self, of: str) -> np.random.Generator:
        """Return a generator for one purpose, independent of all others."""
        again = [self.take] if self.take and of != FIGURES else []
        return np.random.default_rng([self.seed, zlib.crc32(of.encode()), *again])

    def bent(self, Va: Array, amplitude_V: float) -> Array:
        """Return a drive (N,) [V] as distorted by nonlinear effects. Their size is stated at this amplitude."""
        for name, values in self.effects:
            bends = effect_named(name).bends
            Va = Va if bends is None else bends(values, amplitude_V)(Va)
        return Va

    @property
    def filters(self) -> dict[str, Fractions]:
        filters: dict[str, Fractions] = {}
        for name, values in self.effects:
            effect = effect_named(name)
            if effect.path is None:
                continue
            each = effect.path(values)
            for channel in effect.channels:
                filters[channel] = filters[channel].times(each) if channel in filters else each
        return filters

    def affected(self) -> Model:
        """Return the model with every effect that a model holds built in. Raises ModelError."""
        return with_effects(self.model, [each for each in self.effects if effect_named(each[0]).in_model])

    def _vet_effects(self) -> None:
        names = [name for name, _ in self.effects]
        for name, values in self.effects:
            try:
                effect = effect_named(name)
                effect.checked(values)
            except ModelError as e:
                raise UnitRequestError(str(e)) from e
            if names.count(name) > 1:
                raise UnitRequestError(f"effect '{name}' is given {names.count(name)} times; expected once")
            if not (effect.in_model or effect.bends or effect.path):
                raise UnitRequestError(f"effect '{name}' says nothing about how it is simulated in time")


def drawn(model: Model, seed: int, most: float = 2.0) -> Model:
    """Return the model with its uncertain parameters as a seed draws them."""
    return model.drawn(np.random.default_rng([seed, zlib.crc32(b"parameters")]), most)


def on_bench(model: Model, kind: str) -> Model:
    """Return the built-in model of a kind with the payload of [STB]."""
    return model.with_values({"bench.payload_kg": APA_PAYLOAD_KG}) if kind == "apa" else model
