"""`accept model learn`: a batch simulated from known values is recovered, a strange unit is told and moves nothing,
what is learned opens as a model, bad input is refused in words. Units of a two-spring APA, fitted in a second."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from typer.testing import CliRunner

from accept.cli.main import app
from accept.fleet.population.learn import measured_units, with_scatter
from accept.models.model_file import open_model, open_model_file
from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.population.learn import physical
from specs.model import load_model
from tests.accept.units.modelled_records import write_answers

UNITS = 6
MODEL = "apa-2dof"
# what the batch is, and 1 sd from unit to unit: ke is 5 % stiffer than the file says, and alike to 1 %
MEAN = {"apa.ke_N_per_um": 1.84, "bench.payload_kg": 5.73, "constants.ga_N_per_V": -31.0}
SCATTER = {"apa.ke_N_per_um": 0.02, "bench.payload_kg": 0.01, "constants.ga_N_per_V": 0.4}


def unit_folder(folder: Path, serial: str, changes: dict[str, float], seed: int, late_us: float = 0.0) -> Path:
    """A unit whose records are the model's answer."""
    folder.mkdir(parents=True)
    names = ("low", "high", "low_2", "high_2")
    write_answers(folder, names, open_model(MODEL), changes, seed=seed, noise=1e-3, late_us=late_us)
    records = 'low = "low.mat"\nhigh = "high.mat"\nlow_repeat = "low_2.mat"\nhigh_repeat = "high_2.mat"\n'
    (folder / "unit.toml").write_text(f'serial = "{serial}"\nkind = "apa"\n[frf]\n{records}merge_Hz = 350.0\n')
    return folder


def learn(*arguments: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, ["model", "learn", *(str(a) for a in arguments)])
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture(scope="module")
def truth() -> list[dict[str, float]]:
    rng = np.random.default_rng(3)
    return [{n: rng.normal(m, SCATTER[n]) for n, m in MEAN.items()} for _ in range(UNITS)]


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory, truth: list[dict[str, float]]) -> list[Path]:
    parent = tmp_path_factory.mktemp("batch")
    return [unit_folder(parent / f"B-{i}", f"B-{i}", changes, i) for i, changes in enumerate(truth)]


@pytest.fixture(scope="module")
def stranger(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A third softer in ke than the others: the file's priors bear it, the batch does not."""
    odd = MEAN | {"apa.ke_N_per_um": 1.50}
    return unit_folder(tmp_path_factory.mktemp("odd") / "odd", "ODD", odd, 77)


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory, batch: list[Path]) -> tuple[Path, int, str, str]:
    out = tmp_path_factory.mktemp("learned")
    return (out, *learn(*batch, "--model", MODEL, "--out", out))


def document(out: Path) -> dict[str, Any]:
    return json.loads((out / "population.json").read_text())


def test_a_mean_stays_where_a_model_can_be() -> None:
    """Whole struts of beams made the factor of a mode's damping -0.05, and no program could open what was learned."""
    free = [
        Free("apa.mode_damping_4", 1.0, 0.2, lo=np.nextafter(0.0, 1.0)),
        Free("bench.payload_kg", 5.7, 0.1, lo=0.0),
        Free("misalignment.dx_um", 0.0, 50.0, lo=-5000.0, hi=5000.0),
        Free("constants.ga_N_per_V", -30.0, 2.0),
    ]
    given = np.array([p.prior for p in free])
    np.testing.assert_allclose(
        physical(np.array([-0.05, 5.8, 40.0, -33.0]), free, given), [0.05, 5.8, 40.0, -33.0], rtol=1e-12
    )
    np.testing.assert_array_equal(physical(given, free, given), given)


def test_mean_and_scatter_of_a_batch_are_recovered(
    learned: tuple[Path, int, str, str], truth: list[dict[str, float]]
) -> None:
    """Means within U of the mean of what was drawn, widened by what six units can say; scatters between that drawn and
    the file's, which is worth three of them."""
    out, code, said, err = learned
    assert code == 0, err
    found = document(out)
    assert [u["belongs"] for u in found["units"]] == [True] * UNITS
    priors = open_model(MODEL).sds
    for name in MEAN:
        p = found["parameters"][name]
        values = [t[name] for t in truth]
        assert abs(p["mean"] - np.mean(values)) < p["U"], name
        assert p["U"] < 2 * priors[name], name
        assert 0.5 * np.std(values) < p["scatter"] <= 1.1 * max(priors[name], np.std(values, ddof=1)), name
    assert max(g for u in found["units"] for g in (*u["G"].values(), *u["G_left_out"].values())) < 1.5
    inside, compared = found["coverage"]["inside_95"], found["coverage"]["compared"]
    assert inside >= 0.85 * compared > 0
    assert "learned from 6 units" in said


def test_what_was_learned_is_a_model(learned: tuple[Path, int, str, str]) -> None:
    """Its values are the batch's means, its prior the covariance of one more unit, correlations included."""
    path = learned[0] / "population.toml"
    it, found = open_model_file(path), document(learned[0])
    record = it.spec.population
    assert record is not None
    assert record.units == [f"B-{i}" for i in range(UNITS)]
    for name, mean in zip(record.names, record.mean, strict=True):
        assert it.model.values[name] == mean == pytest.approx(found["parameters"][name]["mean"], rel=1e-5)
        assert it.model.sds[name] == pytest.approx(found["parameters"][name]["of_one_more_sd"], rel=1e-4)
    assert it.model.joint is not None
    np.testing.assert_array_equal(it.model.joint.covariance, record.full)
    assert CliRunner().invoke(app, ["model", "show", "--model", str(path)]).exit_code == 0


def test_a_learned_model_fits_a_unit_that_it_was_not_learned_from(
    learned: tuple[Path, int, str, str], tmp_path: Path
) -> None:
    """With the batch for a prior a seventh unit's values are nearer to the truth than the stated U, and that U is below
    that of the file's priors."""
    changes = {n: m + 0.5 * SCATTER[n] for n, m in MEAN.items()}
    folder = unit_folder(tmp_path / "more", "MORE", changes, 99)
    U = {}
    for model in (MODEL, learned[0] / "population.toml"):
        out = tmp_path / Path(model).stem
        done = CliRunner().invoke(app, ["model", "fit", str(folder), "--model", str(model), "--out", str(out)])
        assert done.exit_code == 0, done.stderr
        fit = json.loads((out / "fit.json").read_text())["parameters"]
        for name, value in changes.items():
            assert abs(fit[name]["value"] - value) < 1.5 * fit[name]["U"], name
        U[str(model)] = sum(fit[n]["U"] / abs(v) for n, v in MEAN.items())
    before, after = U.values()
    assert after < before


def test_the_report_says_what_is_common(learned: tuple[Path, int, str, str]) -> None:
    out, _, said, _ = learned
    assert (out / "population.pdf").read_bytes().startswith(b"%PDF")
    assert "apa.ke_N_per_um: 1.75 -> 1.8" in said
    found = document(out)
    assert found["holds_together"] is True
    assert set(found["not_learned"]) <= set(found["parameters"])
    for pair in found["not_told_apart"]:
        assert abs(pair["correlation"]) > 0.9


def test_a_strange_unit_is_told_and_moves_nothing(
    batch: list[Path], stranger: Path, learned: tuple[Path, int, str, str], tmp_path: Path
) -> None:
    code, said, err = learn(*batch, stranger, "--model", MODEL, "--out", tmp_path)
    assert code == 0, err
    found, before = document(tmp_path), document(learned[0])
    assert [u["serial"] for u in found["units"] if not u["belongs"]] == ["ODD"]
    assert "ODD does not belong" in said
    assert "apa.ke_N_per_um" in (found["units"][-1]["reason"] or "")
    for name, p in before["parameters"].items():
        # A latency is not told from a smooth factor of its channel by better than its U, so one unit more moves it.
        share = 0.5 if name.startswith("bench.latency") else 0.1
        assert abs(found["parameters"][name]["mean"] - p["mean"]) < share * p["U"], name


@pytest.mark.parametrize(("model", "added"), [("apa-frame", True), ("strut-as-built", False), ("apa-2dof", False)])
def test_a_model_file_that_takes_every_apa_for_the_same_gets_a_scatter_to_learn(model: str, added: bool) -> None:
    """Before, such a file left units that do not hold together, or every difference between APAs to other causes."""
    said: list[str] = []
    given = open_model_file(model)
    found = with_scatter(given, said.append)
    assert [("[apa] mode_scatter" in words) for words in said] == [True] * added
    assert (found is given) is not added
    assert found.model.scatters is (given.model.scatters or added)
    assert load_model(model).values.items() <= found.spec.values.items()


@pytest.mark.slow
def test_units_with_nothing_in_common_are_no_batch(batch: list[Path], tmp_path: Path) -> None:
    """Two of four late by 300 us: neither two are the others' batch, and two are too few."""
    late = [unit_folder(tmp_path / f"L-{i}", f"L-{i}", MEAN, 50 + i, late_us=300.0) for i in range(2)]
    code, said, err = learn(*batch[:2], *late, "--model", MODEL, "--out", tmp_path / "out")
    assert code == 4, err
    assert "do not hold together" in said
    assert document(tmp_path / "out")["holds_together"] is False
    units = document(tmp_path / "out")["units"]
    assert sum(u["belongs"] for u in units) < 3
    assert all(u["reason"] for u in units if not u["belongs"])
    assert "mode_scatter" not in said  # two springs have no modes to scatter
    for command in (["model", "fit"], ["gap"]):
        refused = CliRunner().invoke(app, [*command, str(batch[0]), "--model", str(tmp_path / "out/population.toml")])
        assert refused.exit_code == 6, refused.output
        assert "was learned from units that are no batch" in refused.output
        assert "nothing is named by it" in refused.output
    with pytest.raises(ModelError, match="no batch"):
        open_model(tmp_path / "out/population.toml")


@pytest.mark.slow
def test_what_all_units_have_alike_is_the_bench_s(tmp_path: Path) -> None:
    """All late by 200 us: a latency of each channel says so within its U, and the units belong."""
    late = [unit_folder(tmp_path / f"L-{i}", f"L-{i}", MEAN, 60 + i, late_us=200.0) for i in range(3)]
    code, said, err = learn(*late, "--model", MODEL, "--out", tmp_path / "out")
    assert code == 0, err
    found = document(tmp_path / "out")
    for channel, one in found["bench"]["latencies"].items():
        assert abs(one["tau_us"] - 200.0) < one["U"] < 10.0, channel
    assert all(u["belongs"] for u in found["units"])
    assert "us later" in said


@pytest.mark.slow
def test_units_of_which_none_belongs_end_in_a_sentence(tmp_path: Path) -> None:
    """Each is another thing: nothing can be compared, which once ended in a traceback."""
    others = [
        MEAN | {"apa.ke_N_per_um": ke, "bench.payload_kg": kg} for ke, kg in ((0.6, 9.0), (1.8, 3.0), (4.0, 15.0))
    ]
    units = [unit_folder(tmp_path / f"N-{i}", f"N-{i}", other, 90 + i) for i, other in enumerate(others)]
    code, said, err = learn(*units, "--model", MODEL, "--out", tmp_path / "out")
    assert code == 4, err
    assert "do not hold together" in said
    assert "Traceback" not in said + err


def test_records_of_noise_are_refused(tmp_path: Path) -> None:
    """Answers in another order: nothing follows the drive, and any model would seem to explain that."""
    rng = np.random.default_rng(8)
    units = [unit_folder(tmp_path / f"N-{i}", f"N-{i}", MEAN, 90 + i) for i in range(3)]
    for record in (tmp_path / "N-1").glob("*.mat"):
        columns = {k: v for k, v in loadmat(record).items() if not k.startswith("__")}
        savemat(record, columns | {c: rng.permutation(columns[c].ravel()) for c in ("Vs", "de", "da")})
    code, _, err = learn(*units, "--model", MODEL, "--out", tmp_path / "out")
    assert code == 6
    assert "N-1" in err
    assert "follows the drive" in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("case", ["few", "twice", "copied", "missing", "kinds", "no sd", "no out"])
def test_bad_input_is_refused_before_anything_is_fitted(case: str, batch: list[Path], tmp_path: Path) -> None:
    out: object = tmp_path / "out"
    units: list[object] = list(batch[:3])
    words = {"few": "3 or more", "twice": "given twice", "missing": "nowhere", "kinds": "of one kind", "no sd": "sd"}
    words["copied"] = "holds the recording of B-0"
    model: object = MODEL
    if case == "few":
        units = units[:2]
    if case == "twice":
        units[2] = units[0]
    if case == "copied":
        units[2] = shutil.copytree(batch[0], tmp_path / "copy")
        text = (tmp_path / "copy" / "unit.toml").read_text()
        (tmp_path / "copy" / "unit.toml").write_text(text.replace("B-0", "OTHER"))
    if case == "missing":
        units[2] = tmp_path / "nowhere"
    if case == "kinds":
        other = tmp_path / "strut"
        shutil.copytree(batch[3], other)
        text = (other / "unit.toml").read_text()
        (other / "unit.toml").write_text(text.replace('"apa"', '"strut"').replace("B-3", "OTHER"))
        units[2] = other
    if case == "no sd":
        text = open_text(MODEL)
        model = tmp_path / "exact.toml"
        (tmp_path / "exact.toml").write_text(text)
    if case == "no out":
        out = batch[0] / "unit.toml"
        words[case] = "unit.toml"
    code, said, err = learn(*units, "--model", model, "--out", out)
    assert code == 6
    assert words[case] in err
    assert "Traceback" not in err + said
    assert not (tmp_path / "out").exists()


def open_text(name: str) -> str:
    """A built-in model's text without one sd."""
    import re

    from specs.model import load_model

    return re.sub(r"\{ value = ([-\d.e+]+), sd = [\d.e+-]+ \}", r"\1", load_model(name).text)


def test_units_are_read_before_any_is_fitted(batch: list[Path]) -> None:
    with pytest.raises(ModelError, match="3 or more"):
        measured_units(batch[:1], open_model_file(MODEL))
