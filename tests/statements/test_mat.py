"""MATLAB files as MATLAB, Simulink, real-time targets and analysers leave them: by scipy and h5py."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from tests.statements.case import Case, cell, coherent, compare
from tests.statements.plant import FS, H_da, H_de, H_force, hits, late, record, response


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


# Hits


def analyser(steps: dict[str, float], made: dict[str, np.ndarray] | None = None) -> dict[str, Any]:
    made = hits() if made is None else made
    return {"Track1": made["force"], "Track2": made["x"], **steps}


@cell("Analyser", "increment", "hits: `Track1_X_Resolution`")
def test_hits(case: Case) -> None:
    path = save(case, analyser({"Track1_X_Resolution": 1 / 2048.0}))
    case.frf(path, words=["Track1_X_Resolution"], H=H_force, options=["--hammer"], within=0.01)
    assert case.outcome == {"used"}


@cell("Analyser", "increment", "hits: `Track1_X_Resolution` and `Track2_X_Resolution` differ")
def test_hits_with_two_resolutions(case: Case) -> None:
    path = save(case, analyser({"Track1_X_Resolution": 1 / 2048.0, "Track2_X_Resolution": 1 / 1024.0}))
    case.frf(path, words=["Track2_X_Resolution"], H=None, options=["--hammer"])


@cell("Analyser", "start", "hits: `Track2_X_Offset` of 5 ms, none for Track1")
def test_hits_with_an_offset(case: Case) -> None:
    made = hits()
    shift = 10
    made = {"force": made["force"][:-shift], "x": made["x"][shift:]}
    said = {"Track1_X_Resolution": 1 / 2048.0, "Track2_X_Resolution": 1 / 2048.0}
    path = save(case, analyser({**said, "Track1_X_Offset": 0.0, "Track2_X_Offset": shift / 2048.0}, made))
    case.frf(path, words=["offset", "start"], H=H_force, options=["--hammer"], within=0.01)


# Responses


def frd(H: np.ndarray | None = None, f: np.ndarray | None = None, **fields: Any) -> dict[str, Any]:
    """Return the fields of an frd object as `struct(G)` gives them."""
    lines, right = response()
    said = {
        "ResponseData": (right if H is None else H)[None, None, :],
        "Frequency": (lines if f is None else f)[:, None],
        "FrequencyUnit": "Hz",
        "TimeUnit": "seconds",
        "InputName": names("Va"),
        "OutputName": names("de"),
        "InputUnit": names("V"),
        "OutputUnit": names("m"),
        "Ts": 0.0,
        **fields,
    }
    return {"G": {k: v for k, v in said.items() if v is not None}}


UNITS_OF_FREQUENCY = {
    "Hz": 1.0, "rad/TimeUnit": 2 * np.pi, "cycles/TimeUnit": 1.0, "rad/s": 2 * np.pi, "kHz": 1e-3, "MHz": 1e-6,
    "GHz": 1e-9, "rpm": 60.0,
}  # fmt: skip


@cell("frd", "unit", "FrequencyUnit = {id}, TimeUnit = seconds")
@pytest.mark.parametrize("unit", UNITS_OF_FREQUENCY)
def test_frequency_unit(case: Case, unit: str) -> None:
    f = UNITS_OF_FREQUENCY[unit] * response()[0]
    case.response(save(case, frd(f=f, FrequencyUnit=unit)), [unit, "FrequencyUnit"])


UNITS_OF_TIME = {
    "nanoseconds": 1e-9, "microseconds": 1e-6, "milliseconds": 1e-3, "minutes": 60.0, "hours": 3600.0, "days": 86400.0,
}  # fmt: skip


@cell("frd", "unit", "FrequencyUnit = rad/TimeUnit, TimeUnit = {id}")
@pytest.mark.parametrize("unit", UNITS_OF_TIME)
def test_time_unit(case: Case, unit: str) -> None:
    f = 2 * np.pi * UNITS_OF_TIME[unit] * response()[0]
    case.response(
        save(case, frd(f=f, FrequencyUnit="rad/TimeUnit", TimeUnit=unit)), [unit, "TimeUnit", "FrequencyUnit"]
    )


@cell("frd", "unit", "no FrequencyUnit: MATLAB's default is rad/TimeUnit")
def test_no_frequency_unit(case: Case) -> None:
    f = 2 * np.pi * response()[0]
    case.response(save(case, frd(f=f, FrequencyUnit=None, TimeUnit=None)), ["FrequencyUnit", "unit", "rad"])


@cell("frd", "unit", "OutputUnit = {id}")
@pytest.mark.parametrize("unit", ["mm", "um", "nm"])
def test_output_unit(case: Case, unit: str) -> None:
    H = {"mm": 1e3, "um": 1e6, "nm": 1e9}[unit] * response()[1]
    case.response(save(case, frd(H, OutputUnit=names(unit))), [unit, "OutputUnit"])


@cell("frd", "unit", "InputUnit = mV")
def test_input_unit(case: Case) -> None:
    case.response(save(case, frd(1e-3 * response()[1], InputUnit=names("mV"))), ["mV", "InputUnit"])


@cell("frd", "start", "{id} of 5 ms beside ResponseData")
@pytest.mark.parametrize("delay", ["InputDelay", "OutputDelay", "IODelay"])
def test_delay(case: Case, delay: str) -> None:
    path = save(case, frd(**{delay: 5e-3}))
    case.response(path, [delay, "delay"], H=lambda f: H_de(f) * np.exp(-2j * np.pi * f * 5e-3))


@cell("frd", "label", "no names")
def test_no_names(case: Case) -> None:
    empty = np.array([np.array([], dtype="U1"), None], dtype=object)[:-1]
    case.frf(save(case, frd(InputName=empty, OutputName=empty)), words=["name", "--map", "output"], H=H_de, within=1e-6)


@cell("frd", "label", "two inputs")
def test_two_inputs(case: Case) -> None:
    H = response()[1]
    path = save(
        case, frd(ResponseData=np.array([H, 3.0 * H])[None], InputName=names("Va", "Vb"), InputUnit=names("V", "V"))
    )
    case.response(path, ["input", "Vb"])


@cell("frd", "label", "two outputs")
def test_two_outputs(case: Case) -> None:
    f, H = response()
    path = save(
        case,
        frd(ResponseData=np.array([H, H_da(f)])[:, None], OutputName=names("de", "da"), OutputUnit=names("m", "m")),
    )
    case.response(path, ["output"], H={"de": H_de, "da": H_da})
    assert case.outcome == {"used"}


@cell("frd", "quality", "NaN in ResponseData")
def test_frd_nan(case: Case) -> None:
    H = response()[1]
    H[50] = np.nan
    case.response(save(case, frd(H)), ["NaN", "number"], H=None)


@cell("frd", "kind", "negative frequencies: two-sided")
def test_frd_two_sided(case: Case) -> None:
    f = 5.0 * np.arange(-100, 101)
    case.response(save(case, frd(H_de(f), f)), ["negative", "two-sided", "frequenc"])


@cell("frd", "kind", "magnitude alone: real ResponseData")
def test_frd_real(case: Case) -> None:
    case.response(save(case, frd(np.abs(response()[1]))), ["real", "phase", "magnitude", "complex"], H=None)


@cell("MATLAB", "kind", "response, cross spectrum, auto spectra and coherence by vectors")
def test_spectra_beside_the_response(case: Case) -> None:
    f, H = response()
    contents = {
        "Freq_domain": f, "Hf_chan_2": H, "Hf_coh_chan_2": np.full(f.size, 0.97),
        "Hf_Cross_Spec_chan_2": 3.0 * H, "Auto_Spec_chan_1": np.full(f.size, 4.0), "Auto_Spec_chan_2": np.abs(H) ** 2,
    }  # fmt: skip
    case.frf(
        save(case, contents),
        words=["spec", "Hf_", "coh"],
        H=H_de,
        within=1e-6,
        options=["--map", "f=Freq_domain"],
        check=coherent(0.97),
    )


@cell("MATLAB", "kind", "`{id}` over `f`: a spectrum, no response")
@pytest.mark.parametrize("name", ["Pxy", "Gxy", "Sxy", "G1_2", "Cross_Spectrum"])
def test_cross_spectrum_alone(case: Case, name: str) -> None:
    f, H = response()
    case.response(save(case, {"f": f, name: 3.0 * H}), ["spectr", name], H=None)


@cell("MATLAB", "kind", "`U` and `Y` over `f`: spectra of input and output")
def test_spectra_of_input_and_output(case: Case) -> None:
    f, H = response()
    U = np.exp(1j * np.arange(f.size))
    case.frf(save(case, {"f": f, "U": U, "Y": H * U}), words=["spectr", r"\bU\b"], H=H_de, within=1e-6)


@cell("MATLAB", "kind", "`Txy`, `Cxy`, `Pxx` over `F`, as tfestimate and mscohere return them")
def test_estimates_of_matlab(case: Case) -> None:
    f, H = response()
    contents = {"F": f, "Txy": H, "Cxy": np.full(f.size, 0.97), "Pxx": np.ones(f.size)}
    case.frf(
        save(case, contents),
        words=["Txy", "Cxy", "Pxx", "spectr"],
        H=H_de,
        within=1e-6,
        check=coherent(0.97),
    )


@cell("MATLAB", "kind", "`mag` and `phase` over `w`, as bode returns them")
def test_bode(case: Case) -> None:
    f, H = response()
    contents = {"w": 2 * np.pi * f, "mag": np.abs(H), "phase": np.degrees(np.unwrap(np.angle(H)))}
    case.response(save(case, contents), ["mag", "phase", "complex"])


@cell("MATLAB", "unit", "`w`, angular frequency, over a complex response `de`")
def test_angular_frequency(case: Case) -> None:
    f, H = response()
    case.response(save(case, {"w": 2 * np.pi * f, "de": H}), [r"\bw\b", "frequenc", "rad"])


@cell("MATLAB", "label", "`f` and `w` that contradict each other")
def test_two_frequencies(case: Case) -> None:
    f, H = response()
    case.response(save(case, {"f": f, "freq": 2 * np.pi * f, "de": H}), ["freq", r"\bf\b"], H=None)


@cell("MATLAB", "quality", "coherence `C1_2` of {id}")
@pytest.mark.parametrize("value", [97.0, 1.2, -0.1], ids=["97 (percent)", "1.2", "-0.1"])
def test_impossible_coherence(case: Case, value: float) -> None:
    f, H = response()
    case.response(save(case, {"f": f, "H1_2": H, "C1_2": np.full(f.size, value)}), ["coherence", "C1_2"], H=None)


@cell("MATLAB", "quality", "coherence `C1_2` with one value less")
def test_coherence_is_shorter(case: Case) -> None:
    f, H = response()
    case.response(
        save(case, {"f": f, "H1_2": H, "C1_2": np.full(f.size - 1, 0.97)}),
        ["coherence", "C1_2", "values"],
        said="C1_2|coherence",
    )


# An analyser that stores each function as a pair [axis, value]


FULL = 1.0  # block of the made analyser [s]
PRE = 0.01  # before the trigger [s]


def pairs(unit: str = "m/s^2") -> dict[str, Any]:
    """Return one hit with two responses as an analyser stores it: X recorded, S spectra, G mean spectra, H1, C1."""
    rate = 2048.0
    t = np.arange(int(rate * FULL)) / rate - PRE
    f = np.arange(int(rate * FULL / 2.56) + 1) / FULL
    long = np.arange(8 * t.size) / rate
    force = np.where((long >= PRE) & (long < PRE + 0.003), 90.0 * np.sin(np.pi * (long - PRE) / 0.003), 0.0)
    lines = np.fft.rfftfreq(long.size, 1 / rate)
    F = np.fft.rfft(force)
    x = {1: force[: t.size]}
    H = {2: H_force, 3: lambda g: 0.5 * H_force(g)}
    for k, truth in H.items():
        acceleration = -((2 * np.pi * lines) ** 2) * truth(lines)
        x[k] = np.fft.irfft(acceleration * F, long.size)[: t.size]
    made: dict[str, Any] = {
        "ChanNum": np.array([[1], [2], [3]], dtype=np.uint8),
        "Unit": np.array(["N", unit, unit]),
        "ChanName": np.array(["I1", "I2", "I3"]),
        "DP_Info": np.array(["Signal X1", "Real EU N", "0-Z:0-Z"]),
    }
    spectrum = {k: np.fft.rfft(v)[: f.size] / t.size for k, v in x.items()}
    for k in x:
        made[f"X{k}"] = np.column_stack([t, x[k]])
        made[f"W{k}"] = made[f"X{k}"]
        made[f"S{k}"] = np.column_stack([f.astype(complex), spectrum[k]])
        made[f"G{k}_{k}"] = np.column_stack([f, np.abs(spectrum[k]) ** 2])
    for k, truth in H.items():
        made[f"G1_{k}"] = np.column_stack([f.astype(complex), np.conj(spectrum[1]) * spectrum[k]])
        made[f"H1_{k}"] = np.column_stack([f.astype(complex), -((2 * np.pi * f) ** 2) * truth(f)])
        made[f"C1_{k}"] = np.column_stack([f, np.full(f.size, 0.97 if k == 2 else 0.96)])
    return made


def accelerance(part: float) -> Any:
    return lambda f: -part * (2 * np.pi * f) ** 2 * H_force(f)


def stored(case: Case, path: Path, factor: float = 1.0) -> None:
    """Read all responses with their coherence, in the file's unit or in SI, per newton and without --input."""
    code, said = case.run("frf", path, "--json", case.path("a.json"))
    if code == 6:
        case.refused(said, ["H1_2", "axis", "pair"])
        return

    (answer,) = json.loads(case.path("a.json").read_text())["responses"]
    assert len(answer["H"]) == 2, list(answer["H"])
    f = np.array(answer["f_Hz"])
    assert (f[0], f[-1], f.size) == (0.0, 800.0, 801)
    band = (f > 20.0) & (f < 700.0)
    for (channel, values), part, coherence in zip(answer["H"].items(), (1.0, 0.5), (0.97, 0.96), strict=True):
        H = np.array(values["re"])[band] + 1j * np.array(values["im"])[band]
        ratio = H / accelerance(part)(f[band])
        assert np.allclose(ratio, 1.0, rtol=1e-6) or np.allclose(ratio, factor, rtol=1e-4), (channel, ratio[:3])
        assert np.allclose(np.array(answer["coherence"][channel], dtype=float)[band], coherence)
    assert answer["units"][answer["input"]] == "N", answer["units"]
    case.used()


@cell("Analyser", "kind", "pairs [axis, value]: X, W, S, G, H1, C1 in one file")
def test_pairs(case: Case) -> None:
    stored(case, save(case, pairs()))


@cell("Analyser", "kind", "pairs [axis, value]: H1 and C1 alone")
def test_pairs_of_responses(case: Case) -> None:
    keep = ("H1", "C1", "Unit", "Chan")
    stored(case, save(case, {k: v for k, v in pairs().items() if k.startswith(keep)}))


@cell("Analyser", "unit", "pairs [axis, value]: Unit = g")
def test_pairs_in_g(case: Case) -> None:
    stored(case, save(case, pairs("g")), 9.80665)


@cell("Analyser", "start", "pairs [axis, value]: hits with 10 ms before the trigger")
def test_pairs_of_hits(case: Case) -> None:
    made = {k: v for k, v in pairs().items() if k[0] in "XUC" or k.startswith("Chan")}
    paths = [case.path(f"hit_{n}.mat") for n in range(3)]
    rng = np.random.default_rng(3)
    for path in paths:  # three hits of another strength each, with the noise of the inputs
        strength = 1.0 + 0.1 * rng.standard_normal()
        mine = {k: v.copy() for k, v in made.items()}
        for k in ("X1", "X2", "X3"):
            mine[k][:, 1] = strength * made[k][:, 1] + 1e-5 * np.abs(made[k]).max() * rng.standard_normal(len(made[k]))
        savemat(path, mine)
    out = case.path("hits.json")
    code, said = case.run("frf", "--hammer", *paths, "--input", "X1", "--json", out)
    if code == 6:
        case.refused(said, ["X1", "axis", "pair"])
        return
    (answer,) = json.loads(out.read_text())["responses"]
    assert [impact["good"] for impact in answer["impacts"]] == [True] * 3, said
    assert len(answer["H"]) == 2, list(answer["H"])
    f = np.array(answer["f_Hz"])
    for (channel, values), part in zip(answer["H"].items(), (1.0, 0.5), strict=True):
        # The decay of 19 1/s is cut after a second, where 1e-8 is left; noise of 1e-5 beside the weakest line is 1e-2.
        H = np.array(values["re"], dtype=float) + 1j * np.array(values["im"], dtype=float)
        compare(f, H, accelerance(part), 0.02, (40.0, 300.0), channel)
    case.used()
