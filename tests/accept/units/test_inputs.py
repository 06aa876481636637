"""Everything that scales, maps or selects a measurement is an input of its finding: on the page, in `accept verify` and
in results.json; one that the unit's file alone states accepts nothing."""

import datetime
import io
import json
import logging
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pypdf import PdfReader
from typer.testing import CliRunner, Result

from accept.base.documents.results import UnitRecord
from accept.certificate import InvalidCertificate, content_of, rejudge
from accept.certificate.page.document import render
from accept.certificate.verify.attachments import check_result
from accept.certificate.verify.rejudge import read_unit
from accept.cli.main import app
from accept.judging import calibration, judge_unit, load_spec
from accept.pictures.labels import CHANNELS, LONGEST_INPUTS, inputs_words
from accept.units import unit_folder
from accept.units.unit_folder import UNIT_FILE
from checks.acceptance import CHECKS
from checks.cause import Cause
from checks.declare import Check, Scalar, Vector
from checks.verdict import Finding, UnitVerdict, Verdict
from specs.bench import parse_bench
from specs.strict import LONGEST
from specs.units import unit_of
from tests.accept.units.test_calibration import bench_text
from tests.causes import causes
from tests.shared.recorded_units import RecordedUnits

MASS_KG, HEAVY_KG = 6.4, 7.0  # of the spec, and one with which the stiffness still lies inside its limits
UNIT = """serial = "A-9"
kind = "apa"
[flatness]
z_um = [0, -0.5, -2, 1, 0.5, 1, 2, 0]
[capacitance]
sensor_uF = 4.9
actuator_uF = 9.8
[stroke]
stroke_um = 366
[stiffness]
closed_circuit = "closed.mat"
mass_kg = {mass_kg}
"""


@pytest.fixture
def folder(recorded_units: RecordedUnits, tmp_path: Path) -> Path:
    """A sound actuator whose stiffness was recorded."""
    place = tmp_path / "A-9"
    place.mkdir()
    shutil.copy(next(recorded_units.folder("A-01").glob("add_mass_closed*.mat")), place / "closed.mat")
    return written(place)


def written(folder: Path, mass_kg: float = MASS_KG, more: str = "") -> Path:
    (folder / "unit.toml").write_text(UNIT.format(mass_kg=mass_kg) + more)
    return folder


def judged(folder: Path, bench: str = "", spec: str = "apa-basic") -> tuple[Finding, UnitRecord]:
    by, stated = load_spec(spec), None
    if bench:
        stated = calibration.statement(parse_bench(bench.encode(), "bench.toml"), by.checks, datetime.date.today())
    result = judge_unit(unit_folder.read(folder), by, stated)
    return next(f for f in result.findings if f.quantity == "k_closed_N_per_um"), result


def accept(*words: object) -> Result:
    """Run a command; what -v logs to goes with it."""
    loggers = [logging.getLogger(name) for name in ("accept", None)]
    before = [(each, each.handlers[:], each.level) for each in loggers]
    done = CliRunner().invoke(app, [str(w) for w in words])
    for each, handlers, level in before:
        each.handlers[:] = handlers
        each.setLevel(level)
    return done


def text_of(pdf: Path) -> str:
    """The text of a page, on one line."""
    found = subprocess.run(["pdftotext", "-layout", pdf, "-"], capture_output=True, text=True, check=True).stdout
    return " ".join(found.split())


def test_no_name_pushes_what_scales_out_of_the_line() -> None:
    """Page and verify cut the line of inputs. Red before: after a long name the gain stood on neither."""
    long = "n" * LONGEST
    read = {"name": "one_stack", "value": f"{long}.mat", "unit": "", "source": UNIT_FILE}
    taken = {"name": f"{CHANNELS}d", "value": {"name": long, "gain": 1.8}, "unit": "", "source": UNIT_FILE}
    (words,) = inputs_words({"findings": [{"check": "stroke", "inputs": [read, taken]}]}).values()
    assert "is multiplied by 1.8" in words[:LONGEST_INPUTS]


def test_the_mass_of_the_spec_accepts(folder: Path) -> None:
    finding, result = judged(folder)
    assert (finding.verdict, result.verdict) == (Verdict.PASS, UnitVerdict.ACCEPTED)
    (mass,) = [i for i in finding.inputs if i.name == "mass_kg"]
    assert (mass.value, mass.unit, mass.source, mass.against) == (MASS_KG, "kg", "unit.toml", None)


def test_another_mass_than_the_specs_accepts_nothing(folder: Path) -> None:
    """Red before: accepted, with the spec's 6.4 kg on the page."""
    finding, result = judged(written(folder, HEAVY_KG))
    assert (finding.verdict, result.verdict) == (Verdict.CONDITIONAL, UnitVerdict.CONDITIONAL)
    assert Cause.INPUT_NOT_STATED in causes(finding.cause)
    assert "added mass 7 kg by unit.toml, but the spec says 6.4 kg" in str(finding.reason)


def test_a_mass_within_the_uncertainty_of_the_specs_is_the_same(folder: Path) -> None:
    """The spec's U of the mass is 0.5 percent, and it is in the budget."""
    assert judged(written(folder, MASS_KG * 1.004))[0].verdict is Verdict.PASS
    assert judged(written(folder, MASS_KG * 1.006))[0].verdict is Verdict.CONDITIONAL


def test_a_mass_that_the_bench_file_states_is_the_benchs(folder: Path) -> None:
    bench = bench_text(stroke="2099-01-01") + f"[values.stiffness]\nmass_kg = {HEAVY_KG}\n"
    finding, result = judged(written(folder, HEAVY_KG), bench)
    assert finding.verdict is Verdict.PASS
    words = inputs_words(result.to_json())[finding.check]  # red before: nothing of the spec, which says otherwise
    assert "added mass 7 kg (as the bench file says; the spec says 6.4 kg)" in words
    finding, _ = judged(written(folder, MASS_KG), bench)  # the spec's, but not what hangs there
    assert Cause.INPUT_NOT_STATED in causes(finding.cause)


@pytest.mark.parametrize(
    ("source", "doubted"),
    [
        ('"de"', False),
        ('"Va"', True),  # the name of another channel here: the file contradicts it
        ('"other"', True),  # chosen, although the file has a `de`
        ("{ sampling_time_s = 0.001 }", False),
    ],
)
def test_a_channel_that_is_read_under_another_name(folder: Path, source: str, doubted: bool) -> None:
    from scipy.io import loadmat, savemat

    m = {k: v for k, v in loadmat(folder / "closed.mat").items() if k in ("t", "de")}
    savemat(folder / "closed.mat", m | {"other": m["de"], "Va": m["de"]})
    name = "t" if "sampling" in source else "de"
    finding, _ = judged(written(folder, more=f"[channels]\n{name} = {source}\n"))
    assert any(i.name == f"channels.{name}" for i in finding.inputs)
    if name == "de":
        assert (Cause.CHANNEL_SCALED in causes(finding.cause)) is doubted


def test_a_sampling_time_of_the_unit_alone_scales_all_times(recorded_units: RecordedUnits, folder: Path) -> None:
    """Red before: only gain and unit of a channel were looked at."""
    from scipy.io import loadmat, savemat

    m = loadmat(folder / "closed.mat")
    savemat(folder / "closed.mat", {"de": m["de"]})
    step = float(np.diff(np.ravel(m["t"]))[0])
    finding, _ = judged(written(folder, more=f"[channels]\nt = {{ sampling_time_s = {step} }}\n"))
    assert Cause.CHANNEL_SCALED in causes(finding.cause)


def test_page_and_verification_name_the_mass_that_was_used(folder: Path, tmp_path: Path) -> None:
    pdf = tmp_path / "a.pdf"
    assert accept("report", written(folder, HEAVY_KG), "--spec", "apa-basic", "--out", pdf).exit_code == 4
    page = text_of(pdf)
    assert "added mass 7 kg (the spec says 6.4 kg)" in page
    assert "6.4 kg added mass" not in page
    assert "without a recording" in page
    assert "beside recordings: added mass 7 kg (Stiffness)" in page
    found = accept("-v", "verify", pdf)
    assert "added mass 7 kg (the spec says 6.4 kg)" in " ".join(found.output.split())
    assert "closed.mat" in page  # which of the files was chosen


def test_a_number_that_the_unit_leaves_to_the_spec_is_named_with_its_source(tmp_path: Path) -> None:
    (tmp_path / "unit.toml").write_text('serial = "A-9"\nkind = "apa"\n[sensor_highpass]\nwith_resistor = "r.mat"\n')
    result = judge_unit(unit_folder.read(tmp_path), load_spec("apa"))
    found = next(f for f in result.findings if f.check == "sensor_highpass")
    assert [(i.value, i.source) for i in found.inputs if i.name == "resistor_ohm"] == [(80600.0, "default")]


def test_what_another_program_left_conditional_is_so_again(folder: Path) -> None:
    """Red before: after any change of the program a certificate with an input of its own was called NOT VALID."""
    unit, by = unit_folder.read(written(folder, HEAVY_KG)), load_spec("apa-basic")
    contents = replace(content_of(judge_unit(unit, by), by, unit.path, "Ann"), code_sha256="0" * 64)
    assert contents.result["verdict"] == UnitVerdict.CONDITIONAL
    attached = read_unit(contents.files[UNIT_FILE])
    check_result(contents, attached, rejudge(contents))
    accepted = [{**f, "verdict": "pass", "cause": None, "reason": None} for f in contents.result["findings"]]
    better = replace(contents, result={**contents.result, "verdict": "accepted", "findings": accepted})
    with pytest.raises(InvalidCertificate):
        check_result(better, attached, rejudge(better))


def test_a_certificate_of_an_earlier_program_verifies_and_lacks_its_inputs(folder: Path) -> None:
    """It accepted what this version leaves conditional; one of this version that says so does not follow."""
    unit, by = unit_folder.read(written(folder, HEAVY_KG)), load_spec("apa-basic")
    before = judge_unit(unit, by, own=False)
    assert before.verdict is UnitVerdict.ACCEPTED
    contents = content_of(before, by, unit.path, "Ann")
    attached = read_unit(contents.files[UNIT_FILE])
    bare = [{k: v for k, v in f.items() if k != "inputs"} for f in contents.result["findings"]]
    for result in (contents.result, {**contents.result, "findings": bare}):
        made = replace(contents, result=result)
        again = rejudge(made)
        with pytest.raises(InvalidCertificate, match="differs"):
            check_result(made, attached, again)
    old = replace(contents, result={**contents.result, "findings": bare}, code_sha256="0" * 64)
    step = check_result(old, attached, rejudge(old))
    assert not step.complete
    assert "by this version conditional: added mass 7 kg by unit.toml, but the spec says 6.4 kg" in step.words
    assert "does not state findings[flatness_um].inputs" in step.words
    assert "Inputs" not in "".join(page.extract_text() for page in PdfReader(io.BytesIO(render(old))).pages)


# Every scalar of every check ------------------------------------------------------------------------------------------

KINDS = {"apa": [c for c in CHECKS.values() if "apa" in c.kinds], "strut": [CHECKS["frf"], CHECKS["misalignment"]]}


def test_every_check_is_asked_here() -> None:
    assert {c.name for checks in KINDS.values() for c in checks} >= {n for n in CHECKS if CHECKS.is_own(n)}


def other_scalar(declared: Scalar, nth: int) -> float:
    """A plausible number of five digits, no default."""
    lo, hi = declared.usual or (max(declared.lo, 1e-2), min(declared.hi, 1e4))
    return float(f"{lo + (hi - lo) * (0.3127 + 0.0131 * nth):.5g}")


def other_setting(default: Any, nth: int) -> Any:
    if isinstance(default, str):
        return "strut-2dof" if default.startswith("strut") else "apa-2dof"
    if isinstance(default, list | tuple):
        return [other_setting(d, nth + n) for n, d in enumerate(default or [101.0 + nth])]
    return float(f"{default * 1.2345 + (0.1357 + 0.01 * nth if default >= 0 else 0):.5g}")


def spec_section(check: Check, settings: dict[str, Any]) -> str:
    quantity = next(iter(check.quantities))
    limit = f'lower = 0.0\nunit = "{unit_of(quantity)}"\nrule = "simple"\nsource = "test"\n'
    lines = "".join(f"{name} = {json.dumps(value)}\n" for name, value in settings.items())
    return f"[checks.{check.name}.limits.{quantity}]\n{limit}[checks.{check.name}.settings]\n{lines}"


def unit_section(check: Check, form: int, scalars: dict[str, float]) -> str:
    """Every number of one form, and names of records that are not there."""
    lines = [f"[{check.name}]"]
    for declared in check.forms[min(form, len(check.forms) - 1)].inputs:
        if isinstance(declared, Scalar):
            scalars[declared.name] = other_scalar(declared, len(scalars))
            lines.append(f"{declared.name} = {scalars[declared.name]}")
        elif isinstance(declared, Vector):
            lines.append(f"{declared.name} = {[0.25 * n for n in range(declared.size)]}")
        else:
            lines.append(f'{declared.name} = "{declared.name}.mat"')
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("kind", "form"), [("apa", 0), ("apa", 1), ("strut", 0)])
def test_every_scalar_and_setting_of_every_check_is_shown(kind: str, form: int, tmp_path: Path) -> None:
    """Enumerated from the declarations: a new check, input or setting that is not shown fails here."""
    spec, unit = f'name = "all"\nkind = "{kind}"\ntitle = "all"\n', f'serial = "U-1"\nkind = "{kind}"\n'
    expected: dict[tuple[str, str], Any] = {}
    sections: dict[str, dict[str, float]] = {}
    for nth, check in enumerate(KINDS[kind]):
        settings = {s.name: other_setting(s.default, 20 * nth + n) for n, s in enumerate(check.settings)}
        spec += spec_section(check, settings)
        if check.reads not in sections:
            unit += unit_section(check, form, sections.setdefault(check.reads, {}))
        used = {name: value for name, value in settings.items() if name not in check.inputs}
        expected |= {(check.name, name): value for name, value in (used | sections[check.reads]).items()}
    (tmp_path / "all.toml").write_text(spec)
    (tmp_path / "U-1").mkdir()
    (tmp_path / "U-1" / "unit.toml").write_text(unit)
    ran = accept("batch", tmp_path / "U-1", "--spec", tmp_path / "all.toml", "--out", tmp_path / "out")
    pdf = tmp_path / "out" / "certificates" / "U-1.pdf"
    assert pdf.exists(), ran.output
    page, verified = text_of(pdf), " ".join(accept("-v", "verify", pdf).output.split())
    (entry,) = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
    held = {(f["check"], i["name"]): i["value"] for f in entry["findings"] for i in f.get("inputs", ())}
    for key, value in expected.items():
        assert held.get(key) == value, key
        numbers = [value] if isinstance(value, str) else [f"{v:.10g}" for v in np.ravel(value)]
        for place, text in (("page", page), ("verify", verified)):
            assert all(re.search(rf"(?<![\d.]){re.escape(n)}(?![\d.]*\d)", text) for n in numbers), (place, key, value)


@pytest.mark.parametrize("value", ["nan", "inf", "{ value = 5.0, U = nan }", "[nan, 5.0]"])
def test_a_number_that_json_does_not_have_stops_no_batch(tmp_path: Path, value: str) -> None:
    """Red before: one unit with such a number ended the batch without results."""
    for serial, sensor in (("N-1", value), ("N-2", "5.1")):
        folder = tmp_path / "units" / serial
        folder.mkdir(parents=True)
        (folder / "unit.toml").write_text(
            f'serial = "{serial}"\nkind = "apa"\n[capacitance]\nsensor_uF = {sensor}\nactuator_uF = 9.85\n'
        )
    accept("batch", tmp_path / "units", "--spec", "apa-basic", "--out", tmp_path / "out", "--no-certificates")
    units = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
    assert "N-2" in {unit["serial"] for unit in units}
    assert not any(unit["verdict"] == "accepted" for unit in units)
