"""The quantities that the simulated instruments measure: a unit's true values, and the technician's setup."""

import json
import os
import random
from dataclasses import asdict, dataclass
from pathlib import Path

from specs.bench import STACK_V

START_V, TOP_V = STACK_V
PLAY_WEIGHT, PLAY_RADIUS = 0.5, 0.1  # of the stroke: a loop about 10 % wide


@dataclass(frozen=True)
class BenchSetup:
    """Truth of a unit, in SI. heights: of the probe points in order; strokes: -20 to 150 V by group of stacks;
    noise as standard deviation, absolute for lengths, relative for capacitances."""

    serial: str
    heights_m: tuple[float, ...]
    sensor_F: float
    actuator_F: float
    one_stack_m: float
    two_stacks_m: float
    dissipation: float = 0.0145
    height_noise_m: float = 0.1e-6
    displacement_noise_m: float = 0.05e-6
    capacitance_noise: float = 1e-5


@dataclass(frozen=True)
class Stage:
    """The technician's setup: probe on which point (from 1), leads on "sensor" or "actuator", voltage [V] on
    "one_stack" or "two_stacks", the hammer at which record's place. None: not connected, no hammer."""

    probe: int | None = None
    leads: str | None = None
    stacks: str | None = None
    V: float = START_V
    hit: str | None = None


class StageFile:
    """A stage in a file, for a bench and a technician's program that are separate processes."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> Stage:
        """Return the stage; nothing connected if the file does not exist. Raises ValueError if it is another file."""
        try:
            found = json.loads(self.path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return Stage()
        if not isinstance(found, dict) or set(found) - set(asdict(Stage())):
            raise ValueError(f"{self.path}: is not a stage of a simulated bench")
        return Stage(**found)

    def write(self, stage: Stage) -> None:
        new = self.path.with_name(self.path.name + ".new")
        new.write_text(json.dumps(asdict(stage)), encoding="utf-8")
        os.replace(new, self.path)


class Play:
    """Displacement of a stack with hysteresis: a linear part and one that plays (Prandtl-Ishlinskii, one operator)."""

    def __init__(self, stroke_m: float) -> None:
        self._stroke, self._play = stroke_m / (1.0 - PLAY_WEIGHT * PLAY_RADIUS), 0.0

    def at(self, V: float) -> float:
        """Return the displacement [m] at a voltage [V], after all voltages before."""
        x = (V - START_V) / (TOP_V - START_V)
        self._play = min(max(self._play, x - PLAY_RADIUS), x + PLAY_RADIUS)
        return self._stroke * ((1.0 - PLAY_WEIGHT) * x + PLAY_WEIGHT * self._play)


class Sources:
    """The present value at each instrument of the bench. seed: of the noise."""

    def __init__(self, world: BenchSetup, stage: StageFile, seed: int = 0) -> None:
        self._world, self._stage, self._rng = world, stage, random.Random(seed)
        self._stacks: str | None = None
        self._play = Play(0.0)

    def height(self) -> float | None:
        probe = self._stage.read().probe
        if probe is None or not 1 <= probe <= len(self._world.heights_m):
            return None
        return self._world.heights_m[probe - 1] + self._rng.gauss(0.0, self._world.height_noise_m)

    def capacitance(self) -> float | None:
        leads = self._stage.read().leads
        capacitances = {"sensor": self._world.sensor_F, "actuator": self._world.actuator_F}
        if leads not in capacitances:
            return None
        return capacitances[leads] * (1.0 + self._rng.gauss(0.0, self._world.capacitance_noise))

    def displacement(self) -> float | None:
        stage = self._stage.read()
        strokes = {"one_stack": self._world.one_stack_m, "two_stacks": self._world.two_stacks_m}
        if stage.stacks not in strokes:
            return None
        if stage.stacks != self._stacks:  # another group of stacks starts from rest
            self._stacks, self._play = stage.stacks, Play(strokes[stage.stacks])
        return self._play.at(stage.V) + self._rng.gauss(0.0, self._world.displacement_noise_m)
