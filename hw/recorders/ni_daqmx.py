"""Recorders of National Instruments by NI-DAQmx: analogue inputs and an output on one sample clock.

Known from the documentation of the package nidaqmx: `Task` is a context manager that frees its device; the output waits
for the input's sample clock if it names it as its source and is started first; `read` returns a list of numbers for one
channel and a list of lists for several; `samp_clk_rate` tells the rate that the device really takes. Assumed: the
input's clock is called `/DEVICE/ai/SampleClock`, as on all X and M series and on CompactDAQ (else `clock` names it).
The package needs NI's driver; it is loaded when the first record is taken."""

from collections.abc import Sequence
from contextlib import ExitStack
from types import ModuleType
from typing import Any, Literal

import numpy as np

from checks.arrays import Array
from hw.errors import InstrumentError, InstrumentRefused, SettingsError
from hw.instruments.driver import settings_of
from hw.instruments.reading import Identity
from hw.recorders.recorder import Heard, NamedInputs, RecorderDriver, vet_rate
from specs.bench import RecorderChannel, RecorderEntry
from specs.distribution import install
from specs.strict import Strict, Words

RANGE_V = 10.0  # if the bench file gives no other
BLOCK_s = 0.25  # of one look for new samples
PATIENCE_s = 10.0  # for a block beyond its own length
RAMP_s = 1.0  # from where a drive was ended to zero: a step would hit the stacks
TERMINALS = {"rse": "RSE", "nrse": "NRSE", "diff": "DIFF", "pseudo_diff": "PSEUDO_DIFF", "default": "DEFAULT"}


class DaqmxSettings(Strict):
    """device: its name in NI MAX. clock: terminal of the input's sample clock. terminal, coupling: of all inputs; None
    leaves the device's own."""

    device: Words
    clock: Words | None = None
    terminal: Literal["rse", "nrse", "diff", "pseudo_diff", "default"] = "default"
    coupling: Literal["ac", "dc"] | None = None


class Daqmx:
    """One device of NI-DAQmx."""

    one_clock = True
    output_range = RANGE_V
    slow = True

    def __init__(self, name: str, settings: DaqmxSettings, drive: str | None) -> None:
        self._name, self._settings, self._drive = name, settings, drive

    def identify(self) -> Identity:
        ni = self._library()
        try:
            device = ni.system.Device(self._settings.device)
            number = int(device.serial_num)  # 0: it has none; NI MAX shows it in hexadecimal digits
            return Identity(str(device.product_type), f"{number:08X}" if number else None)
        except ni.errors.Error as e:
            raise self._refusal(e) from e

    def actual_rate(self, inputs: Sequence[RecorderChannel], rate_Hz: float) -> float:
        ni = self._library()
        try:
            with ni.Task() as task:
                self._add_inputs(ni, task, [(f"ch{k}", at) for k, at in enumerate(inputs)])
                task.timing.cfg_samp_clk_timing(rate_Hz, sample_mode=ni.constants.AcquisitionType.FINITE)
                return float(task.timing.samp_clk_rate)
        except ni.errors.Error as e:
            raise self._refusal(e) from e

    def range_of(self, channel: RecorderChannel) -> float:
        return channel.range if channel.range is not None else RANGE_V

    def acquire(self, inputs: NamedInputs, rate_Hz: float, samples: int, output: Array | None, heard: Heard) -> Array:
        ni = self._library()
        finite = ni.constants.AcquisitionType.FINITE
        blocks: list[Array] = []
        try:
            with ExitStack() as open_tasks:
                reader = open_tasks.enter_context(ni.Task())
                self._add_inputs(ni, reader, inputs)
                reader.timing.cfg_samp_clk_timing(rate_Hz, sample_mode=finite, samps_per_chan=samples)
                vet_rate(self._name, rate_Hz, float(reader.timing.samp_clk_rate))
                if output is not None:
                    # Whatever ends the record, the output goes to zero: this is left first.
                    open_tasks.callback(self._ramp_down, ni, output, blocks, rate_Hz)
                    writer = open_tasks.enter_context(ni.Task())
                    self._add_output(writer, output)
                    clock = self._settings.clock or f"/{self._settings.device}/ai/SampleClock"
                    writer.timing.cfg_samp_clk_timing(rate_Hz, source=clock, sample_mode=finite, samps_per_chan=samples)
                    writer.write(output, auto_start=False)
                    writer.start()  # waits for the clock, which the input's start sets going
                reader.start()
                self._read(reader, len(inputs), rate_Hz, samples, blocks, heard)
        except ni.errors.Error as e:
            raise self._refusal(e) from e
        return np.concatenate(blocks, axis=1)

    def close(self) -> None:
        """Do nothing: every record frees its device."""

    def _library(self) -> ModuleType:
        try:
            import nidaqmx
            import nidaqmx.constants
            import nidaqmx.errors
            import nidaqmx.system
        except ImportError as e:
            raise SettingsError(f"{self._name}: NI-DAQmx needs the package nidaqmx: {install('ni')}") from e
        library: ModuleType = nidaqmx
        return library

    def _add_inputs(self, ni: ModuleType, task: Any, inputs: NamedInputs) -> None:
        constants = ni.constants
        terminal = getattr(constants.TerminalConfiguration, TERMINALS[self._settings.terminal])
        for name, at in inputs:
            end = self.range_of(at)
            channel = task.ai_channels.add_ai_voltage_chan(
                at.physical, name_to_assign_to_channel=name, terminal_config=terminal, min_val=-end, max_val=end
            )
            if at.iepe_mA is not None:
                channel.ai_coupling = constants.Coupling.AC
                channel.ai_excit_src = constants.ExcitationSource.INTERNAL
                channel.ai_excit_voltage_or_current = constants.ExcitationVoltageOrCurrent.USE_CURRENT
                channel.ai_excit_val = at.iepe_mA / 1000.0
            elif self._settings.coupling is not None:
                channel.ai_coupling = getattr(constants.Coupling, self._settings.coupling.upper())

    def _add_output(self, task: Any, output: Array) -> None:
        end = max(float(np.abs(output).max()), 0.1)
        task.ao_channels.add_ao_voltage_chan(self._drive, min_val=-end, max_val=end)

    def _read(self, task: Any, count: int, rate_Hz: float, samples: int, blocks: list[Array], heard: Heard) -> None:
        block, left = max(round(BLOCK_s * rate_Hz), 1), samples
        while left > 0:
            n = min(block, left)
            numbers = np.atleast_2d(
                np.asarray(task.read(number_of_samples_per_channel=n, timeout=n / rate_Hz + PATIENCE_s), dtype=float)
            )
            if numbers.shape != (count, n):
                raise InstrumentError(f"{self._name}: {numbers.shape} numbers came, expected {(count, n)}")
            blocks.append(numbers)
            left -= n
            if heard(numbers):
                return

    def _ramp_down(self, ni: ModuleType, output: Array, blocks: Sequence[Array], rate_Hz: float) -> None:
        """Play a smooth way to zero if the drive was ended before its own end."""
        played = sum(block.shape[1] for block in blocks)
        if played >= output.size and output[-1] == 0.0:
            return
        now = float(output[min(played, output.size - 1)])
        n = max(round(RAMP_s * rate_Hz), 2)
        ramp = now * 0.5 * (1.0 + np.cos(np.pi * np.arange(1, n + 1) / n))
        with ni.Task() as task:
            self._add_output(task, ramp)
            task.timing.cfg_samp_clk_timing(
                rate_Hz, sample_mode=ni.constants.AcquisitionType.FINITE, samps_per_chan=ramp.size
            )
            task.write(ramp, auto_start=False)
            task.start()
            task.wait_until_done(timeout=RAMP_s + PATIENCE_s)

    def _refusal(self, error: Exception) -> InstrumentRefused:
        words = " ".join(str(error).split())
        return InstrumentRefused(f"{self._name}: NI-DAQmx: {words}")


def _open(name: str, entry: RecorderEntry) -> Daqmx:
    return Daqmx(name, settings_of(name, DaqmxSettings, entry), entry.drive.physical if entry.drive else None)


RECORDER = RecorderDriver(("nidaqmx",), _open)
