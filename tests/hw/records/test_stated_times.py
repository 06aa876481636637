"""What a file states of its times is used by every door, or the file is refused with the reason.

The files are written by npTDMS, scipy and h5py. Truth: de is Va one sample later, whatever the starts are called."""

import datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
from scipy.io import savemat

import accept
from checks.declare import Series
from checks.errors import RecordError
from checks.record import Record
from hw import records

FS, N = 1000.0, 4000
VA = np.random.default_rng(11).standard_normal(N + 100)
DE = 2e-6 * np.roll(VA, 1)
T = np.arange(N) / FS
SERIES = Series("low", "a record", {"Va": "V", "de": "m"})
START = np.datetime64("2026-11-20T10:00:00.000000")


def both_doors(path: Path) -> Record:
    """The record of a unit folder, which is that of `accept frf`, `--hammer` and the API."""
    folder, api = records.read(path, SERIES), accept.read_record(path)
    for name in ("Va", "de"):
        np.testing.assert_array_equal(folder[name], api[name])
    np.testing.assert_array_equal(folder.t, api.t)
    assert folder.units == api.units == {"Va": "V", "de": "m"}
    return folder


def refused_at_both_doors(path: Path, words: str) -> None:
    for read in (lambda: records.read(path, SERIES), lambda: accept.read_record(path)):
        with pytest.raises(RecordError, match=words):
            read()


def samples_late(record: Record) -> int:
    """By how many samples de follows Va, from their correlation."""
    Va, de = record["Va"], record["de"]
    lags = range(-60, 61)
    return max(lags, key=lambda k: float(np.dot(Va[60:-60], np.roll(de, -k)[60:-60])))


def tdms(path: Path, Va: dict[str, Any], de: dict[str, Any], x: Any = None, y: Any = None, groups: str = "gg") -> Path:
    """Channels with properties each, over the increment of FS; x, y: their data."""
    with TdmsWriter(str(path)) as file:
        parts = [("Va", VA[:N] if x is None else x, Va), ("de", DE[:N] if y is None else y, de)]
        file.write_segment([ChannelObject(g, n, v, p) for g, (n, v, p) in zip(groups, parts, strict=True)])
    return path


def wave(**more: Any) -> dict[str, Any]:
    return {"wf_increment": 1 / FS, "wf_start_offset": 0.0, "wf_start_time": START, **more}


def us(n: float) -> np.timedelta64:
    return np.timedelta64(round(n), "us")


@pytest.mark.parametrize(
    "late",
    [
        {"wf_start_time": START + us(20_000)},
        {"wf_start_offset": 0.02},
        {"wf_start_time": START + us(15_000), "wf_start_offset": 0.005},
    ],
)
def test_tdms_channels_that_start_apart_are_aligned(late: dict[str, Any], tmp_path: Path) -> None:
    path = tdms(tmp_path / "a.tdms", wave(), wave(**late), y=DE[20 : N + 20])
    record = both_doors(path)
    assert samples_late(record) == 1
    assert record.t.size == N - 20
    np.testing.assert_allclose(record.t[:2], [0.02, 0.021], atol=1e-9)
    assert "de starts 0.02 s (20 samples) after Va" in record.remarks[0]


def test_tdms_start_of_an_express_block_is_used_where_it_is_the_only_date(tmp_path: Path) -> None:
    unset = np.datetime64("1904-01-01T00:00:00.000000")
    parts = [wave(wf_start_time=unset, NI_ExpStartTimeStamp=START + us(n)) for n in (0, 7000)]
    record = both_doors(tdms(tmp_path / "a.tdms", *parts, y=DE[7 : N + 7]))
    assert samples_late(record) == 1


def test_tdms_channels_of_other_lengths_that_end_together(tmp_path: Path) -> None:
    late = wave(wf_start_time=START + us(20_000))
    record = both_doors(tdms(tmp_path / "a.tdms", wave(), late, x=VA[: N + 20], y=DE[20 : N + 20]))
    assert samples_late(record) == 1
    assert record.t.size == N


@pytest.mark.parametrize(
    ("Va", "de", "words"),
    [
        (wave(), wave(wf_start_time=START + us(300)), r"'de' starts 0.0003 s after 'Va'.*10:00:00.000300.*0.3 samples"),
        (wave(), {k: v for k, v in wave().items() if k != "wf_start_time"}, "counts its time from no date"),
        (wave(), {}, "'de' states no time and no sampling time, 'Va' does"),
        (wave(wf_increment=-1.0), wave(), "wf_increment = -1.0"),
        (wave(wf_xunit_string="Hz", wf_xname="Frequency"), wave(wf_xname="Frequency"), "spectrum|no channel 'Va'"),
        (wave(wf_xunit_string="mm"), wave(wf_xunit_string="mm"), "times are in mm, expected a unit of time"),
        (wave(unit_string="m"), wave(), "m does not fit here; use V"),
    ],
)
def test_tdms_statements_that_are_refused(Va: dict[str, Any], de: dict[str, Any], words: str, tmp_path: Path) -> None:
    refused_at_both_doors(tdms(tmp_path / "a.tdms", Va, de), words)


def test_tdms_groups_of_other_rates_and_recordings(tmp_path: Path) -> None:
    """Another rate or another hour is another record: refused if it was declared, left out if not."""
    for name, other in (("rate", wave(wf_increment=2 / FS)), ("hour", wave(wf_start_time=START + us(3.6e9)))):
        path = tdms(tmp_path / f"{name}.tdms", wave(), other, groups="gh")
        with pytest.raises(RecordError, match="several time axes"):
            records.read(path, SERIES)
        with pytest.raises(RecordError, match="no output is sampled with 'Va'"):
            accept.read_record(path)


def test_tdms_lengths_that_no_start_explains(tmp_path: Path) -> None:
    path = tdms(tmp_path / "a.tdms", wave(), wave(), y=DE[: N - 50])
    refused_at_both_doors(path, "'de' has 3950 samples, 'Va' has 4000")


def test_tdms_units_and_times_in_other_units(tmp_path: Path) -> None:
    Va, de = (wave(unit_string=u, wf_increment=1e3 / FS, wf_xunit_string="ms") for u in ("Millivolts", "nm"))
    record = both_doors(tdms(tmp_path / "a.tdms", Va, de, x=1e3 * VA[:N], y=1e9 * DE[:N]))
    np.testing.assert_allclose(record["Va"], VA[:N], rtol=1e-12)  # two roundings of a double
    np.testing.assert_allclose(record["de"], DE[:N], rtol=1e-12)
    assert record.fs == pytest.approx(FS, rel=1e-9)
    assert "de is in nm, converted to m" in record.remarks[0]


def test_tdms_a_column_of_dates_is_its_time(tmp_path: Path) -> None:
    dates = START + (1e6 / FS * np.arange(N)).astype("timedelta64[us]")
    with TdmsWriter(str(tmp_path / "a.tdms")) as file:
        columns = {"Time": dates, "Va": VA[:N], "de": DE[:N]}
        file.write_segment([ChannelObject("g", n, x) for n, x in columns.items()])
    assert both_doors(tmp_path / "a.tdms").fs == pytest.approx(FS, rel=1e-9)


def test_tdms_a_date_in_the_future_is_doubted(tmp_path: Path) -> None:
    late = wave(wf_start_time=np.datetime64(datetime.datetime.now() + datetime.timedelta(days=30)))
    record = both_doors(tdms(tmp_path / "a.tdms", late, late))
    assert "in the future" in record.remarks[0]
    assert both_doors(tdms(tmp_path / "b.tdms", wave(), wave())).remarks == ()


COUNTS = np.round(VA[:N] * 3276.7 / 2).astype(np.int16)


def scale(kind: str, **more: Any) -> dict[str, Any]:
    stated = {"NI_Number_Of_Scales": 1, "NI_Scaling_Status": "unscaled", "NI_Scale[0]_Scale_Type": kind}
    return stated | {f"NI_Scale[0]_{name}": value for name, value in more.items()}


KNOWN_SCALES = [
    scale("Linear", Linear_Slope=2 / 3276.7, Linear_Y_Intercept=0.0),
    scale("Polynomial", Polynomial_Coefficients_Size=2, **{"Polynomial_Coefficients[0]": 0.0,
                                                           "Polynomial_Coefficients[1]": 2 / 3276.7}),
    scale("Table", Table_Pre_Scaled_Values_Size=2, Table_Scaled_Values_Size=2,
          **{"Table_Pre_Scaled_Values[0]": -32767.0, "Table_Pre_Scaled_Values[1]": 32767.0,
             "Table_Scaled_Values[0]": -20.0, "Table_Scaled_Values[1]": 20.0}),
]  # fmt: skip


@pytest.mark.parametrize("stated", KNOWN_SCALES)
@pytest.mark.parametrize("level", ["channel", "group", "file"])
def test_tdms_scales_are_applied(stated: dict[str, Any], level: str, tmp_path: Path) -> None:
    own = stated if level == "channel" else {}
    with TdmsWriter(str(tmp_path / "a.tdms")) as file:
        root = [RootObject(stated if level == "file" else {}), GroupObject("g", stated if level == "group" else {})]
        de = ChannelObject(
            "h" if level == "group" else "g", "de", DE[:N], wave(NI_Scaling_Status="scaled", NI_Number_Of_Scales=0)
        )
        if level == "file":
            de = ChannelObject("g", "de", DE[:N], wave(**scale("Linear", Linear_Slope=1.0, Linear_Y_Intercept=0.0)))
        file.write_segment([*root, ChannelObject("g", "Va", COUNTS, wave(**own)), de])
    np.testing.assert_allclose(both_doors(tmp_path / "a.tdms")["Va"], VA[:N], atol=1e-3)  # half a count is 0.0003


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        (scale("Piecewise"), "states the scale Piecewise, which cannot be applied"),
        (scale("Linear") | {"NI_Scale[1]_Scale_Type": "Bridge", "NI_Number_Of_Scales": 2}, "states the scale Bridge"),
        (scale("Linear") | {"NI_Number_Of_Scales": 0}, "states the scale Linear and NI_Number_Of_Scales = 0"),
        ({"NI_Scaling_Status": "unscaled"}, "raw values and states no scale"),
        (scale("Linear"), "scale that cannot be read .'NI_Scale.0._Linear_Y_Intercept'"),
    ],
)
def test_tdms_scales_that_cannot_be_applied_are_refused_by_name(
    stated: dict[str, Any], words: str, tmp_path: Path
) -> None:
    path = tdms(tmp_path / "a.tdms", wave(**stated), wave(), x=COUNTS)
    refused_at_both_doors(path, words)


# --- MATLAB and HDF5


def structure(start: float = 0.0, **info: Any) -> dict[str, Any]:
    """Two timeseries as structures, the second from `start` on."""
    k = round(start * FS)
    one = {"Name": "Va", "Time": T, "Data": VA[:N]}
    return {"a": one, "b": {"Name": "de", "Time": T + start, "Data": DE[k : k + N], **info}}


def test_timeseries_that_start_apart_are_aligned(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", structure(0.005))
    record = both_doors(tmp_path / "a.mat")
    assert samples_late(record) == 1
    assert "de starts 0.005 s (5 samples) after Va" in record.remarks[0]


def test_start_increment_and_units_of_timeseries(tmp_path: Path) -> None:
    info = {"Units": "milliseconds", "Start": 5.0, "Increment": 1.0}
    other = structure() | {"b": {"Name": "de", "Time": np.empty(0), "Data": 1e9 * DE[5 : N + 5],
                                 "TimeInfo": info, "DataInfo": {"Units": "nm"}}}  # fmt: skip
    savemat(tmp_path / "a.mat", other)
    record = both_doors(tmp_path / "a.mat")
    assert samples_late(record) == 1
    assert np.std(record["de"]) == pytest.approx(2e-6, rel=0.05)  # of 4000 samples


STATED = {
    "sub-sample": (structure(0.0) | {"b": {"Name": "de", "Time": T + 3e-4, "Data": DE[:N]}}, "0.3 samples"),
    "start date": (structure(TimeInfo={"StartDate": "20-Nov-2026 10:00:01"}), "counts its time from 20-Nov"),
    "increment": (structure(TimeInfo={"Increment": 2e-3}), "0.001 s by 'de.Time' and 0.002 s"),
    "unit of time": (structure(TimeInfo={"Units": "inches"}), "inches, expected a unit of time"),
    "unit of data": (structure(DataInfo={"Units": "bar"}), "bar does not fit here; use m"),
    "Ts beside t": ({"t": T, "Va": VA[:N], "de": DE[:N], "Ts": 2e-3}, "0.001 s by 't' and 0.002 s by 'Ts'"),
    "fs beside t": ({"t": T, "Va": VA[:N], "de": DE[:N], "fs": 2e3}, "0.001 s by 't' and 0.0005 s by 'fs'"),
    "dt in ms": ({"Va": VA[:N], "de": DE[:N], "dt": 1e3 / FS}, "is the time in ms"),
    "Ts of nothing": ({"Va": VA[:N], "de": DE[:N], "Ts": 0.0}, "'Ts' holds 0"),
    "two resolutions": (
        {"Va": VA[:N], "de": DE[:N], "Va_X_Resolution": 1e-3, "de_X_Resolution": 2e-3}, "several time axes"),
    "two starts": (
        {"Va": VA[:N], "de": DE[:N], "Ts": 1e-3} | {f"{n}_X_Resolution": 1e-3 for n in ("Va", "de")}
        | {"de_X_Start": 2.5e-4}, "'de' starts 0.00025 s after 'Va'"),
    "one unit": ({"t": T, "Va": VA[:N], "de": DE[:N], "de_Unit": "N"}, "'de': N does not fit here"),
    "start of a structure": (
        {"a": {"Va": VA[:N], "time": T}, "b": {"de": DE[:N], "time": T, "StartTime": "10:00:01"}}, "several time axes"),
}  # fmt: skip


@pytest.mark.parametrize("case", STATED)
def test_statements_of_matlab_files_that_are_refused(case: str, tmp_path: Path) -> None:
    content, words = STATED[case]
    savemat(tmp_path / "a.mat", content)
    refused_at_both_doors(tmp_path / "a.mat", words)


@pytest.mark.parametrize(
    "stated",
    [
        {"Ts": 1 / FS},
        {"fs": FS},
        {"dt": 1e3 / FS, "TimeUnit": "ms"},
        {"Va_X_Resolution": 1 / FS, "de_X_Resolution": 1 / FS, "Va_X_Start": 0.25, "de_X_Start": 0.25},
        {"time_ms": 1e3 * T},
    ],
)
def test_statements_of_matlab_files_that_are_used(stated: dict[str, Any], tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"Va": 1e3 * VA[:N], "de": DE[:N], "Va_Unit": "mV", **stated})
    record = both_doors(tmp_path / "a.mat")
    assert record.fs == pytest.approx(FS, rel=1e-9)
    np.testing.assert_allclose(record["Va"], VA[:N], rtol=1e-12)  # two roundings of a double


def test_attributes_of_hdf5_state_unit_and_time(tmp_path: Path) -> None:
    for name, start in (("same", 0.0), ("late", 0.005), ("apart", 3e-4)):
        k = round(start * FS)
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            group = file.create_group("data")
            for channel, x, unit, at in (("Va", VA[:N], "V", 0.0), ("de", 1e9 * DE[k : N + k], "nm", start)):
                group[channel] = x
                group[channel].attrs.update({"units": unit, "dt": 1 / FS, "t0": at})
    assert samples_late(both_doors(tmp_path / "same.h5")) == 1
    late = both_doors(tmp_path / "late.h5")
    assert samples_late(late) == 1
    assert np.std(late["de"]) == pytest.approx(2e-6, rel=0.05)  # of 4000 samples
    refused_at_both_doors(tmp_path / "apart.h5", "0.3 samples")


def test_structures_of_matlab_7_3_are_read_like_those_of_5(tmp_path: Path) -> None:
    """dSPACE's arrays of structures are references there, and text is stored as numbers."""
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:

        def text(words: str) -> h5py.Reference:
            made = file.create_dataset(f"#refs#/{len(file['#refs#'])}", data=np.array([[ord(c)] for c in words], "u2"))
            made.attrs["MATLAB_class"] = np.bytes_("char")
            return made.ref

        def numbers(x: np.ndarray) -> h5py.Reference:
            made = file.create_dataset(f"#refs#/{len(file['#refs#'])}", data=np.atleast_2d(x))
            made.attrs["MATLAB_class"] = np.bytes_("double")
            return made.ref

        file.create_group("#refs#")
        rec = file.create_group("rec")
        rec.attrs["MATLAB_class"] = np.bytes_("struct")
        rows = {"Name": ["Va", "de"], "Unit": ["V", "nm"], "Data": [VA[:N], 1e9 * DE[:N]]}
        for part, count in (("X", 1), ("Y", 2)):
            group = rec.create_group(part)
            group.attrs["MATLAB_class"] = np.bytes_("struct")
            for field, values in rows.items():
                chosen = {"Name": ["Time"], "Unit": ["ms"], "Data": [1e3 * T]}[field] if part == "X" else values
                refs = [text(v) if isinstance(v, str) else numbers(v) for v in chosen[:count]]
                group.create_dataset(field, data=np.array([refs], h5py.ref_dtype), dtype=h5py.ref_dtype)
    record = both_doors(tmp_path / "a.mat")
    np.testing.assert_allclose(record["de"], DE[:N], rtol=1e-12)  # two roundings of a double
    assert record.fs == pytest.approx(FS, rel=1e-9)


# --- one reader for all doors


def test_a_sampling_time_that_the_file_contradicts_is_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": T, "Va": VA[:N], "de": DE[:N]})
    with pytest.raises(RecordError, match=r"0.001 s by 't' and 0.002 s by '--ts"):
        accept.read_record(tmp_path / "a.mat", step_s=2e-3)
    assert accept.read_record(tmp_path / "a.mat", step_s=1e-3).fs == pytest.approx(FS)


def test_renamed_columns_are_converted_by_their_unit(tmp_path: Path) -> None:
    table = np.c_[T, VA[:N], 1e9 * DE[:N], 1e6 * DE[:N], VA[:N]]
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="t,Va,Geber [nm],Laser (um),Temp [degC]", comments="")
    record = accept.read_record(tmp_path / "a.csv")
    assert record.units == {"Va": "V", "Geber": "m", "Laser": "m", "Temp": "degC"}
    for name in ("Geber", "Laser"):
        np.testing.assert_allclose(record[name], DE[:N], rtol=1e-9)  # of 18 digits, and two roundings
    assert "Geber is in nm, converted to m" in record.remarks[0]
    assert "Temp stays in degC" in record.remarks[0]


def test_two_groups_with_one_name_are_named_in_full(tmp_path: Path) -> None:
    with TdmsWriter(str(tmp_path / "a.tdms")) as file:
        for group in ("one", "two"):
            file.write_segment([ChannelObject(group, n, x[:N], wave()) for n, x in (("Va", VA), ("de", DE))])
    with pytest.raises(RecordError, match="one/Va"):
        accept.read_record(tmp_path / "a.tdms")
    with pytest.raises(RecordError, match="may be one/Va, two/Va"):
        records.read(tmp_path / "a.tdms", SERIES)
    record = accept.read_record(tmp_path / "a.tdms", channels={"Va": "one/Va", "de": "one/de"})
    assert samples_late(record) == 1


def test_a_slow_record_is_none_in_milliseconds(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": 0.05 * np.arange(N), "Va": VA[:N], "de": DE[:N]})
    assert both_doors(tmp_path / "a.mat").fs == pytest.approx(20.0)


@pytest.mark.parametrize(("step", "guess"), [(1.0, "ms"), (1e3, "us")])
def test_times_that_are_not_in_seconds_are_asked_about(step: float, guess: str, tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": step * np.arange(N), "Va": VA[:N], "de": DE[:N]})
    refused_at_both_doors(tmp_path / "a.mat", f"is the time in {guess}")
    assert accept.read_record(tmp_path / "a.mat", step_s=step).fs == pytest.approx(1.0 / step)  # it is said to be slow


def test_mat_temperature_is_no_time_and_two_times_that_differ_are_refused(tmp_path: Path) -> None:
    """Names of times are read in any letters, and a temperature is called T."""
    made = {"t": T, "Va": VA[:N], "de": DE[:N]}
    savemat(tmp_path / "a.mat", {**made, "T": 20.0 + 0.1 * T})
    path = tmp_path / "a.mat"
    np.testing.assert_array_equal(accept.read_record(path).t, T)
    np.testing.assert_array_equal(records.read(path, SERIES).t, T)
    savemat(tmp_path / "b.mat", {**made, "time": 2.0 * T})
    refused_at_both_doors(tmp_path / "b.mat", "'t' and 'time' run apart; name one of them as 't'")
    np.testing.assert_array_equal(accept.read_record(tmp_path / "b.mat", channels={"t": "time"}).t, 2.0 * T)


def test_tdms_each_group_has_its_own_time(tmp_path: Path) -> None:
    """The times of another group are not those of a channel."""
    parts = [
        ChannelObject(group, name, values, {"unit_string": unit})
        for group, rate in (("slow", 2.0), ("fast", 1.0))
        for name, values, unit in (("Time", rate * T, "s"), ("Va", VA[:N], "V"), ("de", DE[:N], "m"))
    ]
    with TdmsWriter(str(tmp_path / "a.tdms")) as file:
        file.write_segment(parts)
    for group, rate in (("slow", 2.0), ("fast", 1.0)):
        names = {"Va": f"{group}/Va", "de": f"{group}/de"}
        np.testing.assert_array_equal(records.read(tmp_path / "a.tdms", SERIES, names).t, rate * T)
