"""TDMS as LabVIEW and DAQmx write it: by nptdms' writer, and by bytes where that has no way to."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

from tests.statements.case import Case, cell
from tests.statements.plant import FS, SHIFT, H_da, H_de, H_force, hits, late, record

STEP = 1.0 / FS
START = np.datetime64("2026-11-20T10:00:00.000000")
WAVE = {"wf_increment": STEP, "wf_start_offset": 0.0, "wf_start_time": START}
UNITS = {"Va": "V", "de": "m", "da": "m"}


def write(path: Path, channels: dict[str, np.ndarray], group: str = "Measurement", **own: dict[str, Any]) -> Path:
    """Write channels with the properties of a waveform; `own`: what differs by channel, None leaves a property out."""
    objects = [RootObject({"name": "bench"}), GroupObject(group)]
    for name, values in channels.items():
        said = {**WAVE, "unit_string": UNITS.get(name, ""), **own.get(name, {})}
        objects.append(ChannelObject(group, name, values, {k: v for k, v in said.items() if v is not None}))
    with TdmsWriter(path) as writer:
        writer.write_segment(objects)
    return path


def two(made: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {"Va": made["Va"], "de": made["de"]}


@cell("TDMS", "start", "equal start times")
def test_equal_starts(case: Case) -> None:
    case.record(write(case.path("r.tdms"), two(record())), ["start"])
    assert case.outcome == {"used"}


@cell("TDMS", "start", "`wf_start_time` of de is 5 ms later")
def test_start_time(case: Case) -> None:
    later = {"wf_start_time": START + np.timedelta64(5000, "us")}
    case.record(write(case.path("r.tdms"), two(late()), de=later), ["start"])


@cell("TDMS", "start", "`wf_start_time` of Va is 5 ms later")
def test_start_time_of_the_drive(case: Case) -> None:
    made = late()
    swapped = {"Va": record(10)["Va"][SHIFT : SHIFT + made["Va"].size], "de": record(10)["de"][: made["de"].size]}
    later = {"wf_start_time": START + np.timedelta64(5000, "us")}
    case.record(write(case.path("r.tdms"), swapped, Va=later), ["start"])


@cell("TDMS", "start", "`wf_start_time` of de is 0.1 sample later")
def test_start_time_within_a_sample(case: Case) -> None:
    # 50 us are 5 degrees at 300 Hz: the response is that of the samples, turned. Within 2 %, as interpolation leaves.
    later = {"wf_start_time": START + np.timedelta64(50, "us")}
    case.record(
        write(case.path("r.tdms"), two(record()), de=later),
        ["start"],
        H=lambda f: H_de(f) * np.exp(-2j * np.pi * f * 50e-6),
        within=0.02,
    )


@cell("TDMS", "start", "`wf_start_time` of de is a day later: no sample in common")
def test_starts_apart(case: Case) -> None:
    later = {"wf_start_time": START + np.timedelta64(1, "D")}
    case.record(write(case.path("r.tdms"), two(record()), de=later), ["start"], H=None)


@cell("TDMS", "start", "`wf_start_offset` of de is 5 ms")
def test_start_offset(case: Case) -> None:
    case.record(write(case.path("r.tdms"), two(late()), de={"wf_start_offset": SHIFT * STEP}), ["start", "offset"])


@cell("TDMS", "start", "`wf_start_time` 5 ms later and `wf_start_offset` -5 ms: the same start")
def test_start_time_and_offset_cancel(case: Case) -> None:
    same = {"wf_start_time": START + np.timedelta64(5000, "us"), "wf_start_offset": -5e-3}
    case.record(write(case.path("r.tdms"), two(record()), de=same), ["start"])


@cell("TDMS", "start", "only Va has a `wf_start_time`")
def test_start_time_of_one(case: Case) -> None:
    case.record(write(case.path("r.tdms"), two(record()), de={"wf_start_time": None}), ["start"])


@cell("TDMS", "start", "`NI_ExpStartTimeStamp` of de is 5 ms later, no `wf_start_time`")
def test_other_start_stamp(case: Case) -> None:
    none = {"wf_start_time": None, "NI_ExpStartTimeStamp": START}
    later = {**none, "NI_ExpStartTimeStamp": START + np.timedelta64(5000, "us")}
    case.record(write(case.path("r.tdms"), two(late()), Va=none, de=later), ["start"])


@cell("TDMS", "start", "hits of a hammer: response 5 ms later by `wf_start_time`")
def test_start_time_of_hits(case: Case) -> None:
    made = hits()
    shift = 10  # samples at 2048 Hz
    later = {"wf_start_time": START + np.timedelta64(round(1e6 * shift / 2048.0), "us")}
    step = {"wf_increment": 1.0 / 2048.0}
    path = write(
        case.path("h.tdms"),
        {"force": made["force"][:-shift], "x": made["x"][shift:]},
        force={**step, "unit_string": "N"},
        x={**step, **later, "unit_string": "m"},
    )
    case.frf(path, words=["start"], H=H_force, options=["--hammer", "--input", "force"], within=0.01)


@cell("TDMS", "increment", "`wf_increment` of de is twice that of Va")
def test_two_increments(case: Case) -> None:
    made = record()
    slow = {"Va": made["Va"], "de": made["de"][::2]}
    case.record(write(case.path("r.tdms"), slow, de={"wf_increment": 2 * STEP}), ["increment", "sampling", "rate"])


@cell("TDMS", "increment", "`wf_increment` differs, numbers of samples do not")
def test_two_increments_of_equal_length(case: Case) -> None:
    made = record()
    path = write(case.path("r.tdms"), two(made), de={"wf_increment": 2 * STEP})
    case.record(path, ["increment", "sampling", "rate"], H=None)


@cell("TDMS", "increment", "only Va has a `wf_increment`")
def test_increment_of_one(case: Case) -> None:
    path = write(case.path("r.tdms"), two(record()), de={"wf_increment": None})
    case.record(path, ["increment", "sampling", "time"], H=None)


@cell("TDMS", "increment", "`wf_increment` = {id}")
@pytest.mark.parametrize("step", [0.0, -STEP, float("nan")], ids=["zero", "negative", "NaN"])
def test_impossible_increment(case: Case, step: float) -> None:
    wrong = {"wf_increment": step}
    path = write(case.path("r.tdms"), two(record()), Va=wrong, de=wrong)
    case.record(path, ["increment", "sampling"], H=None)


@cell("TDMS", "increment", "no `wf_increment`, no channel of time")
def test_no_increment(case: Case) -> None:
    none = dict.fromkeys(WAVE)
    case.record(write(case.path("r.tdms"), two(record()), Va=none, de=none), ["increment", "time", "--ts"])
    assert case.outcome == {"refused"}


@cell("TDMS", "increment", "no `wf_increment`, a channel of time with its unit")
def test_channel_of_time(case: Case) -> None:
    none = dict.fromkeys(WAVE)
    made = {"t": record()["t"], **two(record())}
    case.record(write(case.path("r.tdms"), made, t={**none, "unit_string": "s"}, Va=none, de=none), ["time"])


@cell("TDMS", "increment", "`wf_increment` 0.5 ms beside a channel of time of 0.25 ms")
def test_increment_against_time(case: Case) -> None:
    made = {"t": record()["t"] / 2.0, **two(record())}
    none = dict.fromkeys(WAVE)
    path = write(case.path("r.tdms"), made, t={**none, "unit_string": "s"})
    case.record(path, ["increment", "time"], H=None)


@cell("TDMS", "unit", "`wf_xunit_string` = ms, `wf_increment` = 0.5")
def test_unit_of_the_increment(case: Case) -> None:
    ms = {"wf_increment": 1e3 * STEP, "wf_xunit_string": "ms", "wf_xname": "Time"}
    case.record(write(case.path("r.tdms"), two(record()), Va=ms, de=ms), ["ms", "unit", "increment"])


@cell("TDMS", "kind", "`wf_xname` = Frequency, `wf_xunit_string` = Hz: no record")
def test_axis_of_frequency(case: Case) -> None:
    hertz = {"wf_increment": 1.0, "wf_xunit_string": "Hz", "wf_xname": "Frequency"}
    path = write(case.path("r.tdms"), two(record()), Va=hertz, de=hertz)
    case.record(path, ["frequency", "Hz", "spectr"], H=None)


@cell("TDMS", "unit", "`unit_string` of de = {id}")
@pytest.mark.parametrize("unit", ["mm", "um", "µm", "nm", "Meters", "inch"])
def test_unit_of_a_channel(case: Case, unit: str) -> None:
    factor = {"mm": 1e3, "um": 1e6, "µm": 1e6, "nm": 1e9, "Meters": 1.0, "inch": 1 / 25.4e-3}[unit]
    made = {"Va": record()["Va"], "de": factor * record()["de"]}
    case.record(write(case.path("r.tdms"), made, de={"unit_string": unit}), [unit, "unit"])


@cell("TDMS", "unit", "`unit_string` of Va = {id}")
@pytest.mark.parametrize("unit", ["Volts", "mV", "Volt"])
def test_unit_of_the_drive(case: Case, unit: str) -> None:
    made = {"Va": (1e3 if unit == "mV" else 1.0) * record()["Va"], "de": record()["de"]}
    case.record(write(case.path("r.tdms"), made, Va={"unit_string": unit}), [unit, "unit"])


@cell("TDMS", "unit", "`unit_string` of de = {id}: no length")
@pytest.mark.parametrize("unit", ["m/s^2", "counts", "g", "Strain"])
def test_unit_of_another_kind(case: Case, unit: str) -> None:
    path = write(case.path("r.tdms"), two(record()), de={"unit_string": unit})
    case.record(path, [unit.replace("^", r"\^"), "unit"], H=None)


@cell("TDMS", "unit", "`NI_UnitDescription` of de = mm, no `unit_string`")
def test_other_name_of_the_unit(case: Case) -> None:
    made = {"Va": record()["Va"], "de": 1e3 * record()["de"]}
    path = write(case.path("r.tdms"), made, de={"unit_string": None, "NI_UnitDescription": "mm"})
    case.record(path, ["mm", "unit"])


@cell("TDMS", "unit", "`unit_string` = m against `NI_UnitDescription` = mm")
def test_two_units(case: Case) -> None:
    path = write(case.path("r.tdms"), two(record()), de={"unit_string": "m", "NI_UnitDescription": "mm"})
    case.record(path, ["unit", "mm"], H=None)


def scaled(case: Case, *scales: dict[str, Any], status: str = "unscaled", raw: np.ndarray | None = None) -> Path:
    """Write Va as 16-bit numbers of 0.1 mV with scales as LabVIEW's `Create Scaling Information` writes them."""
    made = record()
    said: dict[str, Any] = {"NI_Scaling_Status": status, "NI_Number_Of_Scales": np.uint32(len(scales))}
    for k, scale in enumerate(scales):
        said |= {f"NI_Scale[{k}]_{name}": value for name, value in scale.items()}
    counts = np.round(made["Va"] / 1e-4).astype(np.int16) if raw is None else raw
    return write(case.path("r.tdms"), {"Va": counts, "de": made["de"]}, Va=said)


LINEAR = {
    "Scale_Type": "Linear",
    "Linear_Slope": 1e-4,
    "Linear_Y_Intercept": 0.0,
    "Linear_Input_Source": np.uint32(0xFFFFFFFF),
}


# Steps of 0.1 mV on 1 V rms are 3e-5, on a line of the multisine, a tenth of that, 5e-4 at most: 5e-3 is far above, and
# far below a missing factor.
@cell("TDMS", "scale", "Linear")
def test_linear_scale(case: Case) -> None:
    case.record(scaled(case, LINEAR), ["scale", "scaling"], within=5e-3)


@cell("TDMS", "scale", "Polynomial 0 + 1e-4 x")
def test_polynomial_scale(case: Case) -> None:
    scale = {
        "Scale_Type": "Polynomial",
        "Polynomial_Coefficients_Size": np.uint32(2),
        "Polynomial_Coefficients[0]": 0.0,
        "Polynomial_Coefficients[1]": 1e-4,
        "Polynomial_Input_Source": np.uint32(0xFFFFFFFF),
    }
    case.record(scaled(case, scale), ["scale", "scaling"], within=5e-3)


@cell("TDMS", "scale", "two linear scales, the second of the first")
def test_chain_of_scales(case: Case) -> None:
    half = {**LINEAR, "Linear_Slope": 1e-2}
    case.record(scaled(case, half, {**half, "Linear_Input_Source": np.uint32(0)}), ["scale", "scaling"], within=5e-3)


@cell("TDMS", "scale", "{id}, which the library does not know")
@pytest.mark.parametrize("kind", ["PieceWisePolynomial", "Reciprocal", "Lookup"])
def test_unknown_scale(case: Case, kind: str) -> None:
    case.record(scaled(case, {"Scale_Type": kind}), ["scale", "scaling", kind], H=None)
    assert case.outcome == {"refused"}


@cell("TDMS", "scale", "an unknown scale after a linear one, peak below 10 V")
def test_unknown_scale_after_a_linear_one(case: Case) -> None:
    path = scaled(case, LINEAR, {"Scale_Type": "PieceWisePolynomial"})
    case.record(path, ["scale", "scaling"], H=None)


@cell("TDMS", "scale", "numbers of an analogue converter, no scale")
def test_counts(case: Case) -> None:
    counts = np.round(record()["Va"] / 1e-4).astype(np.int16)
    path = write(case.path("r.tdms"), {"Va": counts, "de": record()["de"]}, Va={"unit_string": None})
    case.record(path, ["10.5", "counts", "volt", r"\bV\b"], H=None)


@cell("TDMS", "label", "two groups with the same channels")
def test_two_groups(case: Case) -> None:
    made = two(record())
    objects = [
        ChannelObject(group, name, values * (1.0 if group == "Run 1" else 3.0), {**WAVE, "unit_string": UNITS[name]})
        for group in ("Run 1", "Run 2")
        for name, values in made.items()
    ]
    with TdmsWriter(case.path("r.tdms")) as writer:
        writer.write_segment(objects)
    case.frf(case.path("r.tdms"), words=["group", "Run 1", "twice"], H=H_de)


@cell("TDMS", "label", "a channel of text beside the numbers")
def test_channel_of_text(case: Case) -> None:
    objects = [
        ChannelObject("M", name, values, {**WAVE, "unit_string": UNITS[name]}) for name, values in two(record()).items()
    ]
    objects.append(ChannelObject("M", "remarks", np.array(["start", "end"])))
    with TdmsWriter(case.path("r.tdms")) as writer:
        writer.write_segment(objects)
    case.record(case.path("r.tdms"), ["text", "remarks"])


@cell("TDMS", "label", "unit in the channel's name: de (nm)")
def test_unit_in_the_name(case: Case) -> None:
    made = {"Va (V)": record()["Va"], "de (nm)": 1e9 * record()["de"]}
    none = {"unit_string": None}
    case.record(write(case.path("r.tdms"), made, **dict.fromkeys(made, none)), [r"\(nm\)", "unit"])


@cell("TDMS", "quality", "a channel that is {id} shorter")
@pytest.mark.parametrize("lost", [1, 100], ids=["one sample", "100 samples"])
def test_channel_is_shorter(case: Case, lost: int) -> None:
    made = record(10)
    # What is missing may be at the end, as in a recording that was stopped; nothing says so.
    case.frf(
        write(case.path("r.tdms"), {"Va": made["Va"], "de": made["de"][:-lost]}),
        words=["length", "long", "samples", "values", "shorter"],
    )


@cell("TDMS", "quality", "NaN among the values")
def test_nan(case: Case) -> None:
    made = two(record())
    made["de"][100] = np.nan
    case.record(write(case.path("r.tdms"), made), ["NaN", "not a number", "number"], H=None)


@cell("TDMS", "layout", "three segments")
def test_segments(case: Case) -> None:
    made = two(record())
    with TdmsWriter(case.path("r.tdms")) as writer:
        for part in range(3):
            cut = slice(part * 1200, (part + 1) * 1200)
            writer.write_segment(
                [
                    ChannelObject("M", n, v[cut], {**WAVE, "unit_string": UNITS[n]} if part == 0 else {})
                    for n, v in made.items()
                ]
            )
    case.record(case.path("r.tdms"), ["segment"])
    assert case.outcome == {"used"}


def raw_segment(channels: dict[str, np.ndarray], interleaved: bool, order: str) -> bytes:
    """Return one segment by the public description of TDMS: lead-in, objects with properties, values."""

    def text(value: str) -> bytes:
        return struct.pack(f"{order}I", len(value.encode())) + value.encode()

    paths = ["/", "/'M'", *(f"/'M'/'{name}'" for name in channels)]
    meta = struct.pack(f"{order}I", len(paths))
    for path in paths:
        meta += text(path)
        name = path.rpartition("/")[2].strip("'")
        if name in channels:
            meta += struct.pack(f"{order}IIIQ", 20, 10, 1, channels[name].size)  # doubles, one dimension
            meta += struct.pack(f"{order}I", 2)
            meta += text("wf_increment") + struct.pack(f"{order}Id", 10, STEP)
            meta += text("unit_string") + struct.pack(f"{order}I", 0x20) + text(UNITS[name])
        else:
            meta += struct.pack(f"{order}II", 0xFFFFFFFF, 0)
    values = np.array(list(channels.values()))
    data = (values.T if interleaved else values).astype(f"{order}f8").tobytes()
    contents = (1 << 1) | (1 << 2) | (1 << 3) | ((1 << 5) if interleaved else 0) | ((1 << 6) if order == ">" else 0)
    return (
        b"TDSm"
        + struct.pack("<I", contents)
        + struct.pack(f"{order}I", 4713)
        + struct.pack(f"{order}QQ", len(meta) + len(data), len(meta))
        + meta
        + data
    )


@cell("TDMS", "layout", "{id}")
@pytest.mark.parametrize(
    ("interleaved", "order"),
    [(True, "<"), (False, ">"), (True, ">")],
    ids=["interleaved", "big-endian", "interleaved and big-endian"],
)
def test_interleaved_and_big_endian(case: Case, interleaved: bool, order: str) -> None:
    case.path("r.tdms").write_bytes(raw_segment(two(record()), interleaved, order))
    case.record(case.path("r.tdms"), ["interleaved", "endian"])


@cell("TDMS", "layout", "properties without data")
def test_no_data(case: Case) -> None:
    with TdmsWriter(case.path("r.tdms")) as writer:
        writer.write_segment([RootObject({"name": "bench"}), GroupObject("M", {"operator": "Ann"})])
    case.record(case.path("r.tdms"), ["no channel", "no data", "empty", "holds no", "nothing"], H=None)


@cell("TDMS", "unit", "two outputs, de in nm and da in um")
def test_two_outputs(case: Case) -> None:
    made = record(9, "da")
    path = write(
        case.path("r.tdms"),
        {"Va": made["Va"], "de": 1e9 * made["de"], "da": 1e6 * made["da"]},
        de={"unit_string": "nm"},
        da={"unit_string": "um"},
    )
    case.record(path, ["nm", "unit"], H={"de": H_de, "da": H_da})
