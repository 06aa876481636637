"""MATLAB files as MATLAB, Simulink, real-time targets and analysers leave them: by scipy and h5py."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from tests.statements.case import Case, cell
from tests.statements.plant import FS, late, record


def save(case: Case, contents: dict[str, Any], name: str = "r.mat", **how: Any) -> Path:
    savemat(case.path(name), contents, oned_as="column", **how)
    return case.path(name)


def names(*texts: str) -> np.ndarray:
    """Return texts as a cell array, as an frd object keeps its names."""
    return np.array([*texts, None], dtype=object)[:-1]


# Records


@cell("MATLAB", "layout", "{id}")
@pytest.mark.parametrize(
    "how",
    [{}, {"do_compression": True}, {"format": "4"}],
    ids=["MATLAB 5", "MATLAB 7, compressed", "MATLAB 4"],
)
def test_versions(case: Case, how: dict[str, Any]) -> None:
    case.record(save(case, record(), **how), ["MATLAB 4", "version", "-v4"])


def save_hdf(path: Path, contents: dict[str, np.ndarray]) -> Path:
    """Write vectors as MATLAB does with -v7.3: HDF5 behind a block of 512 bytes, each with its class."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in contents.items():
            file[name] = np.atleast_2d(values)
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Fri Nov 20 10:00:00 2026 HDF5 schema 1.00 ."
    with path.open("r+b") as file:
        file.write(head.ljust(116) + b"\0" * 8 + b"\x00\x02IM")
    return path


@cell("MATLAB 7.3", "layout", "vectors")
def test_hdf(case: Case) -> None:
    case.record(save_hdf(case.path("r.mat"), record()), ["7.3"])
    assert case.outcome == {"used"}


@cell("MATLAB 7.3", "increment", "`Ts` and `t` contradict each other")
def test_hdf_with_two_times(case: Case) -> None:
    contents = {**record(), "Ts": np.array([2.0 / FS])}
    case.record(save_hdf(case.path("r.mat"), contents), ["Ts", "sampling", "time"], H=None)


@cell("MATLAB", "layout", "single precision and rows")
def test_single_precision(case: Case) -> None:
    made = {n: v.astype(np.float32 if n != "t" else float)[None, :] for n, v in record().items()}
    case.record(save(case, made), ["single"])


@cell("MATLAB", "increment", "`Ts` alone")
def test_sampling_time(case: Case) -> None:
    made = record()
    made["Ts"] = np.array([[1.0 / FS]])
    del made["t"]
    case.record(save(case, made), ["Ts", "time", "sampling"])


@cell("MATLAB", "increment", "`{id}` and `t` contradict each other")
@pytest.mark.parametrize(("name", "value"), [("Ts", 2.0 / FS), ("dt", 2.0 / FS), ("Fs", FS / 2), ("fs", FS / 2)])
def test_two_sampling_times(case: Case, name: str, value: float) -> None:
    case.record(save(case, {**record(), name: value}), [name, "sampling", "time"], H=None)


@cell("MATLAB", "increment", "`{id}` and `t` agree")
@pytest.mark.parametrize(("name", "value"), [("Ts", 1.0 / FS), ("Fs", FS)])
def test_equal_sampling_times(case: Case, name: str, value: float) -> None:
    case.record(save(case, {**record(), name: value}), [name])
    assert case.outcome == {"used"}


@cell("MATLAB", "increment", "`dt` = 0.5, which is milliseconds, and no time")
def test_sampling_time_in_ms(case: Case) -> None:
    made = {**record(), "dt": 1e3 / FS}
    del made["t"]
    case.record(save(case, made), ["dt", "ms", "sampling"])


@cell("MATLAB", "unit", "`t` in {id}, nothing says so")
@pytest.mark.parametrize("factor", [1e3, 1e6], ids=["ms", "us"])
def test_time_in_other_units(case: Case, factor: float) -> None:
    made = record()
    made["t"] = factor * made["t"]
    case.record(save(case, made), ["ms", "us", "sampling", "did you mean"])


@cell("MATLAB", "increment", "`t` in days of a calendar (datenum)")
def test_datenum(case: Case) -> None:
    made = record()
    made["t"] = 740000.0 + made["t"] / 86400.0
    case.record(save(case, made), ["days", "sampling", "date"], within=0.05)


@cell("MATLAB", "increment", "two vectors of time, `t` and `time`, that differ")
def test_two_vectors_of_time(case: Case) -> None:
    made = record()
    case.record(save(case, {**made, "time": 2.0 * made["t"]}), ["time", r"\bt\b"], H=None)


@cell("MATLAB", "increment", "`t` lacks ten samples in the middle")
def test_gap(case: Case) -> None:
    made = {n: np.delete(v, slice(1000, 1010)) for n, v in record().items()}
    case.record(save(case, made), ["time", "lost", "gap", "sampl", "missing"], within=0.02)


@cell("MATLAB", "start", "`t` starts at 1,700,000,000 s")
def test_epoch(case: Case) -> None:
    made = record()
    made["t"] = 1.7e9 + made["t"]
    # Doubles keep 0.2 us of an epoch: 4e-4 of a step.
    case.record(save(case, made), ["time", "start"], within=2e-3)


def series(made: dict[str, np.ndarray], late_de: float = 0.0, **info: dict[str, Any]) -> dict[str, Any]:
    """Return a struct for each channel with the fields of a timeseries."""
    return {
        name: {
            "Name": name,
            "Time": (made["t"] + (late_de if name == "de" else 0.0))[:, None],
            "Data": made[name][:, None],
            **info.get(name, {}),
        }
        for name in made
        if name != "t"
    }


@cell("MATLAB", "start", "a timeseries for each channel, equal Time")
def test_timeseries(case: Case) -> None:
    case.record(save(case, series(record())), ["Time"])


@cell("MATLAB", "start", "a timeseries for each channel, Time of de 5 ms later")
def test_timeseries_start(case: Case) -> None:
    path = save(case, series(late(), 5e-3))
    case.record(path, ["Time", "start"])


@cell("MATLAB", "increment", "a timeseries for each channel, Time of de at half the rate")
def test_timeseries_increment(case: Case) -> None:
    contents = series(record())
    contents["de"]["Time"] = 2.0 * contents["de"]["Time"]
    case.record(save(case, contents), ["Time", "sampling"], H=None)


@cell("MATLAB", "unit", "timeseries with DataInfo.Units = nm")
def test_timeseries_unit(case: Case) -> None:
    made = record()
    made["de"] = 1e9 * made["de"]
    path = save(case, series(made, de={"DataInfo": {"Units": "nm"}}, Va={"DataInfo": {"Units": "V"}}))
    case.record(path, ["DataInfo", "Units"])


@cell("MATLAB", "unit", "timeseries with TimeInfo.Units = milliseconds")
def test_timeseries_time_unit(case: Case) -> None:
    made = record()
    made["t"] = 1e3 * made["t"]
    info = {"TimeInfo": {"Units": "milliseconds"}}
    path = save(case, series(made, de=info, Va=info))
    case.record(path, ["TimeInfo", "millisecond"])


@cell("Simulink", "layout", "structure with time, a signal each")
def test_structure_with_time(case: Case) -> None:
    made = record()
    signals = np.array(
        [{"values": made[n][:, None], "label": n, "dimensions": 1.0} for n in ("Va", "de")], dtype=object
    )
    case.record(save(case, {"out": {"time": made["t"][:, None], "signals": signals}}), ["it holds"])


@cell("Simulink", "layout", "structure with time, one matrix of signals")
def test_structure_with_matrix(case: Case) -> None:
    made = record()
    values = np.column_stack([made["Va"], made["de"]])
    signals = {"values": values, "label": "Va, de", "dimensions": 2.0}
    case.record(save(case, {"out": {"time": made["t"][:, None], "signals": signals}}), ["it holds"])


@cell("Simulink", "layout", "To File as a matrix: time, Va, de in rows without names")
def test_matrix_of_rows(case: Case) -> None:
    made = record()
    case.record(save(case, {"ans": np.vstack([made["t"], made["Va"], made["de"]])}), ["it holds"])


@cell("Simulink", "start", "`tout` and `yout` of one rate, `uout` that starts 5 ms before")
def test_two_times_of_simulink(case: Case) -> None:
    made = late()
    contents = {
        "tu": made["t"], "Va": made["Va"], "ty": made["t"] + 5e-3, "de": made["de"],
    }  # fmt: skip
    case.record(save(case, contents), ["tu", "ty", "two times", "time axes"])


@cell("Speedgoat", "layout", "struct `data` with a field each, and `SampleTime`")
def test_target(case: Case) -> None:
    made = record()
    data = {n: made[n] for n in ("Va", "de")}
    path = save(case, {"data": {**data, "SampleTime": 1.0 / FS}})
    case.record(path, ["sampl", "time", "data"], channels={"Va": "data.Va", "de": "data.de"})


@cell("Speedgoat", "increment", "`SampleTime` contradicts `time` of the struct")
def test_target_with_two_times(case: Case) -> None:
    made = record()
    data = {"time": made["t"], "Va": made["Va"], "de": made["de"], "SampleTime": 2.0 / FS}
    path = save(case, {"data": data})
    case.record(path, ["SampleTime", "sampling", "time"], channels={"Va": "data.Va", "de": "data.de"}, H=None)


def dspace(made: dict[str, np.ndarray], unit: str = "m", time_unit: str = "s") -> dict[str, Any]:
    """Return what ControlDesk exports: X with the time, Y with a struct for each variable."""
    y = [("Va", made["Va"], "V"), ("de", made["de"], unit)]
    return {
        "exp_001": {
            "X": {
                "Name": "Time",
                "Type": "Double",
                "Data": made["t"][None, :],
                "Unit": time_unit,
                "Raster": "HostService",
            },
            "Y": np.array([{"Name": n, "Data": v[None, :], "Unit": u, "XIndex": 1.0} for n, v, u in y], dtype=object),
        }
    }


@cell("dSPACE", "layout", "X and Y with Name, Data and Unit")
def test_control_desk(case: Case) -> None:
    case.record(save(case, dspace(record())), ["it holds"])


@cell("dSPACE", "unit", "Unit of de = {id}")
@pytest.mark.parametrize("unit", ["nm", "mm"])
def test_control_desk_unit(case: Case, unit: str) -> None:
    made = record()
    made["de"] = {"nm": 1e9, "mm": 1e3}[unit] * made["de"]
    case.record(save(case, dspace(made, unit)), ["it holds"])


@cell("MATLAB", "scale", "Va in numbers of a 16-bit converter")
def test_counts(case: Case) -> None:
    made = record()
    made["Va"] = np.round(made["Va"] / 1e-4).astype(np.int16)
    case.record(save(case, made), ["10.5", "counts", "volt", r"\bV\b"], H=None)


@cell("MATLAB", "quality", "{id} in de")
@pytest.mark.parametrize("value", [np.nan, np.inf], ids=["NaN", "Inf"])
def test_nan(case: Case, value: float) -> None:
    made = record()
    made["de"][100] = value
    case.record(save(case, made), ["NaN", "inf", "number"], H=None)


@cell("MATLAB", "quality", "de is one sample shorter")
def test_shorter(case: Case) -> None:
    made = record()
    made["de"] = made["de"][:-1]
    case.record(save(case, made), ["long", "length", "samples", "values"])
