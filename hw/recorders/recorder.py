"""A recorder: inputs, and mostly an output, on one clock, from which a record is made.

The back end (`Converter`) moves numbers of the converters; gains, units, ranges and the record are made here."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from checks.arrays import Array
from checks.record import Record
from checks.signals import integrated
from hw.errors import Garbled, Implausible, InstrumentError, NoReply, OverRange, SettingsError
from hw.instruments.reading import Identity, check_identity
from specs.bench import RecorderChannel, RecorderEntry
from specs.units import UnitMismatch, factor

DRIVE = "drive"  # `physical` of a channel with the played signal, if one clock plays and records
NEAR_END = 0.999  # of a converter's range: a value beyond may have been cut
RATE_WITHIN = 1e-4  # a clock may differ from the wanted rate as a quartz does
MOST_SAMPLES = 50_000_000  # of all channels together: 400 MB as doubles

NamedInputs = Sequence[tuple[str, RecorderChannel]]
"""Name and entry of each input."""
Heard = Callable[[Array], bool]
"""Receives each block (C, n) of the converters' numbers as it comes; returns whether that is enough."""
Follow = Callable[[Callable[[], Record]], bool]
"""Receives a function that makes the record so far; returns whether that is enough."""


class Converter(Protocol):
    """The interface of a back end. one_clock: output and record begin with the same sample, so that a channel may be
    `drive`; slow: whether it passes frequencies below a hertz; output_range: the largest output."""

    one_clock: bool
    output_range: float
    slow: bool

    def identify(self) -> Identity:
        """Return model and serial number as the device states them. Raises InstrumentError."""

    def actual_rate(self, inputs: Sequence[RecorderChannel], rate_Hz: float) -> float:
        """Return the rate [Hz] at which it would run if it was asked for this one. Raises InstrumentError."""

    def acquire(self, inputs: NamedInputs, rate_Hz: float, samples: int, output: Array | None, heard: Heard) -> Array:
        """Return (C, N) numbers of the inputs, N = samples unless `heard` ended it; output (samples,) is played
        meanwhile, and ends at zero whatever happens. Raises InstrumentError."""

    def range_of(self, channel: RecorderChannel) -> float: ...

    def close(self) -> None: ...


Opener = Callable[[str, RecorderEntry], Converter]


@dataclass(frozen=True)
class RecorderDriver:
    """names: as `driver` of a recorder in a bench file. open: (name in the bench file, entry) -> back end, which opens
    nothing before its first use; raises SettingsError."""

    names: tuple[str, ...]
    open: Opener

    @property
    def name(self) -> str:
        return self.names[0]


class Recorder:
    """Takes records by name and unit of their channels."""

    def __init__(self, name: str, entry: RecorderEntry, converter: Converter) -> None:
        """Raise SettingsError if the back end cannot do what the entry requires."""
        self.name, self.entry, self._converter = name, entry, converter
        played = [c for c, at in entry.channels.items() if at.physical == DRIVE]
        if played and not (converter.one_clock and entry.drive is not None):
            words = "needs [recorders.{0}.drive]" if converter.one_clock else "is not known: record it by an input"
            raise SettingsError(f"{name}: {', '.join(played)}: physical = 'drive' {words.format(name)}")
        places = [at.physical for at in entry.channels.values() if at.physical != DRIVE]
        if twice := sorted({at for at in places if places.count(at) > 1}):
            raise SettingsError(f"{name}: input {', '.join(twice)} is given to two channels")

    @property
    def slow(self) -> bool:
        """Return whether it passes frequencies below a hertz."""
        return self._converter.slow

    def connect(self) -> Identity:
        """Return the device's identity. Raises InstrumentError, WrongInstrument if the bench file names another."""
        identity = self._converter.identify()
        check_identity(self.name, identity, self.entry.model, self.entry.serial)
        return identity

    def close(self) -> None:
        self._converter.close()

    def rate(self, channels: Mapping[str, str], wanted_Hz: float) -> float:
        """Return the rate [Hz]: the bench file's, else the nearest to the wanted one. Raises InstrumentError."""
        inputs = [at for _, at in self._inputs(channels) if at.physical != DRIVE]
        return self._converter.actual_rate(inputs, self.entry.rate_Hz or wanted_Hz)

    def range_of(self, channel: str, unit: str) -> float:
        """Return the largest value, in a unit, that a channel can have. Raises SettingsError."""
        at = self._at(channel)
        return abs(self._converter.range_of(at) * at.gain * self._factor(channel, unit))

    def record(
        self,
        channels: Mapping[str, str],
        rate_Hz: float,
        seconds: float,
        drive: Array | None = None,
        follow: Follow | None = None,
        stopped: Callable[[], bool] = lambda: False,
    ) -> Record:
        """Return a record of channels (name -> unit in the record), shorter if `follow` or `stopped` ended it.

        rate_Hz: one of `rate`. drive (N,): voltage at the amplifier's input [V], played meanwhile, from 0 V to 0 V; the
        record is then as long as it, and refused if an input was overloaded. follow: called with the record so far.
        Raises InstrumentError, and plays nothing then."""
        inputs = self._inputs(channels)
        samples = drive.size if drive is not None else round(seconds * rate_Hz)
        if not 2 <= samples * len(inputs) <= MOST_SAMPLES:
            raise SettingsError(f"{self.name}: {samples} samples of {len(inputs)} channels: at most {MOST_SAMPLES}")
        output = None if drive is None else self._output(drive)
        wired = [(name, at) for name, at in inputs if at.physical != DRIVE]
        if output is None and len(wired) != len(inputs):
            raise SettingsError(f"{self.name}: nothing is played, so there is no channel 'drive'")
        blocks: list[Array] = []

        def heard(block: Array) -> bool:
            if stopped():
                return True
            if follow is None:
                return False
            blocks.append(block)
            return follow(lambda: self._make_record(inputs, channels, rate_Hz, np.concatenate(blocks, axis=1), drive))

        raw = self._converter.acquire(wired, rate_Hz, samples, output, heard)
        if raw.shape[0] != len(wired) or not 0 < raw.shape[1] <= samples:
            raise NoReply(f"{self.name}: {raw.shape} numbers came, expected {len(wired)} channels of {samples}")
        if not np.isfinite(raw).all():
            raise Garbled(f"{self.name}: numbers that are not finite came")
        if drive is not None:
            self._vet_ranges(wired, raw)
        return self._make_record(inputs, channels, rate_Hz, raw, drive)

    def _at(self, channel: str) -> RecorderChannel:
        try:
            return self.entry.channels[channel]
        except KeyError:
            words = f"no '{channel}', which this step records (it has: {', '.join(self.entry.channels)})"
            raise SettingsError(f"{self.name}: [recorders.{self.name}.channels] has {words}") from None

    def _inputs(self, channels: Mapping[str, str]) -> list[tuple[str, RecorderChannel]]:
        """Return the inputs of channels. Raises SettingsError for a missing input or another kind of unit."""
        for name, unit in channels.items():
            self._factor(name, unit)
        return [(name, self._at(name)) for name in channels]

    def _factor(self, channel: str, unit: str) -> float:
        try:
            return factor(self._at(channel).unit, unit)
        except UnitMismatch as e:
            raise SettingsError(f"{self.name}: channel {channel}: {e}") from e

    def _output(self, drive: Array) -> Array:
        """Return the numbers for the output. Raises SettingsError, Implausible for a drive beyond its range."""
        at = self.entry.drive
        if at is None:
            raise SettingsError(f"{self.name}: [recorders.{self.name}.drive] is missing: this step needs a drive")
        output = drive / at.gain
        most = at.range if at.range is not None else self._converter.output_range
        if not np.isfinite(output).all() or np.abs(output).max() > most:
            words = f"the drive reaches {np.abs(drive).max():.4g} V, the output only {most * at.gain:.4g} V"
            raise Implausible(f"{self.name}: {words}; nothing was played")
        return output

    def _vet_ranges(self, wired: NamedInputs, raw: Array) -> None:
        for (name, at), numbers in zip(wired, raw, strict=True):
            end = self._converter.range_of(at)
            beyond = int(np.count_nonzero(np.abs(numbers) >= NEAR_END * end))
            if beyond:
                raise OverRange(
                    f"{self.name}: {name} reached the end of its range ({end:g} at {at.physical}) in {beyond} samples; "
                    "lower the drive or widen the range"
                )

    def _make_record(
        self, inputs: NamedInputs, channels: Mapping[str, str], rate_Hz: float, raw: Array, drive: Array | None
    ) -> Record:
        rows, columns = iter(raw), {}
        for name, at in inputs:
            numbers = drive[: raw.shape[1]] if at.physical == DRIVE and drive is not None else next(rows)
            value = at.gain * self._factor(name, channels[name]) * numbers
            columns[name] = integrated(value, rate_Hz, at.integrations) if at.integrations else value
        return Record(np.arange(raw.shape[1]) / rate_Hz, columns, dict(channels), self.name)


def vet_rate(name: str, asked_Hz: float, actual_Hz: float) -> None:
    """Raise InstrumentError if a device runs at another rate than it was asked for."""
    if not abs(actual_Hz / asked_Hz - 1.0) <= RATE_WITHIN:
        raise InstrumentError(f"{name}: it runs at {actual_Hz:.8g} Hz and was asked for {asked_Hz:.8g} Hz")
