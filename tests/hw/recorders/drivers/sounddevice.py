"""The package sounddevice as its documentation prints it: one audio interface with two inputs and two outputs, whose
driver is a loop: a hammer that hits by itself and an accelerometer on a part with modes, or the output behind a wire.

A stream calls its function from a thread of its own, block by block, between its start and its stop; it gives the same
memory each time, as PortAudio does."""

import os
import threading
import time

import numpy as np
from scipy.signal import lfilter

DEVICE = "Interface 2i2"
RATES = (44_100, 48_000, 96_000)
BLOCK, EVERY_s, WIDTH_s, FORCE_N = 1024, 1.2, 6e-4, 90.0
N_PER_FULL_SCALE, MS2_PER_FULL_SCALE = 250.0, 4000.0  # of the hammer and of the accelerometer behind their knobs
LEVER_m = 0.05  # of the accelerometer: angle = displacement / lever
MODES = (  # of the places in their order: frequency [Hz], share
    ((281.0, 1.0), (843.0, 0.02)),
    ((409.0, 1.0), (1210.0, 0.02)),
    ((268.0, 0.6), (412.0, 0.5), (803.0, 0.3)),
    ((268.0, 0.6), (412.0, 0.5)),
)
RUNS_s = 30.0  # of hits; then the hammer rests
BOUNCING = 2  # the hit that bounces, counted from 0
speed = float(os.environ.get("LOOP_SPEED", "1e9"))  # times real time
opened = 0  # streams so far
lose_after: int | None = None  # blocks, then a flag


class PortAudioError(Exception):
    pass


class CallbackFlags:
    def __init__(self, input_overflow: bool = False, output_underflow: bool = False) -> None:
        self.input_overflow, self.output_underflow = input_overflow, output_underflow


def query_devices(device=None, kind=None):
    if device not in DEVICE:
        raise ValueError(f"No input/output device matching {device!r}")
    return {"name": DEVICE, "max_input_channels": 2, "max_output_channels": 2}


def check_input_settings(device=None, channels=None, dtype=None, extra_settings=None, samplerate=None) -> None:
    query_devices(device)
    if channels > 2:
        raise PortAudioError("Error opening InputStream: Invalid number of channels [PaErrorCode -9998]")
    if samplerate not in RATES:
        raise PortAudioError("Error opening InputStream: Invalid sample rate [PaErrorCode -9997]")


def hits(n: int, rate: float, seed: int) -> np.ndarray:
    """Force [N]: half sines between 60 and 120 N, the third one bounces."""
    rng = np.random.default_rng(seed)
    force, width = np.zeros(n), round(WIDTH_s * rate)
    pulse = np.sin(np.pi * (np.arange(width) + 0.5) / width)
    for k in range(int(n / rate / EVERY_s)):
        at, height = round((k + 0.4) * EVERY_s * rate), rng.uniform(60.0, 120.0)
        force[at : at + width] += height * pulse[: max(n - at, 0)]
        if k == BOUNCING:
            late = at + round(0.012 * rate)
            force[late : late + width] += 0.5 * height * pulse
    return force + 0.02 * rng.standard_normal(n)


def acceleration(force: np.ndarray, rate: float, place: int, seed: int) -> np.ndarray:
    """Of the accelerometer [m/s2] under a force: poles by matching, so that frequencies are exact."""
    a, total = 0.008, np.zeros(force.size)
    for f, share in MODES[place]:
        w, T = 2.0 * np.pi * f, 1.0 / rate
        wd, r = w * np.sqrt(1.0 - a * a), np.exp(-a * w * T)
        impulse = lfilter([0.0, np.sin(wd * T) * r], [1.0, -2.0 * r * np.cos(wd * T), r * r], force)
        angle = 3e-7 * share * w / np.sqrt(1.0 - a * a) * T * impulse
        total += np.gradient(np.gradient(angle, T), T)
    return LEVER_m * total + 0.02 * np.random.default_rng(seed + 1).standard_normal(force.size)


class _Stream:
    def __init__(self, channels, callback, samplerate, device, dtype, output: bool) -> None:
        global opened
        query_devices(device)
        inputs = channels[0] if output else channels
        if inputs > 2 or (output and channels[1] > 2):
            raise PortAudioError("Error opening Stream: Invalid number of channels [PaErrorCode -9998]")
        if samplerate not in RATES:
            raise PortAudioError("Error opening Stream: Invalid sample rate [PaErrorCode -9997]")
        assert dtype == "float32"
        self._rate, self._callback, self._inputs = samplerate, callback, inputs
        self._outputs = channels[1] if output else 0
        self._place, opened = opened % len(MODES), opened + 1
        self._source = np.zeros((0, 2))
        if not self._outputs:
            force = hits(round(RUNS_s * self._rate), self._rate, self._place)
            felt = acceleration(force, self._rate, self._place, self._place)
            self._source = np.stack([force / N_PER_FULL_SCALE, felt / MS2_PER_FULL_SCALE], axis=1)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> "_Stream":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join(30.0)
        assert not self._thread.is_alive()

    def _run(self) -> None:
        indata, delayed = np.zeros((BLOCK, self._inputs), dtype=np.float32), np.zeros(300)
        for k in range(10**7):
            if self._over.is_set():
                return
            lost = lose_after is not None and k >= lose_after
            # The first flag is PortAudio's own: the stream runs before anything was there.
            flags = CallbackFlags(lost or k == 0, bool(self._outputs) and k == 0)
            if self._outputs:
                outdata = np.full((BLOCK, self._outputs), np.nan, dtype=np.float32)
                indata[:] = delayed[:BLOCK, None] if delayed.size >= BLOCK else 0.0
                self._callback(indata, outdata, BLOCK, None, flags)
                assert np.isfinite(outdata).all(), "frames that were not filled"
                delayed = np.concatenate([delayed[BLOCK:], np.clip(outdata[:, 0], -1.0, 1.0)])
            else:
                part = self._source[k * BLOCK : (k + 1) * BLOCK]
                indata[:] = 0.0
                indata[: len(part)] = np.clip(part[:, : self._inputs], -1.0, 1.0)
                self._callback(indata, BLOCK, None, flags)
            time.sleep(max(BLOCK / self._rate / speed, 1e-5))
            indata[:] = np.nan  # its memory is used again


class InputStream(_Stream):
    def __init__(self, samplerate=None, device=None, channels=None, dtype=None, callback=None) -> None:
        super().__init__(channels, callback, samplerate, device, dtype, output=False)


class Stream(_Stream):
    def __init__(self, samplerate=None, device=None, channels=None, dtype=None, callback=None) -> None:
        super().__init__(channels, callback, samplerate, device, dtype, output=True)
