"""The same CSV read by `accept frf`, by the API and in a unit folder: units of its header are converted, and said."""

from pathlib import Path

import numpy as np
import pytest

import accept
from accept.analysis.misalignment import estimate_unit
from accept.gap.unit_responses import responses
from checks.acceptance.frf import CHECK
from checks.cause import Cause
from checks.declare import Series
from checks.errors import RecordError
from hw.records import csv_bytes, mat_bytes, read

FS, N = 1e4, 120_000
LOW = next(i for i in CHECK.inputs.values() if isinstance(i, Series))


def columns(scale: float = 1.0) -> dict[str, np.ndarray]:
    """A resonance at 80 Hz of 20 um/V, in m times `scale`."""
    rng = np.random.default_rng(4)
    Va = rng.standard_normal(N)
    f = np.fft.rfftfreq(N, 1 / FS)
    H = 2e-5 / (1 - (f / 80.0) ** 2 + 0.02j * f / 80.0)
    d = np.fft.irfft(H * np.fft.rfft(Va), N)
    noise = 1e-9 * rng.standard_normal((2, N))
    return {
        "t": np.arange(N) / FS,
        "Va": Va,
        "Vs": 0.1 * Va,
        "de": scale * (d + noise[0]),
        "da": scale * (d + noise[1]),
    }


def write(path: Path, header: str, scale: float) -> Path:
    first, _, rows = csv_bytes(columns(scale)).partition(b"\n")
    assert first.split(b",")[1] == b"Va"
    path.write_bytes(header.encode() + b"\n" + rows)
    return path


@pytest.fixture(scope="module")
def in_nm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("nm") / "low.csv", "time [s],Va [V],Vs [V],de [nm],da [nm]", 1e9)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("m") / "low.csv", "t,Va,Vs,de,da", 1.0)


def test_a_unit_folder_reads_what_the_api_reads(in_nm: Path, plain: Path, capsys: pytest.CaptureFixture[str]) -> None:
    by_folder, truth = read(in_nm, LOW), read(plain, LOW)
    by_api = accept.read_record(in_nm)
    for channel in ("Va", "Vs", "de", "da"):
        # Numbers are written with all their digits; the scale costs a rounding.
        np.testing.assert_allclose(by_folder[channel], truth[channel], rtol=1e-12)
        np.testing.assert_allclose(by_api[channel], truth[channel], rtol=1e-12)
    assert "de is in nm, converted to m" in capsys.readouterr().err
    assert by_folder.remarks == by_api.remarks
    assert "time from 'time'" in by_folder.remarks[0]
    assert truth.remarks == ()


def test_a_channel_named_by_its_whole_header_keeps_its_unit(in_nm: Path) -> None:
    record = read(in_nm, LOW, {"de": "de [nm]"})
    assert np.ptp(record["de"]) < 1e-2


def test_a_header_of_another_kind_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "low.csv", "t,Va,Vs,de [N],da", 1.0)
    with pytest.raises(RecordError, match="'de': N does not fit here; use m"):
        read(path, LOW)


def unit(folder: Path, record: Path) -> Path:
    (folder / "low.csv").write_bytes(record.read_bytes())
    (folder / "unit.toml").write_text('serial = "S-9"\nkind = "strut"\n[frf]\nlow = "low.csv"\n')
    return folder


def test_judging_notes_what_was_converted(in_nm: Path, tmp_path: Path) -> None:
    notes = accept.judge(unit(tmp_path, in_nm)).notes
    assert any(n.startswith("frf: low.csv") and "de is in nm, converted to m" in n for n in notes)


def test_motions_in_nm_without_a_header_are_refused_everywhere(tmp_path: Path) -> None:
    """By the estimate of a response, by a fit, by a misalignment and by judging: for one cause."""
    path = write(tmp_path / "low.csv", "t,Va,Vs,de,da", 1e9)
    mat = tmp_path / "low.mat"
    mat.write_bytes(mat_bytes(columns(1e9)))
    folder = tmp_path / "unit"
    folder.mkdir()
    unit(folder, path)
    causes = []
    for run in (
        lambda: accept.frequency_response(path),
        lambda: accept.frequency_response(mat),
        lambda: responses(folder),
        lambda: accept.fit_model(folder),
        lambda: estimate_unit(accept.read_unit(folder).folder, "strut"),
    ):
        with pytest.raises(RecordError, match="nm") as caught:
            run()
        causes.append(caught.value.reason.cause if caught.value.reason else None)
    assert set(causes) == {Cause.CHANNEL_UNIT}
    found = accept.judge(folder)
    assert any(f.cause is not None and Cause.CHANNEL_UNIT in {r.cause for r in f.cause.all()} for f in found.findings)
