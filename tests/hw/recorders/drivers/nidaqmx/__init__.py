"""NI-DAQmx as the documentation of the package nidaqmx prints it: one device, whose inputs see its output through a
plant. It is strict about the order of calls, as the driver is: a task that was closed, a channel after the clock, an
output that names the input's clock and is started after it."""

from collections.abc import Callable

import numpy as np

from . import constants, errors, system
from .errors import DaqError

__all__ = ["Task", "constants", "errors", "system"]

CALLS: list[str] = []
CLOCK_Hz = 100e6  # rates are its whole parts
plant: Callable[[str, np.ndarray], np.ndarray] = lambda _channel, output: output  # noqa: E731 - set by a test
fail_after: int | None = None  # samples, then an error
output_range_V = 10.0
_outputs: list["Task"] = []  # of the one device: a second one finds it reserved
_played: list[np.ndarray] = []  # all that the output has given, in order


def forget() -> None:
    global plant, fail_after
    CALLS.clear()
    _outputs.clear()
    _played.clear()
    plant, fail_after = (lambda _channel, output: output), None


class _Timing:
    def __init__(self, task: "Task") -> None:
        self._task = task
        self.samp_clk_rate = 0.0
        self.source, self.samples = "", 0

    def cfg_samp_clk_timing(
        self, rate, source="", active_edge=constants.Edge.RISING, sample_mode=None, samps_per_chan=1000
    ) -> None:
        task = self._task
        assert task.channels, "a clock without a channel"
        assert sample_mode is constants.AcquisitionType.FINITE
        self.samp_clk_rate = CLOCK_Hz / max(round(CLOCK_Hz / rate), 1)
        self.source, self.samples = source, samps_per_chan
        CALLS.append(f"clock {task.kind} {source}".strip())


class _Channel:
    def __init__(self) -> None:
        self.__dict__["set"] = {}

    def __setattr__(self, name: str, value: object) -> None:
        assert name in {"ai_coupling", "ai_excit_src", "ai_excit_val", "ai_excit_voltage_or_current"}, name
        self.__dict__["set"][name] = value


class _Inputs:
    def __init__(self, task: "Task") -> None:
        self._task = task

    def add_ai_voltage_chan(
        self,
        physical_channel,
        name_to_assign_to_channel="",
        terminal_config=constants.TerminalConfiguration.DEFAULT,
        min_val=-5.0,
        max_val=5.0,
    ) -> _Channel:
        self._task.add("ai", physical_channel, max_val)
        assert isinstance(terminal_config, constants.TerminalConfiguration)
        channel = _Channel()
        self._task.made.append(channel)
        return channel


class _Outputs:
    def __init__(self, task: "Task") -> None:
        self._task = task

    def add_ao_voltage_chan(self, physical_channel, name_to_assign_to_channel="", min_val=-10.0, max_val=10.0) -> None:
        if _outputs:
            raise DaqError("The specified resource is reserved.\nTask Name: _unnamed\nStatus Code: -50103")
        self._task.add("ao", physical_channel, max_val)
        _outputs.append(self._task)


class Task:
    last: "Task | None" = None  # that read

    def __init__(self, new_task_name: str = "") -> None:
        self.kind, self.channels, self.made = "", [], []
        self.ai_channels, self.ao_channels = _Inputs(self), _Outputs(self)
        self.timing = _Timing(self)
        self._open, self._started, self._read = True, False, 0
        self._data: np.ndarray | None = None

    def add(self, kind: str, physical: str, end: float) -> None:
        assert self._open
        assert not self.timing.samp_clk_rate, "a channel after the clock"
        assert self.kind in ("", kind), "inputs and outputs are two tasks"
        if not physical.startswith("Dev1/"):
            raise DaqError(f"Device identifier is invalid.\nDevice Specified: {physical}\nStatus Code: -200220")
        self.kind = kind
        self.channels.append((physical, end))
        CALLS.append(f"add {physical}")

    def write(self, data, auto_start=None, timeout=10.0) -> int:
        assert self._open
        assert self.kind == "ao"
        assert auto_start is False, "a finite output that follows a clock is not started by its write"
        data = np.asarray(data, dtype=float)
        assert data.shape == (self.timing.samples,), (data.shape, self.timing.samples)
        if np.abs(data).max() > output_range_V:
            raise DaqError("Requested value is outside the range.\nStatus Code: -200077")
        self._data = data
        CALLS.append("write")
        return data.size

    def start(self) -> None:
        assert self._open
        assert not self._started
        assert self.timing.samp_clk_rate, "started without a clock"
        if self.kind == "ao":
            assert self._data is not None, "an output without data"
            if not self.timing.source:
                _played.append(self._data)
        else:
            waiting = [t for t in _outputs if t.timing.source]
            assert all(t._started for t in waiting), "the output has to wait for the clock before it runs"
            assert all(t.timing.source == "/Dev1/ai/SampleClock" for t in waiting)
        self._started = True
        CALLS.append(f"start {self.kind}")

    def read(self, number_of_samples_per_channel=None, timeout=10.0):
        assert self._open
        assert self.kind == "ai"
        assert self._started, "read before the start"
        n, at = number_of_samples_per_channel, self._read
        assert at + n <= self.timing.samples, "more than the task takes"
        assert timeout > n / self.timing.samp_clk_rate, "it would not wait for its own block"
        if fail_after is not None and at + n > fail_after:
            raise DaqError("The application is not able to keep up with the hardware.\nStatus Code: -200279")
        waiting = [t for t in _outputs if t.timing.source]
        output = waiting[0]._data if waiting else np.zeros(self.timing.samples)
        rows = [np.clip(plant(name, output)[at : at + n], -end, end).tolist() for name, end in self.channels]
        self._read += n
        if waiting:
            _played.append(output[at : at + n])
        return rows if len(rows) > 1 else rows[0]

    def wait_until_done(self, timeout=10.0) -> None:
        assert self._started

    def close(self) -> None:
        assert self._open, "closed twice"
        self._open = False
        if self in _outputs:
            _outputs.remove(self)
        CALLS.append(f"close {self.kind}")

    def __enter__(self) -> "Task":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def played() -> np.ndarray:
    """All that the output gave."""
    return np.concatenate(_played) if _played else np.empty(0)
