"""Methods of the blind test: how they are called and what counts as an answer, the baselines on small problems with a
known solution, gates that are left out, priors of other widths, the matrices by their hash."""

import hashlib
import json
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from accept.models.model_file import open_model
from checks.gap import EFFECTS
from checks.gap.decision import build_result, gates
from tests.conftest import DATA
from validation import shell, strut
from validation.cases import Case
from validation.data import fetch
from validation.methods import sensitivity, sparse
from validation.methods.call import METHODS, Command, MethodError, answer_of, method_of
from validation.model_files import text_for
from validation.scoring.scores import Outcome
from validation.sets import SETS
from validation.studies import ablation, compare, curves, posterior

needs_data = pytest.mark.needs_data
NAMED = {"effect": "crosstalk", "parameters": {"V_per_V": {"value": 0.01, "ci95": [0.009, 0.011]}}}


# --- how a method is called -------------------------------------------------------------------------------------------


def right(folder: Path, model: Path, *, without: Sequence[str] = ()) -> Mapping[str, Any]:
    return {"verdict": "explained", "named": [NAMED], "without": list(without)}


def maker(argument: str) -> Any:
    return lambda folder, model, *, without=(): {"verdict": argument}


def test_methods_by_name_function_maker_and_command(tmp_path: Path) -> None:
    for name in METHODS:
        assert callable(method_of(name))
    assert method_of("tests.validation.test_methods:right") is right
    assert method_of("tests.validation.test_methods:maker@unexplained")(tmp_path, tmp_path)["verdict"] == "unexplained"
    with pytest.raises(MethodError, match="sensitivity"):
        method_of("unheard-of")


def test_a_command_gets_folder_model_and_library_and_prints_its_answer(tmp_path: Path) -> None:
    script = tmp_path / "method.py"
    script.write_text("import json, sys; print(json.dumps({'verdict': ' '.join(sys.argv[1:])}))")
    command = f"{sys.executable} {script} {{unit}} --model {{model}} --without={{without}}"
    answer = method_of(command)(tmp_path / "a unit", tmp_path / "m.toml", without=("creep", "crosstalk"))
    assert answer["verdict"] == f"{tmp_path}/a unit --model {tmp_path}/m.toml --without=creep,crosstalk"


@pytest.mark.parametrize(
    ("code", "words"), [("import sys; sys.exit('no licence')", "no licence"), ("print('done')", "JSON")]
)
def test_a_command_that_gives_no_answer_says_why(tmp_path: Path, code: str, words: str) -> None:
    script = tmp_path / "method.py"
    script.write_text(code)
    with pytest.raises(MethodError, match=words):
        Command(f"{sys.executable} {script} {{unit}}")(tmp_path, tmp_path)


@pytest.mark.parametrize(
    "answer",
    [
        [],
        {"named": []},
        {"verdict": "explained", "named": ["crosstalk"]},
        {"verdict": "explained", "named": [{"effect": "crosstalk", "parameters": {"V_per_V": 0.01}}]},
        {"verdict": "explained", "named": [{"effect": "a", "parameters": {"x": {"value": 1.0, "ci95": [0.0]}}}]},
    ],
)
def test_what_cannot_be_scored_is_refused(answer: Any) -> None:
    with pytest.raises(MethodError):
        answer_of(answer)
    assert answer_of({"verdict": "explained", "named": [NAMED]})["named"] == [NAMED]


# --- the comparison ---------------------------------------------------------------------------------------------------


def outcome(kind: str, effects: Mapping[str, Any], named: Sequence[Any], **gap: Any) -> Outcome:
    verdict = "explained" if named else "no_missing_effect"
    truth = {"kind": kind, "effects": effects, "outside": {}, "alike": []}
    return Outcome("U", truth, {"verdict": verdict, "named": list(named), **gap}, 1.0)


def test_scores_of_a_table_are_counted_by_truth() -> None:
    true = {"crosstalk": {"V_per_V": 0.0105}}
    found = {"exact": [outcome("one", true, [NAMED]), outcome("none", {}, [NAMED]), outcome("none", {}, [])]}
    rows = dict(row.strip("| ").split(" | ") for row in compare.table({"it": found}).splitlines()[2:])
    assert rows["`exact`: units with a false name"].startswith("1 of 3 [")
    assert rows["one effect: named, nothing else"].startswith("1 of 1 [")
    assert rows["nothing hidden: nothing is missing"].startswith("1 of 2 [")
    assert rows["95 % intervals of right names that hold"].startswith("1 of 1 [")


@pytest.mark.takes_data
def test_every_method_gets_the_same_units_and_finished_ones_are_kept(tmp_path: Path) -> None:
    cases = {"exact": compare.drawn(3, 1)["exact"]}
    both = {"one": "tests.validation.test_methods:right", "two": "unheard-of"}
    found = compare.answers(cases, both, tmp_path)
    (one,), (two,) = found["one"]["exact"], found["two"]["exact"]
    assert one.truth == two.truth == json.loads(json.dumps(cases["exact"][0].truth()))
    assert one.named == ["crosstalk"]
    assert two.error is not None
    assert "unheard-of" in two.error
    (again,) = compare.answers(cases, {"one": "unheard-of"}, tmp_path)["one"]["exact"]
    assert (again.gap, again.error) == (one.gap, None)


def test_the_reported_seed_is_no_development_seed() -> None:
    from validation.challenge import DEVELOPMENT_SEEDS

    assert compare.SEED not in DEVELOPMENT_SEEDS


# --- the baselines ----------------------------------------------------------------------------------------------------


def test_pursuit_finds_the_atoms_that_a_residual_is_made_of() -> None:
    rng = np.random.default_rng(4)
    names = ("crosstalk", "encoder_scale", "payload_mass", "creep", "misalignment")
    rows = rng.standard_normal((len(names), 400))
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    every = [sparse.Atom(EFFECTS[n], {}, row[None]) for n, row in zip(names, rows, strict=True)]
    r = 30.0 * rows[1] - 20.0 * rows[3] + rng.standard_normal(400)
    assert [a.effect.name for a in sparse.pursue(every, r)] == ["encoder_scale", "creep"]
    assert sparse.pursue(every, rng.standard_normal(400)) == []


def test_an_atom_turns_its_size_into_a_value() -> None:
    scale = sparse.Atom(EFFECTS["crosstalk"], {}, np.ones((1, 3))).found(np.array([0.02]), np.array([0.001]))
    assert (scale.values, scale.sds) == ({"V_per_V": 0.02}, {"V_per_V": 0.001})
    lag = sparse.Atom(EFFECTS["loop_delay"], {"tau_us": 100.0}, np.ones((1, 3)))
    assert lag.found(np.array([0.5]), np.array([0.1])).values == {"tau_us": 50.0}
    corner = sparse.Atom(EFFECTS["amplifier_bandwidth"], {"f_Hz": 1000.0}, np.ones((1, 3)))
    assert corner.found(np.array([0.5]), np.array([0.1])).values == {"f_Hz": 2000.0}  # half as much: twice as far


def test_updating_begins_a_filter_far_above_the_band_and_moves_it_by_its_inverse() -> None:
    effect = EFFECTS["amplifier_bandwidth"]
    corner = sensitivity.updated(effect, effect.parameters[0], open_model("strut"))
    assert corner.value(corner.begin) == pytest.approx(sensitivity.FAR_HZ)
    h = 1e-9
    slope = (corner.value(2e-4 + h) - corner.value(2e-4 - h)) / (2 * h)
    assert corner.slope(2e-4) == pytest.approx(slope, rel=1e-6)


# --- gates, thresholds, priors ----------------------------------------------------------------------------------------


def test_a_gate_is_left_out_of_the_table_and_comes_back() -> None:
    every = gates.GATES
    for name in ablation.GATES:
        with ablation.left_out(name):
            assert {g.name for g in gates.GATES} == set(ablation.GATES) - {name}
    with ablation.left_out(ablation.EVERY):
        assert gates.GATES == ()
    assert gates.GATES == every
    rules = [getattr(build_result, rule) for rule in ablation.RIVALS_OF]
    with ablation.left_out(ablation.RIVALS):
        assert [getattr(build_result, rule)(1, 2, 3) for rule in ablation.RIVALS_OF] == [(), ()]
    assert [getattr(build_result, rule) for rule in ablation.RIVALS_OF] == rules
    with pytest.raises(KeyError, match="expected one of"), ablation.left_out("gait"):
        pass


def test_only_units_that_a_gate_alone_kept_back_are_run_without_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, list[str]]] = []

    def fake(cases: Mapping[str, Sequence[str]], methods: Mapping[str, str], out: Path) -> Any:
        (name,) = methods
        if name == "gap":
            alone = {"a": ["gain"], "b": []}
            made = [replace(outcome("none", {}, [], alone=alone[c]), serial=c) for c in cases["exact"]]
        else:
            if cases["exact"]:
                asked.append((name, list(cases["exact"])))
            made = [replace(outcome("none", {}, [NAMED]), serial=c) for c in cases["exact"]]
        return {name: {"exact": made}}

    class Drawn(str):
        serial = property(str)

    monkeypatch.setattr(ablation, "answers", fake)
    found = ablation.ablated({"exact": [Drawn("a"), Drawn("b")]}, tmp_path)  # type: ignore[list-item]
    assert asked == [("gain", ["a"])]
    assert [o.named for o in found["gain"]["exact"]] == [["crosstalk"], []]
    assert [o.named for o in found["share"]["exact"]] == [[], []]
    assert "| `gain` | 1 | 1 of 2" in ablation.table(found)


def test_names_count_from_their_evidence() -> None:
    weak, strong = ({**NAMED, "evidence": {"delta_lnL": e}} for e in (10.0, None))
    it = outcome("none", {}, [weak, strong])
    assert len(curves.above(it, 8.0).named) == 2
    assert len(curves.above(it, 12.5).named) == 1  # found before any search: no evidence is asked of it


@pytest.mark.parametrize("name", ["exact", "scatter-1"])
def test_every_prior_of_a_model_file_is_changed_by_the_factor(name: str) -> None:
    def widths(text: str) -> list[float]:
        model = tomllib.loads(text)
        stated = [v["sd"] for section in model.values() if isinstance(section, dict) for v in section.values()
                  if isinstance(v, dict) and "sd" in v]  # fmt: skip
        return [*stated, *model["apa"].get("mode_scatter", {}).values()]

    text = text_for(SETS[name])
    own, wide = widths(text), widths(curves.with_priors(text, 2.0))
    assert wide == pytest.approx([2.0 * sd for sd in own])
    assert len(own) == len(strut.priors()) + (2 if SETS[name].stated else 0)
    assert curves.with_priors(text, 1.0).count("value") == text.count("value")


# --- what a clone needs -----------------------------------------------------------------------------------------------


def test_matrices_are_taken_by_their_hash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source, place = tmp_path / "matrices.mat", tmp_path / "data" / "APA300ML.mat"
    source.write_bytes(b"other matrices")
    with pytest.raises(fetch.FetchError, match="other matrices"):
        fetch.fetch(source, place)
    assert not place.exists()
    monkeypatch.setattr(fetch, "SHA256", hashlib.sha256(b"other matrices").hexdigest())
    assert fetch.fetch(source, place).read_bytes() == b"other matrices"
    with pytest.raises(fetch.FetchError, match=r"validation\.data\.fetch FILE"):
        fetch.fetch(tmp_path / "nowhere.mat", place)


def test_without_matrices_a_program_says_how_to_get_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shell, "PUBLIC", tmp_path / "APA300ML.mat")
    with pytest.raises(SystemExit, match=r"validation\.data\.fetch"):
        shell.require_matrices()


@needs_data
def test_the_recorded_matrices_are_those_that_are_fetched() -> None:
    fetch.checked((DATA / "superelements" / "APA300ML.mat").read_bytes(), "beside")


@needs_data
def test_the_strut_is_that_of_the_recorded_units() -> None:
    """Sealed truths keep their hashes: means and priors are those that units were drawn from before."""
    own, recorded = (tomllib.loads(p.read_text()) for p in (strut.MODEL_FILE, DATA / "units" / "model.toml"))
    assert own.pop("name") == recorded.pop("name")
    assert Path(own["apa"].pop("file")).name == Path(recorded["apa"].pop("file")).name
    assert own == recorded


@pytest.mark.takes_data
def test_reported_units_are_drawn_alike_each_time() -> None:
    kinds = [[c.truth() for c in each] for each in compare.drawn(5, 2).values()]
    assert kinds == [[c.truth() for c in each] for each in compare.drawn(5, 2).values()]
    assert all(isinstance(c, Case) for each in compare.drawn(5, 2).values() for c in each)


# --- the sampler ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampler", ["metropolis", "emcee"])
def test_a_sampler_has_the_quantiles_of_a_normal_density(sampler: str) -> None:
    """20 000 states of a walk in two dimensions are worth some 2000 independent ones: 5 % of a standard deviation."""
    if sampler == "emcee":
        pytest.importorskip("emcee")
    cov = np.array([[4.0, 1.5e-3], [1.5e-3, 1e-6]])
    information = np.linalg.inv(cov)
    states = posterior.SAMPLERS[sampler](
        lambda x: -0.5 * float(x @ information @ x), np.zeros(2), cov, 20_000, np.random.default_rng(2)
    )[4000:]
    for k, sd in enumerate(np.sqrt(np.diag(cov))):
        assert np.quantile(states[:, k], posterior.QUANTILES) == pytest.approx([-1.96 * sd, 1.96 * sd], abs=0.15 * sd)
