"""`accept frf` on records of other tools: what they hold is found, converted and said."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from accept.analysis.record_responses import read_any
from checks.errors import RecordError
from hw.records import ReadLimits, mat5

FS, N = 1000.0, 400
T = np.arange(N) / FS
VA = np.random.default_rng(5).standard_normal(N)
DE = 2e-6 * np.roll(VA, 1)


def semicolons(path: Path) -> None:
    rows = [f"{t:.6f};{1e3 * v:.9f};{1e6 * d:.9f}".replace(".", ",") for t, v, d in zip(T, VA, DE, strict=True)]
    path.write_text("\n".join(["Time [s];Va [mV];de (um)", *rows, ""]))


def speedgoat(path: Path) -> None:
    savemat(path, {"log": {"time": T, "Va": VA, "de": DE}})


def dspace(path: Path) -> None:
    signals = [{"Name": '"Model/DAC/Va"', "Data": VA, "Unit": "V"}, {"Name": '"Model/Enc/de"', "Data": DE, "Unit": "m"}]
    savemat(path, {"rec": {"X": {"Name": "Time", "Data": T}, "Y": np.array(signals, dtype=object)}})


def hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("time", T), ("Va", VA), ("de", DE)):
            file[f"data/{name}"] = values


def simulink(path: Path) -> None:
    """A structure with time; its signals one by one."""
    signals = [{"values": VA, "label": "Va", "dimensions": 1}, {"values": DE, "label": "de", "dimensions": 1}]
    savemat(path, {"out": {"time": T, "signals": np.array(signals, dtype=object)}})


def scope(path: Path) -> None:
    """A structure with time; its signals in one matrix."""
    savemat(path, {"scope": {"time": T, "signals": {"values": np.c_[VA, DE], "label": ["Va", "de"]}}})


def file_scope(path: Path) -> None:
    names = np.array(["Va", "de", "Time"], dtype=object)
    savemat(path, {"f": {"version": 2, "signalNames": names, "data": np.c_[VA, DE, T]}})


def with_step(path: Path) -> None:
    savemat(path, {"Va": VA, "de": DE, "Ts": 1 / FS})


def units_below(path: Path) -> None:
    """As a German Windows writes it."""
    rows = [f"{1e3 * t:.6f}\t{v:.9f}\t{1e6 * d:.9f}".replace(".", ",") for t, v, d in zip(T, VA, DE, strict=True)]
    path.write_bytes("\r\n".join(["Zeit\tVa\tde", "ms\tV\tµm", *rows, ""]).encode("cp1252"))


def tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as file:
        clock = {"wf_increment": 1 / FS, "wf_start_offset": 0.0}
        parts = [("Va", VA, "V"), ("de", 1e6 * DE, "um")]
        file.write_segment([ChannelObject("g", n, x, {**clock, "unit_string": u}) for n, x, u in parts])


WRITTEN = [
    (semicolons, "a.csv"),
    (speedgoat, "a.mat"),
    (dspace, "b.mat"),
    (hdf5, "c.mat"),
    (simulink, "d.mat"),
    (scope, "e.mat"),
    (file_scope, "f.mat"),
    (with_step, "g.mat"),
    (units_below, "h.txt"),
    (tdms, "i.tdms"),
]


@pytest.mark.parametrize(("write", "name"), WRITTEN)
def test_channels_units_and_time_are_found_and_said(write, name, tmp_path, capsys):
    write(tmp_path / name)
    record = read_any(tmp_path / name, "Va", {}, None)
    assert record.fs == pytest.approx(FS, rel=1e-6)
    np.testing.assert_allclose(record["Va"], VA, rtol=0, atol=1e-9)  # nine decimals of the text
    np.testing.assert_allclose(record["de"], DE, rtol=0, atol=1e-14)
    assert record.units == {"Va": "V", "de": "m"}
    said = capsys.readouterr().err
    assert f"{name}: " in said  # how its time and units were read


def test_channels_of_any_name_with_the_sampling_time_given(tmp_path):
    np.savetxt(tmp_path / "x.csv", np.c_[VA, DE], delimiter=",", header="AI0,AI1", comments="")
    with pytest.raises(RecordError, match=r"use --map Va=NAME. It holds AI0 \(400\), AI1 \(400\)"):
        read_any(tmp_path / "x.csv", "Va", {}, None)
    with pytest.raises(RecordError, match="give the sampling time with --ts"):
        read_any(tmp_path / "x.csv", "Va", {"Va": "AI0", "de": "AI1"}, None)
    record = read_any(tmp_path / "x.csv", "Va", {"Va": "AI0", "de": "AI1"}, 1 / FS)
    assert record.fs == pytest.approx(FS)
    np.testing.assert_allclose(record["de"], DE)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"Time [s];Va [m];de [m]\n0,0;1,0;2,0\n0,1;1,0;2,0\n", "m does not fit here; use V"),
        (b"Va;de\n1,0;2,0\n2,0;x\n", "line 3: column 'de' holds 'x', expected a number"),
        (b"Va;Va\n1,0;2,0\n", "two columns have the name 'Va'"),
        (b"Va,de\n1,0,2,0\n", "row 1 has 4 fields, the header has 2; decimal commas need ';'"),
        (b"<html><body>Login\n</body>\n", "line 2: column .* holds '</body>'|no single 'de'"),
        (b"\x00" * 300, "zero|is not"),
    ],
)
def test_what_cannot_be_taken_is_refused_by_name(content, said, tmp_path):
    (tmp_path / "y.csv").write_bytes(content)
    with pytest.raises(RecordError, match=said):
        read_any(tmp_path / "y.csv", "Va", {"de": "de"}, None)


def test_a_matrix_gives_its_columns_by_number(tmp_path):
    savemat(tmp_path / "m.mat", {"data": np.c_[T, VA, DE]})
    with pytest.raises(RecordError, match=r"data\[1\] \(400\), data\[2\]"):
        read_any(tmp_path / "m.mat", "Va", {}, None)
    record = read_any(tmp_path / "m.mat", "Va", {"t": "data[1]", "Va": "data[2]", "de": "data[3]"}, None)
    np.testing.assert_allclose(record["de"], DE)
    assert record.fs == pytest.approx(FS)


def test_two_signals_of_one_name_are_refused(tmp_path):
    signals = [{"values": VA, "label": "Va"}, {"values": DE, "label": "Va"}]
    savemat(tmp_path / "two.mat", {"out": {"time": T, "signals": np.array(signals, dtype=object)}})
    with pytest.raises(RecordError, match="two signals named 'Va'"):
        read_any(tmp_path / "two.mat", "Va", {}, None)


@pytest.mark.parametrize(("made", "said"), [({}, "the file holds 0 of them"), ({"external": "own"}, "in another file")])
def test_numbers_that_are_not_in_the_file_are_not_made_up(made, said, tmp_path):
    """HDF5 reads what was never written as zeros, gigabytes of them from a file of two kilobytes, and other files."""
    import h5py

    (tmp_path / "other").write_bytes(DE.tobytes())
    outside = {"external": [(str(tmp_path / "other"), 0, DE.nbytes)]} if made else {}
    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["data/time"], file["data/Va"] = T, VA
        file.create_dataset("data/de", (N,), "f8", **outside)
    with pytest.raises(RecordError, match=said):
        read_any(tmp_path / "a.mat", "Va", {}, None)


def test_a_small_file_that_unpacks_to_more_than_is_read_is_refused(tmp_path, monkeypatch):
    savemat(tmp_path / "a.mat", {"log": {"time": T, "Va": VA, "de": np.zeros(200_000)}}, do_compression=True)
    read_any(tmp_path / "a.mat", "Va", {"de": "time"}, 1 / FS)
    monkeypatch.setattr(mat5, "DEFAULT_LIMITS", ReadLimits(max_samples=100_000))
    with pytest.raises(RecordError, match=r"unpacks to 16.* bytes; at most 800000 are read"):
        read_any(tmp_path / "a.mat", "Va", {"de": "time"}, 1 / FS)


def test_signals_of_two_time_axes_are_no_record(tmp_path):
    axes = np.array([{"Name": "fast", "Data": T}, {"Name": "slow", "Data": 2 * T}], dtype=object)
    signals = [{"Name": "Va", "Data": VA, "XIndex": 1}, {"Name": "de", "Data": DE, "XIndex": 2}]
    savemat(tmp_path / "two.mat", {"rec": {"X": axes, "Y": np.array(signals, dtype=object)}})
    with pytest.raises(RecordError, match=r"every 0.002 s .slow.*several time axes"):
        read_any(tmp_path / "two.mat", "Va", {}, None)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [({"Va": np.where(T == T[77], np.nan, VA)}, "nan at sample 77"), ({"time": np.sort(T**2)}, "not uniform")],
)
def test_what_is_wrong_in_a_foreign_record_is_said_and_not_that_it_is_foreign(wrong, said, tmp_path):
    savemat(tmp_path / "w.mat", {"time": T, "Va": VA, "de": DE} | wrong)
    with pytest.raises(RecordError, match=said):
        read_any(tmp_path / "w.mat", "Va", {}, None)


def test_a_tdms_file_that_is_cut_is_said_in_one_line(tmp_path, capfd):
    tdms(tmp_path / "a.tdms")
    (tmp_path / "cut.tdms").write_bytes((tmp_path / "a.tdms").read_bytes()[:4000])
    with pytest.raises(RecordError, match=r"cut.tdms: .* cut off"):
        read_any(tmp_path / "cut.tdms", "Va", {}, None)
    assert not capfd.readouterr().err
