"""Audio interfaces as recorders, by PortAudio: a hammer and an accelerometer with current supply on its inputs.

Known from the documentation of the package sounddevice: a `Stream` is a context manager; while it is open it calls a
function from a thread of its own with the frames that came, those to be played, and flags that tell whether some were
lost; numbers are parts of full scale; `check_input_settings` tells whether the device takes a rate. What an interface
cannot do: it passes nothing slower than some hertz, and its output begins at an unknown moment, so that the drive has
to be recorded by an input. The position of its gain knob is unknown to a program: the laboratory compares it with a
known signal. The package is loaded when the first record is taken."""

import queue
from collections.abc import Sequence
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from checks.arrays import Array
from hw.errors import InstrumentRefused, NoReply, SettingsError
from hw.instruments.driver import settings_of
from hw.instruments.reading import Identity
from hw.recorders.recorder import Heard, NamedInputs, RecorderDriver
from specs.bench import RecorderChannel, RecorderEntry
from specs.distribution import install
from specs.strict import Strict, Words

FULL_SCALE = 1.0
RATE_Hz = 48_000.0
PATIENCE_s = 5.0  # for the next frames, which come every few milliseconds
SLOW_CHECKS = ("stroke", "hysteresis", "stiffness", "sensor_highpass")


class AudioSettings(Strict):
    """device: its name in the list of `python -m sounddevice`, or a part that no other name contains."""

    device: Words


class AudioInterface:
    """One audio interface. Inputs and outputs are counted from 1."""

    one_clock = False
    output_range = FULL_SCALE
    slow = False

    def __init__(self, name: str, settings: AudioSettings, drive: str | None) -> None:
        self._name, self._settings = name, settings
        self._drive = None if drive is None else self._number(drive)

    def identify(self) -> Identity:
        audio = self._library()
        try:
            return Identity(str(audio.query_devices(self._settings.device)["name"]))
        except (ValueError, audio.PortAudioError) as e:
            raise self._refusal(e) from e

    def actual_rate(self, inputs: Sequence[RecorderChannel], rate_Hz: float) -> float:
        """Return the rate; an interface supports few, so the bench file should state one."""
        audio = self._library()
        most = max(self._number(at.physical) for at in inputs)
        try:
            audio.check_input_settings(device=self._settings.device, channels=most, dtype="float32", samplerate=rate_Hz)
        except (ValueError, audio.PortAudioError) as e:
            raise InstrumentRefused(
                f"{self._name}: the interface does not take {rate_Hz:g} Hz with {most} inputs ({_line(e)}); "
                f"rate_Hz = {RATE_Hz:.0f} in the bench file is what most take"
            ) from e
        return rate_Hz

    def range_of(self, channel: RecorderChannel) -> float:
        return channel.range if channel.range is not None else FULL_SCALE

    def acquire(self, inputs: NamedInputs, rate_Hz: float, samples: int, output: Array | None, heard: Heard) -> Array:
        audio = self._library()
        columns = [self._number(at.physical) - 1 for _, at in inputs]
        queue = _Queue()
        given: dict[str, Any] = {"samplerate": rate_Hz, "device": self._settings.device, "dtype": "float32"}
        try:
            if output is None:
                stream = audio.InputStream(channels=max(columns) + 1, callback=queue.of_input, **given)
            else:
                duplex = partial(queue.of_both, _Played(output, (self._drive or 1) - 1))
                stream = audio.Stream(channels=(max(columns) + 1, self._drive), callback=duplex, **given)
            with stream:
                blocks = self._blocks(queue, columns, samples, heard)
        except (ValueError, audio.PortAudioError) as e:
            raise self._refusal(e) from e
        return np.concatenate(blocks, axis=1)[:, :samples]

    def close(self) -> None:
        """Leave nothing open: every record closes its stream, and a closed output is silent."""

    def _blocks(self, came: "_Queue", columns: Sequence[int], samples: int, heard: Heard) -> list[Array]:
        blocks: list[Array] = []
        while sum(block.shape[1] for block in blocks) < samples:
            try:
                frames = came.drain(PATIENCE_s)
            except queue.Empty:
                raise NoReply(f"{self._name}: nothing came within {PATIENCE_s:g} s") from None
            except _SamplesLost as e:
                raise NoReply(f"{self._name}: {e}; is this computer busy?") from None
            blocks.append(np.asarray(frames, dtype=float).T[list(columns)])
            if heard(blocks[-1]):
                break
        return blocks

    def _number(self, physical: str) -> int:
        if not physical.isdecimal() or int(physical) < 1:
            raise SettingsError(f"{self._name}: physical = {physical!r}: expected the number of an input, from 1")
        return int(physical)

    def _library(self) -> ModuleType:
        try:
            import sounddevice
        except ImportError as e:
            raise SettingsError(f"{self._name}: audio needs the package sounddevice: {install('audio')}") from e
        except OSError as e:  # raised if PortAudio itself is not there
            raise SettingsError(f"{self._name}: PortAudio is not installed on this computer ({_line(e)})") from e
        library: ModuleType = sounddevice
        return library

    def _refusal(self, error: Exception) -> InstrumentRefused:
        return InstrumentRefused(f"{self._name}: audio interface {self._settings.device!r}: {_line(error)}")


class _SamplesLost(Exception):
    """Samples were lost on their way, or the output had nothing to play."""


class _Played:
    """The output signal: a drive (N,) in one of its columns, then silence."""

    def __init__(self, drive: Array, column: int) -> None:
        self._drive, self._column, self._at = drive, column, 0

    def fill(self, frames: Any) -> None:
        part = self._drive[self._at : self._at + len(frames)]
        frames[:] = 0.0
        frames[: part.size, self._column] = part
        self._at += len(frames)


class _Queue:
    """A queue of blocks from PortAudio's thread to the one that judges, which may be slower."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[tuple[Any, str]] = queue.SimpleQueue()
        self._first = True

    def of_input(self, indata: Any, _frames: int, _time: Any, status: Any) -> None:
        """Take a block of frames; called by PortAudio."""
        lost = "samples were lost" if status.input_overflow and not self._first else ""
        self._first = False
        self._queue.put((np.array(indata), lost))  # its memory is used again

    def of_both(self, played: _Played, indata: Any, outdata: Any, _frames: int, _time: Any, status: Any) -> None:
        """Take a block and provide the output for the next one; called by PortAudio."""
        lost = "the output ran dry" if status.output_underflow and not self._first else ""
        lost = "samples were lost" if status.input_overflow and not self._first else lost
        self._first = False
        played.fill(outdata)
        self._queue.put((np.array(indata), lost))

    def drain(self, timeout_s: float) -> Array:
        """Return all frames that have come, at least one block. Raises queue.Empty, _SamplesLost."""
        found = [self._queue.get(timeout=timeout_s)]
        while True:
            try:
                found.append(self._queue.get_nowait())
            except queue.Empty:
                break
        if words := next((lost for _, lost in found if lost), ""):
            raise _SamplesLost(words)
        return np.concatenate([frames for frames, _ in found])


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def _open(name: str, entry: RecorderEntry) -> AudioInterface:
    if slow := [check for check in entry.measures if check in SLOW_CHECKS]:
        raise SettingsError(f"{name}: an audio interface passes no slow signal, so it cannot measure {', '.join(slow)}")
    settings = settings_of(name, AudioSettings, entry)
    opened = AudioInterface(name, settings, entry.drive.physical if entry.drive else None)
    for channel in entry.channels.values():
        opened._number(channel.physical)  # noqa: SLF001 - of this file: a wrong number is told before anything is opened
    return opened


RECORDER = RecorderDriver(("sounddevice",), _open)
