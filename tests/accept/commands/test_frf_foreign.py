"""`accept frf` on records of other tools: what they hold is found, converted and said."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from accept.commands.physics.frf import read_any
from checks.errors import RecordError

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


@pytest.mark.parametrize(
    ("write", "name"), [(semicolons, "a.csv"), (speedgoat, "a.mat"), (dspace, "b.mat"), (hdf5, "c.mat")]
)
def test_channels_units_and_time_are_found_and_said(write, name, tmp_path, capsys):
    write(tmp_path / name)
    record = read_any(tmp_path / name, "Va", {}, None)
    assert record.fs == pytest.approx(FS, rel=1e-6)
    np.testing.assert_allclose(record["Va"], VA, rtol=0, atol=1e-9)  # nine decimals of the text
    np.testing.assert_allclose(record["de"], DE, rtol=0, atol=1e-14)
    assert record.units == {"Va": "V", "de": "m"}
    assert "400 samples" in capsys.readouterr().err


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
        (b"Va;de\n1,0;x\n", "could not convert"),
        (b"Va;Va\n1,0;2,0\n", "a name twice"),
        (b"\x00" * 300, "zero|no rows|is not"),
    ],
)
def test_what_cannot_be_taken_is_refused_by_name(content, said, tmp_path):
    (tmp_path / "y.csv").write_bytes(content)
    with pytest.raises(RecordError, match=said):
        read_any(tmp_path / "y.csv", "Va", {"de": "de"}, None)
