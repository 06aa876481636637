"""Files from a field trial, each with the right answer beside it: right by the door that its page names, or refused."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import accept
from tests.statements.case import Case
from tests.statements.plant import H_de

FIELD = Path(__file__).parents[3] / "shared" / "field"
NEVER = [r"(?!)"]  # the page of the file knows one right answer, and no refusal
SLOPE = (20.0, 80.0)  # Hz: below the resonance the averages of the records are right to 1 %, as the same records show


def record_H(f: np.ndarray) -> np.ndarray:
    """Return the truth of the records: 120.000 Hz, 0.994 %, 2.0 um/V."""
    return 2e-6 * 120.0**2 / (120.0**2 - f**2 + 2j * 0.00994 * 120.0 * f)


def of_record(case: Case, path: Path, words: list[str], options: tuple[object, ...] = (), right: bool = True) -> None:
    H = record_H if right else None
    case.frf(path, words=words, H=H, options=options, within=0.02, band=SLOPE)


def of_response(case: Case, path: Path, words: list[str], right: bool = True, **more: object) -> None:
    """Nine digits and 1 Hz lines on 1 % damping: 1e-5."""
    case.frf(path, words=words, H=H_de if right else None, within=1e-5, **more)  # type: ignore[arg-type]


def like(case: Case, reference: Path, *options: object) -> Callable[[np.ndarray], np.ndarray]:
    """Return the response of another file with the same values, at its lines."""
    out = case.path("reference.json")
    case.run("frf", reference, *options, "--json", out, codes=(0,))
    (response,) = json.loads(out.read_text())["responses"]
    f, values = np.array(response["f_Hz"]), response["H"]["de"]
    H = np.array(values["re"], dtype=float) + 1j * np.array(values["im"], dtype=float)
    return lambda at: np.interp(at, f, H.real) + 1j * np.interp(at, f, H.imag)


pytestmark = pytest.mark.needs_data
if not FIELD.is_dir():  # one skip, not one for each file
    pytest.skip("the files of the field trial are not beside the repository", allow_module_level=True)


def test_01_german_thousands(case: Case) -> None:
    folder = FIELD / "01-german-thousands"
    words = ["thousand", "group", "decimal", "comma"]
    case.frf(folder / "de.csv", words=words, H=like(case, folder / "right.csv"), within=1e-3, band=SLOPE)


@pytest.mark.parametrize("name", ["rec.csv", "rec.txt"])
def test_03_utf16(case: Case, name: str) -> None:
    path = FIELD / "03-utf16" / name
    plain = case.text(name.replace("rec", "plain"), path.read_text(encoding="utf-16"))
    short = ("--segment-s", 0.1)  # half a second was recorded, so lines lie 10 Hz apart: 29 in this band
    case.frf(path, words=["UTF-16"], H=like(case, plain, *short), options=short, within=1e-9, band=(20.0, 300.0))


@pytest.mark.parametrize("name", ["rec.csv", "sep.csv"])
def test_04_preamble(case: Case, name: str) -> None:
    of_record(case, FIELD / "04-preamble" / name, ["line 1", "header", "first line", "sep="])


@pytest.mark.parametrize("name", ["plain.csv", "labelled.csv", "time_ms.csv", "us.csv"])
def test_05_time(case: Case, name: str) -> None:
    of_record(case, FIELD / "05-time-ms" / name, ["ms", "sampling"])


def test_05_time_of_hits(case: Case) -> None:
    of_record(case, FIELD / "05-time-ms" / "plain.csv", ["ms", "sampling"], ("--hammer", "--input", "Va"), right=False)


@pytest.mark.parametrize("name", ["epoch.csv", "epoch_ms.csv", "date.csv"])
def test_06_epoch(case: Case, name: str) -> None:
    of_record(case, FIELD / "06-epoch" / name, ["date", "--ts", "ms"])


@pytest.mark.parametrize("name", ["counts.csv", "only_va.csv"])
def test_07_counts(case: Case, name: str) -> None:
    of_record(case, FIELD / "07-adc" / name, ["10.5", "counts", "volt"], right=False)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("good", NEVER),
        ("german", NEVER),
        ("khz", ["kHz"]),
        ("rads", ["rad"]),
        ("complex", ["complex", "de_re"]),
        ("matlabi", ["complex", "de_re"]),
        ("dbdeg", ["dB", "deg"]),
        ("magphase", ["magnitude", "phase", "de_re"]),
        ("neg", ["negative", "two-sided"]),
        ("mixunit", ["um/V", "unit"]),
        ("accel", ["m/s", "unit"]),
    ],
)
def test_09_responses(case: Case, name: str, words: list[str]) -> None:
    of_response(case, FIELD / "09-frf" / f"{name}.csv", words, right=name != "accel")


@pytest.mark.parametrize("name", ["same.tdms", "shifted.tdms"])
def test_10_tdms_start(case: Case, name: str) -> None:
    of_record(case, FIELD / "10-tdms-start" / name, ["start"])


@pytest.mark.parametrize("name", ["frf_mm_164.uff", "frf_mm_label.uff", "frf_si.uff"])
def test_13_uff_164(case: Case, name: str) -> None:
    of_response(case, FIELD / "13-uff-164" / name, ["164", "mm", "unit"])


@pytest.mark.parametrize("name", ["khz", "rads", "rpm"])
def test_14_uff_abscissa(case: Case, name: str) -> None:
    # 2 pi in six digits moves the flank of the resonance by 1e-4
    case.frf(FIELD / "14-uff-abscissa" / f"{name}.uff", words=["abscissa", "kHz", "rad", "rpm"], within=1e-3)


def test_15_uff_filled_line(case: Case) -> None:
    of_record(case, FIELD / "15-uff-time" / "pad.uff", ["39999"])
    assert case.outcome == {"used"}, "a line that is filled is no defect"


@pytest.mark.parametrize("name", ["cyc", "default", "hz", "khz", "none", "rads", "rpm"])
def test_16_frd(case: Case, name: str) -> None:
    of_response(case, FIELD / "16-mat-frd" / f"{name}.mat", ["FrequencyUnit", "unit", "rad", "rpm"])


def test_16_frd_of_two_outputs(case: Case) -> None:
    H = {"de": H_de, "da": lambda f: 3.0 * H_de(f)}
    case.frf(FIELD / "16-mat-frd" / "two.mat", words=["output"], H=H, within=1e-5)


@pytest.mark.parametrize("name", ["twoin", "twoin_nonames"])
def test_16_frd_of_two_inputs(case: Case, name: str) -> None:
    of_response(case, FIELD / "16-mat-frd" / f"{name}.mat", ["input"])


@pytest.mark.parametrize("name", ["tt.mat", "tt_shift.mat", "dt.mat"])
def test_18_records(case: Case, name: str) -> None:
    of_record(case, FIELD / "18-mat-records" / name, ["start", "time axes", "Time", "dt", "ms", "sampling"])


@pytest.mark.parametrize(
    ("name", "quality", "right"),
    [
        ("fraction", "coherence", True),
        ("percent", "coherence", True),
        ("percent_nolabel", "coherence", False),
        ("cohdb", "coherence", False),
        ("mvar", "var", True),
        ("umvar", "var", True),
        ("negvar", "var", False),
    ],
)
def test_32_coherence(case: Case, name: str, quality: str, right: bool) -> None:
    def check(answer: dict[str, dict[str, list[float]]]) -> None:
        first = answer[quality]["de"][0]
        assert first == pytest.approx(0.987260766 if quality == "coherence" else 4.0005555e-16, rel=1e-6)

    path = FIELD / "32-coherence-percent" / f"{name}.csv"
    of_response(case, path, ["coherence", "varian", "_var"], right, options=("--averages", 20), check=check)


def test_33_study(case: Case) -> None:
    case.table(["rr"], FIELD / "33-rr-comma" / "rr.csv", None, 0.0, ["comma", "fields"])


def test_33_study_with_a_column_twice(case: Case) -> None:
    case.table(["rr"], FIELD / "33-rr-comma" / "rr_dupcol.csv", None, 0.0, ["twice", "two columns", "more than once"])


def test_34_bias(case: Case) -> None:
    path = FIELD / "34-gauge-comma" / "bias.csv"
    lines = path.read_text().splitlines()[1:]
    mean = float(np.mean([float(".".join(x.split(",")[1:])) for x in lines]))
    assert mean == pytest.approx(9.85, abs=0.01)
    words = ["comma", "fields"]
    case.table(["gauge", "bias"], path, {"mean": mean}, 1e-9, words, "--reference", 9.85, "--tolerance", 1)


def test_37_conjugate(case: Case) -> None:
    path = FIELD / "37-conjugate" / "conj.csv"
    code, said = case.run("frf", path)
    if code == 6:
        case.refused(said, ["phase", "conjugate", "sign"])
    else:
        assert re.search("phase|conjugate|sign", said, re.IGNORECASE), f"its phase rises, without a word: {said}"


def judged(case: Case, name: str, quantity: str, right: float | None, within: float, words: list[str]) -> None:
    case.unit(FIELD / name / "A-01", quantity, right, within, words, alone=False)


FLAT = 5.415254  # um: smallest zone of the heights by linear programming, as in test_unit_folder


@pytest.mark.parametrize(
    ("name", "quantity", "right", "words"),
    [
        ("40-flatness-nm", "flatness_um", None, ["um", "nm", "plausible", "height"]),
        ("41-flatness-unit-header", "flatness_um", FLAT, ["nm", "unit"]),
        ("43-capacitance-farad", "sensor_uF", None, ["plausible", "uF", "F"]),
        ("44-measured-2062", "flatness_um", None, ["2062", "future"]),
        ("45-backslash-path", "flatness_um", FLAT, ["backslash"]),
        ("46-flatness-utf16", "flatness_um", FLAT, ["UTF-16"]),
        ("47-flatness-trailing-commas", "flatness_um", FLAT, ["empty", "column"]),
        ("48-hysteresis-semicolon", "hysteresis_percent", 3.489, NEVER),
        ("49-hysteresis-cp1252", "hysteresis_percent", 3.489, NEVER),
        ("55-nfd-name", "flatness_um", FLAT, ["NFD", "composed", "Unicode"]),
        ("56-highpass-tdms-start", "sensor_highpass_Hz", 0.387, ["start"]),
    ],
    ids=lambda value: value if isinstance(value, str) and "-" in value else "",
)
def test_40_to_56_units(case: Case, name: str, quantity: str, right: float | None, words: list[str]) -> None:
    judged(case, name, quantity, right, 2e-3, words)


def test_52_example_of_the_docs(case: Case) -> None:
    # Its records are 0.3 s: read, and too short for the check. What is said is about the time and no longer the text.
    case.unit(
        FIELD / "52-docs-example" / "S-01", "axial_resonance_Hz", None, 0.0, ["short", "long", "duration", "10 s"]
    )


def test_60_analyser(case: Case) -> None:
    path = FIELD / "60-dataphysics" / "hammer_point.mat"
    contents = loadmat(path)
    code, said = case.run("frf", path, "--json", case.path("a.json"))
    assert code == 0, said
    (answer,) = json.loads(case.path("a.json").read_text())["responses"]
    assert len(answer["H"]) == 3
    assert len(answer["f_Hz"]) == 1601
    assert answer["units"][answer["input"]] == "N"
    for channel, k in zip(answer["H"], (2, 3, 4), strict=True):
        values = answer["H"][channel]
        H = np.array(values["re"], dtype=float) + 1j * np.array(values["im"], dtype=float)
        ratio = (H / contents[f"H1_{k}"][:, 1])[100:]
        assert np.allclose(ratio, 1.0, rtol=1e-9) or np.allclose(ratio, 9.80665, rtol=1e-5), (channel, ratio[:3])
        coherence = np.array(answer["coherence"][channel], dtype=float)
        assert np.allclose(coherence, contents[f"C1_{k}"][:, 1].real, rtol=1e-9)


def test_60_hits_of_the_analyser(case: Case) -> None:
    path = FIELD / "60-dataphysics" / "hammer_point.mat"
    code, said = case.run("frf", "--hammer", path, "--input", "X1", "--json", case.path("a.json"))
    if code == 6:  # one hit says nothing about the scatter of hits; it is judged all the same
        case.refused(said, ["two good hits", "1 of 1"])
        assert "no time vector" not in said


def test_the_door_of_python_agrees(case: Case) -> None:
    """What `accept frf` refuses of these, `accept.read_record` refuses too, and in words of its own."""
    for path, words in (
        (FIELD / "10-tdms-start" / "shifted.tdms", ["start"]),
        (FIELD / "18-mat-records" / "tt_shift.mat", ["start", "Time", "time axes"]),
    ):
        try:
            record = accept.read_record(path)
        except accept.AcceptError as error:
            case.refused(str(error), words)
            continue
        found = accept.frequency_response(record).frf
        near = int(np.abs(found.f - 50.0).argmin())
        H = found.H[near, found.channels.index("de")]
        assert abs(H / record_H(found.f[near : near + 1])[0] - 1.0) < 0.02, f"{path.name}: {H}"
