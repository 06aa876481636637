"""Universal files of responses as pyuff writes them: what labels, data types, exponents and data set 164 state is used,
or the file is refused with the reason."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import pyuff

import accept
from hw.records.responses import read_response_file

F = np.arange(1.0, 301.0)
S = 2j * np.pi * F
H = 2e-6 * (2 * np.pi * 120) ** 2 / (S**2 + 2 * 0.01 * 2 * np.pi * 120 * S + (2 * np.pi * 120) ** 2)  # m/V
DIGITS = 1e-5  # relative: pyuff writes the abscissa with six digits
FOOT = 0.3048


def function(**more: object) -> dict:
    """A response de over Va of pyuff, in metres per volt, without labels or data types but what `more` states."""
    base = {
        "type": 58, "func_type": 4, "rsp_node": 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0, "rsp_ent_name": "de",
        "ref_ent_name": "Va", "x": F, "data": H, "abscissa_spacing": 1, "binary": 0, "ord_data_type": 6,
        "orddenom_spec_data_type": 0, "abscissa_spec_data_type": 18, "id1": "x",
    }  # fmt: skip
    return base | more


def units(code: int, length: float, force: float) -> dict:
    return {"type": 164, "units_code": code, "units_description": "x", "temp_mode": 1, "length": length, "force": force,
            "temp": 1.0, "temp_offset": 273.15}  # fmt: skip


def write(path: Path, *sets: dict) -> Path:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for each in sets:
            pyuff.UFF(str(path)).write_sets(each, "add")
    return path


METRES = {"ordinate_axis_units_lab": "m", "orddenom_axis_units_lab": "V"}
ABSCISSAS = {
    "rad/s": ({"abscissa_axis_units_lab": "rad/s"}, 2 * np.pi),
    "kHz": ({"abscissa_axis_units_lab": "kHz"}, 1e-3),
    "rpm by label": ({"abscissa_axis_units_lab": "rpm"}, 60.0),
    "rpm by type": ({"abscissa_spec_data_type": 19}, 60.0),
    "1/min": ({"abscissa_spec_data_type": 19, "abscissa_axis_units_lab": "1/min"}, 60.0),
    "Hz": ({"abscissa_axis_units_lab": "Hz"}, 1.0),
    "none": ({"abscissa_spec_data_type": 0}, 1.0),
}


@pytest.mark.parametrize("binary", [0, 1, 2])
@pytest.mark.parametrize("case", ABSCISSAS)
def test_the_unit_of_the_abscissa_is_used(case: str, binary: int, tmp_path: Path) -> None:
    more, scale = ABSCISSAS[case]
    order = {"binary": min(binary, 1)} | ({"byte_ordering": binary} if binary else {})
    path = write(tmp_path / "a.uff", function(x=F * scale, **METRES, **more, **order))
    found = accept.read_response(path)
    np.testing.assert_allclose(found.frf.f, F, rtol=DIGITS)
    np.testing.assert_allclose(found.frf.H[:, 0], H, rtol=1e-10)
    assert found.frf.input == "Va"


ORDINATES = {
    "SI, no word": ([function()], H),
    "mm by label": ([function(data=1e3 * H, ordinate_axis_units_lab="mm", orddenom_axis_units_lab="V")], H),
    "mm per mV": ([function(data=H, ordinate_axis_units_lab="mm", orddenom_axis_units_lab="mV")], H),
    "displacement by type, mm by 164": (
        [units(5, 1e3, 1e3), function(data=1e3 * H, ordinate_spec_data_type=8, orddenom_axis_lab="Voltage")], H,
    ),
    "inch by 164": (
        [units(7, 1 / 0.0254, 0.224808943), function(data=H / 0.0254, ordinate_spec_data_type=8,
                                                     orddenom_axis_lab="Voltage")],
        H,
    ),
    "foot by 164 of the user": (
        [units(9, 1 / FOOT, 1.0), function(data=H / FOOT, ordinate_spec_data_type=8, orddenom_axis_units_lab="V")], H,
    ),
    "general, exponent of length": (
        [units(5, 1e3, 1e3), function(data=1e3 * H, ordinate_spec_data_type=1, ordinate_len_unit_exp=1,
                                      orddenom_spec_data_type=1)], H,
    ),
    "164 in SI": ([units(1, 1.0, 1.0), function(ordinate_spec_data_type=8)], H),
    "164 and label agree": (
        [units(5, 1e3, 1e3), function(data=1e3 * H, ordinate_spec_data_type=8, ordinate_axis_units_lab="mm",
                                      orddenom_axis_units_lab="V")], H,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", ORDINATES)
def test_the_unit_of_the_ordinate_is_used(case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sets, true = ORDINATES[case]
    found = accept.read_response(write(tmp_path / "a.uff", *sets))
    np.testing.assert_allclose(found.frf.H[:, 0], true, rtol=1e-6)  # factors of seven digits
    assert found.units == {"de": "m", "Va": "V"}
    assert ("converted to" in capsys.readouterr().err) is (not np.allclose(sets[-1]["data"], H) or "mV" in case)


FORCES = {
    "labels": (
        [function(ordinate_axis_units_lab="m/s^2", orddenom_axis_units_lab="N", ref_ent_name="NONE")], 1.0, "m/s2",
    ),
    "types": ([function(ordinate_spec_data_type=12, orddenom_spec_data_type=13, ref_ent_name="NONE")], 1.0, "m/s2"),
    "types, mm and N": (
        [units(10, 1e3, 1.0), function(ordinate_spec_data_type=12, orddenom_spec_data_type=13, ref_ent_name="NONE")],
        1e-3, "m/s2",
    ),
    "types, mm and mN": (
        [units(5, 1e3, 1e3), function(ordinate_spec_data_type=12, orddenom_spec_data_type=13, ref_ent_name="NONE")],
        1.0, "m/s2",
    ),
    "velocity": ([function(ordinate_spec_data_type=11, orddenom_spec_data_type=13, ref_ent_name="NONE")], 1.0, "m/s"),
    "g": ([function(ordinate_axis_units_lab="g", orddenom_axis_units_lab="N", ref_ent_name="NONE")], 1.0, "g"),
    "all in one label": ([function(ordinate_axis_units_lab="m/s^2/N", ref_ent_name="NONE")], 1.0, "m/s2"),
}  # fmt: skip


@pytest.mark.parametrize("case", FORCES)
def test_a_response_per_force_keeps_its_units(case: str, tmp_path: Path) -> None:
    sets, scale, unit = FORCES[case]
    if sets[0]["type"] == 164 and sets[0]["units_code"] == 10:
        sets = [{**sets[0], "units_code": 9}, *sets[1:]]  # pyuff writes codes up to 9
    found = accept.read_response(write(tmp_path / "a.uff", *sets), channels={"acc": "de"})
    np.testing.assert_allclose(found.frf.H[:, 0], scale * H, rtol=1e-9)
    assert found.ratios == {"acc": f"{unit}/N"}
    assert found.frf.input == "force"  # not Va
    with pytest.raises(accept.AcceptError, match="de is in m here"):
        accept.read_response(tmp_path / "a.uff")  # de must be a displacement


REFUSED = {
    "time as abscissa": ([function(abscissa_spec_data_type=17)], "stands over frequencies"),
    "time as label": ([function(abscissa_axis_lab="Time")], "stands over frequencies"),
    "order as abscissa": ([function(abscissa_spec_data_type=20)], "stands over frequencies"),
    "seconds": ([function(abscissa_axis_units_lab="s")], "expected Hz"),
    "rpm by type, Hz by label": ([function(abscissa_spec_data_type=19, abscissa_axis_units_lab="Hz")], "correct one"),
    "acceleration labelled m": ([function(ordinate_spec_data_type=12, ordinate_axis_units_lab="m")], "contradict"),
    "displacement labelled m/s2": ([function(ordinate_spec_data_type=8, ordinate_axis_units_lab="m/s2")], "contradict"),
    "axis label Velocity": ([function(ordinate_spec_data_type=8, ordinate_axis_lab="Velocity")], "contradict"),
    "unit against label": ([function(ordinate_axis_lab="Acceleration", ordinate_axis_units_lab="mm")], "contradict"),
    "force of Va": ([function(orddenom_spec_data_type=13)], "Va is in V here"),
    "exponents": ([function(ordinate_spec_data_type=8, ordinate_force_unit_exp=1)], "exponents"),
    "label against 164": ([units(5, 1e3, 1e3), function(ordinate_axis_units_lab="m")], "data set 164 has mm"),
    "no type beside 164": ([units(5, 1e3, 1e3), function()], "neither a unit label nor a data type"),
    "code against factors": ([units(5, 1.0, 1.0), function(ordinate_spec_data_type=8)], "units code 5"),
    "two systems": ([units(1, 1.0, 1.0), units(5, 1e3, 1e3), function()], "two data sets 164"),
    "real ordinate": ([function(data=np.abs(H), ord_data_type=4)], "no phase"),
    "cross spectrum": ([function(func_type=3)], r"cross spectrum \(type 3\) of de"),
    "auto spectrum": ([function(func_type=2, data=np.abs(H), ord_data_type=4)], r"auto spectrum \(type 2\) of de"),
    "two inputs": ([function(), function(ref_ent_name="Vb", rsp_ent_name="da")], "Va, Vb; name one of them"),
    "two alike": ([function(), function(id1="y")], "two responses have one name"),
    "other frequencies": ([function(), function(rsp_ent_name="da", x=F + 0.5)], "other frequencies"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_file_contradicts_is_refused(case: str, tmp_path: Path) -> None:
    sets, words = REFUSED[case]
    with pytest.raises(accept.AcceptError, match=words):
        accept.read_response(write(tmp_path / "a.uff", *sets))


def test_of_two_inputs_the_named_one_is_taken(tmp_path: Path) -> None:
    path = write(tmp_path / "a.uff", function(**METRES), function(ref_ent_name="Vb", data=3 * H, **METRES))
    np.testing.assert_allclose(read_response_file(path, "Vb").H[:, 0], 3 * H, rtol=1e-10)
    np.testing.assert_allclose(read_response_file(path, "Va").H[:, 0], H, rtol=1e-10)


QUALITY = np.linspace(0.5, 0.99, F.size)


def coherence(**more: object) -> dict:
    return function(func_type=6, data=QUALITY, ord_data_type=4) | more


def test_coherence_is_paired_and_converted(tmp_path: Path) -> None:
    other = function(rsp_ent_name="da", rsp_node=2)
    theirs = coherence(rsp_ent_name="da", rsp_node=2, data=100 * QUALITY[::-1], ordinate_axis_units_lab="%")
    found = accept.read_response(write(tmp_path / "a.uff", theirs, function(), other, coherence()), averages=20)
    np.testing.assert_allclose(found.frf.coherence, np.column_stack([QUALITY, QUALITY[::-1]]), rtol=1e-10)
    true = np.abs(H) ** 2 * (1 - QUALITY) / QUALITY / 19  # [PS12] 2.5
    np.testing.assert_allclose(found.frf.var[:, 0], true, rtol=1e-9)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"data": 100 * QUALITY}, r"is it in percent\? write \[%\]"),
        ({"data": -QUALITY}, "expected 0 to 1"),
        ({"ordinate_axis_units_lab": "dB", "data": 10 * np.log10(QUALITY)}, "10 or 20 lg"),
        ({"x": F + 0.5}, "over other frequencies"),
        ({"x": F[:-1], "data": QUALITY[:-1]}, "over other frequencies"),
    ],
)
def test_a_coherence_that_cannot_be_is_refused(more: dict, words: str, tmp_path: Path) -> None:
    with pytest.raises(accept.AcceptError, match=words):
        accept.read_response(write(tmp_path / "a.uff", function(), coherence(**more)))


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (
            lambda raw: raw.replace(b"         6       300", b"         6       3x0"),
            "record 7 .* '3x0' in place of a number",
        ),
        (lambda raw: raw.replace(b"        18    0", b"        q8    0"), "record 8 .* 'q8' in place of a number"),
        (lambda raw: raw.replace(b"  2.0", b"  2.z", 1), "text in place of a number"),
        (lambda raw: raw[: len(raw) // 2], "cut"),
    ],
)
def test_a_damaged_file_is_refused_in_words(edit, words: str, tmp_path: Path) -> None:
    path = write(tmp_path / "a.uff", function(**METRES))
    path.write_bytes(edit(path.read_bytes()))
    with pytest.raises(accept.AcceptError, match=words):
        accept.read_response(path)
