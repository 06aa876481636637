"""Recorders against drivers written from their documentation: what is recorded is what was there, in the stated unit;
nothing is cut, nothing is played beyond a range, and the output always ends at zero."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from checks.acceptance.spurious_modes import CHANNELS
from checks.signals import Rig
from hw.errors import (
    Implausible,
    InstrumentError,
    InstrumentRefused,
    NoReply,
    OverRange,
    SettingsError,
    WrongInstrument,
)
from hw.recorders import RECORDERS, Recorder, open_recorder
from specs.bench import parse_bench

DRIVERS = Path(__file__).parent / "drivers"
NI = """
name = "bench"
[recorders.daq]
driver = "nidaqmx"
measures = ["frf"]
model = "USB-6363"
serial = "01A2B3C4"
settings = {{ device = "{device}" }}
drive = {{ physical = "Dev1/ao0" }}
[recorders.daq.channels]
Va = {{ physical = "Dev1/ai0", unit = "V" }}
Vs = {{ physical = "Dev1/ai1", unit = "V", gain = 2.0, range = 5.0 }}
de = {{ physical = "Dev1/ai2", unit = "um", gain = 10.0 }}
played = {{ physical = "drive", unit = "V" }}
force = {{ physical = "Dev1/ai3", unit = "N", gain = 100.0, iepe_mA = 4.0 }}
"""
AUDIO = """
name = "bench"
[recorders.audio]
driver = "sounddevice"
measures = ["spurious_modes"]
rate_Hz = 48000.0
settings = {{ device = "Interface" }}
drive = {{ physical = "1", gain = 10.0 }}
[recorders.audio.channels]
Track1 = {{ physical = "1", unit = "N", gain = 250.0 }}
Track2 = {{ physical = "{second}", unit = "rad", gain = 80000.0, integrations = 2 }}
Va = {{ physical = "1", unit = "V", gain = 10.0 }}
"""
WANTED = {"Va": "V", "Vs": "V", "de": "m"}
DRIVE = Rig(fs=10_000.0, ramp_s=0.5).noise(10.0, 400.0, 2.0, 0.2, seed=1).Va


@pytest.fixture
def daqmx(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    return _driver(monkeypatch, "nidaqmx")


@pytest.fixture
def audio(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    return _driver(monkeypatch, "sounddevice")


def _driver(monkeypatch: pytest.MonkeyPatch, name: str) -> ModuleType:
    for known in [m for m in sys.modules if m.partition(".")[0] == name]:
        monkeypatch.delitem(sys.modules, known)
    monkeypatch.syspath_prepend(str(DRIVERS))
    return __import__(name)


def recorder(text: str, name: str) -> Recorder:
    return open_recorder(name, parse_bench(text.encode(), "bench.toml").recorders[name])


def daq(device: str = "Dev1") -> Recorder:
    return recorder(NI.format(device=device), "daq")


def test_daqmx_records_what_is_there_in_the_unit_that_is_asked(daqmx: ModuleType) -> None:
    daqmx.plant = lambda channel, V: {"Dev1/ai0": V, "Dev1/ai1": 0.5 * V, "Dev1/ai2": 0.1 * V}[channel]
    record = daq().record(WANTED | {"played": "V"}, 10_000.0, 0.0, DRIVE)
    assert record.fs == pytest.approx(10_000.0)
    assert np.array_equal(record["Va"], DRIVE)
    assert np.array_equal(record["played"], DRIVE)
    assert np.allclose(record["Vs"], DRIVE, rtol=1e-12)  # 0.5 V per V, gain 2
    assert np.allclose(record["de"], 1e-6 * DRIVE, rtol=1e-12)  # 0.1 V per V, 10 um per V, in m
    assert np.array_equal(daqmx.played(), DRIVE)  # and nothing after it: it ends at zero by itself
    assert daqmx.CALLS[:3] == ["add Dev1/ai0", "add Dev1/ai1", "add Dev1/ai2"]
    assert daqmx.CALLS.index("start ao") < daqmx.CALLS.index("start ai")
    assert daqmx.CALLS.count("close ai") == daqmx.CALLS.count("close ao") == 1


def test_daqmx_says_who_it_is(daqmx: ModuleType) -> None:
    assert daq().connect().serial == "01A2B3C4"
    other = NI.replace("01A2B3C4", "0BADCAFE").format(device="Dev1")
    with pytest.raises(WrongInstrument, match="swapped"):
        recorder(other, "daq").connect()
    with pytest.raises(InstrumentRefused, match="Device identifier is invalid"):
        daq("Dev9").connect()


def test_daqmx_feeds_a_sensor_with_current(daqmx: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    add = daqmx.Task.add
    monkeypatch.setattr(daqmx.Task, "add", lambda task, *a: (made.append(task), add(task, *a))[1])
    daq().record({"force": "N"}, 10_000.0, 0.5)
    (channel,) = made[-1].made
    assert channel.set["ai_excit_val"] == pytest.approx(0.004)
    assert channel.set["ai_excit_src"].name == "INTERNAL"
    assert channel.set["ai_excit_voltage_or_current"].name == "USE_CURRENT"
    assert channel.set["ai_coupling"].name == "AC"


@pytest.mark.parametrize("how", ["stopped", "failed"])
def test_an_ended_drive_goes_smoothly_to_zero(daqmx: ModuleType, how: str) -> None:
    blocks = 0

    def stopped() -> bool:
        nonlocal blocks
        blocks += 1
        return how == "stopped" and blocks == 4  # in the middle, at the mean voltage

    if how == "failed":
        daqmx.fail_after = 10_000
        with pytest.raises(InstrumentRefused, match="-200279"):
            daq().record(WANTED, 10_000.0, 0.0, DRIVE)
    else:
        record = daq().record(WANTED, 10_000.0, 0.0, DRIVE, stopped=stopped)
        assert record.t.size == 10_000  # four blocks of a quarter of a second
    played = daqmx.played()
    assert played[-1] == pytest.approx(0.0, abs=1e-12)
    assert played.size == 20_000  # a second of the drive and a second of the way back
    within = np.abs(np.diff(played[10_001:])).max()
    assert within < 1e-3  # V per sample: pi/2 x 3.5 V over 10,000 samples is 5.5e-4
    assert abs(played[10_000] - played[9_999]) < np.abs(np.diff(DRIVE)).max() + 1e-3


@pytest.mark.parametrize(
    ("wanted", "drive", "error", "words"),
    [
        ({"Va": "V", "da": "m"}, DRIVE, SettingsError, "has no 'da'"),
        ({"Va": "m"}, DRIVE, SettingsError, "V does not fit here; use m"),
        ({"played": "V"}, None, SettingsError, "nothing is played"),
        ({"Va": "V"}, 4.0 * DRIVE, Implausible, "nothing was played"),
        ({"Va": "V"}, np.full(100, np.nan), Implausible, "nothing was played"),
    ],
)
def test_what_cannot_be_recorded_plays_nothing(
    daqmx: ModuleType, wanted: dict[str, str], drive: np.ndarray | None, error: type[InstrumentError], words: str
) -> None:
    with pytest.raises(error, match=words):
        daq().record(wanted, 10_000.0, 1.0, drive)
    assert not daqmx.CALLS or drive is None


def test_an_overloaded_input_is_no_record(daqmx: ModuleType) -> None:
    daqmx.plant = lambda channel, V: 2.0 * V  # 6.5 V and more into 5 V
    with pytest.raises(OverRange, match=r"Vs reached the end of its range \(5 at Dev1/ai1\)"):
        daq().record(WANTED, 10_000.0, 0.0, DRIVE)
    assert daqmx.played()[-1] == 0.0


def test_a_clock_that_takes_another_rate_says_so(daqmx: ModuleType) -> None:
    daqmx.CLOCK_Hz = 13.1072e6 / 256  # as of an analyser module: 51.2 kHz and whole parts
    assert daq().rate(WANTED, 10_000.0) == pytest.approx(10_240.0)
    with pytest.raises(InstrumentError, match="runs at 10240 Hz and was asked for 10000"):
        daq().record(WANTED, 10_000.0, 0.0, DRIVE)


def test_without_its_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "nidaqmx", None)
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    with pytest.raises(SettingsError, match=r"accept-bench\[ni\]"):
        daq().connect()
    with pytest.raises(SettingsError, match=r"accept-bench\[audio\]"):
        interface().connect()


def interface(second: str = "2") -> Recorder:
    text = AUDIO.format(second=second).replace('Va = { physical = "1", unit = "V", gain = 10.0 }\n', "")
    return recorder(text, "audio")


def test_an_accelerometer_on_an_audio_interface_shows_the_angle(audio: ModuleType) -> None:
    audio.opened = 0
    record = interface().record(CHANNELS, 48_000.0, 6.0)
    truth = audio.hits(round(audio.RUNS_s * 48_000), 48_000.0, 0)[: record.t.size]
    assert np.allclose(record["Track1"], truth, atol=1e-4)  # single precision of 250 N
    seen, angle = (np.abs(np.fft.rfft(x)) for x in (record["Track2"], _angle(audio, truth)))
    f = np.fft.rfftfreq(truth.size, 1 / 48_000.0)
    near = (f > 275.0) & (f < 287.0)
    assert seen[near].max() == pytest.approx(angle[near].max(), rel=0.01)  # noise of the sensor: 0.3 %


def _angle(audio: ModuleType, force: np.ndarray) -> np.ndarray:
    from scipy.signal import lfilter

    total = np.zeros(force.size)
    for f, share in audio.MODES[0]:
        w, T = 2 * np.pi * f, 1 / 48_000.0
        wd, r = w * np.sqrt(1 - 0.008**2), np.exp(-0.008 * w * T)
        total += (
            3e-7
            * share
            * w
            / np.sqrt(1 - 0.008**2)
            * T
            * lfilter([0.0, np.sin(wd * T) * r], [1.0, -2 * r * np.cos(wd * T), r * r], force)
        )
    return total


def test_a_follower_ends_the_record_and_sees_it_grow(audio: ModuleType) -> None:
    lengths = []

    def enough(make) -> bool:
        lengths.append(make().t.size)
        return lengths[-1] > 48_000

    record = interface().record(CHANNELS, 48_000.0, 100.0, follow=enough)
    assert lengths == sorted(lengths)
    assert record.t.size == lengths[-1]


def test_lost_samples_are_no_record(audio: ModuleType) -> None:
    audio.lose_after = 20
    with pytest.raises(NoReply, match="samples were lost"):
        interface().record(CHANNELS, 48_000.0, 6.0)


def test_the_output_of_an_audio_interface_comes_back_by_an_input(audio: ModuleType) -> None:
    text = AUDIO.replace('Track1 = {{ physical = "1", unit = "N", gain = 250.0 }}\n', "").format(second="2")
    drive = 0.1 * DRIVE
    record = recorder(text, "audio").record({"Va": "V"}, 48_000.0, 0.0, drive)
    seen, shape = np.diff(record["Va"][8_000:14_000]), np.diff(drive[8_000:12_000])
    late = int(np.argmax(np.correlate(seen, shape, "valid")))
    assert late > 0  # it begins at an unknown moment
    assert np.allclose(record["Va"][late:], drive[: drive.size - late], atol=1e-6)  # single precision of 1 V


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('physical = "1", unit = "N"', 'physical = "one", unit = "N"'), "expected the number of an input"),
        (('physical = "1", unit = "N"', 'physical = "drive", unit = "N"'), "expected the number of an input"),
        (('"spurious_modes"', '"stroke"'), "passes no slow signal"),
        (('device = "Interface"', 'mike = "Interface"'), "mike"),
        (('driver = "sounddevice"', 'driver = "cassette"'), "unknown recorder 'cassette'"),
    ],
)
def test_a_bench_file_that_no_recorder_can_follow(change: tuple[str, str], words: str) -> None:
    with pytest.raises(SettingsError, match=words):
        recorder(AUDIO.format(second="2").replace(*change), "audio")


def test_one_input_is_one_channel() -> None:
    with pytest.raises(SettingsError, match="input 1 is given to two channels"):
        recorder(AUDIO.format(second="1"), "audio")


def test_an_interface_that_does_not_take_the_rate_says_which_most_take(audio: ModuleType) -> None:
    text = AUDIO.format(second="2").replace("rate_Hz = 48000.0", "rate_Hz = 5120.0")
    text = text.replace('Va = { physical = "1", unit = "V", gain = 10.0 }\n', "")
    with pytest.raises(InstrumentRefused, match="rate_Hz = 48000"):
        recorder(text, "audio").rate(CHANNELS, 5120.0)


def test_back_ends_are_found_by_their_folder() -> None:
    assert {"nidaqmx", "sounddevice"} <= set(RECORDERS)
