"""`accept frf --hammer`, `accept.hammer_response` and the check of spurious modes: one estimator, one answer."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import accept
from checks.acceptance import CHECKS
from checks.errors import RecordError
from checks.record import Record
from hw.records import read
from specs.spec import CheckSpec
from tests.checks.signals.hammer_plant import FS, Struck, clean, noisy
from tests.shared import command_line
from tests.shared.record_files import write_mat

run = partial(command_line.accept, code=0, columns=200)
TWO = ((280.0, 0.008, 1e-6), (840.0, 0.008, 1.2e-7))
HITS = tuple((0.5 + 1.2 * k, 70.0 + 9.0 * (k % 3)) for k in range(6))


def write(path: Path, seed: int, hits: tuple = HITS, names: tuple[str, str] = ("Track1", "Track2")) -> Path:
    force, y = noisy(clean(Struck(TWO, hits)), np.random.default_rng(seed), rotation=1e-7)
    write_mat(path, {names[0]: force, names[1]: y, "Track1_X_Resolution": np.array([1 / FS])})
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("hits")
    again = tuple(sorted((*HITS, (HITS[2][0] + 0.05, 30.0))))
    return [write(folder / "one.mat", 1), write(folder / "two.mat", 2, again)]


def test_hits_of_several_records_as_json_and_pictures(files: list[Path], tmp_path: Path) -> None:
    out = {kind: tmp_path / f"h.{kind}" for kind in ("json", "pdf", "uff")}
    found = run("frf", "--hammer", *files, "--json", out["json"], "--plot", out["pdf"], "--uff", out["uff"])
    assert "double hit at 2.90 s" in found.stderr
    (response,) = json.loads(out["json"].read_text())["responses"]
    assert response["estimator"] == "hammer h1"
    assert response["segments"] == 11
    assert response["added_decay_per_s"] == 0.0
    assert [i["file"] for i in response["impacts"] if not i["good"]] == ["two.mat"]
    assert len(response["impacts"]) == 12
    for mode, (f, damping, _) in zip(response["modes"], TWO, strict=True):
        # One clock made and samples the record, so its U is not needed; 4 u of scatter is one in 16,000.
        assert abs(mode["f_Hz"] - f) < 2.0 * mode["U_Hz"]
        assert abs(mode["damping_ratio"] - damping) < 2.0 * mode["U_damping"]
    assert out["pdf"].read_bytes()[:4] == b"%PDF"
    assert out["uff"].stat().st_size > 10_000


def test_check_command_and_function_give_one_answer(files: list[Path], tmp_path: Path) -> None:
    run("frf", "--hammer", files[0], "--json", tmp_path / "h.json")
    (response,) = json.loads((tmp_path / "h.json").read_text())["responses"]
    struck = accept.hammer_response(files[0])
    record = accept.read_record(files[0], "Track1")
    check = CHECKS["spurious_modes"]
    judged = {q.name: q for q in check.measure({"x_bending": record}, CheckSpec(required=False)).quantities}
    mode = struck.modes["Track2"][0]
    assert response["modes"][0]["f_Hz"] == mode.f_Hz == judged["x_bending_Hz"].value
    assert 100 * mode.damping_ratio == judged["x_bending_damping_percent"].value
    assert 100 * mode.U_damping == pytest.approx(judged["x_bending_damping_percent"].U)


def test_the_response_of_hits_goes_where_any_response_goes(files: list[Path]) -> None:
    struck = accept.hammer_response(*files, estimator="hv", f_hi=1500.0)
    assert struck.frf.f[-1] <= 1500.0
    assert struck.to_pandas()["Track2", "coherence"].max() > 0.99
    assert {"Track2 magnitude", "coherence", "impacts of two.mat"} <= set(accept.plot(struck).panels)
    assert [i.fault for i in struck.impacts["two.mat"]].count(None) == 5
    assert len(repr(struck)) < 300
    assert "11 of 12 impacts good" in repr(struck)
    with pytest.raises(accept.AcceptError, match="a model answers to Va"):
        accept.fit_model(struck, "strut-2dof")


@pytest.mark.parametrize("estimator", ["auto", "h1", "lpm"])
def test_a_hammer_given_as_a_lasting_drive_is_recognised(files: list[Path], estimator: str) -> None:
    """Averaged segments of one hit gave modes that are not there, local polynomials 0.15 of the true size."""
    found = run("frf", files[0], "--input", "Track1", "--estimator", estimator, code=6)
    assert "looks like a hammer: use --hammer" in found.stderr
    with pytest.raises(accept.AcceptError, match=r"accept\.hammer_response"):
        accept.frequency_response(files[0], input="Track1", estimator=estimator)


def test_what_is_no_hammer_test_is_refused(files: list[Path], tmp_path: Path) -> None:
    single = write(tmp_path / "single.mat", 5, HITS[:1])
    other = write(tmp_path / "other.mat", 6, names=("Track1", "Track3"))
    rng = np.random.default_rng(1)
    noise = {"Track1": rng.standard_normal(20_000), "Track2": rng.standard_normal(20_000)}
    write_mat(tmp_path / "noise.mat", {**noise, "Track1_X_Resolution": np.array([1 / FS])})
    for words, said in (
        ([single], "1 of 1 impacts good: two good hits are needed"),
        ([files[0], other], "'Track2' is not in every record"),
        ([files[0], "--estimator", "lpm"], "expected one of h1, h2, hv"),
        ([files[0], files[1], "--merge-Hz", 300], "--merge-Hz joins records of different drives"),
        ([files[0], "--input", "force"], "force"),
        ([files[0], "--force-range-N", 10], "overload"),
        ([tmp_path / "noise.mat"], "0 of 0 impacts good"),
    ):
        found = run("frf", "--hammer", *words, code=6)
        assert said in found.stderr, words
    assert "add --hammer" in run("frf", files[0], "--input", "Track1", "--estimator", "hv", code=6).stderr


def test_one_hit_in_each_of_several_records(tmp_path: Path) -> None:
    """As an analyser with a trigger stores them: one file per hit."""
    files = [write(tmp_path / f"{k}.mat", k, ((0.2, 70.0 + 5 * k),)) for k in range(4)]
    struck = accept.hammer_response(*files)
    assert struck.frf.segments == 4
    assert struck.modes["Track2"][0].f_Hz == pytest.approx(280.0, abs=0.02)


def test_as_good_as_a_maintained_library_on_the_same_records() -> None:
    """Poles of 20 simulated tests of six hits, noise of 2e-7 rad on the rotation.

    sdypy-EMA 0.31.0 (`Model(frf, freq, lower=60, upper=1200, pol_order_high=20)`, poles closest to the truth at order
    20), on the H1 of the same hits, once, by hand: rms error of the first mode 0.0079 Hz and 0.0025 % of damping, of
    the second 0.151 Hz and 0.0198 %. Here: 0.0009 Hz, 0.0003 %, 0.024 Hz, 0.0013 %, with U of 0.0019 Hz and 0.0007 %,
    0.048 Hz and 0.0055 %; that library gives none."""
    errors = []
    base = clean(Struck(TWO, HITS))
    for seed in range(20):
        force, y = noisy(base, np.random.default_rng([21, seed]), rotation=2e-7)
        t = np.arange(force.size) / FS
        record = Record(t, {"Track1": force, "Track2": y}, {"Track1": "N", "Track2": "rad"})
        modes = accept.hammer_response(record, f_lo=60.0).modes["Track2"]
        found = [min(modes, key=lambda m, f=f: abs(m.f_Hz - f)) for f, _, _ in TWO]
        errors.append([x for m, (f, d, _) in zip(found, TWO, strict=True) for x in (m.f_Hz - f, m.damping_ratio - d)])
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert (rms < [0.0079, 2.5e-5, 0.151, 1.98e-4]).all()


def analyser(path: Path, start: float, channels: int = 3, seed: int = 1) -> Path:
    """A file as an analyser with a trigger stores one hit: every variable a pair [axis, value], X time records from
    10 ms before the hit on, beside spectra, a response and a coherence. Channel k answers k times as much."""
    n = 4096
    hit = Struck(TWO, ((start, 70.0),))
    force, y = noisy(clean(hit), np.random.default_rng(seed), rotation=1e-7)
    first = round((start - 0.01) * FS)
    t = -0.01 + np.arange(n) / FS
    tracks = [force[first : first + n], *((k + 1) * y[first : first + n] for k in range(channels - 1))]
    f = np.arange(1601) * 0.125
    content: dict = {"ChanNum": np.arange(1, channels + 1)[:, None], "Unit": np.array(["N", *["g"] * (channels - 1)])}
    for k, x in enumerate(tracks, start=1):
        content |= {
            f"X{k}": np.c_[t, x],
            f"W{k}": np.c_[t, 0.5 * x],
            f"S{k}": np.c_[f, f + 1j],
            f"G{k}_{k}": np.c_[f, f],
        }
        content |= {f"H1_{k}": np.c_[f, f + 2j], f"C1_{k}": np.c_[f, 0.5 + 0 * f]} if k > 1 else {}
    savemat(path, content)
    return path


@pytest.mark.parametrize("channels", [2, 5])
def test_hits_that_an_analyser_stored_with_its_pretrigger(channels: int, tmp_path: Path) -> None:
    """The force is found by its unit; the time of each pair counts, so that a file's own step is used."""
    files = [analyser(tmp_path / f"{k}.mat", 0.5, channels, seed=k) for k in range(3)]
    found = run("frf", "--hammer", *files, "--json", tmp_path / "h.json")
    assert "Track1 from 'X1'" in found.stderr
    assert "X2 stays in g" in found.stderr
    (response,) = json.loads((tmp_path / "h.json").read_text())["responses"]
    assert [(i["good"], round(i["time_s"], 2)) for i in response["impacts"]] == [(True, 0.0)] * 3
    assert list(response["H"]) == [f"X{k}" for k in range(2, channels + 1)]
    assert response["units"]["X2"] == "g"
    mode = next(m for m in response["modes"] if m["channel"] == "X2")
    assert abs(mode["f_Hz"] - TWO[0][0]) < 2.0 * mode["U_Hz"]  # 4 u of scatter: one in 16,000


def test_a_force_that_pulls_is_said(files: list[Path], tmp_path: Path) -> None:
    force, y = noisy(clean(Struck(TWO, HITS)), np.random.default_rng(1), rotation=1e-7)
    write_mat(tmp_path / "n.mat", {"Track1": -force, "Track2": y, "Track1_X_Resolution": np.array([1 / FS])})
    said = run("frf", "--hammer", tmp_path / "n.mat").stderr
    assert "the hits are negative in Track1; its sign is turned" in said
    assert "negative" not in run("frf", "--hammer", files[0]).stderr


def hits_in(path: Path, header: str, scale: tuple[float, float]) -> Path:
    force, y = noisy(clean(Struck(TWO, HITS)), np.random.default_rng(1), rotation=1e-7)
    table = np.c_[np.arange(force.size) / FS, scale[0] * force, scale[1] * y]
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.9g")
    return path


@pytest.mark.parametrize(
    ("header", "scale", "words"),
    [
        ("t,force [N],acc [mm]", (1.0, 1e3), None),
        ("t,force [N],acc", (1.0, 1.0), "acc states no unit, in a.csv m"),
        ("t,force [lbf],acc [m]", (1 / 4.448, 1.0), "force states lbf, in a.csv N"),
    ],
)
def test_hits_of_other_units(header: str, scale: tuple[float, float], words: str | None, tmp_path: Path) -> None:
    """Converted if both files state a unit that is known, else refused: the mean of both would be no response."""
    pair = hits_in(tmp_path / "a.csv", "t,force [N],acc [m]", (1.0, 1.0)), hits_in(tmp_path / "b.csv", header, scale)
    if words is None:
        both, one = (accept.hammer_response(*each, input="force") for each in (pair, (pair[0], pair[0])))
        np.testing.assert_allclose(both.frf.H, one.frf.H, rtol=1e-6)  # nine digits in the file
        return
    with pytest.raises(RecordError, match=words):
        accept.hammer_response(*pair, input="force")


def test_a_record_that_is_too_slow_for_hits_is_refused_in_words(tmp_path: Path) -> None:
    for header, words in (("t", "is the time in ms"), ("t [s]", "too slow for hits")):
        n = 12_000
        force = np.where(np.arange(n) % 2000 == 900, 50.0, 0.0) + 0.01 * np.sin(np.arange(n))
        table = np.c_[np.arange(n) / 4.0, force, np.roll(force, 1)]
        np.savetxt(tmp_path / "s.csv", table, delimiter=",", header=f"{header},force,acc", comments="")
        with pytest.raises(RecordError, match=words):
            accept.hammer_response(tmp_path / "s.csv", input="force")


def test_two_sampling_times_of_the_tracks_are_refused(tmp_path: Path) -> None:
    force, y = noisy(clean(Struck(TWO, HITS)), np.random.default_rng(1), rotation=1e-7)
    steps = {"Track1_X_Resolution": np.array([1 / FS]), "Track2_X_Resolution": np.array([2 / FS])}
    write_mat(tmp_path / "r.mat", {"Track1": force, "Track2": y, **steps})
    with pytest.raises(RecordError, match=r"'Track2'.* by 'Track2_X_Resolution' and .* by 'Track1_X_Resolution'"):
        accept.hammer_response(tmp_path / "r.mat")
    with pytest.raises(RecordError, match="by 'Track2_X_Resolution'"):
        read(tmp_path / "r.mat", CHECKS["spurious_modes"].inputs["x_bending"])
