"""Records that must not be used are refused in words: the file, the channel, what was found, what was expected."""

import io
import os
import struct
import time
import tracemalloc
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io.matlab import MatlabObject
from scipy.sparse import csc_array

from checks.declare import Series
from checks.errors import RecordError
from hw import records
from hw.records import ReadLimits
from tests.hw.records import records_files as made

STROKE = Series("one_stack", "Stroke", {"t": "s", "V": "V", "d": "m"})
N = 4000


@pytest.fixture
def refusal(tmp_path):
    """Text of the RecordError for a file with these bytes or arrays."""

    def read(content, series=made.SERIES, name="r.mat", limits=records.DEFAULT_LIMITS, rename=None) -> str:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else made.mat5(content))
        with pytest.raises(RecordError) as refused:
            records.read(path, series, rename or {}, limits)
        assert str(refused.value).startswith(f"{name}: ")
        return str(refused.value)

    return read


def changed(channel: str, edit) -> dict[str, np.ndarray]:
    """A good record in which `edit` has changed one channel in place, or returned another."""
    data = made.channels(N)
    edited = edit(data[channel])
    return data if edited is None else data | {channel: edited}


def put_in(*at_and_value):
    def edit(x):
        x[at_and_value[0]] = at_and_value[1]

    return edit


def test_files_that_are_no_record(tmp_path, refusal):
    with pytest.raises(RecordError, match=r"gone\.mat: no such file"):
        records.read(tmp_path / "gone.mat", made.SERIES)
    with pytest.raises(RecordError, match="is a folder, expected a file"):
        records.read(tmp_path, made.SERIES)
    os.mkfifo(tmp_path / "pipe.mat")
    with pytest.raises(RecordError, match="is a pipe or a device"):
        records.read(tmp_path / "pipe.mat", made.SERIES)
    with pytest.raises(RecordError, match="cannot be read: File name too long"):
        records.read(tmp_path / ("x" * 300), made.SERIES)
    assert "is empty (0 bytes)" in refusal(b"")
    assert "is none of MATLAB 5 to 7.3 (.mat), .csv, .uff, .tdms; it starts with 'hello" in refusal(b"hello world")
    assert "at most 100 are read" in refusal(made.channels(), limits=ReadLimits(max_bytes=100))


def test_a_missing_channel_is_named_with_what_is_there(refusal):
    data = {k: v for k, v in made.channels().items() if k not in ("Vs", "da")}
    words = refusal(data | {"note": "hello"})
    assert "lacks 'Vs'; it has t (64 x 1 double), Va (64 x 1 double), de (64 x 1 double), note (1 x 5 char)" in words
    assert "lacks 'Vs' (here 'adc3')" in refusal(data, rename={"Vs": "adc3"})
    assert "lacks 't'" in refusal({k: v for k, v in made.channels().items() if k != "t"})
    assert "'de' cannot be all of Vs, de" in refusal(made.channels(), rename={"Vs": "de"})


@pytest.mark.parametrize(
    ("channel", "edit", "words"),
    [
        ("Vs", lambda x: x[:-1], "channel 'Vs' has 3999 samples, the time has 4000"),
        ("Vs", lambda x: x.reshape(2, -1), "channel 'Vs' is 2 x 2000, expected one dimension"),
        ("Vs", lambda x: x.reshape(2, 1, -1), "channel 'Vs' is 2 x 1 x 2000, expected one dimension"),
        ("Vs", lambda x: x[:0], "channel 'Vs' is empty"),
        ("Vs", lambda x: x + 1j, "channel 'Vs' is of kind complex, expected real numbers"),
        ("Vs", lambda x: "text", "channel 'Vs' is of kind char, expected real numbers"),
        ("Vs", lambda x: {"Data": x}, "channel 'Vs' is of kind struct, expected real numbers"),
        ("Vs", lambda x: np.array([x, x], object), "channel 'Vs' is of kind cell, expected real numbers"),
        ("Vs", lambda x: csc_array(x[None, :]), "channel 'Vs' is of kind sparse, expected real numbers"),
        ("Vs", lambda x: x > 0, "channel 'Vs' is of kind logical, expected real numbers"),
        (
            "Vs",
            lambda x: MatlabObject(np.array([(1.0,)], [("a", object)]), "timeseries"),
            "channel 'Vs' is of kind object, expected real numbers",
        ),
        ("Vs", put_in(1234, np.nan), "sensor stack Vs holds nan at sample 1234 (t = 0.6234 s), 1 of 4000 samples"),
        (
            "Vs",
            put_in(slice(10, 30), np.inf),
            "sensor stack Vs holds inf at sample 10 (t = 0.501 s), 20 of 4000",
        ),
        ("de", put_in(5, -np.inf), "encoder de holds -inf at sample 5"),
        ("de", put_in(5, 1e300), "encoder de holds 1e+300 at sample 5 (t = 0.5005 s), 1 of 4000 samples; nothing"),
        ("de", put_in(slice(None), 0.25), "encoder de is constant at 0.25 m: nothing was recorded"),
        ("da", put_in(slice(None), 0.0), "interferometer da is constant at 0 m"),
        ("t", put_in(7, np.nan), "time t holds nan at sample 7, 1 of 4000"),
        ("t", lambda x: np.zeros(N), "time 't' does not run forward"),
        ("t", lambda x: x[::-1].copy(), "time 't' does not run forward"),
        ("t", lambda x: np.delete(np.append(x, 0.9), 2000), "from sample 1999 to 2000: 0.6999 s to 0.7001 s"),
        ("t", put_in(2000, 0.6999), "time 't' stands still from sample 1999 to 2000"),
        ("t", put_in(2000, 0.6998), "time 't' runs backwards from sample 1999 to 2000"),
        ("t", put_in(N - 1, 5.0), "time 't' is not uniform from sample 3998 to 3999: 0.8998 s to 5 s, expected a step"),
        ("t", lambda x: 0.5 + 1e-4 * np.arange(N) ** 1.0005, "time 't' drifts away from a uniform grid"),
        (
            "t",
            lambda x: x + 0.5e-4 * (np.arange(N) % 2),
            "time 't' is not uniform from sample 1 to 2: 0.50015 s to 0.5002 s",
        ),
    ],
)
def test_channels_that_are_refused(channel, edit, words, refusal):
    assert words in refusal(changed(channel, edit))


def test_too_few_samples(refusal):
    assert "has 15 samples, at least 16 are needed" in refusal(made.channels(15))
    assert "at most 319 are read" in refusal(made.channels(64), limits=ReadLimits(max_samples=319))
    hammer = Series("h", "h", {"Track1": "N"}, step="dt")
    assert "has 3 samples" in refusal({"Track1": [0.0, 1.0, 0.0], "dt": 1e-3}, hammer)


@pytest.mark.parametrize("step", [0.0, -1e-3, np.nan, np.inf, 1e12, [1e-3, 2e-3]])
def test_a_step_that_is_no_sampling_time(step, refusal):
    series = Series("h", "h", {"Track1": "N"}, step="dt")
    words = refusal({"Track1": np.arange(20.0), "dt": step}, series)
    assert "'dt' holds" in words
    assert "expected one sampling time" in words


# --- clipping: the rule and what it must leave alone


def slow_sine(peak: float, n: int = 20_000) -> np.ndarray:
    return peak * np.sin(2 * np.pi * 3 * np.arange(n) / n)


def sixteen_bits(x: np.ndarray) -> np.ndarray:
    lsb = 10 / 2**15
    return np.clip(np.round(x / lsb), -(2**15), 2**15 - 1) * lsb


def with_sensor(vs: np.ndarray) -> dict[str, np.ndarray]:
    return made.channels(vs.size) | {"Vs": vs}


@pytest.mark.parametrize("limit", [10.0, 10 * (1 - 2**-15), 10.24])
def test_a_clipped_sensor_voltage_is_refused(limit, refusal):
    vs = np.clip(slow_sine(12.0), -limit, limit)
    assert "sensor stack Vs is clipped: 1" in refusal(with_sensor(vs))


def test_one_burst_of_three_clipped_samples_is_enough(refusal):
    vs = made.channels(N)["Vs"] / 5
    vs[100:103] = 10.0
    words = refusal(with_sensor(vs))
    assert (
        "3 samples hold its largest value 10 V, the end of the converter's range, from sample 100 (t = 0.51 s)" in words
    )


@pytest.mark.parametrize(
    "vs",
    [
        sixteen_bits(slow_sine(9.0)),  # the crest of a quantised sine repeats its largest code
        sixteen_bits(9.7 * np.sin(2 * np.pi * 0.013 * np.arange(20_000))),
        np.clip(slow_sine(5.0), -3.0, 3.0),  # a plateau inside the range is the signal's own
        np.where(np.arange(20_000) == 7, 10.0, 0.1 * slow_sine(1.0)),  # one sample, such as a spike
    ],
)
def test_what_is_not_clipped(vs, tmp_path):
    path = tmp_path / "r.mat"
    path.write_bytes(made.mat5(with_sensor(vs)))
    assert np.array_equal(records.read(path, made.SERIES)["Vs"], vs)


def test_plateaus_of_stroke_and_encoder_are_signals(tmp_path):
    t = 1e-3 * np.arange(20_000)
    volt = np.clip(300 * np.sin(2 * np.pi * 0.1 * t), -20.0, 150.0)  # waits at both ends
    d = np.round(np.clip(volt, 0, 140) * 1e-6 / 2.5e-9) * 2.5e-9
    path = tmp_path / "stroke.mat"
    path.write_bytes(made.mat5({"t": t, "V": volt, "d": d}))
    assert np.array_equal(records.read(path, STROKE)["V"], volt)


def test_only_voltages_clip_at_ten(tmp_path):
    """An impact may well stay at 10 N for some samples of a quantised force."""
    force = np.minimum(100 * np.abs(slow_sine(1.0)), 10.0)
    path = tmp_path / "hammer.mat"
    path.write_bytes(made.mat5({"Track1": force, "dt": 1e-4}))
    assert np.array_equal(records.read(path, Series("h", "h", {"Track1": "N"}, step="dt"))["Track1"], force)


# --- damaged and hostile files


def one_packed(edit) -> bytes:
    """A compressed file of `t` alone, its deflate stream replaced by edit(stream, what it holds)."""
    raw = made.mat5({"t": made.channels()["t"]})
    stream = edit(zlib.compress(raw[128:], 9), raw[128:])
    return raw[:128] + b"\x0f\0\0\0" + len(stream).to_bytes(4, "little") + stream


def longer(held: bytes) -> bytes:
    return held[:4] + (int.from_bytes(held[4:8], "little") + 8).to_bytes(4, "little") + held[8:]


@pytest.mark.parametrize(
    "edit",
    [
        lambda stream, held: stream[:-4],  # the checksum is missing
        lambda stream, held: zlib.compress(held[:-8], 9),
        lambda stream, held: zlib.compress(held + b"\0", 9),
        lambda stream, held: zlib.compress(longer(held), 9),
    ],
)
def test_a_deflate_stream_of_another_length(edit, refusal):
    only_time = Series("x", "x", {"t": "s"})
    assert "'t' is cut or damaged inside its compressed data" in refusal(one_packed(edit), only_time)


def test_sizes_that_contradict_each_other(refusal):
    raw = made.mat5(made.channels())
    assert "not copied whole: the last 3 bytes of the variable at byte 2400 are missing" in refusal(raw[:-3])
    fewer = raw.replace(np.array([64, 1], "<i4").tobytes(), np.array([32, 1], "<i4").tobytes())
    assert "variable 'Va' declares 32 numbers, but its data are 512 bytes of type 9" in refusal(fewer)


def test_a_matlab_object_of_today(refusal):
    """A `timeseries` as MATLAB saves it: opaque, its name before its class, its data in an unnamed array at the end."""

    def element(kind: int, data: bytes) -> bytes:
        return kind.to_bytes(4, "little") + len(data).to_bytes(4, "little") + data + b"\0" * (-len(data) % 8)

    words = element(6, np.array([17, 0], "<u4").tobytes()) + b"".join(
        element(1, text) for text in (b"Vs", b"MCOS", b"timeseries")
    )
    unnamed = made.mat5({"zz": np.arange(3, dtype="u1")})[128:].replace(b"\1\0\2\0zz", b"\1\0\0\0\0\0")
    data = {name: values for name, values in made.channels().items() if name != "Vs"}
    raw = made.mat5(data) + element(14, words) + unnamed + unnamed
    assert "channel 'Vs' is of kind opaque, expected real numbers" in refusal(raw)


def test_a_signalling_nan_is_named_like_any_other(refusal):
    """Casting one from single to double raises a floating-point warning."""
    vs = np.linspace(1.0, 2.0, 64, dtype="f4")
    raw = made.mat5(made.channels() | {"Vs": vs})
    assert "Vs holds nan at sample 0" in refusal(raw.replace(vs[:1].tobytes(), b"\x01\0\x80\x7f"))


@pytest.mark.parametrize("name", ["plain.mat", "packed.mat", "v73.mat", "v73-packed.mat", "table.csv", "binary.uff"])
def test_every_cut_file_is_refused_or_whole(name, refusal, tmp_path):
    """No prefix of a file may pass for the record, whatever the byte at which the copy broke off."""
    raw = made.every_format(tmp_path)[name]
    rng = np.random.default_rng(5)
    whole = made.channels()
    for end in sorted({1, 100, 600, len(raw) - 200, *rng.integers(1, len(raw) - 8, 40).tolist()}):
        path = tmp_path / name
        path.write_bytes(raw[:end])
        try:
            record = records.read(path, made.SERIES)
        except RecordError:
            continue
        assert all(np.array_equal(record[c], whole[c]) for c in record.channels), end  # cut behind what is needed


def test_a_header_of_64_bytes_cannot_ask_for_gigabytes(refusal):
    """A v5 array of 2^31-1 by 2^31-1 doubles, and a compressed one of 8 GB of zeros, in files of some hundred bytes."""
    big = np.array([2**31 - 1, 1], "<i4").tobytes()
    one = np.array([64, 1], "<i4").tobytes()
    raw = made.mat5(made.channels())
    tracemalloc.start()
    assert "at most 40000000 are read" in refusal(raw.replace(one, big))
    assert "declares 10000 numbers" in refusal(raw.replace(one, np.array([10_000, 1], "<i4").tobytes()))
    body = made.mat5({"t": np.zeros(2_000_000)})[128:]
    bomb = zlib.compress(body, 9)
    packed = raw[:128] + b"\x0f\0\0\0" + len(bomb).to_bytes(4, "little") + bomb
    series = Series("x", "x", {"t": "s"})
    assert "at most 1000 are read" in refusal(packed, series, limits=ReadLimits(max_samples=1000))
    lie = body[:4] + (2**31).to_bytes(4, "little") + body[8:]
    small = zlib.compress(lie, 9)
    packed = raw[:128] + b"\x0f\0\0\0" + len(small).to_bytes(4, "little") + small
    assert "cannot hold a variable of 2147483648 bytes" in refusal(packed, series)
    assert tracemalloc.get_traced_memory()[1] < 100e6
    tracemalloc.stop()


def hdf5(fill) -> bytes:
    out = io.BytesIO()
    with h5py.File(out, "w") as f:
        for name, values in made.channels().items():
            if name != "Vs":
                f[name] = values
        fill(f)
    return out.getvalue()


def _declared_only(f):
    f.create_dataset("Vs", (64,), "f8", chunks=(16,), compression=3)


def _half_written(f):
    f.create_dataset("Vs", (64,), "f8", chunks=(16,))[:32] = 1.0


def _half_packed(f):
    f.create_dataset("Vs", (64,), "f8", chunks=(16,), compression=3)[:32] = np.arange(32.0)


def _huge(f):
    f.create_dataset("Vs", (10**12,), "f8", chunks=(10**6,), compression=3)


def _char(f):
    f["Vs"] = np.arange(64, dtype="u2")
    f["Vs"].attrs["MATLAB_class"] = np.bytes_("char")


def _empty(f):
    f["Vs"] = np.array([0, 0], "u8")
    f["Vs"].attrs["MATLAB_class"] = np.bytes_("double")
    f["Vs"].attrs["MATLAB_empty"] = np.uint8(1)


def _complex(f):
    f["Vs"] = np.zeros(64, [("real", "f8"), ("imag", "f8")])


def _external(f):
    f.create_dataset("Vs", (64,), "f8", external=[("/etc/passwd", 0, 512)])


def _virtual(f):
    layout = h5py.VirtualLayout((64,), "f8")
    layout[:] = h5py.VirtualSource("other.h5", "Vs", (64,))
    f.create_virtual_dataset("Vs", layout)


def _lzf(f):
    f.create_dataset("Vs", data=np.arange(64.0), chunks=(64,), compression="lzf")


@pytest.mark.parametrize(
    ("fill", "words"),
    [
        (_declared_only, "variable 'Vs' declares 512 bytes, the file holds 0 of them"),
        (_half_written, "variable 'Vs' declares 512 bytes, the file holds 256 of them"),
        (_half_packed, "variable 'Vs' has 2 chunks of data, expected 4"),
        (_huge, "1000000000000 of them in channel 'Vs'; at most 40000000 are read"),
        (_char, "channel 'Vs' is of kind char"),
        (_empty, "channel 'Vs' is of kind empty"),
        (_complex, "channel 'Vs' is of kind complex"),
        (lambda f: f.create_group("Vs"), "channel 'Vs' is of kind struct"),
        (lambda f: f.create_dataset("Vs", data="text"), "channel 'Vs' is of kind HDF5 object"),
        (_external, "variable 'Vs' lies in another file"),
        (_virtual, "variable 'Vs' lies in another file"),
        (_lzf, "is packed with HDF5 filter [32000]"),
        (lambda f: f.__setitem__("Vs", h5py.SoftLink("/de")), "lacks 'Vs'"),
        (lambda f: f.__setitem__("Vs", h5py.ExternalLink("other.h5", "/Vs")), "lacks 'Vs'"),
    ],
)
def test_hdf5_that_is_not_all_in_the_file(fill, words, refusal):
    assert words in refusal(hdf5(fill), name="r.h5")


def test_what_universal_files_may_not_hold(refusal, tmp_path):
    data = made.channels()
    path = tmp_path / "made.uff"
    assert "channel 'de': mV does not fit here; use m" in refusal(made.uff(data, path, ordinate_axis_units_lab="mV"))
    assert "its time axis is in mV; expected s" in refusal(made.uff(data, path, abscissa_axis_units_lab="mV"))
    assert "holds no time record" in refusal(made.uff(data, path, func_type=4))
    assert "channel 'Va' is of kind complex" in refusal(
        made.uff({k: v + 0j for k, v in data.items()}, path, x=data["t"])
    )
    text = made.uff(data, path)
    assert "declares 65 values of 20 bytes, but 1280 bytes are there" in refusal(
        text.replace(b"        64", b"        65")
    )
    assert "declares 63 values of 20 bytes, but 1280 bytes" in refusal(text.replace(b"        64", b"        63"))
    short = made.uff({"t": data["t"][:-1], "de": data["de"][:-1]}, path)
    assert "another time axis than 'Va'" in refusal(text + short.replace(b"        de", b"        dx"))
    assert "holds 'de' more than once" in refusal(text + short)


def test_the_same_name_twice(refusal):
    raw = made.mat5(made.channels())
    assert "holds 'de' more than once" in refusal(raw + made.mat5({"de": np.zeros(3)})[128:])


def test_a_refusal_keeps_its_cause(tmp_path):
    path = tmp_path / "r.mat"
    raw = bytearray(made.mat5(made.channels(), compressed=True))
    raw[140:150] = b"\xff" * 10
    path.write_bytes(raw)
    with pytest.raises(RecordError, match="is damaged or cut") as refused:
        records.read(path, made.SERIES)
    assert isinstance(refused.value.__cause__, zlib.error)


def test_the_program_still_stops_when_told(monkeypatch, tmp_path):
    """Only what a damaged file can cause becomes a RecordError; an interrupt does not."""
    path = tmp_path / "r.csv"
    path.write_bytes(made.csv(made.channels()))

    def interrupted(*_args, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "loadtxt", interrupted)
    with pytest.raises(KeyboardInterrupt):
        records.read(Path(path), made.SERIES)


def _element(kind: int, content: bytes) -> bytes:
    return struct.pack("<2I", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def _nested(number: int, shape: tuple[int, int], body: bytes) -> bytes:
    """A MATLAB file of one compressed cell or structure."""
    flags, dims = struct.pack("<2I", number, 0), struct.pack("<2i", *shape)
    matrix = _element(14, _element(6, flags) + _element(5, dims) + _element(1, b"log") + body)
    packed = zlib.compress(matrix, 9)
    return b"MATLAB".ljust(124) + b"\0\1IM" + struct.pack("<2I", 15, len(packed)) + packed


def test_a_small_file_of_millions_of_empty_parts_takes_no_minutes(refusal):
    """Red before: 92 kB were read for half a minute, and took 2 GB as structures."""
    many = 2_000_000
    empty = struct.pack("<2I", 14, 0) * many
    fields = struct.pack("<HHi", 5, 4, 8) + _element(1, b"a".ljust(8, b"\0"))
    for content in (_nested(1, (many, 1), empty), _nested(2, (many, 1), fields + empty)):
        assert len(content) < 100_000
        began = time.process_time()
        assert "a variable has more than 200000 parts" in refusal(content)
        assert time.process_time() - began < 5.0


def test_two_fields_of_one_name_are_ambiguous(refusal):
    part = _element(
        14, _element(6, struct.pack("<2I", 6, 0)) + _element(5, struct.pack("<2i", 1, 1)) + _element(1, b"")
    )
    names = struct.pack("<HHi", 5, 4, 8) + _element(1, b"d".ljust(8, b"\0") * 2)
    assert "two fields of one name" in refusal(_nested(2, (1, 1), names + 2 * part))


def test_a_text_of_millions_of_letters_is_left_alone(refusal):
    """Red before: 2.3 GB for a file of 100 kB."""
    content = _nested(4, (10_000_000, 2), _element(4, b"a\0" * 20_000_000))
    tracemalloc.start()
    try:
        assert "lacks 'Va'" in refusal(content)
        assert tracemalloc.get_traced_memory()[1] < 200e6
    finally:
        tracemalloc.stop()


def test_many_variables_of_one_long_group_take_no_minutes(tmp_path):
    """Red before: the parts were counted anew for each of them, 25 million times in a file of 2 MB."""
    path = tmp_path / "r.mat"
    with h5py.File(path, "w", libver="latest") as file:
        group = file.create_group("long")
        for name in range(5000):
            group.create_group(str(name))
        for name in range(5000):
            file[f"s{name}"] = group
    began = time.process_time()
    with pytest.raises(RecordError, match="has more than 200000 parts"):
        records.list_channels(path)
    assert time.process_time() - began < 20.0
