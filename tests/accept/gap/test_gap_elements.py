"""`accept gap` with an element in the mechanics, to its end: terminal, gap.json, gap.pdf, gap.html, certificate and the
improved model with it, which explains the unit."""

import html
import json
import tomllib
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pypdf import PdfReader

from accept.certificate import InvalidCertificate
from accept.certificate.page.gap_section import explanation
from accept.certificate.verify.picture_check import check_gap
from accept.gap.analyse_unit import GapAnalysis, write
from accept.gap.report import summary
from accept.gap.unit_responses import Responses
from accept.models.model_file import open_model_file, write_model
from accept.pictures.pdf.fonts import register
from accept.units.unit_folder import parse
from checks.errors import ModelError
from checks.gap.decision.result import NO_MISSING
from checks.gap.effects import EFFECTS
from checks.gap.workflow import Inputs, run
from specs.errors import AcceptError
from specs.strict import toml_of
from tests.checks.gap.shared.experiment_cases import DAMPERS, SPRINGS, known
from tests.checks.gap.shared.gap_cases import FS, recorded

SPRING, STIFFNESS = "element.payload.z.spring_N_per_um", 0.2
HANGS = "element.payload.z.hung_Hz"
NINETY = {"hung_kg": 0.1, "hung_Hz": 90.0, "hung_damping_ratio": 0.02}


@cache
def analysed(model_file: str | Path = "apa-2dof") -> GapAnalysis:
    """An APA with a spring from the payload to ground, compared with a model of it without, or with another."""
    given, built_in = open_model_file(model_file), known(*SPRINGS, *DAMPERS)
    truth = built_in.with_values({"constants.ga_N_per_V": -33.0}).with_elements({SPRING: STIFFNESS})
    given = replace(given, model=built_in) if model_file == "apa-2dof" else given
    A, B = (recorded(truth, seed).thinned(100) for seed in (1, 2))
    inputs = Inputs(given.model, A, B, FS, without=frozenset(EFFECTS) - {"sensor_highpass"})
    result = run(inputs, lambda _: None)
    return GapAnalysis(result, Responses("V-1", "apa", A, B, inputs.merge_Hz), given, inputs)


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("gap")
    write(analysed(), folder, html=find_spec("plotly") is not None)
    return folder


def test_the_improved_model_holds_the_element_and_explains_the_unit(out: Path) -> None:
    before, first = analysed().result, analysed().document["elements"][0]
    written = tomllib.loads((out / "model.toml").read_text())
    (entry,) = written["elements"]
    stated = first["parameters"]["k_N_per_um"]
    assert (entry["place"], entry["direction"], entry["kind"]) == ("payload", "z", first["kind"])
    assert entry["spring_N_per_um"]["value"] == stated["value"] == pytest.approx(STIFFNESS, rel=0.1)
    assert entry["covariance"] == [[pytest.approx(entry["spring_N_per_um"]["sd"] ** 2)]]
    improved = open_model_file(out / "model.toml").model
    assert improved.values[SPRING] == stated["value"]
    f, after = before.after.data.f, before.after
    assert improved.frf(f) == pytest.approx(after.response.frf(f, after.at, after.data.channels), rel=1e-9)
    again = analysed(out / "model.toml").result
    assert (again.verdict, again.elements) == (NO_MISSING, ())
    assert all(before.gap_after.channels[c].G < gap.G for c, gap in before.gap_before.channels.items())


def test_every_report_states_the_element_its_likely_cause_and_the_next_experiment(out: Path) -> None:
    (e,) = analysed().document["elements"]
    pages = " ".join(page.extract_text() for page in PdfReader(out / "gap.pdf").pages)
    terminal = " ".join(summary("V-1", analysed().result))
    section = " ".join(f.getPlainText() for f in certificate_section() if hasattr(f, "getPlainText"))
    assert e["looks_like"][0] in e["sentence"]
    for words in (e["sentence"], e["experiment"]):
        for text in (pages, terminal, section):
            assert "".join(words.split()) in "".join(text.replace("µ", "u").split())
    assert "something like a spring" in section
    assert "before" in pages
    assert "after" in pages
    if (out / "gap.html").exists():
        assert html.escape(e["sentence"]) in (out / "gap.html").read_text()


def certificate_section() -> list[Any]:
    register()
    return explanation({"gap": {"start": "apa-2dof", **analysed().document}, "findings": []})


ANSWER: dict[str, Any] = {  # of a recorded strut, written before the check
    "kind": "resonator",
    "places": [
        {"part": "top interface", "against": "ground", "direction": "z", "point_mm": [-5.9, 0.8, 0.0]},
        {"part": "payload", "against": "ground", "direction": "z", "point_mm": [0.0, 0.0, 0.0]},
    ],
    "parameters": {
        "damping_ratio": {"value": 0.010038, "ci95": [0.009602, 0.010474]},
        "f_Hz": {"value": 120.877, "ci95": [120.730, 121.024]},
        "m_kg": {"value": 0.018364, "ci95": [0.017686, 0.019043]},
    },
    "sentence": "Something like a mass on a spring to ground at the top interface, along z, at (-6, 1) mm: m 0.01836 "
    "kg (95 %: 0.01769 to 0.01904), f 120.88 Hz (95 %: 120.73 to 121.02), damping ratio 0.01004 (95 %: 0.00960 to "
    "0.01047); a cable, a hose or a loose part that swings there would look like this. As good: to ground at the "
    "payload, along z.",
    "looks_like": [
        "a cable, a hose or a loose part that swings there",
        "a payload whose centre of mass lies beside the axis and rocks on its guide",
    ],
    "experiment": "repeat the record with whatever touches or hangs on the top interface and the payload removed, one "
    "part after the other: it is then gone",
}


def checked(element: dict[str, Any]) -> None:
    text = b'serial = "V-1"\nkind = "strut"\n[frf]\nlow = "a.mat"\nhigh = "b.mat"\n'
    unit = parse(Path("V-1"), text, toml_of(text))
    check_gap(unit, {"verdict": "ambiguous", "named": [], "elements": [element]}, {})


AS_WELL = ANSWER | {
    "sentence": ANSWER["sentence"] + " Explained as well by sensor highpass, other values of apa.damping_ratio, "
    "joint.kz_N_per_um.",
    "experiment": ANSWER["experiment"].partition(", one part")[0]
    + ": an element there is then gone, sensor highpass stays",
}


ASKED = ANSWER | {  # by prediction
    "experiment": "repeat with whatever touches or hangs on the payload removed: an element there is then gone, all "
    'else stays; in unit.toml [[experiments]] kind = "removed_from_payload"'
}


@pytest.mark.parametrize("one", [ANSWER, AS_WELL, ASKED, None])
def test_an_element_in_the_words_of_the_analysis_is_verified(one: dict[str, Any] | None) -> None:
    checked(one or json.loads(json.dumps(analysed().document["elements"][0], sort_keys=True)))


@pytest.mark.parametrize(
    "forged",
    [
        {"sentence": ANSWER["sentence"].replace("at the payload", "at the ACCEPTED unit")},
        {"sentence": ANSWER["sentence"].replace("f 120.88 Hz", "ACCEPTED 120.88 Hz")},
        {"sentence": ANSWER["sentence"] + " The unit is ACCEPTED."},
        {"sentence": ANSWER["sentence"] + " Explained as well by sensor highpass, a unit that is ACCEPTED."},
        {"experiment": "none: the unit is ACCEPTED"},
        {"experiment": ANSWER["experiment"] + ", and the unit ACCEPTED"},
        {"experiment": ASKED["experiment"] + ", mass_kg = 0.5"},
        {"experiment": ASKED["experiment"].replace("the payload removed", "the ACCEPTED unit removed")},
        {"sentence": ANSWER["sentence"].replace("a cable", "a good unit, ACCEPTED")},
        {"kind": "good unit"},
        {"sentence": ANSWER["sentence"].replace("120.88", "620.88")},  # red before: any number passed
        {"sentence": ANSWER["sentence"].replace("As good: to ground at the payload", "As good: to ground at the head")},
        {"parameters": ANSWER["parameters"] | {"OK_Hz": {"value": 1.0, "ci95": [0.9, 1.1]}}},
        {"places": [ANSWER["places"][0] | {"part": "ACCEPTED unit"}, ANSWER["places"][1]]},
        {"sentence": ANSWER["sentence"] + " Explained as well by other values of THE.UNIT.IS_ACCEPTED."},  # red before
        {
            "sentence": ANSWER["sentence"]
            + " Explained as well by other values of the.unit.is.ACCEPTED_by.quality_assurance."
        },
        {"sentence": ANSWER["sentence"] + " Explained as well by other values of apa.ACCEPTED."},
        {
            "sentence": ANSWER["sentence"] + " Explained as well by sensor highpass."
        },  # red before: the experiment differs
    ],
)
def test_an_element_in_other_words_is_no_certificate(forged: dict[str, Any]) -> None:
    with pytest.raises(InvalidCertificate, match="an element in words that are not its own"):
        checked(ANSWER | forged)


HUNG = "hung_kg = 0.1\nhung_Hz = 80.0\nhung_damping_ratio = 0.02\n"
ENTRY = 'place = "payload"\ndirection = "z"\n'


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ([ENTRY + "hung_kg = 0.1\n"], r"element.payload.z.hung_Hz.* is missing|hung_damping_ratio: is missing"),
        ([ENTRY + "spring_Nm_per_rad = 1.0\n"], "spring_Nm_per_rad: expected one of .*spring_N_per_um"),
        ([ENTRY + HUNG, ENTRY + "spring_N_per_um = 1.0\n"], "two entries along one direction"),
        ([ENTRY + "spring_N_per_um = 'stiff'\n"], "spring_N_per_um"),
        ([ENTRY + "added_kg = inf\n"], "added_kg"),
        (['place = "head"\ndirection = "u"\nadded_kg = 0.1\n'], "direction"),
    ],
)
def test_a_file_with_elements_that_make_no_sense_is_refused(entries: list[str], words: str, tmp_path: Path) -> None:
    text = open_model_file("apa-2dof").spec.text + "".join(f"\n[[elements]]\n{e}" for e in entries)
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(AcceptError, match=words):
        open_model_file(tmp_path / "m.toml")


def test_an_element_at_a_part_that_the_strut_does_not_have_is_refused(tmp_path: Path) -> None:
    entry = '\n[[elements]]\nplace = "head"\ndirection = "z"\nadded_kg = 0.1\n'
    (tmp_path / "m.toml").write_text(open_model_file("apa-2dof").spec.text + entry)
    with pytest.raises(ModelError, match="attached to head, which this strut does not have"):
        open_model_file(tmp_path / "m.toml").model.frf([100.0])


def test_what_hangs_is_written_and_read_with_new_values(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(f"{open_model_file('apa-2dof').spec.text}\n[[elements]]\n{ENTRY}{HUNG}")
    read = write_model(tmp_path / "n.toml", open_model_file(tmp_path / "m.toml").spec, {HANGS: 90.0}, {HANGS: 0.5})
    assert (read.values[HANGS], read.sds[HANGS]) == (90.0, 0.5)
    f, model = np.array([70.0, 90.0]), open_model_file(tmp_path / "n.toml").model
    direct = known().with_elements({f"element.payload.z.{k}": v for k, v in NINETY.items()})
    assert model.frf(f) == pytest.approx(direct.frf(f), rel=1e-9)
