"""The simulated recorder: a driven unit, or one that is hit by a hammer."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from accept.models.model_file import SIMULATED_MODEL, open_model
from accept.simulate import apa
from accept.simulate.converters import RANGE_V, in_steps
from accept.simulate.hammer_records import DoubleHits, hammer_record
from accept.simulate.records import AMPLITUDES_V, DrivenUnit
from accept.simulate.unit_request import UnitRequest, drawn, on_bench
from checks.arrays import Array
from checks.model import loops_of, stroke_of
from checks.record import motion_of
from hw.errors import SettingsError
from hw.instruments import Identity, settings_of
from hw.recorders import Heard, Recorder
from hw.simulated import StageFile
from specs.bench import AMPLIFIER_GAIN, STACK_V, RecorderChannel, RecorderEntry
from specs.strict import NotNegative, Strict, Words

MODEL, SERIAL = "simulated recorder", "SIM-DAQ"
HAMMER, STROKE = ("Track1", "Track2"), ("V", "d")
INPUTS = {"Va": "V", "Vs": "V", "de": "m", "da": "m", "V": "V", "d": "m", "Track1": "N", "Track2": "rad"}
SLOW_V = 1.0  # a drive that goes further from its mean is slow: it opens the loops of the stacks
BLOCK_s = 0.25
END = 1e9  # of the channels that a counter or an analyser gives: they have no converter's range


class SimulatedSettings(Strict):
    """kind, model, seed: of the unit, as in `accept simulate unit`. stage: file of the simulated bench with the driven
    stacks and the hammer's place. bouncing: hits that bounce, counted from 0. pace: seconds for a recorded second."""

    kind: Literal["apa", "strut", "strut-plates"] = "apa"
    model: Words | None = None
    seed: Annotated[int, Field(ge=0)] = 0
    stage: Words | None = None
    bouncing: list[int] = Field(default_factory=list)
    pace: NotNegative = 1.0


class SimulatedConverter:
    """The back end: an input is called as its channel."""

    one_clock = True
    output_range = RANGE_V
    slow = True

    def __init__(self, name: str, settings: SimulatedSettings) -> None:
        self._name, self._settings, self._taken = name, settings, 0
        self._bench: DrivenUnit | None = None

    def identify(self) -> Identity:
        return Identity(MODEL, SERIAL)

    def actual_rate(self, inputs: Sequence[RecorderChannel], rate_Hz: float) -> float:
        del inputs
        return rate_Hz

    def range_of(self, channel: RecorderChannel) -> float:
        if channel.range is not None:
            return channel.range
        return RANGE_V if channel.physical in ("Va", "Vs") else END

    def acquire(
        self,
        inputs: Sequence[tuple[str, RecorderChannel]],
        rate_Hz: float,
        samples: int,
        output: Array | None,
        heard: Heard,
    ) -> Array:
        self._taken += 1
        names = [at.physical for _, at in inputs]
        if set(names) <= set(HAMMER):
            signals = self._hits(rate_Hz, samples)
        elif output is None:
            raise SettingsError(f"{self._name}: {', '.join(names)} stand still without a drive")
        elif set(names) <= set(STROKE):
            signals = self._stroke(output)
        else:
            signals = self._driven_record(output, rate_Hz)
        if unknown := [name for name in names if name not in signals]:
            raise SettingsError(f"{self._name}: no simulated input is called {', '.join(unknown)}")
        raw = np.array([signals[name] for name in names])
        return self._deliver(raw, rate_Hz, heard)

    def close(self) -> None:
        """Leave nothing open."""

    def _deliver(self, raw: Array, rate_Hz: float, heard: Heard) -> Array:
        """Deliver the numbers (C, N) block by block, at the pace of the recording."""
        block = max(round(BLOCK_s * rate_Hz), 1)
        for at in range(0, raw.shape[1], block):
            part = raw[:, at : at + block]
            time.sleep(self._settings.pace * part.shape[1] / rate_Hz)
            if heard(part):
                return raw[:, : at + part.shape[1]]
        return raw

    @property
    def _unit(self) -> DrivenUnit:
        if self._bench is None:
            given = self._settings
            model = on_bench(open_model(given.model or SIMULATED_MODEL[given.kind]), given.kind)
            request = UnitRequest("SIMULATED", given.kind, drawn(model, given.seed), given.seed)
            self._bench = DrivenUnit(request, request.affected())
        return self._bench

    @property
    def _figures(self) -> apa.Figures:
        return apa.draw(self._unit.request.rng("figures"))

    def _driven_record(self, output: Array, rate_Hz: float) -> dict[str, Array]:
        unit, name = self._unit, f"record {self._taken}"
        columns = {key: np.asarray(column) for key, column in unit.play(name, output, rate_Hz).items()}
        away = output - float(np.median(output))
        if np.abs(away[output.size // 4 : -output.size // 4]).max() > SLOW_V:
            loops = loops_of(self._figures.loop, AMPLITUDES_V[unit.request.family][-1])(columns["Va"])
            motion = motion_of(columns)
            moved = unit.answer(output.size, rate_Hz)(loops)[motion]
            columns[motion] = unit.request.converters.read(motion, moved, unit.request.rng(f"{name}, {motion}"))
        return columns

    def _stroke(self, output: Array) -> dict[str, Array]:
        one, *others = self._figures.stacks_um
        stroke_um = one if self._stage_value("stacks") == "one_stack" else sum(others)
        V = AMPLIFIER_GAIN * output
        lowest = int(np.argmin(V))  # the stroke is stated from there
        d = np.zeros(V.size)
        d[lowest:] = stroke_of(stroke_um * apa.UM, STACK_V[1] - STACK_V[0], self._figures.loop)(V[lowest:])
        d += apa.GAUGE_NOISE * self._unit.request.rng(f"stroke {self._taken}").standard_normal(V.size)
        return {"V": V, "d": in_steps(d, apa.GAUGE_STEP)}

    def _hits(self, rate_Hz: float, samples: int) -> dict[str, Array]:
        place = self._stage_value("hit") or "x_bending"
        modes = apa.shell_modes(place, self._figures)
        rng = self._unit.request.rng(f"hammer, {place}, {self._taken}")
        double = DoubleHits(hits=tuple(self._settings.bouncing)) if self._settings.bouncing else None
        force, angle = hammer_record(modes, rng, double, samples / rate_Hz, rate_Hz)
        return {"Track1": force, "Track2": angle}

    def _stage_value(self, what: str) -> str | None:
        if self._settings.stage is None:
            return None
        found: str | None = getattr(StageFile(Path(self._settings.stage)).read(), what)
        return found


def open_simulated(name: str, entry: RecorderEntry) -> Recorder:
    """Return the simulated recorder of an entry. Raises SettingsError."""
    return Recorder(name, entry, SimulatedConverter(name, settings_of(name, SimulatedSettings, entry)))
