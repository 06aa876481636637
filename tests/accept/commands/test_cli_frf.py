"""`accept frf` and `accept compare` as a person runs them."""

import json
import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from accept.commands.physics.frf import with_U
from tests.accept.commands.test_compare import APAS
from tests.accept.units.units import GOOD, make_unit
from tests.checks.signals.frf_plant import Plant, unit
from tests.hw.records.read_uff import read_frf
from tests.shared import command_line
from tests.shared.record_files import write_mat

accept = partial(command_line.accept, code=0)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("records")
    made = unit(Plant(), seed=5, seconds=10.0)
    for key, record in made.items():
        write_mat(folder / f"{key}.mat", {"t": record.t, **record.channels})
    return [folder / f"{key}.mat" for key in ("low", "high")]


def test_merged_response_as_json_universal_file_and_picture(files, tmp_path: Path):
    out = {kind: tmp_path / f"frf.{kind}" for kind in ("json", "uff", "png")}
    found = accept(
        "frf", *files, "--merge-Hz", 350, "--json", out["json"], "--uff", out["uff"], "--plot", out["png"], "--f-lo", 5
    )
    assert "low.mat + high.mat" in found.stdout
    assert f"{abs(Plant().pole(5000.0)):.2f}" in found.stdout
    (response,) = json.loads(out["json"].read_text())["responses"]
    f, H = np.array(response["f_Hz"]), response["H"]["de"]
    assert f[0] >= 5.0
    assert len(H["re"]) == len(H["im"]) == len(response["var"]["de"]) == len(response["coherence"]["de"]) == f.size
    assert response["files"] == ["low.mat", "high.mat"]
    assert response["units"] == {"Va": "V", "Vs": "V", "de": "m", "da": "m"}
    assert [len(h) for h in response["sha256"]] == [64, 64]
    static = np.abs(np.array(H["re"]) + 1j * np.array(H["im"]))[(f > 10) & (f < 20)]
    assert static == pytest.approx(26e-6, rel=0.05)  # 1/(1 - (20/94)^2) is 4.7 %
    back = read_frf(out["uff"])
    assert back.channels == tuple(response["H"])
    assert np.allclose(back.H[:, back.channels.index("de")].real, H["re"], rtol=1e-9)
    assert out["png"].read_bytes()[:4] == b"\x89PNG"


def test_each_record_by_itself_and_the_other_estimator(files, tmp_path: Path):
    accept("frf", *files, "--estimator", "lpm", "--f-lo", 80, "--f-hi", 110, "--json", tmp_path / "a.json")
    responses = json.loads((tmp_path / "a.json").read_text())["responses"]
    assert [r["files"] for r in responses] == [["low.mat"], ["high.mat"]]
    assert {r["estimator"] for r in responses} == {"lpm"}
    (mode,) = (m for m in responses[0]["resonances"] if m["channel"] == "de")
    true = Plant().pole(5000.0)
    clock = 2e-4 * mode["f_Hz"]  # of the converters, beside it the scatter: neither is zero
    assert mode["U_Hz"] > clock
    assert abs(mode["f_Hz"] - abs(true)) < 2 * math.sqrt(mode["U_Hz"] ** 2 - clock**2)  # simulated by one clock


def test_a_periodic_input_is_recognised(tmp_path: Path):
    rng = np.random.default_rng(1)
    u = np.tile(rng.standard_normal(1000), 12)
    y = np.convolve(u, [5e-6, 2.5e-6])[: u.size]  # m, as far as an encoder moves
    np.savetxt(tmp_path / "p.csv", np.column_stack([np.arange(u.size) / 1e3, u, y]), delimiter=",", header="t,Va,de",
               comments="")  # fmt: skip
    found = accept("frf", tmp_path / "p.csv", "--json", tmp_path / "p.json")
    (response,) = json.loads((tmp_path / "p.json").read_text())["responses"]
    assert response["estimator"] == "periodic"
    H = np.array(response["H"]["de"]["re"]) + 1j * np.array(response["H"]["de"]["im"])
    f = np.array(response["f_Hz"])
    assert np.allclose(H, 5e-6 + 2.5e-6 * np.exp(-2j * np.pi * f / 1e3), rtol=1e-9, atol=0.0)
    assert "periods" in found.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere.mat"], "no such file"),
        (["{low}", "--input", "Vx"], "no channel 'Vx'"),
        (["{low}", "--merge-Hz", "350"], "joins two records"),
        (["{low}", "{high}", "--merge-Hz", "4000"], "cannot merge at 4000 Hz"),
        (["{low}", "{high}", "--uff", "{out}/x.uff"], "one response, not 2"),
        (["{out}"], "is a folder, expected a file"),
        (["{low}", "--plot", "{out}/x.bmp"], "ends in .pdf, .svg or .png"),
        (["{low}", "--json", "{out}"], "is a folder, expected a file"),
        (["{low}", "--json", "{low}/x.json"], "is a file, expected a folder"),
        (["{low}", "--segment-s", "20"], "segment"),
        (["{low}", "--segment-s", "1e9"], "do not hold two"),  # an array of that length would be asked for
        (["{low}", "--f-lo", "9000"], "no two frequencies"),
    ],
)
def test_bad_input_is_one_clear_line(files, tmp_path: Path, words, said):
    filled = [w.format(low=files[0], high=files[1], out=tmp_path) for w in words]
    found = accept("frf", *filled, code=6)
    assert said in found.stderr
    assert "Traceback" not in found.stderr


def seed_units(folder: Path) -> list[Path]:
    made = []
    for number, k in APAS.items():
        text = GOOD.replace("k_N_per_um = 1.70", f"k_N_per_um = {k}")
        made.append(make_unit(folder / f"{number}", f"APA-{number:02d}", text))
    return made


def test_compare_prints_who_stands_out_and_writes_it(tmp_path: Path):
    seed_units(tmp_path / "units")
    out, plot = tmp_path / "c.json", tmp_path / "c.pdf"
    found = accept("compare", tmp_path / "units", "--spec", "apa-basic", "--json", out, "--plot", plot)
    assert "APA-07 stands out: Stiffness, closed circuit (k_closed_N_per_um)" in found.stdout
    assert found.stdout.count("stands out") == 1
    (written,) = json.loads(out.read_text())["fleets"]
    assert written["outliers"] == {"APA-07": ["k_closed_N_per_um"]}
    (k,) = (c for c in written["compared"] if c["name"] == "k_closed_N_per_um")
    assert [m["serial"] for m in k["members"] if m["outlier"]] == ["APA-07"]
    assert plot.read_bytes()[:4] == b"%PDF"


@pytest.mark.slow
def test_compare_overlays_and_scores_the_responses(tmp_path: Path):
    """Five APAs with records; one is 3 dB stronger, which none of the others comes near."""
    spec = tmp_path / "frf-only.toml"
    spec.write_text(
        'name = "frf-only"\nkind = "apa"\ntitle = "t"\n[checks.frf]\n[checks.frf.limits.axial_resonance_Hz]\n'
        'lower = 88.0\nupper = 102.0\nunit = "Hz"\nrule = "guarded"\nsource = "test"\n'
    )
    rng = np.random.default_rng(6)
    for n in range(5):
        gain = 2.6e-5 * (10 ** (3 / 20) if n == 3 else 1 + 0.002 * rng.standard_normal())
        folder = tmp_path / "units" / str(n)
        folder.mkdir(parents=True)
        for key, record in unit(Plant(static=gain), seed=n, seconds=10.0).items():
            write_mat(folder / f"{key}.mat", {"t": record.t, **record.channels})
        (folder / "unit.toml").write_text(
            f'serial = "T-{n}"\nkind = "apa"\n[frf]\nlow = "low.mat"\nhigh = "high.mat"\nmerge_Hz = 350.0\n'
        )
    out, plot = tmp_path / "c.json", tmp_path / "c.png"
    accept("compare", tmp_path / "units", "--spec", spec, "--json", out, "--plot", plot)
    (written,) = json.loads(out.read_text())["fleets"]
    odd = set(written["outliers"]["T-3"])
    assert {"gain_de_um_per_V", "frf/de magnitude", "frf/da magnitude"} <= odd
    assert "frf/Vs magnitude" not in odd
    assert set(written["outliers"]) == {"T-3"}
    (curve,) = (c for c in written["compared"] if c["name"] == "frf/de magnitude")
    assert curve["members"][3]["value"] == pytest.approx(3.0, abs=0.1)
    assert plot.stat().st_size > 10_000


def test_compare_refuses_one_unit_and_doubled_serials(tmp_path: Path):
    make_unit(tmp_path / "a", "T-01")
    assert "one unit only" in accept("compare", tmp_path, "--spec", "apa-basic", code=6).stderr
    make_unit(tmp_path / "b", "T-01")
    assert "another unit" in accept("compare", tmp_path, "--spec", "apa-basic", code=6).stderr


def test_compare_of_two_says_that_they_are_too_few(tmp_path: Path):
    make_unit(tmp_path / "a", "T-01")
    make_unit(tmp_path / "b", "T-02")
    found = accept("compare", tmp_path, "--spec", "apa-basic")
    assert "2 units of kind apa are too few" in found.stdout
    assert "no apa stands out" not in found.stdout  # nobody can tell


def test_units_in_brackets_stay_on_the_terminal(files):
    """A table's "[percent]" is no markup."""
    found = accept("frf", files[0])
    assert "damping [%]" in found.stdout


@pytest.mark.parametrize(
    ("value", "U", "words"),
    [
        (413.0384, 0.0234, "413.038 ± 0.023"),
        (85.37643, 4.8e-6, "85.3764 ± less than 0.0001"),
        (94.2, 12.0, "94 ± 12"),
        (94.2, math.nan, "94.2"),
    ],
)
def test_a_value_and_its_uncertainty_in_words(value: float, U: float, words: str):
    assert with_U(value, U) == words
