"""Specs are read strictly, and one report lists every problem with its key path."""

from pathlib import Path

import pytest

from accept.judging import load_spec
from checks.acceptance import CHECKS
from specs.spec import builtin, load
from specs.strict import SpecError
from specs.units import unit_of

GOOD = """
name = "mine"
kind = "apa"
title = "mine"
[checks.capacitance]
[checks.capacitance.limits.sensor_uF]
lower = 4.4
upper = 5.5
unit = "uF"
rule = "guarded"
source = "me"
"""


def problems_of(tmp_path: Path, text: str) -> list[str]:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(SpecError) as found:
        load_spec(str(path))
    assert all(str(path) in line for line in str(found.value).splitlines())
    return found.value.problems


def test_a_good_spec_loads(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(GOOD)
    spec = load_spec(str(path))
    assert spec.checks["capacitance"].limits["sensor_uF"].upper == 5.5
    assert len(spec.sha256) == 64


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ('rule = "guarded"', 'rule = "lenient"', "checks.capacitance.limits.sensor_uF.rule", "simple"),
        ('source = "me"', "", "checks.capacitance.limits.sensor_uF.source", "is missing"),
        ('source = "me"', 'source = ""', "checks.capacitance.limits.sensor_uF.source", "at least 1"),
        ('unit = "uF"', 'unit = "F"', "checks.capacitance.limits", "expected 'uF'"),
        ("lower = 4.4", "lower = 6.0", "checks.capacitance.limits.sensor_uF", "not below"),
        ("lower = 4.4", "lower = nan", "checks.capacitance.limits.sensor_uF.lower", "finite"),
        ("lower = 4.4", 'lower = "4.4"', "checks.capacitance.limits.sensor_uF.lower", "number"),
        ("lower = 4.4", "lower = true", "checks.capacitance.limits.sensor_uF.lower", "number"),
        ("lower = 4.4\nupper = 5.5", "", "checks.capacitance.limits.sensor_uF", "neither lower nor upper"),
        ('source = "me"', 'source = "me"\nlowwer = 4.3', "checks.capacitance.limits.sensor_uF.lowwer", "unknown key"),
        ('kind = "apa"', 'kind = "motor"', "kind", "apa"),
        ('rule = "guarded"', 'rule = "shared"', "checks.capacitance.limits.sensor_uF", "U_max"),
        ('name = "mine"', 'name = "mine"\nsha256 = "00"', "sha256", "unknown key"),
        ('name = "mine"', 'name = "mine"\nserial_pattern = "["', "serial_pattern", "regular expression"),
        ("[checks.capacitance]\n", "[checks.capacitance]\nrequired = false\n", "top level", "requires no check"),
        ("limits.sensor_uF]", "limits.sensor_mF]", "checks.capacitance.limits", "unit is 'uF'"),
        ("limits.sensor_uF]", "limits.other_uF]", "checks.capacitance.limits.other_uF", "unknown name"),
        ("capacitance", "conductance", "checks.conductance", "unknown check"),
    ],
)
def test_each_fault_is_named_with_its_key(tmp_path: Path, old: str, new: str, key: str, words: str) -> None:
    assert old in GOOD
    (problem, *_) = problems_of(tmp_path, GOOD.replace(old, new))
    assert f"[{key}" in problem
    assert words in problem


SETTINGS = """
[checks.frf]
[checks.frf.limits.axial_resonance_Hz]
lower = 88.0
unit = "Hz"
rule = "simple"
source = "me"
[checks.frf.settings]
"""


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("coherence_min = nan", "finite"),  # not (x < nan): the gate would be open
        ("duration_min_s = inf", "finite"),
        ("coherent_de_Hz = [10.0, nan]", "finite"),
        ("coherent_de_Hz = [700.0, 10.0]", "not a range"),  # nothing would be asked to be coherent
        ("coherent_de_Hz = [0.0, 700.0]", "greater than 0 (got 0.0)"),  # thirds of octaves from zero never end
        ("sampling_Hz = [0.0]", "greater than 0 (got 0.0)"),
        ("coherent_de_Hz = [10.0]", "at least 2 items"),
        ("coherent_de_Hz = 700.0", "valid list"),
        ("polarity = [0, 0]", "at least 3 items"),
        ("spurious_Hz = ['200']", "[checks.frf.settings.spurious_Hz.0] Input should be a valid number"),
        ("payload_kg = '5'", "Input should be a valid number"),
        ("payload_kg = true", "Input should be a valid number"),
        ("payload_within = -0.2", "greater than or equal to 0 (got -0.2)"),
        ("payload_kg = 0", "greater than 0 (got 0)"),
        ("model = 3", "valid string (got 3)"),
        ("payload = 5.0", "unknown name"),
    ],
)
def test_a_setting_that_would_open_a_gate_is_refused(tmp_path: Path, line: str, words: str) -> None:
    (problem,) = problems_of(tmp_path, GOOD + SETTINGS + line)
    assert "checks.frf.settings" in problem
    assert words in problem


FINE = """payload_kg = 5
sampling_Hz = [10000.0]
spurious_Hz = [1.0, 2, 3.0]
polarity = [-1, 0, 1]
"""


def test_settings_as_they_should_be(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(GOOD + SETTINGS + FINE)
    assert load_spec(str(path)).checks["frf"].settings["payload_kg"] == 5
    points = "positions_mm = [" + ", ".join("[1.0, 2]" for _ in range(8)) + "]"
    flat = GOOD + "[checks.flatness]\nrequired = false\n[checks.flatness.settings]\n"
    path.write_text(flat + points)
    assert load_spec(str(path))
    (short,) = problems_of(tmp_path, flat + points.replace("[1.0, 2]", "[1.0]", 1))
    assert "[checks.flatness.settings.positions_mm.0]" in short
    assert "at least 2 items" in short


@pytest.mark.parametrize("key", ["title", "checks.capacitance.instrument"])
def test_no_text_fills_pages(tmp_path: Path, key: str) -> None:
    """Red before: a certificate of a title of a million letters was signed, and took minutes to verify."""
    section, _, name = key.rpartition(".")
    text = GOOD.replace('title = "mine"\n', "") if name == "title" else GOOD
    long = f'{name} = "{"x " * 1001}"\n'
    text = text.replace(f"[{section}]\n", f"[{section}]\n{long}") if section else long + text
    (problem,) = problems_of(tmp_path, text)
    assert f"[{key}] String should have at most 2000 characters" in problem


def test_one_report_lists_every_problem(tmp_path: Path) -> None:
    text = GOOD.replace('unit = "uF"', 'unit = "F"').replace('kind = "apa"', 'kind = "x"').replace('title = "mine"', "")
    assert len(problems_of(tmp_path, text)) == 3


def test_a_check_that_limits_nothing_cannot_be_required(tmp_path: Path) -> None:
    text = 'name = "n"\nkind = "apa"\ntitle = "t"\n[checks.stroke]\n'
    assert "pass on nothing" in problems_of(tmp_path, text)[0]


def test_damaged_files(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(b"name = '\xff'")
    with pytest.raises(SpecError, match="not UTF-8: byte 8 is 0xff"):
        load(path)
    path.write_text("name = ")
    with pytest.raises(SpecError, match="not TOML"):
        load(path)
    path.write_text("x = " + "[" * 5000)
    with pytest.raises(SpecError, match="nested too deeply"):
        load(path)
    path.write_text(GOOD.replace("5.5", "1" + "0" * 5000))
    with pytest.raises(SpecError, match="a number of more than 4300 digits"):
        load(path)
    path.write_bytes(GOOD.encode("utf-8-sig"))  # as an editor on Windows saves it
    assert load(path).text.encode() == path.read_bytes()
    with pytest.raises(SpecError, match="cannot be read"):
        load(tmp_path / "absent.toml")
    with pytest.raises(SpecError, match="apa-basic"):
        load("no-such-spec")


@pytest.mark.parametrize("name", sorted(builtin()))
def test_built_in_specs_are_valid_and_sourced(name: str) -> None:
    spec = load_spec(name)
    assert spec.name == name
    for section in spec.checks.values():
        for limit in section.limits.values():
            assert len(limit.source) > 5


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS)
def test_every_check_declares_itself_fully(check) -> None:
    assert check.title
    assert check.kinds
    assert check.quantities
    assert all(i.label for i in check.inputs.values())
    assert all(s.meaning for s in check.settings)
    assert len(set(check.quantities)) == len(check.quantities)


def test_units_come_from_names() -> None:
    assert unit_of("k_closed_N_per_um") == "N/um"
    assert unit_of("flatness_um") == "um"
    assert unit_of("ga_N_per_V") == "N/V"
    assert unit_of("axial_resonance_Hz") == "Hz"
    assert unit_of("hysteresis_percent") == "percent"
    assert unit_of("coherence") == "1"
