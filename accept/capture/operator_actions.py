"""The operator's actions at the bench - put the probe on a point, connect the leads, set a voltage - and their
performers: a person who is asked, a clock that plays, or the file of a simulated bench."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from hw.errors import Implausible, SettingsError
from hw.simulated import StageFile
from specs.bench import STACK_V

Ask = Callable[[str], str]
NAMES = {
    "sensor": "the sensor stack",
    "actuator": "the two actuator stacks in parallel",
    "one_stack": "one stack",
    "two_stacks": "the two other stacks",
    "closed_circuit": "Connect the stacks to the amplifier at 0 V",
    "open_circuit": "Disconnect the stacks",
}

NO_MASS = "the simulated bench has no mass to put on"


class OperatorActions(Protocol):
    """The operator's actions. Every call returns when it is done. Voltages in V on the stacks, points counted from 1.
    sets_each_voltage: a person sets each by hand, so there should be few."""

    sets_each_voltage: bool

    def probe(self, point: int, x_mm: float, y_mm: float) -> None: ...
    def leads(self, group: str) -> None: ...
    def drive(self, stacks: str) -> None: ...
    def voltage(self, V: float) -> None: ...
    def weigh(self) -> str: ...
    def load(self, circuit: str) -> None: ...
    def stand_by(self, words: str) -> None: ...
    def connect(self, stacks: str) -> None: ...
    def hammer(self, place: str, called: str) -> None: ...


class Person:
    """A person who is asked and answers with Enter."""

    sets_each_voltage = True

    def __init__(self, ask: Ask) -> None:
        self._ask = ask

    def probe(self, point: int, x_mm: float, y_mm: float) -> None:
        self._ask(f"Put the probe on point {point} (x {x_mm:g} mm, y {y_mm:g} mm), then Enter: ")

    def leads(self, group: str) -> None:
        self._ask(f"Discharge the stacks and connect the meter to {NAMES[group]}, then Enter: ")

    def drive(self, stacks: str) -> None:
        self._ask(f"Connect the amplifier to {NAMES[stacks]}, zero the gauge, set -20 V, then Enter: ")

    def voltage(self, V: float) -> None:
        self._ask(f"Set {V:g} V, then Enter: ")

    def weigh(self) -> str:
        return self._ask("Weigh the mass; its mass in kg: ")

    def load(self, circuit: str) -> None:
        self._ask(f"{NAMES[circuit]}; leave the mass off, then Enter, and put it on when you are told: ")

    def stand_by(self, words: str) -> None:
        """Ask for Enter before something is driven."""
        self._ask(f"{words}, then Enter: ")

    def connect(self, stacks: str) -> None:
        self._ask(f"Connect the amplifier to {NAMES[stacks]} and zero the gauge; Enter starts the drive: ")

    def hammer(self, place: str, called: str) -> None:
        """Ask for Enter before the hits of a record. place: its name; called: in words."""
        del place
        self._ask(f"{called}: take the hammer, Enter, then hit; each hit is judged at once: ")


class Player(Person):
    """A person, but the voltage steps are played by the rig: `dwell_s` per step from when the person starts it.

    Each step counts as reached `settle_s` after its beginning, which must cover the person's reaction and creep."""

    sets_each_voltage = False

    def __init__(self, ask: Ask, dwell_s: float, settle_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(ask)
        self._dwell_s, self._settle_s, self._clock = dwell_s, settle_s, clock
        self._start, self._step = 0.0, 0

    def drive(self, stacks: str) -> None:
        self._ask(f"Connect the amplifier to {NAMES[stacks]}, zero the gauge, then start the rig and press Enter: ")
        self._start, self._step = self._clock(), 0

    def voltage(self, _: float) -> None:
        begins = self._start + self._step * self._dwell_s
        if self._clock() > begins + self._settle_s:
            raise Implausible(
                f"step {self._step + 1}: the reading before it took until after this step had settled, and at which "
                f"voltage it was taken is not known; let the rig dwell longer than {self._dwell_s:g} s"
            )
        self._step += 1
        time.sleep(max(0.0, begins + self._settle_s - self._clock()))


class StagedOperator:
    """The operator of a simulated bench, who writes into its stage file."""

    sets_each_voltage = False

    def __init__(self, file: Path) -> None:
        self._file = StageFile(file)

    def probe(self, point: int, *_: float) -> None:
        self._set(probe=point)

    def leads(self, group: str) -> None:
        self._set(leads=group)

    def drive(self, stacks: str) -> None:
        self._set(stacks=stacks, V=STACK_V[0])

    def voltage(self, V: float) -> None:
        self._set(V=V)

    def weigh(self) -> str:
        raise SettingsError(NO_MASS)

    def load(self, _: str) -> None:
        raise SettingsError(NO_MASS)

    def stand_by(self, _: str) -> None:
        """Do nothing: the simulated unit is always connected."""

    def connect(self, stacks: str) -> None:
        self._set(stacks=stacks)

    def hammer(self, place: str, _: str) -> None:
        self._set(hit=place)

    def _set(self, **what: object) -> None:
        self._file.write(replace(self._file.read(), **what))  # type: ignore[arg-type]
