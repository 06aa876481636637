"""Unit folders with files of other programs and values typed by people of another laboratory, by `accept batch`."""

import unicodedata
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat
from scipy.signal import cont2discrete, lfilter, lfilter_zi

from tests.statements.case import Case, cell
from tests.statements.plant import hits
from tests.statements.test_uff import VOLT, time

CORNER = 0.4  # Hz
LOOP = 5.0  # percent
POSITIONS = [(-29.5, 9), (-16, 9), (-16, -9), (-29.5, -9), (16, 9), (29.5, 9), (29.5, -9), (16, -9)]
HEIGHTS = [0.0, -9.0, -15.5, -18.0, -4.5, 6.5, -2.5, -1.0]  # um; half of the zone 5.42 um by an independent program
FLATNESS = 5.4155  # um


def flatness_of(heights: list[float]) -> float:
    """Return half the distance of the two planes that hold all points: the smallest largest residual, by linear
    programming."""
    from scipy.optimize import linprog

    xy = np.array(POSITIONS, dtype=float)
    A = np.column_stack([xy, np.ones(8)])
    z = np.array(heights)
    one = np.ones((8, 1))
    found = linprog(
        [0, 0, 0, 1],
        np.block([[A, -one], [-A, -one]]),
        np.concatenate([z, -z]),
        bounds=[(None, None)] * 3 + [(0, None)],
    )
    return float(found.fun)


def unit(case: Case, sections: str, **files: bytes | str) -> Path:
    """Write a unit folder with these sections; files by name."""
    folder = case.path("U-1")
    folder.mkdir()
    (folder / "unit.toml").write_text(f'serial = "U-1"\nkind = "apa"\n{sections}\n', encoding="utf-8")
    for name, contents in files.items():
        (folder / name).write_bytes(contents.encode() if isinstance(contents, str) else contents)
    return folder


# Flatness


def points(
    header: str = "x_mm,y_mm,z_um", factor: float = 1.0, xy: float = 1.0, separator: str = ",", decimal: str = "."
) -> str:
    rows = [
        separator.join(f"{v:.10g}" for v in (xy * x, xy * y, factor * z)).replace(".", decimal)
        for (x, y), z in zip(POSITIONS, HEIGHTS, strict=True)
    ]
    return (header + "\n" if header else "") + "\n".join(rows) + "\n"


def flatness(case: Case, text: str, words: list[str], encoding: str = "utf-8", right: bool = True) -> None:
    folder = unit(case, '[flatness]\npoints = "flatness.csv"', **{"flatness.csv": text.encode(encoding)})
    case.unit(folder, "flatness_um", flatness_of(HEIGHTS) if right else None, 1e-6, words)


def test_the_truth_is_that_of_an_independent_program() -> None:
    assert flatness_of(HEIGHTS) == pytest.approx(FLATNESS, abs=0.01)


@cell("Unit folder: flatness", "layout", "x_mm,y_mm,z_um")
def test_flatness(case: Case) -> None:
    flatness(case, points(), ["z_um"])
    assert case.outcome == {"used"}


@cell("Unit folder: flatness", "unit", "heights as `{id}`")
@pytest.mark.parametrize(
    ("header", "factor"),
    [
        ("x_mm,y_mm,z_nm", 1e3), ("x_mm,y_mm,z_mm", 1e-3), ("x_mm,y_mm,z [nm]", 1e3), ("x [mm],y [mm],z [um]", 1.0),
        ("x [mm],y [mm],z [µm]", 1.0), ("x_mm,y_mm,z_um [um]", 1.0), ("x_mm,y_mm,z (inch)", 1 / 25400.0),
    ],
    ids=["z_nm", "z_mm", "z [nm]", "z [um]", "z [micro m]", "z_um [um]", "z (inch)"],
)  # fmt: skip
def test_unit_of_heights(case: Case, header: str, factor: float) -> None:
    flatness(case, points(header, factor), ["unit", "x_mm", "z_um"])


@cell("Unit folder: flatness", "unit", "`{id}` contradicts itself")
@pytest.mark.parametrize("header", ["z_um [nm]", "z_um (inch)", "z_um [mm]"])
def test_two_units_of_heights(case: Case, header: str) -> None:
    # Nobody can know which of the two is right: nothing but a refusal is.
    factor = {"z_um [nm]": 1e3, "z_um (inch)": 1 / 25400.0, "z_um [mm]": 1e-3}[header]
    flatness(case, points(f"x_mm,y_mm,{header}", factor), ["nm", "inch", "mm", "unit", "not in um"])


@cell("Unit folder: flatness", "unit", "z_um holds {id}")
@pytest.mark.parametrize("factor", [1e3, 1e-3, 1e-6], ids=["nm", "mm", "m"])
def test_heights_in_another_unit(case: Case, factor: float) -> None:
    flatness(case, points(factor=factor), ["nm", "mm", "unit", "um", "height", "plausible"], right=False)


@cell("Unit folder: flatness", "unit", "x and y in m under x_mm, y_mm")
def test_positions_in_another_unit(case: Case) -> None:
    flatness(case, points(xy=1e-3), ["x_mm", "position", "mm"], right=False)


@cell("Unit folder: flatness", "layout", "{id}")
@pytest.mark.parametrize(
    "how",
    [
        "UTF-16", "UTF-8 with its mark", "cp1252", "semicolons and decimal commas", "trailing separators", "sep=;",
        "a title above",         "no header", "CR LF", "empty rows at the end", "quotes",
    ],
)  # fmt: skip
def test_layout_of_heights(case: Case, how: str) -> None:
    text = {
        "semicolons and decimal commas": points("x_mm;y_mm;z_um", separator=";", decimal=","),
        "trailing separators": points().replace("\n", ",,\n"),
        "sep=;": "sep=;\n" + points("x_mm;y_mm;z_um", separator=";"),
        "a title above": "Flatness of U-1,,\n" + points(),
        "no header": points(""),
        "CR LF": points().replace("\n", "\r\n"),
        "empty rows at the end": points() + ",,\n,,\n",
        "quotes": points().replace("x_mm,y_mm,z_um", '"x_mm","y_mm","z_um"'),
        "cp1252": points("x_mm,y_mm,z_um,Prüfer").replace("\n", ",Jürg\n").replace("Prüfer,Jürg", "Prüfer"),
    }.get(how, points())
    encoding = {"UTF-16": "utf-16", "UTF-8 with its mark": "utf-8-sig", "cp1252": "cp1252"}.get(how, "utf-8")
    words = ["UTF-16", "UTF-8", "1252", "sep=", "line 1", "header", "empty", "column", "x_mm", "separat"]
    flatness(case, text, words, encoding)


@cell("Unit folder: flatness", "scale", "decimal commas between commas")
def test_commas_for_both(case: Case) -> None:
    flatness(case, points(decimal=",").replace("9,", "9,0,"), ["comma", "fields", "column"], right=False)


@cell("Unit folder: flatness", "scale", "nm with thousands marks, 15.500 beside 29,5")
def test_thousands_of_heights(case: Case) -> None:
    rows = [
        f"{x};{y};{1e3 * z:,.0f}".replace(".", ";").replace(",", ".")
        for (x, y), z in zip(POSITIONS, HEIGHTS, strict=True)
    ]
    rows = [
        ";".join([f"{x:g}".replace(".", ","), f"{y:g}", f"{1e3 * z:,.0f}".replace(",", ".")])
        for (x, y), z in zip(POSITIONS, HEIGHTS, strict=True)
    ]
    flatness(
        case,
        "x [mm];y [mm];z [nm]\n" + "\n".join(rows) + "\n",
        ["thousand", "group", "mark"],
    )


@cell("Unit folder: flatness", "label", "path with a backslash")
def test_backslash(case: Case) -> None:
    folder = unit(case, '[flatness]\npoints = "data\\flatness.csv"')
    (folder / "data").mkdir()
    (folder / "data" / "flatness.csv").write_text(points())
    case.unit(folder, "flatness_um", flatness_of(HEIGHTS), 1e-6, ["backslash"])


@cell("Unit folder: flatness", "label", "path with a backslash that TOML does not know")
def test_other_backslash(case: Case) -> None:
    folder = unit(case, '[flatness]\npoints = "data\\points.csv"')
    (folder / "data").mkdir()
    (folder / "data" / "points.csv").write_text(points())
    case.unit(folder, "flatness_um", flatness_of(HEIGHTS), 1e-6, ["backslash", r"escape", r"\\p"])


@cell("Unit folder: flatness", "label", "literal path with a backslash, in single quotes")
def test_literal_backslash(case: Case) -> None:
    folder = unit(case, "[flatness]\npoints = 'data\\flatness.csv'")
    (folder / "data").mkdir()
    (folder / "data" / "flatness.csv").write_text(points())
    case.unit(folder, "flatness_um", flatness_of(HEIGHTS), 1e-6, ["backslash"])


@cell("Unit folder: flatness", "label", "file name in {id}")
@pytest.mark.parametrize(
    ("toml", "disk"), [("NFC", "NFD"), ("NFD", "NFC")], ids=["NFD (macOS)", "NFC, unit.toml in NFD"]
)
def test_forms_of_unicode(case: Case, toml: str, disk: str) -> None:
    folder = unit(case, f'[flatness]\npoints = "{unicodedata.normalize(toml, "Höhe.csv")}"')
    (folder / unicodedata.normalize(disk, "Höhe.csv")).write_text(points())
    case.unit(folder, "flatness_um", flatness_of(HEIGHTS), 1e-6, ["Unicode", "NFD", "composed"])


# Typed values


CAPACITANCES = {"F": (4.81e-6, 9.69e-6), "nF": (4810.0, 9690.0), "pF": (4.81e6, 9.69e6), "mF": (4.81e-3, 9.69e-3)}


@cell("Unit folder: typed values", "unit", "capacitances in {id} under `_uF`")
@pytest.mark.parametrize("wrong", CAPACITANCES)
def test_capacitances(case: Case, wrong: str) -> None:
    sensor, actuator = CAPACITANCES[wrong]
    folder = unit(case, f"[capacitance]\nsensor_uF = {sensor!r}\nactuator_uF = {actuator!r}")
    case.unit(folder, "sensor_uF", None, 1e-9, ["plausible", "unit", "nF", "F", "pF", "mF", "uF"])


@cell("Unit folder: typed values", "unit", "stroke in {id} under `stroke_um`")
@pytest.mark.parametrize("stroke", [373.2e-6, 0.3732, 373200.0], ids=["m", "mm", "nm"])
def test_strokes(case: Case, stroke: float) -> None:
    folder = unit(case, f"[stroke]\nstroke_um = {stroke!r}")
    case.unit(folder, "stroke_um", None, 1e-9, ["plausible", "unit", "um", "mm", "nm"])


@cell("Unit folder: typed values", "unit", "stiffness in {id} under `k_N_per_um`")
@pytest.mark.parametrize("k", [1.7e6, 1.7e3, 1.7e-3], ids=["N per m", "N per mm", "N per nm"])
def test_stiffness(case: Case, k: float) -> None:
    folder = unit(case, f"[stiffness]\nk_N_per_um = {k!r}")
    case.unit(folder, "k_closed_N_per_um", None, 1e-9, ["plausible", "unit", "N/um", "N/m"])


@cell("Unit folder: typed values", "unit", "heights `z_um` in {id}")
@pytest.mark.parametrize("factor", [1e3, 1e-6], ids=["nm", "m"])
def test_typed_heights(case: Case, factor: float) -> None:
    folder = unit(case, f"[flatness]\nz_um = {[factor * z for z in HEIGHTS]}")
    case.unit(folder, "flatness_um", None, 1e-9, ["plausible", "unit", "um", "nm", "height"])


@cell("Unit folder: typed values", "quality", "measured on {id}")
@pytest.mark.parametrize("day", ["2062-11-20", "1926-11-20"])
def test_day_of_measurement(case: Case, day: str) -> None:
    folder = unit(case, f"[flatness]\nz_um = {HEIGHTS}\n[measured]\nflatness = {day}")
    case.unit(folder, "flatness_um", None, 1e-9, ["measured", "future", day, "date"])


# Records of two checks whose truth is known


def sweep() -> dict[str, np.ndarray]:
    """Return a slow sweep of Va and what a sensor stack with a resistor makes of it: 0.93 V/V above 0.4 Hz."""
    fs, seconds = 50.0, 100.0
    t = np.arange(int(fs * seconds)) / fs
    rate = np.log(10.0 / 0.1) / seconds
    Va = 0.5 * np.sin(2 * np.pi * 0.1 / rate * (np.exp(rate * t) - 1.0))
    b, a, _ = cont2discrete(([1.0, 0.0], [1.0, 2 * np.pi * CORNER]), 1.0 / fs, "foh")
    Vs = 0.93 * lfilter(b.ravel(), a, Va, zi=lfilter_zi(b.ravel(), a) * Va[0])[0]
    return {"t": t, "Va": Va, "Vs": Vs}


def loops() -> dict[str, np.ndarray]:
    """Return sines of growing amplitude with loops of 5 %, in steps of 2.5 nm as an encoder counts."""
    t = np.arange(0.0, 8.0, 1e-3)
    amplitude = np.repeat([1.0, 2.0, 3.0, 4.0], t.size // 4)
    Va = 3.25 + amplitude * np.sin(2 * np.pi * t)
    de = 20e-6 * (Va - 3.25) - 20e-6 * LOOP / 100.0 * amplitude * np.cos(2 * np.pi * t)
    return {"t": t, "Va": Va, "de": 2.5e-9 * np.round(de / 2.5e-9)}


def csv(
    made: dict[str, np.ndarray],
    header: str,
    separator: str = ",",
    decimal: str = ".",
    end: str = "\n",
    factors: tuple[float, ...] = (1.0, 1.0, 1.0),
) -> str:
    frame = pd.DataFrame([factor * made[n] for n, factor in zip(made, factors, strict=True)]).T
    body = frame.to_csv(
        sep=separator, decimal=decimal, index=False, header=False, float_format="%.9g", lineterminator=end
    )
    return header + end + body


def highpass(
    case: Case,
    name: str,
    contents: bytes | str | Callable[[Path], None],
    words: list[str],
    right: float | None = CORNER,
    channels: str = "",
) -> None:
    """Judge the corner: without noise the estimate is right to 1e-6, and a sample of delay changes it by 1.2e-3."""
    folder = unit(case, f'[sensor_highpass]\nwith_resistor = "{name}"\nresistor_ohm = 80600.0\n{channels}')
    if callable(contents):
        contents(folder / name)
    else:
        (folder / name).write_bytes(contents.encode() if isinstance(contents, str) else contents)
    case.unit(folder, "sensor_highpass_Hz", right, 3e-4, words)


def hysteresis(
    case: Case, name: str, contents: bytes | str, words: list[str], right: float | None = LOOP, channels: str = ""
) -> None:
    """Judge the loops: steps of 2.5 nm on 80 um are 3e-5 of the loop's 5 %, 1e-3 of that; 1 % is allowed."""
    folder = unit(case, f'[hysteresis]\nrecord = "{name}"\n{channels}')
    (folder / name).write_bytes(contents.encode() if isinstance(contents, str) else contents)
    case.unit(folder, "hysteresis_percent", right, 0.01, words)


@cell("Unit folder: records", "layout", "MATLAB 5")
def test_mat(case: Case) -> None:
    highpass(case, "w.mat", lambda path: savemat(path, sweep()), ["t"])
    assert case.outcome == {"used"}


def tdms(made: dict[str, np.ndarray], **starts: float) -> Callable[[Path], None]:
    """Return a writer of Va and Vs as waveforms that start so many seconds after the first."""

    def write(path: Path) -> None:
        step = float(made["t"][1] - made["t"][0])
        channels = []
        for name in ("Va", "Vs"):
            start = np.datetime64("2026-11-20T10:00:00") + np.timedelta64(round(1e6 * starts.get(name, 0.0)), "us")
            said = {"wf_increment": step, "wf_start_time": start, "wf_start_offset": 0.0, "unit_string": "V"}
            channels.append(ChannelObject("M", name, made[name], said))
        with TdmsWriter(path) as writer:
            writer.write_segment(channels)

    return write


@cell("Unit folder: records", "start", "TDMS: equal starts")
def test_tdms(case: Case) -> None:
    highpass(case, "w.tdms", tdms(sweep()), ["tdms"])


@cell("Unit folder: records", "start", "TDMS: Vs starts {id} later by `wf_start_time`")
@pytest.mark.parametrize("samples", [1, 10], ids=["20 ms", "200 ms"])
def test_tdms_start(case: Case, samples: int) -> None:
    made = sweep()
    cut = {"t": made["t"][:-samples], "Va": made["Va"][:-samples], "Vs": made["Vs"][samples:]}
    highpass(case, "w.tdms", tdms(cut, Vs=samples / 50.0), ["start"])


@cell("Unit folder: records", "start", "TDMS: Va starts 20 ms later by `wf_start_time`")
def test_tdms_start_of_the_drive(case: Case) -> None:
    made = sweep()
    highpass(
        case, "w.tdms", tdms({"t": made["t"][:-1], "Va": made["Va"][1:], "Vs": made["Vs"][:-1]}, Va=0.02), ["start"]
    )


@cell("Unit folder: records", "start", "universal file: Vs starts 20 ms later")
def test_uff_start(case: Case) -> None:
    made = sweep()
    text = time(made["Va"][:-1], "Va", VOLT, step=0.02) + time(made["Vs"][1:], "Vs", VOLT, step=0.02, start=0.02)
    highpass(case, "w.uff", text, ["start"])


@cell("Unit folder: records", "start", "timeseries: Vs starts 20 ms later")
def test_timeseries_start(case: Case) -> None:
    made = sweep()
    contents = {
        "Va": {"Time": made["t"][:-1, None], "Data": made["Va"][:-1, None]},
        "Vs": {"Time": made["t"][1:, None], "Data": made["Vs"][1:, None]},
    }
    highpass(case, "w.mat", lambda path: savemat(path, contents), ["start", "time"])


@cell("Unit folder: records", "increment", "`Ts` and `t` contradict each other")
def test_two_sampling_times(case: Case) -> None:
    contents = {**sweep(), "Ts": 0.04}
    highpass(case, "w.mat", lambda path: savemat(path, contents), ["Ts", "sampling"], None)


@cell("Unit folder: records", "layout", "hysteresis: {id}")
@pytest.mark.parametrize(
    "how",
    ["commas", "semicolons and decimal commas", "cp1252", "UTF-16", "UTF-8 with its mark", "sep=;", "a title above",
     "trailing separators", "no end of the last line", "quotes", "tabs"],
)  # fmt: skip
def test_layout_of_a_record(case: Case, how: str) -> None:
    header, made = "t [s],Va [V],de [nm]", loops()
    scales = (1.0, 1.0, 1e9)
    text = csv(made, header, factors=scales)
    if how in ("semicolons and decimal commas", "sep=;"):
        text = csv(made, header.replace(",", ";"), ";", ",", "\r\n", scales)
    text = {
        "cp1252": csv(made, "Time (ms),Va (V),de (µm)", factors=(1e3, 1.0, 1e6)),
        "sep=;": "sep=;\r\n" + text,
        "a title above": "Hysteresis of U-1,,\n" + text,
        "trailing separators": text.replace("\n", ",,\n"),
        "no end of the last line": text.rstrip("\n"),
        "quotes": text.replace(header, '"t [s]","Va [V]","de [nm]"'),
        "tabs": csv(made, header.replace(",", "\t"), "\t", factors=scales),
    }.get(how, text)
    encoding = {"cp1252": "cp1252", "UTF-16": "utf-16", "UTF-8 with its mark": "utf-8-sig"}.get(how, "utf-8")
    words = [
        "UTF-16",
        "1252",
        "UTF-8",
        "sep=",
        "line 1",
        "header",
        "empty",
        "column",
        "separat",
        "comma",
        "last line",
        "tab",
    ]
    hysteresis(case, "h.csv", text.encode(encoding), words)


@cell("Unit folder: records", "label", "German names by [channels], semicolons, decimal commas")
def test_german_record(case: Case) -> None:
    text = csv(loops(), "Zeit [s];Ausgang [V];Geber [nm]", ";", ",", "\r\n", (1.0, 1.0, 1e9))
    hysteresis(
        case,
        "tief.csv",
        text,
        ["Zeit", "Geber", "semicolon"],
        channels='[channels]\nt = "Zeit"\nVa = "Ausgang"\nde = "Geber"',
    )
    assert case.outcome == {"used"}, "the page on exchange shows this file"


@cell("Unit folder: records", "unit", "unit of [channels] {id} the header's")
@pytest.mark.parametrize(("said", "right"), [("nm", LOOP), ("um", None)], ids=["is", "contradicts"])
def test_unit_of_the_channels(case: Case, said: str, right: float) -> None:
    text = csv(loops(), "t [s],Va [V],Geber [nm]", factors=(1.0, 1.0, 1e9))
    channels = f'[channels]\nde = {{ name = "Geber", unit = "{said}" }}'
    hysteresis(case, "h.csv", text, ["unit", "um", "nm"], right, channels)


@cell("Unit folder: records", "scale", "decimal commas in time and Va, thousands points in de [nm]")
def test_thousands_in_a_record(case: Case) -> None:
    made = loops()
    rows = [
        f"{t:.3f};{va:.6f}".replace(".", ",") + ";" + f"{de:,.0f}".replace(",", ".")
        for t, va, de in zip(made["t"], made["Va"], 1e9 * made["de"] + 150e3, strict=True)
    ]
    hysteresis(case, "h.csv", "t [s];Va [V];de [nm]\n" + "\n".join(rows) + "\n", ["thousand", "group", "mark"])


@cell("Unit folder: records", "scale", "Va in numbers of a converter")
def test_counts_in_a_record(case: Case) -> None:
    text = csv(loops(), "t,Va,de", factors=(1.0, 3276.7, 1.0))
    hysteresis(case, "h.csv", text, ["10.5", "counts", "V"], None)


@cell("Unit folder: records", "unit", "time in ms, nothing says so")
def test_time_in_ms(case: Case) -> None:
    hysteresis(
        case,
        "h.csv",
        csv(loops(), "t,Va,de", factors=(1e3, 1.0, 1.0)),
        ["ms", "sampling", "rate", "did you mean"],
    )


@cell("Unit folder: records", "increment", "hits: two resolutions that differ")
def test_hits_of_two_resolutions(case: Case) -> None:
    made = hits(8)
    folder = unit(case, '[spurious_modes]\nx_bending = "x.mat"')
    contents = {
        "Track1": made["force"], "Track2": made["x"], "Track1_X_Resolution": 1 / 2048.0,
        "Track2_X_Resolution": 1 / 1024.0,
    }  # fmt: skip
    savemat(folder / "x.mat", contents)
    case.unit(folder, "x_bending_Hz", None, 1e-9, ["Track2_X_Resolution", "resolution"])
