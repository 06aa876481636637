"""The instruments of a bench file as the workflow's port."""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from accept.capture.operator_actions import StagedOperator
from accept.capture.recipes import GROUPS, POINTS_MM, RECIPES
from accept.capture.recorded import RECORDED
from accept.workflow.instruments.port import InstrumentPort, Instruments
from checks.acceptance import CHECKS
from checks.declare import Series
from hw.errors import SettingsError
from hw.instruments import Instrument as Driver
from hw.instruments import Traffic, open_instrument
from hw.recorders import Recorder, open_recorder
from specs.bench import OFFLINE, SIMULATED, BenchFile, InstrumentEntry, RecorderEntry

BY_HAND = (OFFLINE, "manual")  # what a person reads is typed into its field anyway
MOST_TRAFFIC = 400  # entries beside one reading: some ten looks; what was only looked at for longer counts no more


@dataclass(frozen=True)
class BenchInstrument:
    """A driver, and what must be set up in front of it if the bench is simulated. key: its name in the bench file;
    mutex: one question at a time goes over its line; answered: whether each did when it was asked last, by key."""

    key: str
    driver: Driver
    entry: InstrumentEntry
    set_up: Callable[[], None] = lambda: None
    mutex: threading.Lock = field(default_factory=threading.Lock)
    answered: dict[str, bool] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return _full_name(self.key, self.entry)

    @property
    def short_name(self) -> str:
        return f"{self.key} ({self.entry.model})" if self.entry.model else self.key

    @property
    def offer(self) -> str:
        return "the reading"

    def read(self) -> tuple[float, str]:
        """Return one reading in SI. Raises InstrumentError."""
        with self.mutex:
            self.set_up()
            self.answered[self.key] = False  # until it has
            reading = self.driver.read()
            self.answered[self.key] = True
        return reading.value, reading.unit

    def evidence(self, most: int = MOST_TRAFFIC) -> Mapping[str, Any]:
        """Return model, serial number, calibration, and at most `most` entries of the traffic since the last call."""
        with self.mutex:
            traffic = [] if self.driver.link is None else self.driver.link.take_transcript()
        return _evidence(self.key, self.entry, self.driver.asked, bounded(traffic, most))

    def uncertainty(self, value: float) -> float | None:
        return self.entry.accuracy.at(value) if self.entry.accuracy else None

    def close(self) -> None:
        self.driver.close()


@dataclass(frozen=True)
class BenchRecorder:
    """A recorder; mutex: one record at a time. key: its name in the bench file."""

    key: str
    recorder: Recorder
    mutex: threading.Lock = field(default_factory=threading.Lock)

    @property
    def name(self) -> str:
        return _full_name(self.key, self.recorder.entry)

    def evidence(self) -> Mapping[str, Any]:
        """Return model, serial number, calibrations, and how the inputs were set."""
        entry = self.recorder.entry
        channels = {name: at.model_dump(mode="json", exclude_defaults=True) for name, at in entry.channels.items()}
        return _evidence(self.key, entry, {**entry.settings, "channels": channels})

    def close(self) -> None:
        self.recorder.close()


class BenchInstruments(Instruments):
    """Drivers by name; each opens its line when it is first read and stays open."""

    def __init__(self, bench: BenchFile) -> None:
        """Raise SettingsError for an entry that no driver can take."""
        self._recorders = {
            name: BenchRecorder(name, open_bench_recorder(name, entry)) for name, entry in bench.recorders.items()
        }
        self._instruments = [
            BenchInstrument(name, open_instrument(name, entry, _no_operator), entry)
            for name, entry in bench.instruments.items()
            if entry.driver not in BY_HAND
        ]
        self.staged = StagedOperator(Path(bench.stage)) if bench.stage else None

    def serving(self, check: str, name: str, index: int | None) -> InstrumentPort | None:
        """Return the first instrument that measures this check, if the check's value is a reading: a value that is
        derived from records, such as a stroke, has no instrument."""
        if check not in CHECKS or any(isinstance(i, Series) for i in CHECKS[check].inputs.values()):
            return None
        found = self._measuring(check)
        return None if found is None else replace(found, set_up=partial(self._set_up, name, index))

    def recording(self, check: str) -> BenchInstrument | BenchRecorder | None:
        """Return the recorder for a check's records, else the first instrument that measures it whole, by a recipe."""
        recorder = next((r for r in self._recorders.values() if check in r.recorder.entry.measures), None)
        if recorder is not None and check in RECORDED:
            return recorder
        return self._measuring(check) if check in RECIPES else None

    def _measuring(self, check: str) -> BenchInstrument | None:
        return next((each for each in self._instruments if check in each.entry.measures), None)

    @property
    def answering(self) -> Mapping[str, bool | None]:
        asked = {each.key: each.answered.get(each.key) for each in self._instruments}
        return {**asked, **dict.fromkeys(self._recorders)}

    def close(self) -> None:
        for instrument in self._instruments:
            instrument.close()
        for recorder in self._recorders.values():
            recorder.close()

    def _set_up(self, name: str, index: int | None) -> None:
        """Set up a simulated bench as a technician would set up a real one: its stage holds where the probe stands."""
        if self.staged is None:
            return
        if index is not None and index < len(POINTS_MM):
            self.staged.probe(index + 1, *POINTS_MM[index])
        elif name in GROUPS:
            self.staged.leads(GROUPS[name])


def open_bench_recorder(name: str, entry: RecorderEntry) -> Recorder:
    """Return the recorder of an entry, real or simulated. Raises SettingsError, also for a check that no recorder
    takes."""
    if unknown := [check for check in entry.measures if check not in RECORDED]:
        raise SettingsError(f"{name}: no recorder measures {', '.join(unknown)} (known: {', '.join(RECORDED)})")
    if entry.driver == SIMULATED:
        from accept.simulate.recorder import open_simulated  # the models load slowly: only when wanted

        return open_simulated(name, entry)
    return open_recorder(name, entry)


def _full_name(key: str, entry: InstrumentEntry | RecorderEntry) -> str:
    """Return the name with model and serial number, by which `accept recall` finds it."""
    return " ".join(word for word in (key, entry.model, entry.serial) if word)


def _evidence(
    key: str, entry: InstrumentEntry | RecorderEntry, settings: Mapping[str, Any], traffic: Sequence[Traffic] = ()
) -> dict[str, Any]:
    stated = entry.calibration
    return {
        "instrument": key,
        "model": entry.model,
        "serial": entry.serial,
        "calibration": stated and {"certificate": stated.certificate, "due": stated.due.isoformat()},
        "settings": dict(settings),
        "transcript": [t.to_json() for t in traffic],
    }


def bounded(traffic: Sequence[Traffic], most: int = MOST_TRAFFIC) -> list[Traffic]:
    """Return the last entries, and a note on how many went before: a live value can be shown for hours, and a record
    that is followed has thousands of entries."""
    if len(traffic) <= most:
        return list(traffic)
    gone = len(traffic) - most
    words = f"{gone} earlier lines are not kept here".encode()
    return [Traffic(traffic[gone].t, "note", words), *traffic[gone:]]


def _no_operator(words: str) -> str:
    raise SettingsError(f"{words}: no operator to answer; type the value into its field")
