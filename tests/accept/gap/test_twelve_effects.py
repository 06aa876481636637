"""Effects of data acquisition on the recorded strut S-01, by every command: each is named for what it is, alone or with
what the band does not tell from it, refused, or honestly unidentified; none is called by another cause.

Red before: `accept frf` had no word on clipped, held, zeroed and lost samples, and its responses went into a fit.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import accept
from accept.gap.unit_responses import gain_notes, responses
from checks.cause import Cause, because
from tests.accept.gap.acquisition_effects import EFFECTS, LOW, AcquisitionEffect, spoilt
from tests.checks.model.units_model import DATA, NOMINAL, needs_data
from tests.shared import command_line
from tests.shared.recorded_units import RecordedUnits

run = command_line.accept
BATCH = DATA / "population"
HONEST = {  # causes of a missing result that name no effect: what the responses show, not why
    Cause.MODEL_MISFIT.code, Cause.RATIO_UNKNOWN.code, Cause.CHANNEL_OFFSET.code, Cause.SEARCH_FAILED.code,
    Cause.NOT_CONVERGED.code, Cause.PRIOR_EXCEEDED.code, Cause.PRIORS_EXCEEDED.code,
}  # fmt: skip
SUMMED_UP = 1.5  # U of an estimate within which the truth lies: 1 in 300 outside


@pytest.fixture(scope="module")
def unit_with(recorded_units: RecordedUnits, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The folder of the unit with an effect, made when it is first asked for."""
    place, made = tmp_path_factory.mktemp("effects"), {}

    def of(name: str) -> Path:
        if name not in made:
            made[name] = spoilt(recorded_units.folder("S-01"), place / f"unit-{len(made)}", EFFECTS[name])
        return made[name]

    return of


def judged(unit: Path, out: Path) -> dict[str, Any]:
    """What batch writes of a unit; `accept report` and the screens judge by the same function."""
    run("batch", unit, "--out", out, "--no-certificates")
    (found,) = json.loads((out / "results.json").read_text())["units"]
    return found


REFUSED = [name for name, effect in EFFECTS.items() if effect.cause is not None]
COMPARED = [name for name, effect in EFFECTS.items() if effect.cause is None]


@needs_data
@pytest.mark.parametrize("name", REFUSED)
def test_a_fault_of_sampling_is_said_or_refused(name: str, unit_with: Callable[[str], Path], tmp_path: Path) -> None:
    unit, cause = unit_with(name), EFFECTS[name].cause
    response = accept.frequency_response(unit / LOW, f_lo=10, f_hi=300)
    with pytest.raises(accept.AcceptError) as refused:
        accept.analyse_gap(unit, str(NOMINAL))
    reason = refused.value.reason
    assert reason.cause is cause
    words = str(replace(reason, record="", file=""))
    assert words in response.frf.notes
    assert words in " ".join(run("frf", unit / LOW).stderr.split())
    with pytest.raises(accept.AcceptError) as of_response:
        accept.fit_model(response, "strut-2dof")
    assert of_response.value.reason.cause is cause
    causes = {f["quantity"]: f["cause"] for f in judged(unit, tmp_path / "out")["findings"]}
    assert {causes[q]["code"] for q in ("axial_resonance_Hz", "dx_um", "dy_um")} == {cause.code}
    for command in (["misalign"], ["model", "fit"], ["gap", "--out", tmp_path / "gap"]):
        done = run(*command, unit)
        assert done.exit_code == 6, done.output
        assert words in " ".join(done.stderr.split())
    done = run("model", "learn", unit, BATCH / "P-01", BATCH / "P-02", "--out", tmp_path / "learned")
    assert words in " ".join(done.stderr.split())


@pytest.mark.parametrize("name", COMPARED)
def test_an_effect_on_the_responses_gets_no_false_name(
    name: str, unit_with: Callable[[str], Path], tmp_path: Path
) -> None:
    unit, effect = unit_with(name), EFFECTS[name]
    frf = run("frf", unit / LOW)
    assert frf.exit_code == 0
    assert not frf.stderr
    found = judged(unit, tmp_path / "out")
    causes = [f["cause"]["code"] for f in found["findings"] if f["check"] in ("frf", "misalignment") and f["cause"]]
    assert set(causes) <= HONEST
    if found.get("gap", {}).get("named") is not None:
        assert_names(found["gap"], effect)
    for model in (NOMINAL, "strut-as-built"):
        run("misalign", unit, "--model", model, "--json", tmp_path / "off.json")
        off = json.loads((tmp_path / "off.json").read_text())
        assert all(
            off[a]["value"] is None or abs(off[a]["value"]) < SUMMED_UP * off[a]["U"] for a in ("dx_um", "dy_um")
        )
    fitted = run("model", "fit", unit, "--model", NOMINAL)
    assert fitted.exit_code == (0 if effect.harmless else 4)
    told = run("gap", unit, "--model", NOMINAL, "--out", tmp_path / "gap")
    document = json.loads((tmp_path / "gap" / "gap.json").read_text())
    assert_names(document, effect)
    if document["verdict"] != "no_missing_effect":
        assert document["named"] or document["candidates"]
        assert document["named"] or "tried, with the gain" in told.stdout
    else:
        assert effect.harmless
    by_api = accept.analyse_gap(unit, str(NOMINAL)).document if not effect.harmless else document
    assert [n["effect"] for n in by_api["named"]] == [n["effect"] for n in document["named"]]


def assert_names(document: dict[str, Any], effect: AcquisitionEffect) -> None:
    """Only right names, each with its truth in the class if it is one of several."""
    assert {n["effect"] for n in document["named"]} <= effect.names
    for each in document["ambiguous"]:
        assert effect.names & set(each["effects"]), each


def test_a_misfit_of_the_ratio_blames_neither_channel_alone() -> None:
    """The estimate sees de over da: which of them is late it cannot say."""
    where = {"lo": 700.0, "hi": 1000.0, "G": 8.0, "data": "the fitted data", "chance": "p = 1e-9"}
    words = [str(because(Cause.MODEL_MISFIT, channel=c, **where)) for c in ("de", "da")]
    assert words[0] == words[1]
    assert "de or interferometer da" in words[0]


def test_a_gain_that_drifts_from_record_to_record_is_said(recorded_units: RecordedUnits) -> None:
    """By how much, in every channel; within the tolerance of the model, which then agrees."""
    measured = responses(recorded_units.folder("S-01"))
    assert measured.second is not None
    assert gain_notes(measured.first, measured.second) == ()
    (note,) = gain_notes(measured.first, replace(measured.second, H=1.01 * measured.second.H))
    assert all(f"{c} +1.0 %" in note for c in ("Vs", "de", "da"))


@needs_data
def test_learning_leaves_an_affected_unit_out_by_name(tmp_path: Path) -> None:
    """One of four units has a channel late: it is no part of what the bench does to all."""
    late = spoilt(BATCH / "P-04", tmp_path / "P-04", EFFECTS["charge amplifier of second order"])
    done = run("model", "learn", *(BATCH / f"P-0{k}" for k in (1, 2, 3)), late, "--out", tmp_path / "learned")
    assert "P-04" in done.stderr
    learned = json.loads((tmp_path / "learned" / "population.json").read_text())
    assert "P-04" not in learned["units"]
