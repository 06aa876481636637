"""Reading records: every format gives the arrays that went in, exactly; scipy, h5py and pyuff wrote the files."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from checks.declare import CsvTable, Series
from checks.errors import RecordError
from hw import records
from tests.hw.records import records_files as made
from tests.shared.record_files import write_csv, write_mat

KNOWN = {"t": "s", "V": "V", "d": "m", "de": "m", "da": "m", "Va": "V", "Vs": "V", "Track1": "N", "Track2": "rad"}
HAMMER = Series("top", "Impact", {"Track1": "N", "Track2": "rad"}, step="Track1_X_Resolution")
EXACT = 0.0
# The writers of text print 18 digits (savetxt) and 12 (pyuff, "%20.11e").
TEXT_TOLERANCE = {"table.csv": EXACT, "text.uff": 1e-11}


@pytest.fixture
def put(tmp_path):
    def write(name: str, raw: bytes) -> Path:
        path = tmp_path / name
        path.write_bytes(raw)
        return path

    return write


@pytest.mark.parametrize(
    "name",
    ["plain.mat", "packed.mat", "v73.mat", "v73-packed.mat", "table.csv", "text.uff", "binary.uff", "uneven.uff"],
)
def test_every_format_gives_back_what_went_in(name, put, tmp_path):
    path = put(name, made.every_format(tmp_path)[name])
    record = records.read(path, made.SERIES)
    truth = made.channels()
    assert list(record.channels) == ["Va", "Vs", "de", "da"]
    assert record.units == {"Va": "V", "Vs": "V", "de": "m", "da": "m"}
    assert record.name == name
    assert record.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    # UFF gives an even abscissa by start and step, of six digits each: 0.5 s and 1e-4 s are exact.
    np.testing.assert_allclose(record.t, truth["t"], rtol=1e-15)
    for channel, values in record.channels.items():
        np.testing.assert_allclose(values, truth[channel], rtol=TEXT_TOLERANCE.get(name, EXACT))
        assert not values.flags.writeable
        assert values.dtype == np.float64


def test_the_content_tells_the_format_not_the_suffix(put):
    path = put("record.csv", made.mat5(made.channels()))
    assert records.read(path, made.SERIES).t.size == made.N


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"])
@pytest.mark.parametrize("compressed", [False, True])
def test_every_number_class_as_scipy_reads_it(dtype, compressed, put):
    values = np.arange(made.N).astype(dtype)
    path = put("ints.mat", made.mat5(made.channels() | {"de": values}, compressed))
    record = records.read(path, made.SERIES)
    assert np.array_equal(record["de"], loadmat(path)["de"].ravel().astype(np.float64))


def test_matlab_stores_small_whole_doubles_as_bytes(put):
    """MATLAB writes a double array of whole numbers with the smallest type that holds them (chapter 1, "Compression").

    No library here writes such files: the data element of a file is replaced by hand.
    """
    data = made.channels() | {"zz": np.arange(64.0)}
    raw = made.mat5(data)
    doubles = b"\x09\0\0\0" + (64 * 8).to_bytes(4, "little") + np.arange(64.0).tobytes()
    bytes_ = b"\x02\0\0\0" + (64).to_bytes(4, "little") + bytes(range(64))
    start = raw.rindex(doubles)
    tag = raw.rindex((14).to_bytes(4, "little"), 0, start)
    size = int.from_bytes(raw[tag + 4 : tag + 8], "little") - len(doubles) + len(bytes_)
    raw = raw[: tag + 4] + size.to_bytes(4, "little") + raw[tag + 8 : start] + bytes_
    path = put("narrow.mat", raw)
    series = Series("x", "x", {"zz": "m"})
    assert np.array_equal(loadmat(path)["zz"].ravel(), np.arange(64.0))
    assert np.array_equal(records.read(path, series)["zz"], np.arange(64.0))


def test_big_endian_files(put):
    """As written on SPARC and PowerPC; laid out by hand after MAT-File Format, figure 1-1."""

    def element(kind: int, data: bytes) -> bytes:
        return kind.to_bytes(4, "big") + len(data).to_bytes(4, "big") + data + b"\0" * (-len(data) % 8)

    def matrix(name: str, values: np.ndarray) -> bytes:
        flags, dims = np.array([6, 0], ">u4").tobytes(), np.array([values.size, 1], ">i4").tobytes()
        parts = (
            element(6, flags),
            element(5, dims),
            element(1, name.encode()),
            element(9, values.astype(">f8").tobytes()),
        )
        return element(14, b"".join(parts))

    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI"
    data = made.channels()
    path = put("big.mat", header + b"".join(matrix(k, v) for k, v in data.items()))
    assert np.array_equal(loadmat(path)["de"].ravel(), data["de"])
    record = records.read(path, made.SERIES)
    assert np.array_equal(record["de"], data["de"])
    assert record["de"].dtype.isnative


def test_what_is_not_asked_for_may_be_anything(put):
    extra = {"note": "measured twice", "cfg": {"gain": 20.0}, "c": np.array([[1, "x"]], object), "z": 1j * np.ones(3)}
    path = put("rich.mat", made.mat5(made.channels() | extra))
    assert records.read(path, made.SERIES).t.size == made.N
    assert set(extra) < set(records.list_channels(path))


def test_rows_columns_and_optional_channels(put):
    data = made.channels()
    rows = {name: values[None, :] for name, values in data.items() if name != "da"}
    record = records.read(put("rows.mat", made.mat5(rows)), made.SERIES)
    assert list(record.channels) == ["Va", "Vs", "de"]
    assert np.array_equal(record["de"], data["de"])


def test_renamed_channels(put):
    data = made.channels()
    lab = {"time": data["t"], "dac": data["Va"], "adc3": data["Vs"], "enc": data["de"]}
    rename = {"t": "time", "Va": "dac", "Vs": "adc3", "de": "enc", "da": "int"}
    record = records.read(put("lab.mat", made.mat5(lab)), made.SERIES, rename)
    assert list(record.channels) == ["Va", "Vs", "de"]
    assert np.array_equal(record["Vs"], data["Vs"])
    assert np.array_equal(record.t, data["t"])


@pytest.mark.parametrize("suffix", ["mat", "csv"])
def test_a_step_instead_of_a_time_vector(suffix, put):
    rng = np.random.default_rng(3)
    step = 1 / 5120
    tracks = {"Track1": rng.standard_normal(100), "Track2": 1e-5 * rng.standard_normal(100)}
    raw = {
        "mat": made.mat5(tracks | {"Track1_X_Resolution": step}),
        "csv": made.csv(tracks | {"Track1_X_Resolution": np.full(100, step)}),
    }[suffix]
    record = records.read(put(f"hammer.{suffix}", raw), HAMMER)
    assert list(record.channels) == ["Track1", "Track2"]
    assert np.array_equal(record.t, step * np.arange(100))
    assert record.fs == pytest.approx(5120, rel=1e-12)


def test_a_time_vector_where_a_step_was_declared(put):
    data = made.channels()
    record = records.read(put("h.mat", made.mat5({"t": data["t"], "Track1": data["Vs"], "Track2": data["de"]})), HAMMER)
    assert np.array_equal(record.t, data["t"])


def test_the_time_keeps_its_start_and_single_precision_is_uniform_enough(put):
    t = (60.0 + made.DT * np.arange(20_000)).astype(np.float32)
    data = {"t": t, "Va": np.sin(t), "Vs": np.cos(t), "de": np.sin(2 * t)}
    record = records.read(put("single.mat", made.mat5(data)), made.SERIES)
    assert record.t[0] == np.float32(60.0)


def test_channels_and_shapes_are_listed_in_every_format(put, tmp_path):
    for name, raw in made.every_format(tmp_path).items():
        shapes = records.list_channels(put(name, raw))
        assert set(shapes) == {"t", "Va", "Vs", "de", "da"}, name
        assert all(np.prod(shape) == made.N for shape in shapes.values()), name


def test_a_table(put):
    path = put("flatness.csv", b"\xef\xbb\xbfx_mm, y_mm,z_um\r\n-29.5,9,0\r\n\r\n16,-9,-2.5\r\n")
    table = records.read_table(path, CsvTable("points", "Heights", ("x_mm", "z_um"), min_rows=2))
    assert {k: v.tolist() for k, v in table.items()} == {"x_mm": [-29.5, 16.0], "z_um": [0.0, -2.5]}


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (b"x_mm,y_mm,z_um\n1,2,3\n", "has 1 rows, at least 2"),
        (b"x_mm,y_mm\n1,2\n3,4\n", "lacks column z_um; it has x_mm"),
        (b"x_mm,y_mm,z_um\n1,2,3\n1,2,nan\n", "column 'z_um' holds nan in row 2"),
        (b"x_mm,y_mm,z_um\n1,2,3\n1,2,\n", "line 3: column 'z_um' holds '', expected a number"),
        (b"x_mm,y_mm,z_um\n1,2,3\n1,2,3,4\n", "line 3: row 2 has 4 fields, the header has 3"),
        (b"x_mm,y_mm,z_um\n1,2,3,4\n1,2,3,4\n", "line 2: row 1 has 4 fields, the header has 3"),
        (
            b"x_mm,y_mm,z_um\n1,2,3\n4,5,-15.5"[:-3],
            "its last line (3) has no end, so its last number '-1' may be cut; if the file is whole, add a newline",
        ),
        (b"x_mm;y_mm;z_um\n1;2;3,5\n4;5;6.5\n", "line 2 holds '3,5' in column 'z_um', line 3 holds '6.5'"),
        (b"1,2,3\n4,5,6\n", "line 1 does not name the columns: names are expected above the numbers"),
        (b"x_mm,y_mm,z_um,z_um\n1,2,3,4\n1,2,3,4\n", "two columns have the name 'z_um'"),
        (b"x_mm,y_mm,z_um\n", "a header and no rows"),
        (b"\n\n", "is blank; expected the names of the columns"),
        (b"x_mm,y_mm,z_um\n\x00\x00", "is not text"),
        (b"\xff\xfe\x00", "is UTF-16 and breaks off"),
    ],
)
def test_tables_that_are_refused(raw, words, put):
    with pytest.raises(RecordError) as refusal:
        records.read_table(
            put("flatness.csv", raw), CsvTable("points", "Heights", ("x_mm", "y_mm", "z_um"), min_rows=2)
        )
    assert words in str(refusal.value)
    assert str(refusal.value).startswith("flatness.csv: ")


@pytest.mark.parametrize("unit", ["A-01", "S-01"])
def test_recorded_units_as_scipy_reads_them(unit, recorded_units):
    paths = sorted(recorded_units.folder(unit).glob("*.mat"))
    assert paths
    for path in paths:
        truth = loadmat(path, squeeze_me=True)
        with_time = Series("x", "x", {name: KNOWN[name] for name in records.list_channels(path) if name in KNOWN})
        record = records.read(path, with_time if "t" in truth else HAMMER)
        for name, values in record.channels.items():
            assert np.array_equal(values, truth[name]), (path.name, name)
        expected = truth["t"] if "t" in truth else truth["Track1_X_Resolution"] * np.arange(record.t.size)
        assert np.array_equal(record.t, expected), path.name


def test_writers_read_back_exactly_and_write_the_same_bytes(tmp_path):
    data = made.channels()
    for name, write in (("a.mat", write_mat), ("a.csv", write_csv)):
        write(tmp_path / name, data)
        record = records.read(tmp_path / name, made.SERIES)
        assert np.array_equal(record.t, data["t"])
        assert all(np.array_equal(record[c], data[c]) for c in record.channels)
        first = (tmp_path / name).read_bytes()
        write(tmp_path / name, data)
        assert (tmp_path / name).read_bytes() == first


def test_a_written_mat_file_is_what_scipy_expects(tmp_path):
    write_mat(tmp_path / "a.mat", {"Track1": [1.0, 2.0], "Track1_X_Resolution": 1e-3})
    found = loadmat(tmp_path / "a.mat")
    assert found["Track1"].tolist() == [[1.0], [2.0]]
    assert found["Track1_X_Resolution"].tolist() == [[1e-3]]
    assert b"20" not in (tmp_path / "a.mat").read_bytes()[:116]  # no year: no date
    savemat(tmp_path / "b.mat", {"Track1": [1.0, 2.0]}, oned_as="column")
    assert loadmat(tmp_path / "b.mat")["Track1"].shape == found["Track1"].shape


@pytest.mark.parametrize(
    ("mapping", "words"),
    [
        ({"1st": [1.0]}, "not a channel name"),
        ({"_hidden": [1.0]}, "not a channel name"),
        ({"x": [np.nan, 1.0]}, "finite real numbers"),
        ({"x": [1j]}, "finite real numbers"),
        ({"x": ["a"]}, "finite real numbers"),
        ({"x": []}, "finite real numbers"),
        ({"x": [[1.0, 2.0], [3.0, 4.0]]}, "finite real numbers"),
    ],
)
def test_writers_refuse_what_no_reader_would_accept(mapping, words):
    for to_bytes in (records.mat_bytes, records.csv_bytes):
        with pytest.raises(ValueError, match=words):
            to_bytes(mapping)


def test_csv_columns_must_be_equally_long():
    with pytest.raises(ValueError, match=r"lengths \[1, 2\]"):
        records.csv_bytes({"a": [1.0], "b": [1.0, 2.0]})
