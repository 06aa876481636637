"""Unit folders: hostile input ends in a clear refusal or a reasoned no_result, never in a verdict or a traceback."""

import json
import os
import unicodedata
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from accept.base.documents.results import UnitRecord
from accept.judging import judge_unit, load_spec
from accept.units import unit_folder
from accept.units.unit_folder import UnitError
from checks.cause import Cause, because
from checks.verdict import UnitVerdict, Verdict
from tests.accept.units.units import GOOD, make_unit, save_mat

SPEC = load_spec("apa-basic")


def judge(folder: Path):
    return judge_unit(unit_folder.read(folder), SPEC)


def findings(folder: Path) -> dict:
    return {f.quantity: f for f in judge(folder).findings}


MANY = "".join(f'p{n} = "A-{n}"\n' for n in range(201))


def test_a_good_unit_is_accepted(tmp_path: Path) -> None:
    result = judge(make_unit(tmp_path))
    assert result.verdict is UnitVerdict.ACCEPTED
    assert {f.verdict for f in result.findings} == {Verdict.PASS}
    assert list(result.inputs) == ["unit.toml"]


def test_the_folder_of_a_unit_of_the_workflow_names_its_last_attempt(tmp_path: Path) -> None:
    for number in (9, 10):
        make_unit(tmp_path / f"attempt-{number}")
    with pytest.raises(UnitError, match=r"the last one: .*attempt-10$"):
        unit_folder.read(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('serial = "{serial}"', "", ["serial is missing"]),
        ('serial = "{serial}"', "serial = 7", ["serial = 7", "text"]),
        ('serial = "{serial}"', 'serial = "../../etc/passwd"', ["serial", "letters"]),
        ('serial = "{serial}"', 'serial = ""', ["serial", "text"]),
        ('kind = "apa"', 'kind = "motor"', ["kind = 'motor'", "apa, strut"]),
        ("sensor_uF = 5.10", 'sensor_uF = "5.10"', ["[capacitance] sensor_uF = '5.10'", "number in uF"]),
        ("sensor_uF = 5.10", "sensor_uF = true", ["[capacitance] sensor_uF = True", "number in uF"]),
        ("sensor_uF = 5.10", "sensor_F = 5.10", ["[capacitance] sensor_F", "unknown key", "sensor_uF"]),
        ("sensor_uF = 5.10", "sensor_uF = { value = 5.1, u = 1 }", ["[capacitance] sensor_uF", "{ value, U }"]),
        ("sensor_uF = 5.10", "sensor_uF = [5.1]", ["[capacitance] sensor_uF", "number in uF"]),
        ("stroke_um = 373.2", 'stroke_um = 373.2\none_stack = "a.mat"', ["[stroke]", "mixes"]),
        ("[stroke]\nstroke_um = 373.2", "stroke = 373.2", ["unknown key"]),
        ("[stroke]", "[strok]", ["[strok] unknown section", "did you mean 'stroke'?"]),
        ("[flatness]\nz_um = [0, -0.5,", '[flatness]\nz_um = [0, "-0.5",', ["[flatness] z_um", "list of 8 numbers"]),
        ("[capacitance]", '[channels]\nVS = "AI0"\n[capacitance]', ["[channels] VS", "did you mean 'Vs'?"]),
        ("[capacitance]", "[parts]\napa = 3\n[capacitance]", ["[parts] apa = 3", "text"]),
        ("[capacitance]", f"[parts]\n{MANY}[capacitance]", ["[parts] has 201 entries, at most 200"]),
    ],
)
def test_an_unusable_unit_toml_is_refused_by_key(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert old in GOOD
    with pytest.raises(UnitError) as refused:
        unit_folder.read(make_unit(tmp_path, text=GOOD.replace(old, new)))
    message = str(refused.value)
    assert "unit.toml" in message
    assert "\n" not in message
    assert all(word in message for word in words), message


@pytest.mark.parametrize(
    ("value", "question"),
    [("4.81e-6", "did you mean 4.81e-06 F?"), ("4810", "did you mean 4810 nF?"), ("4.81e6", "4.81e+06 pF?"), ("0", "")],
)
def test_a_capacitance_in_another_unit_is_no_result_and_no_wrong_stack(
    tmp_path: Path, value: str, question: str
) -> None:
    """A stack has some uF; a meter that shows farads, nF or pF is typed as it reads. 0: open leads."""
    found = findings(make_unit(tmp_path, text=GOOD.replace("sensor_uF = 5.10", f"sensor_uF = {value}")))
    finding = found["sensor_uF"]
    assert finding.verdict is Verdict.NO_RESULT
    assert "expected 0.01 to 100 uF" in finding.reason
    assert question in finding.reason


def test_a_day_in_the_future_is_refused_and_tomorrow_is_a_laboratory_further_east(tmp_path: Path) -> None:
    def measured(days: int, folder: str) -> Path:
        day = date.today() + timedelta(days=days)
        return make_unit(tmp_path / folder, text=f"{GOOD}\n[measured]\nflatness = {day}\n")

    assert unit_folder.read(measured(1, "east")).measured
    late = measured(2, "late")
    with pytest.raises(UnitError, match=r"\[measured\] flatness = .* lies in the future, today is"):
        unit_folder.read(late)
    assert unit_folder.read(late, latest=date.max).measured  # a certificate that is judged again on a slow clock


def test_a_windows_path_between_double_quotes_is_called_so(tmp_path: Path) -> None:
    text = GOOD.replace("[stroke]\nstroke_um = 373.2", '[stroke]\none_stack = "data\\flat.mat"\ntwo_stacks = "b.mat"')
    with pytest.raises(UnitError, match=r"backslash makes a control character in TOML; write 'data/flat\.mat'"):
        unit_folder.read(make_unit(tmp_path, text=text))


@pytest.mark.parametrize(("stored", "named"), [("NFD", "NFC"), ("NFC", "NFD")])
def test_a_name_is_found_in_either_form_of_unicode(tmp_path: Path, stored: str, named: str) -> None:
    """macOS stores an umlaut as a letter and its dots; an editor writes one character."""
    name = "H\u00f6he.csv"
    (tmp_path / unicodedata.normalize(stored, name)).write_text("x_mm,y_mm,z_um\n")
    found = unit_folder.inside(tmp_path, unicodedata.normalize(named, name))
    assert found.read_text().startswith("x_mm")
    both = tmp_path / unicodedata.normalize(named, name)
    both.write_text("the one that is named")
    assert unit_folder.inside(tmp_path, both.name).read_text() == "the one that is named"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"serial = '\xff'", "not UTF-8"),
        (b"serial = ", "not TOML"),
        (b"", "serial is missing"),
        (b"\0" * 99, "not TOML"),
        (b"a=" + b"[" * 5000, "not TOML"),
        (b"a=1" + b"0" * 5000, "a number of more than 4300 digits"),
        (b"#" * 2_000_000, "has 2000000 bytes, at most 1000000 are read"),
    ],
)
def test_damaged_toml(tmp_path: Path, content: bytes, words: str) -> None:
    (tmp_path / "unit.toml").write_bytes(content)
    with pytest.raises(UnitError, match=words):
        unit_folder.read(tmp_path)


def test_not_a_folder_not_there_and_nothing_inside(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    (tmp_path / "empty").mkdir()
    for path, words in (("file", "is a file"), ("absent", "does not exist"), ("empty", "holds no unit.toml")):
        with pytest.raises(UnitError, match=words):
            unit_folder.find(tmp_path / path)


@pytest.mark.parametrize(
    ("old", "new", "quantity", "words"),
    [
        ("sensor_uF = 5.10", "sensor_uF = nan", "sensor_uF", "sensor_uF is nan"),
        ("sensor_uF = 5.10", "sensor_uF = inf", "sensor_uF", "sensor_uF is inf"),
        ("sensor_uF = 5.10", f"sensor_uF = 1{'0' * 400}", "sensor_uF", "inf"),
        ("sensor_uF = 5.10", "sensor_uF = -5.1", "sensor_uF", "not plausible"),
        ("sensor_uF = 5.10", "sensor_uF = { value = 5.1, U = -0.1 }", "sensor_uF", "expected a positive number"),
        ("sensor_uF = 5.10", "sensor_uF = { value = 5.1, U = nan }", "sensor_uF", "expected a positive number"),
        ("sensor_uF = 5.10", "sensor_uF = { value = 5.1, U = 5e-12 }", "sensor_uF", "no instrument is that exact"),
        ("sensor_uF = 5.10", "", "sensor_uF", "not measured"),
        ("[stroke]\nstroke_um = 373.2", "", "stroke_um", "not measured"),
        ("stroke_um = 373.2", "", "stroke_um", "not measured"),
        ("[0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]", "[1, 2]", "flatness_um", "heights: 2 of 8 are given"),
        ("[0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]", "[0, 1, 2, 3, 4, 5, 6, nan]", "flatness_um", "value 8 is nan"),
        ("z_um = [0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]", 'points = "no.csv"', "flatness_um", "no.csv"),
        ("z_um = [0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]", 'points = "../o.csv"', "flatness_um", "outside the unit"),
        ("z_um = [0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]", 'points = "/etc/hosts"', "flatness_um", "outside the unit"),
        (
            "z_um = [0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]",
            'points = "a/../o.csv"',
            "flatness_um",
            "outside the unit",
        ),
        ("z_um = [0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]", f'points = "{"a" * 300}.csv"', "flatness_um", "too long"),
        ("stroke_um = 373.2", 'one_stack = "a.mat"\ntwo_stacks = "b.mat"', "stroke_um", "a.mat"),
    ],
)
def test_a_section_that_cannot_be_used_is_no_result_and_the_rest_is_judged(
    tmp_path: Path, old: str, new: str, quantity: str, words: str
) -> None:
    assert old in GOOD
    result = judge(make_unit(tmp_path, text=GOOD.replace(old, new)))
    found = {f.quantity: f for f in result.findings}
    assert found[quantity].verdict is Verdict.NO_RESULT
    assert words in found[quantity].reason
    assert result.verdict is UnitVerdict.INCOMPLETE
    rest = [f for f in result.findings if f.check != found[quantity].check]
    assert len(rest) >= 3
    assert {f.verdict for f in rest} == {Verdict.PASS}


def test_what_was_not_measured_has_no_result_for_every_limit_where_it_is_required(tmp_path: Path) -> None:
    folder = make_unit(tmp_path, text=GOOD.replace("[capacitance]\nsensor_uF = 5.10\nactuator_uF = 10.03\n", ""))
    result = judge(folder)
    missing = [f for f in result.findings if f.check == "capacitance"]
    assert [f.quantity for f in missing] == ["sensor_uF", "actuator_uF"]
    assert {(f.verdict, f.reason) for f in missing} == {(Verdict.NO_RESULT, "not measured")}
    assert all(f.cause == because(Cause.NOT_MEASURED) for f in missing)
    assert result.verdict is UnitVerdict.INCOMPLETE
    optional = {**SPEC.checks, "capacitance": SPEC.checks["capacitance"].model_copy(update={"required": False})}
    result = judge_unit(unit_folder.read(folder), SPEC.model_copy(update={"checks": optional}))
    assert [f.quantity for f in result.findings if f.check == "capacitance"] == []
    assert result.notes == ("capacitance: not measured (the spec does not require it)",)
    assert result.verdict is UnitVerdict.ACCEPTED


def test_a_typed_uncertainty_is_used(tmp_path: Path) -> None:
    text = GOOD.replace("sensor_uF = 5.10", "sensor_uF = { value = 5.48, U = 0.2 }")
    found = findings(make_unit(tmp_path, text=text))["sensor_uF"]
    assert found.U == pytest.approx(0.2)
    assert found.verdict is Verdict.CONDITIONAL


def test_a_value_without_stated_uncertainty_takes_that_of_the_spec(tmp_path: Path) -> None:
    found = findings(make_unit(tmp_path))
    assert found["sensor_uF"].U == pytest.approx(0.005 * 5.10)
    assert found["stroke_um"].U == pytest.approx(0.01 * 373.2)
    assert found["k_closed_N_per_um"].U == pytest.approx(0.02 * 1.70)


def test_a_spec_of_another_kind_refuses(tmp_path: Path) -> None:
    folder = make_unit(tmp_path, text=GOOD.replace('kind = "apa"', 'kind = "strut"'))
    with pytest.raises(UnitError, match="judges 'apa'"):
        judge(folder)


def records_unit(folder: Path, **stroke: np.ndarray) -> Path:
    make_unit(folder, text=GOOD.replace("stroke_um = 373.2", 'one_stack = "one.mat"\ntwo_stacks = "two.mat"'))
    save_mat(folder / "one.mat", **stroke)
    save_mat(folder / "two.mat", **stroke | {"d": 2.01 * stroke["d"]})
    return folder


def good_stroke() -> dict[str, np.ndarray]:
    t = np.arange(20000) * 1e-3
    angle = 2 * np.pi * 0.1 * t
    # A stack lags: what follows its voltage along a line is no stack, but a wire.
    return {"t": t, "V": 65 - 85 * np.cos(angle), "d": (85 - 85 * np.cos(angle - 0.03)) * 0.65e-6}


def test_a_unit_of_records_is_judged(tmp_path: Path) -> None:
    found = findings(records_unit(tmp_path, **good_stroke()))
    assert found["stroke_um"].value == pytest.approx(332.6, rel=1e-3)


@pytest.mark.parametrize("fault", ["truncated", "nan", "missing channel", "unequal", "text"])
def test_damaged_records_are_no_result(tmp_path: Path, fault: str) -> None:
    stroke = good_stroke()
    if fault == "nan":
        stroke["d"][777] = np.nan
    if fault == "missing channel":
        del stroke["V"]
    if fault == "unequal":
        stroke["d"] = stroke["d"][:-5]
    folder = records_unit(tmp_path, **stroke)
    if fault == "truncated":
        (folder / "two.mat").write_bytes((folder / "two.mat").read_bytes()[:-4000])
    if fault == "text":
        (folder / "two.mat").write_text("no record at all")
    found = findings(folder)["stroke_um"]
    assert found.verdict is Verdict.NO_RESULT
    assert ".mat" in found.reason
    assert findings(folder)["sensor_uF"].verdict is Verdict.PASS


toml_values = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True), st.integers(), st.booleans(), st.text(max_size=8),
    st.lists(st.floats(), max_size=9), st.dictionaries(st.sampled_from(["value", "U", "x"]), st.floats(), max_size=3),
)  # fmt: skip


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from(["flatness", "capacitance", "stroke", "stiffness", "parts", "channels", "serial", "kind", "other"]),
    st.one_of(st.dictionaries(st.sampled_from(["z_um", "sensor_uF", "stroke_um", "k_N_per_um", "x"]), toml_values),
              toml_values),
)  # fmt: skip
def test_any_content_is_refused_or_judged_without_passing_on_nothing(tmp_path: Path, key: str, value: object) -> None:
    data = {"serial": "T-01", "kind": "apa", "capacitance": {"sensor_uF": 5.0, "actuator_uF": 10.0}, key: value}
    try:
        folder = unit_folder.parse(tmp_path, b"", data)
        if folder.kind != "apa":
            return
        result = judge_unit(folder, SPEC)
    except UnitError:
        return
    assert result.verdict is not UnitVerdict.ACCEPTED  # at least two required sections are always missing
    for finding in result.findings:
        if finding.verdict is Verdict.PASS:
            assert finding.value is not None
            assert finding.U is not None


def test_one_recording_is_not_two(tmp_path: Path) -> None:
    """Neither as the same bytes nor saved again in another form: noise never repeats itself."""
    folder = records_unit(tmp_path / "R-1", **good_stroke())
    data = scipy.io.loadmat(folder / "one.mat")
    for compressed in (False, True):
        scipy.io.savemat(folder / "two.mat", {k: data[k] for k in ("t", "V", "d")}, do_compression=compressed)
        assert "hold the same recording" in (findings(folder)["stroke_um"].reason or "")


def test_a_pipe_is_no_record_and_is_not_waited_for(tmp_path: Path) -> None:
    folder = records_unit(tmp_path / "R-1", **good_stroke())
    (folder / "one.mat").unlink()
    os.mkfifo(folder / "one.mat")
    with pytest.raises(UnitError, match=r"one\.mat is a pipe or a device"):
        findings(folder)


def test_a_byte_order_mark_is_no_fault(tmp_path: Path) -> None:
    folder = make_unit(tmp_path / "B-1")
    (folder / "unit.toml").write_bytes(b"\xef\xbb\xbf" + (folder / "unit.toml").read_bytes())
    assert unit_folder.read(folder).serial == unit_folder.read(make_unit(tmp_path / "B-2")).serial


def test_findings_and_information_survive_results_json(tmp_path: Path) -> None:
    """Bad and good ones, with their causes: what the store holds is what was judged."""
    text = GOOD.replace("sensor_uF = 5.10", "sensor_uF = 1.72").replace("stroke_um = 373.2", 'one_stack = "gone.mat"')
    result = judge(make_unit(tmp_path, "X-1", text))
    assert UnitRecord.from_text(json.dumps(result.to_json())) == result
    assert any(f.cause is not None for f in result.findings)
    assert result.information
