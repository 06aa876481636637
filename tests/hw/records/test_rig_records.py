"""Records of a real-time rig, as it writes them: structures, names of its own, gains, units, its sampling time."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from checks.declare import Series
from checks.errors import RecordError
from hw import records
from specs.bench import ChannelSource, channel_map
from tests.accept.analysis.test_foreign_record import (
    DE,
    FS,
    VA,
    T,
    dspace,
    file_scope,
    hdf5,
    scope,
    simulink,
    speedgoat,
)

SERIES = Series("low", "a record", {"Va": "V", "de": "m"})
N = T.size


def timeseries(path: Path) -> None:
    """As `struct(ts)` of MATLAB, one for each signal."""
    savemat(path, {"Va": {"Name": "Va", "Time": T, "Data": VA}, "de": {"Name": "unnamed", "Time": T, "Data": DE}})


@pytest.mark.parametrize("write", [speedgoat, simulink, scope, file_scope, dspace, hdf5, timeseries])
def test_structures_are_read_as_the_vectors_in_them(write, tmp_path):
    write(tmp_path / "a.mat")
    found = records.read(tmp_path / "a.mat", SERIES)
    np.testing.assert_array_equal(found["Va"], VA)  # the very numbers of the file
    np.testing.assert_array_equal(found["de"], DE)
    assert found.fs == pytest.approx(FS, rel=1e-9)


def test_names_gains_and_units_are_those_of_the_rig(tmp_path):
    """A DAC that counts, an encoder in micrometres, in one structure beside a signal of the same last name."""
    savemat(tmp_path / "a.mat", {"log": {"time": T, "dac": {"counts": VA * 3276.7}, "enc": {"x": 1e6 * DE}}})
    sources = channel_map(
        {"Va": {"name": "counts", "gain": 1 / 3276.7}, "de": {"name": "log.enc.x", "unit": "um"}, "t": "log.time"}
    )
    found = records.read(tmp_path / "a.mat", SERIES, sources)
    np.testing.assert_allclose(found["Va"], VA, rtol=1e-12)  # two roundings of a double
    np.testing.assert_allclose(found["de"], DE, rtol=1e-12)
    assert found.units == {"Va": "V", "de": "m"}


def test_a_sampling_time_is_for_files_without_a_time_of_their_own(tmp_path):
    sources = channel_map({"t": {"sampling_time_s": 1e-4}})
    savemat(tmp_path / "plain.mat", {"Va": VA, "de": DE})
    assert records.read(tmp_path / "plain.mat", SERIES, sources).fs == pytest.approx(1e4, rel=1e-9)
    savemat(tmp_path / "nested.mat", {"log": {"Va": VA, "de": DE}})
    assert records.read(tmp_path / "nested.mat", SERIES, sources).fs == pytest.approx(1e4, rel=1e-9)
    for name, content in (("own", {"t": T, "Va": VA, "de": DE}), ("inner", {"log": {"time": T, "Va": VA, "de": DE}})):
        savemat(tmp_path / f"{name}.mat", content)
        assert records.read(tmp_path / f"{name}.mat", SERIES, sources).fs == pytest.approx(FS, rel=1e-9)


@pytest.mark.parametrize(
    ("content", "sources", "words"),
    [
        ({"a": {"Va": VA, "time": T}, "b": {"Va": DE}, "de": DE}, {}, "'Va' may be a.Va, b.Va"),
        ({"a": {"Va": VA, "time": T}, "b": {"de": DE, "time": T + 1.0}}, {}, "several time axes"),
        ({"a": {"Va": VA, "time": T}}, {}, "lacks 'de'"),
        ({"a": {"Va": VA, "de": DE}}, {}, "lacks 't'"),
        ({"a": {"Va": VA, "de": DE, "time": T}}, {"de": {"unit": "V"}}, "does not fit"),
        ({"a": {"Va": VA, "de": DE, "time": T}}, {"de": {"name": "enc"}}, r"'de' \(here 'enc'\)"),
    ],
)
def test_what_could_be_meant_otherwise_is_refused(content, sources, words, tmp_path):
    savemat(tmp_path / "a.mat", content)
    with pytest.raises(RecordError, match=words):
        records.read(tmp_path / "a.mat", SERIES, channel_map(sources))


def test_a_unit_that_the_file_states_is_converted_and_another_one_refused(tmp_path):
    signals = [{"Name": "Va", "Data": VA, "Unit": "V"}, {"Name": "de", "Data": DE, "Unit": "mm"}]
    savemat(tmp_path / "a.mat", {"rec": {"X": {"Name": "Time", "Data": T}, "Y": np.array(signals, dtype=object)}})
    with pytest.raises(RecordError, match="'de' is in mm, \\[channels\\] has um"):
        records.read(tmp_path / "a.mat", SERIES, channel_map({"de": {"unit": "um"}}))
    for sources in ({}, {"de": ChannelSource(unit="mm")}):  # two roundings of a double
        np.testing.assert_allclose(records.read(tmp_path / "a.mat", SERIES, sources)["de"], 1e-3 * DE, rtol=1e-12)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"Va": {"gain": 0.0}}, "gain = 0"),
        ({"Va": {"gian": 2.0}}, "unknown key"),
        ({"Va": {"sampling_time_s": 1e-4}}, "belongs to 't'"),
        ({"t": {"sampling_time_s": 1e-4, "name": "time"}}, "stands alone"),
        ({"Va": {"gain": float("nan")}}, "gain"),
        ({"Va": 3}, "Va = 3"),
    ],
)
def test_a_map_that_cannot_be(given, words):
    with pytest.raises(ValueError, match=words):
        channel_map(given)


def test_a_record_of_this_program_is_read_by_its_own_names(tmp_path):
    """The map of a rig is for the rig's records: a stroke that was measured live has our names, in SI."""
    (tmp_path / "own.mat").write_bytes(records.own_record({"t": T, "Va": VA, "de": DE}))
    sources = channel_map({"Va": "DAC_1", "de": {"name": "encoder", "unit": "nm"}, "t": "time"})
    np.testing.assert_array_equal(records.read(tmp_path / "own.mat", SERIES, sources)["de"], DE)
    savemat(tmp_path / "other.mat", {"t": T, "Va": VA, "de": DE})
    with pytest.raises(RecordError, match=r"'Va' \(here 'DAC_1'\)"):
        records.read(tmp_path / "other.mat", SERIES, sources)
