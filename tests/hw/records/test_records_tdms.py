"""TDMS files: what npTDMS writes is read to the last bit; what is damaged or cut off is refused."""

import tracemalloc

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from checks.declare import Series
from checks.errors import RecordError
from hw.records import list_channels, read

SERIES = Series("a record", "a record", channels={"V": "V", "d": "m"})
N = 200
RNG = np.random.default_rng(3)
DATA = {"V": RNG.normal(size=N), "d": RNG.normal(size=N) * 1e-6}
WAVE = {"wf_increment": 1e-3, "wf_start_offset": 0.5}


def written(path, channels=DATA, properties=WAVE, group="bench", more=()):
    with TdmsWriter(str(path)) as writer:
        writer.write_segment([ChannelObject(group, name, x, properties=properties) for name, x in channels.items()])
        for segment in more:
            writer.write_segment(segment)
    return path


def test_channels_and_their_time(tmp_path):
    record = read(written(tmp_path / "run.tdms"), SERIES)
    for name, x in DATA.items():
        np.testing.assert_array_equal(record.channels[name], x)
    np.testing.assert_allclose(record.t, 0.5 + 1e-3 * np.arange(N), rtol=1e-12)


def test_a_time_channel_goes_before_the_properties(tmp_path):
    t = 7.0 + 1e-3 * np.arange(N)
    record = read(written(tmp_path / "run.tdms", {**DATA, "t": t}), SERIES)
    np.testing.assert_array_equal(record.t, t)


def test_a_time_channel_and_properties_that_contradict_each_other(tmp_path):
    with pytest.raises(RecordError, match=r"0.001 s by 'wf_increment' and 0.00502513 s by 't'"):
        read(written(tmp_path / "run.tdms", {**DATA, "t": np.linspace(0.0, 1.0, N)}), SERIES)


def test_several_segments_are_one_channel(tmp_path):
    more = [[ChannelObject("bench", name, x) for name, x in DATA.items()]]
    record = read(written(tmp_path / "run.tdms", more=more), SERIES)
    np.testing.assert_array_equal(record.channels["V"], np.tile(DATA["V"], 2))


def test_names_of_two_groups_and_units(tmp_path):
    path = tmp_path / "run.tdms"
    with TdmsWriter(str(path)) as writer:
        for group in ("one", "two"):
            writer.write_segment([ChannelObject(group, "V", DATA["V"], properties={**WAVE, "unit_string": "Volts"})])
    found = list_channels(path)
    assert {"one/V", "two/V"} <= {str(name) for name in found}


@pytest.mark.parametrize(
    ("properties", "words"),
    [
        ({}, "lacks 't'"),
        ({"wf_increment": -1.0}, "no time"),
        ({"wf_increment": float("nan")}, "no time|different times"),
        ({**WAVE, "unit_string": "mV"}, "'d': mV does not fit here; use m"),
    ],
)
def test_what_a_record_must_tell(properties, words, tmp_path):
    with pytest.raises(RecordError, match=words):
        read(written(tmp_path / "run.tdms", properties=properties), SERIES)


def test_text_is_no_channel(tmp_path):
    with pytest.raises(RecordError, match="'V'"):
        read(written(tmp_path / "run.tdms", {**DATA, "V": ["a"] * N}), SERIES)


def test_a_file_that_is_cut_off_anywhere(tmp_path):
    """Never a shorter record, never another error than RecordError."""
    raw = written(tmp_path / "run.tdms").read_bytes()
    for length in range(4, len(raw), 37):
        (tmp_path / "cut.tdms").write_bytes(raw[:length])
        with pytest.raises(RecordError):
            read(tmp_path / "cut.tdms", SERIES)


def test_a_file_that_is_damaged_anywhere(tmp_path):
    """One byte of the head replaced: refused, or the same number of values is read; nothing else is raised."""
    raw = written(tmp_path / "run.tdms").read_bytes()
    for at in range(4, 420):
        hurt = bytearray(raw)
        hurt[at] ^= 0xFF
        (tmp_path / "hurt.tdms").write_bytes(bytes(hurt))
        try:
            record = read(tmp_path / "hurt.tdms", SERIES)
        except RecordError:
            continue
        assert record.t.size == N


@pytest.mark.parametrize(
    "properties", [{"NI_Number_Of_Scales": 2 * 10**9}, {f"NI_Scale[{10**9}]_Scale_Type": "Linear"}]
)
def test_a_number_of_scales_takes_no_memory(tmp_path, properties):
    """Red before: 16 GB to list the channels of a file of 400 bytes, as npTDMS makes a list of so many."""
    path = written(tmp_path / "run.tdms", properties=WAVE | properties)
    tracemalloc.start()
    try:
        assert "V" in list_channels(path)
        with pytest.raises(RecordError, match="states more than 100 scales"):
            read(path, SERIES)
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()
