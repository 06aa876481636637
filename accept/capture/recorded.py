"""Sections that a recorder measures: it drives the unit, or waits for the hammer, and takes the check's records."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from operator import methodcaller

import numpy as np

from accept.capture.operator_actions import OperatorActions
from accept.capture.reading_loop import CaptureStopped, Say
from accept.capture.setup import CaptureResult, RecordFile
from checks.acceptance import HitsSoFar, hammer_progress
from checks.cause import record_label
from checks.declare import Input, Series
from checks.record import Record
from checks.signals import Excitation, Rig
from hw import records
from hw.errors import Implausible
from hw.recorders import Recorder
from specs.spec import CheckSpec

DRIVEN_Hz, SLOW_Hz, HAMMER_Hz = 10_000.0, 1_000.0, 5_120.0  # rates, if the bench file states none
LOW_HZ, HIGH_HZ = (1.0, 400.0), (290.0, 2100.0)  # of the noise: merged at 350 Hz ([STB] 3.2)
LOW_RMS_V, HIGH_RMS_V = 0.04, 0.3
MERGE_HZ = 350.0
SINES_HZ, SINES_V = 0.1, (0.1, 0.2, 0.4, 1.0, 2.0, 4.0)  # of the check's own guide
STROKE_HZ = 0.1
HITS = 10  # of the check's own guide: their scatter then is known to a fifth
HAMMER_s = 180.0  # at most, for one place
STEMS = {
    "low": "frf_low",
    "high": "frf_high",
    "low_repeat": "frf_low_2",
    "high_repeat": "frf_high_2",
    "record": "hysteresis",
}


ShowHits = Callable[[str, HitsSoFar], None]


def nobody_looks(_: str, __: HitsSoFar) -> None:
    """Show the hits of a place on no screen."""


@dataclass(frozen=True)
class Recording:
    """The means of a recipe. asked: the spec's section of the check; inputs: of the check, by name; stopped: whether
    the technician ended the capture; show: is given the hits of a place so far."""

    recorder: Recorder
    actions: OperatorActions
    say: Say
    asked: CheckSpec
    inputs: Mapping[str, Input]
    stopped: Callable[[], bool]
    show: ShowHits = nobody_looks
    notes: list[str] = field(default_factory=list)

    def driven(
        self, key: str, channels: Mapping[str, str], rate_Hz: float, make: Callable[[Rig], Excitation]
    ) -> Record:
        """Return the record of a drive, from its beginning to its end without the ramps. Raises InstrumentError,
        ExcitationError for a drive that the stacks or the amplifier must not get."""
        recorded = {name: unit for name, unit in channels.items() if name != "t"}
        rate = self.recorder.rate(recorded, rate_Hz)
        drive = make(Rig(fs=rate))
        self.say(f"{record_label(key)}: {drive.meaning}, {drive.t.size / rate:.0f} s")
        record = self.recorder.record(recorded, rate, 0.0, drive.Va, stopped=self.stopped)
        if self.stopped() or record.t.size < drive.t.size:
            raise CaptureStopped("stopped; nothing was entered")
        inside = slice(drive.start, drive.stop)
        cut = {name: column[inside] for name, column in record.channels.items()}
        return Record(record.t[inside] - record.t[drive.start], cut, record.units, record.name)


def responses(at: Recording) -> CaptureResult:
    """Record low and high noise, each twice: the second realisation shows the repeatability."""
    channels = _series_of(at, "low").channels
    at.actions.stand_by("Connect the amplifier to the two actuator stacks; from now on the unit is driven")
    files = {}
    for number, key in enumerate(("low", "high", "low_repeat", "high_repeat")):
        (lo, hi), rms = (LOW_HZ, LOW_RMS_V) if key.startswith("low") else (HIGH_HZ, HIGH_RMS_V)
        seconds = at.recorder.entry.response_s
        record = at.driven(key, channels, DRIVEN_Hz, methodcaller("noise", lo, hi, seconds, rms, number))
        files[key] = _file(STEMS[key], record)
    return CaptureResult(files=files, notes=tuple(at.notes))


def hysteresis(at: Recording) -> CaptureResult:
    """Record slow sines of growing amplitude."""
    declared = _series_of(at, "record")
    channels = dict(declared.channels)
    channels |= {c: unit for c, unit in declared.optional_channels.items() if c in at.recorder.entry.channels}
    at.actions.stand_by("Connect the amplifier to the two actuator stacks; from now on the unit is driven")
    record = at.driven("record", channels, SLOW_Hz, lambda rig: rig.sines(SINES_HZ, SINES_V))
    return CaptureResult(files={"record": _file(STEMS["record"], record)}, notes=tuple(at.notes))


def stroke(at: Recording) -> CaptureResult:
    """Record the displacement of one stack, then of the other two, over the whole range of their voltage."""
    files = {}
    for key in ("one_stack", "two_stacks"):
        at.actions.connect(key)
        record = at.driven(key, _series_of(at, key).channels, SLOW_Hz, lambda rig: rig.full_range(STROKE_HZ))
        files[key] = _file(f"stroke_{key}", record)
    return CaptureResult(files=files, notes=tuple(at.notes))


def hammer(at: Recording) -> CaptureResult:
    """Record the hits of the hammer at each place, each judged at once. A place is done with enough good hits."""
    files = {}
    for key in at.inputs:
        at.actions.hammer(key, record_label(key))
        files[key] = _file(f"hammer_{key}", _hits(at, key))
    return CaptureResult(files=files, notes=tuple(at.notes))


def _hits(at: Recording, key: str) -> Record:
    channels = dict(_series_of(at, key).channels)
    rate = at.recorder.rate(channels, HAMMER_Hz)
    at.say(f"{record_label(key)}: hit now")
    reported, next_s = 0, 0.0

    def enough(make: Callable[[], Record]) -> bool:
        nonlocal reported, next_s
        began, record = time.monotonic(), make()
        if record.t[-1] < next_s:  # judging a long record takes a while, in which more has come
            return False
        so_far = hammer_progress(record, asked, HITS)
        at.show(record_label(key), so_far)
        next_s = float(record.t[-1]) + time.monotonic() - began
        if len(so_far.hits) > reported:
            at.say(f"{record_label(key)}, {so_far.words_after(reported)}")  # two, if judging took longer than a hit
            reported = len(so_far.hits)
        return so_far.more == 0 and not so_far.coming

    asked = _with_range(at.asked, at.recorder.range_of("Track1", channels["Track1"]))
    record = at.recorder.record(channels, rate, HAMMER_s, follow=enough, stopped=at.stopped)
    if at.stopped():
        raise CaptureStopped("stopped; nothing was entered")
    so_far = hammer_progress(record, asked)
    if so_far.more:
        raise Implausible(f"{record_label(key)}: {so_far.words} within {HAMMER_s:g} s; begin this step again")
    at.notes.append(f"{record_label(key)}: {so_far.good} of {len(so_far.hits)} hits good")
    return record


def _with_range(asked: CheckSpec, range_N: float) -> CheckSpec:
    """Return the spec's section, with the recorder's range of the force if the spec states none."""
    if asked.settings.get("force_range_N") or not np.isfinite(range_N):
        return asked
    return asked.model_copy(update={"settings": {**asked.settings, "force_range_N": range_N}})


def _file(stem: str, record: Record) -> RecordFile:
    return RecordFile(f"{stem}.mat", records.own_record({"t": record.t, **record.channels}))


def _series_of(at: Recording, name: str) -> Series:
    declared = at.inputs[name]
    if not isinstance(declared, Series):
        raise TypeError(f"{name}: expected a record")
    return declared


RECORDED: dict[str, Callable[[Recording], CaptureResult]] = {
    "frf": responses,
    "hysteresis": hysteresis,
    "stroke": stroke,
    "spurious_modes": hammer,
}
