"""A strut without encoder, whose encoder sits on the plates: Vs and da alone, from folder to certificate and gap."""

import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from accept.analysis.misalignment import estimate_unit
from accept.base.documents.results import UnitRecord
from accept.cli.main import app
from accept.judging import default_spec, judge_unit, load_spec
from accept.models.model_file import open_model
from accept.simulate import UnitRequest, UnitRequestError, simulate, write
from accept.simulate.records import axial_Hz
from accept.simulate.unit import SimulatedUnit
from accept.units import unit_folder
from accept.units.unit_folder import UNIT_FILE, UnitError
from accept.workflow.steps.plan import steps_of
from checks.acceptance import CHECKS
from checks.cause import Cause
from checks.declare import Series
from checks.gap import EFFECTS
from hw import records
from specs.plugins import product_named
from specs.spec import builtin
from specs.strict import SpecError
from tests.shared.once import once

KIND, SECONDS = "strut-plates", 10.5
NO_ENCODER = "no encoder on this strut: it sits on the plates"
BANDS = ("frf_noise", "frf_noise_hf", "frf_noise_2", "frf_noise_hf_2")


def simulated(serial: str, kind: str = KIND, **changes: object) -> SimulatedUnit:
    model = open_model("strut" if kind == "strut" else KIND)
    made = simulate(UnitRequest(serial, kind, model, seed=3, low_s=SECONDS, high_s=SECONDS, **changes))  # type: ignore[arg-type]
    text = made.files[UNIT_FILE].replace(b"simulated = true\n", b"")
    return replace(made, files={**made.files, UNIT_FILE: text})


def unit(place: Path, serial: str, kind: str = KIND, **changes: object) -> Path:
    return write(simulated(serial, kind, **changes), place / serial)


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sound unit with two records of its responses, made once for a run."""
    return once(tmp_path_factory, "sound_strut_plates", lambda place: unit(place, "P-1", repeats=False))


@pytest.fixture
def folder(sound: Path, tmp_path: Path) -> Path:
    """A copy of it, which a test may change."""
    return Path(shutil.copytree(sound, tmp_path / "P-1"))


def column(folder: Path, stems: tuple[str, ...], channel: str, values: object) -> None:
    """Put a column into records of a folder; values: (N,) of t (N,), or a function of it."""
    wanted = dict.fromkeys(("t", "Va", "Vs", "da"), "")
    for stem in stems:
        path = folder / f"{stem}.mat"
        record = records.read(path, Series("r", "r", {"t": "s", "Va": "V"}, optional_channels=wanted))
        put = values(record.t) if callable(values) else values
        path.write_bytes(records.mat_bytes({"t": record.t, **record.channels, channel: put}))


def judged(folder: Path, spec: str = KIND) -> UnitRecord:
    return judge_unit(unit_folder.read(folder), load_spec(spec))


def causes(result: UnitRecord, quantity: str) -> list[Cause]:
    (finding,) = (f for f in result.findings if f.quantity == quantity)
    return [] if finding.cause is None else [reason.cause for reason in finding.cause.all()]


def accept(home: Path, *arguments: object) -> tuple[int, str, str]:
    env = {"ACCEPT_HOME": str(home), "ACCEPT_PASSPHRASE": "twelve plates are stacked", "COLUMNS": "200"}
    done = CliRunner().invoke(app, [str(a) for a in arguments], env=env)
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exc_info
    return done.exit_code, done.stdout, done.stderr


@dataclass(frozen=True)
class BatchRun:
    """A sound unit, its batch, and what `accept verify` says of its certificate."""

    folder: Path
    exit_code: int
    entry: dict
    verified: tuple[int, str, str]
    certificate: Path


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory) -> BatchRun:
    def make(place: Path) -> BatchRun:
        folder, home = unit(place, "P-1"), place / "home"
        exit_code, _, _ = accept(home, "batch", folder, "--out", place / "out")
        (entry,) = json.loads((place / "out" / "results.json").read_text())["units"]
        certificate = place / "out" / entry["certificate"]
        return BatchRun(folder, exit_code, entry, accept(home, "verify", certificate), certificate)

    return once(tmp_path_factory, "strut_plates", make)


@pytest.mark.slow
def test_a_sound_one_is_accepted_certified_and_verified(batch: BatchRun) -> None:
    """Red before: no kind, no spec; records without de had no result."""
    assert (batch.exit_code, batch.entry["verdict"]) == (0, "accepted")
    assert {f["quantity"] for f in batch.entry["findings"]} == {"axial_resonance_Hz", "hysteresis_percent"}
    known = {i["quantity"] for i in batch.entry["information"]}
    assert {"vs_zero_Hz", "gain_da_um_per_V", "gain_Vs_V_per_V", "ga_N_per_V", "gs_V_per_m"} <= known
    assert not {q for q in known if "_de_" in q or q in ("dx_um", "dy_um", "x_bending_Hz")}
    assert f"frf: misalignment does not apply: {NO_ENCODER}" in batch.entry["notes"]
    exit_code, said, more = batch.verified
    assert exit_code == 0, said
    assert "judged again from the attached data: the same result" in more


@pytest.mark.slow
def test_what_it_measures_is_what_was_put_in(batch: BatchRun) -> None:
    found = {f["quantity"]: f for f in batch.entry["findings"]} | {i["quantity"]: i for i in batch.entry["information"]}
    model = open_model(KIND)
    truth = {"axial_resonance_Hz": axial_Hz(model), "ga_N_per_V": model.values["constants.ga_N_per_V"]}
    truth["gs_V_per_m"] = model.values["constants.gs_V_per_m"]
    assert {n: abs(found[n]["value"] - v) < found[n]["U"] for n, v in truth.items()} == dict.fromkeys(truth, True)


@pytest.mark.slow
def test_its_gap_searches_two_channels_and_says_what_it_cannot_see(batch: BatchRun) -> None:
    gap = batch.entry["gap"]
    assert (gap["start"], gap["verdict"]) == (KIND, "no_missing_effect")
    assert gap["gap_before"]["channels"].keys() == gap["gap_after"]["channels"].keys() == {"Vs", "da"}
    (note,) = (n for n in gap["notes"] if n.startswith(NO_ENCODER))
    assert all(name in note for name in ("misalignment", "encoder bracket mode", "encoder mass", "bench mode"))
    assert not any(name in note for name in ("hysteresis", "loop delay", "crosstalk", "support mode"))
    seen = {name: set(EFFECTS[name].channels) & {"Vs", "da"} for name in gap["detection_limits"]}
    assert {name for name, channels in seen.items() if not channels} <= {"hysteresis"}  # red before: misalignment, too


@pytest.mark.slow
def test_an_effect_is_found_in_two_channels_and_hysteresis_in_da(tmp_path: Path) -> None:
    hidden = (("loop_delay", {"tau_us": 60.0}), ("hysteresis", {"relative_width": 0.06}))
    folder = unit(tmp_path, "P-2", effects=hidden)
    exit_code, said, _ = accept(tmp_path / "home", "gap", folder, "--out", tmp_path / "out", "--html")
    found = json.loads((tmp_path / "out" / "gap.json").read_text())
    # The bench's own lags make up the form of a lag of the drive, as where de is measured: two names for it.
    assert (exit_code, found["verdict"]) == (4, "ambiguous")
    (loops,) = (n for n in found["named"] if n["effect"] == "hysteresis")
    lo, hi = loops["parameters"]["relative_width"]["ci95"]
    assert lo < 0.06 < hi
    named = [n["effect"] for n in found["named"]] + [e for a in found["ambiguous"] for e in a["effects"]]
    assert "loop_delay" in named
    assert not any(EFFECTS[name].channels == ("de",) for name in named if name != "hysteresis")
    assert found["gap_after"]["channels"].keys() == {"Vs", "da"}
    assert max(found["gap_after"]["channels"].values()) < 1.0 < max(found["gap_before"]["channels"].values())
    assert f"N{NO_ENCODER[1:]}" in " ".join(said.split())
    assert f"N{NO_ENCODER[1:]}" in (tmp_path / "out" / "gap.html").read_text()
    assert (tmp_path / "out" / "gap.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(("dead", "cause"), [("noise", Cause.CHANNEL_NOT_DRIVEN), ("constant", Cause.CHANNEL_CONSTANT)])
def test_with_a_dead_sensor_it_is_refused(dead: str, cause: Cause, folder: Path, tmp_path: Path) -> None:
    if dead == "constant":
        column(folder, BANDS[:2], "Vs", np.zeros_like)
    else:
        folder = unit(tmp_path, "P-3", fault="dead_sensor", repeats=False)
    result = judged(folder)
    assert (result.verdict, causes(result, "axial_resonance_Hz")[0]) == ("incomplete", cause)


def test_an_encoder_in_its_records_is_asked_about(folder: Path) -> None:
    """Records of a strut with encoder under the kind of one without: never a pass, and gap does not use de."""
    for name, content in simulated("P-1", "strut", repeats=False).files.items():
        if name.startswith("frf"):
            (folder / name).write_bytes(content)
    result = judged(folder)
    assert result.verdict == "conditional"
    assert causes(result, "axial_resonance_Hz") == [Cause.CHANNEL_NOT_EXPECTED]
    (words,) = (f.reason for f in result.findings if f.quantity == "axial_resonance_Hz")
    assert "the file holds encoder de" in str(words)
    assert "is an encoder fixed?" in str(words)
    assert causes(result, "hysteresis_percent") == []


def test_a_column_de_that_stands_still_is_no_encoder(folder: Path) -> None:
    """A rig stores every input: without encoder its counter stays at one value."""
    column(folder, BANDS[:2], "de", np.zeros_like)
    assert judged(folder).verdict == "accepted"


def test_a_strut_with_encoder_needs_de_and_is_pointed_to_the_other_kind(folder: Path) -> None:
    text = (folder / UNIT_FILE).read_text().replace(f'"{KIND}"', '"strut"')
    (folder / UNIT_FILE).write_text(text)
    result = judged(folder, "strut-basic")
    assert result.verdict == "incomplete"
    assert causes(result, "axial_resonance_Hz") == [Cause.OTHER_VARIANT]
    (reason,) = (f.reason for f in result.findings if f.quantity == "axial_resonance_Hz")
    assert "lacks 'de'" in str(reason)
    assert f"a strut without encoder is of kind '{KIND}'" in str(reason)
    with pytest.raises(UnitError, match=f"judges '{KIND}'"):
        judge_unit(unit_folder.read(folder), load_spec(KIND))


def test_misalignment_says_why_it_does_not_apply(folder: Path, tmp_path: Path) -> None:
    exit_code, _, said = accept(tmp_path / "home", "misalign", folder)
    assert exit_code == 6
    assert NO_ENCODER in said
    with pytest.raises(UnitError, match=NO_ENCODER):
        estimate_unit(unit_folder.read(folder))
    spec = tmp_path / "spec.toml"
    limits = builtin()["strut"].read_text().partition("[checks.misalignment]")
    spec.write_text(builtin()[KIND].read_text() + "".join(limits[1:]).partition("[checks.hysteresis]")[0])
    with pytest.raises(SpecError, match=NO_ENCODER):
        load_spec(str(spec))


def test_a_model_with_an_encoder_is_not_its_model(folder: Path, tmp_path: Path) -> None:
    """The head's mass is not there: what it leaves in da would be given another name."""
    exit_code, _, said = accept(tmp_path / "home", "gap", folder, "--model", "strut", "--out", tmp_path / "out")
    assert exit_code == 6
    assert f"the model of its kind is {KIND}" in said
    for kind, model in ((KIND, "strut"), ("strut", KIND)):
        with pytest.raises(UnitRequestError, match=r"has (no )?de"):
            UnitRequest("P-9", kind, open_model(model))


def test_all_follows_from_the_product() -> None:
    product, spec = product_named(KIND), default_spec(KIND)
    assert (product.family, product.model, spec.gap.model if spec.gap else None) == ("strut", KIND, KIND)
    assert not {"dx_um", "dy_um"} & set(product.matched_by)
    assert "encoder" not in product.parts
    assert open_model(KIND).channels == ("Vs", "da")
    steps = {step.name: step for step in steps_of(spec)}
    assert steps.keys() == {"frf", "hysteresis"}
    inputs = {name: i for step in steps.values() for name, i in step.check.inputs.items() if isinstance(i, Series)}
    assert {name: set(i.channels) for name, i in inputs.items() if name in ("low", "high", "record")} == {
        "low": {"t", "Va", "Vs", "da"},
        "high": {"t", "Va", "Vs", "da"},
        "record": {"t", "Va", "da"},
    }
    assert not any("encoder" in name for name in inputs)  # nothing to compare with
    assert all("encoder" not in step.guide.picture for step in steps.values())
    assert all("sits on the plates" in step.guide.words for step in steps.values())


@pytest.mark.parametrize("kind", ["apa", "strut"])
def test_other_products_are_measured_as_their_checks_declare(kind: str) -> None:
    steps = steps_of(default_spec(kind))
    assert all(step.check is CHECKS[step.name] for step in steps)
