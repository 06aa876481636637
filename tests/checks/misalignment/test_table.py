"""The table of the misalignment: what it holds, what a query says, and that only the model's own table is used."""

import multiprocessing
import os
import signal
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from accept.cli.main import app
from accept.models.lookup_cache import Plan, TableError, build, open_table, read_table, table_for, write_table
from accept.models.model_file import open_model
from checks.acceptance.misalignment import _coarse_table
from checks.errors import ModelError
from checks.fitting.dataset import simulated
from checks.misalignment.estimate import estimate_misalignment
from checks.misalignment.table import Likelihood, MisalignmentTable, grid, table_frequencies, table_limits_um
from checks.model import Model
from tests.checks.misalignment.misaligned import CHANNELS, F, draw, noise_m_per_V, table_of
from tests.checks.model.units_model import NOMINAL

quiet = list[str]


@pytest.fixture(scope="module")
def strut() -> Model:
    """With real modes: a table takes a third of the time."""
    return replace(open_model("strut"), damping="modal")


@pytest.fixture(scope="module")
def table(strut: Model) -> MisalignmentTable:
    return table_of(strut)


@pytest.fixture(autouse=True)
def own_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def test_units_that_are_judged_by_one_model_share_its_coarse_table(strut: Model) -> None:
    assert _coarse_table(strut) is _coarse_table(strut)
    assert _coarse_table(strut) is not _coarse_table(replace(strut, name="another"))


def plain(strut: Model, dx: float, dy: float):
    """Responses of the nominal strut without noise to speak of."""
    H = strut.frf(F, {"misalignment.dx_um": dx, "misalignment.dy_um": dy}, CHANNELS)
    return simulated(F, H, CHANNELS, (1e-15 * np.eye(2) * np.ones((F.size, 1, 1))).astype(complex), rng(0))


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_a_row_is_the_models_own_ratio(strut: Model, table: MisalignmentTable) -> None:
    x, y = 7, 13
    at = {"misalignment.dx_um": table.dx[x], "misalignment.dy_um": table.dy[y]}
    H = strut.frf(table.f, at, CHANNELS)
    # single precision keeps 6e-8 of the largest; a sharp zero loses a few digits of that
    assert np.abs(table.R[x, y] / (H[:, 0] / H[:, 1]) - 1).max() < 1e-5
    assert table.dx[20] == 200.0
    assert table.dy[0] == -600.0


def test_gain_and_delay_of_the_drive_drop_out(strut: Model, table: MisalignmentTable) -> None:
    late = strut.with_values({"delay.tau_us": 300.0, "amplifier.f_Hz": 1500.0, "constants.ga_N_per_V": -20.0})
    assert np.allclose(MisalignmentTable.row(late, 0.0, np.array([0.0]), table.f)[0], table.R[10, 10], rtol=1e-5)


def test_dz_hardly_shows(strut: Model) -> None:
    """Seed 6.2: 200 um along z change the ratio by less than a twentieth of what they do along y, as a median."""
    f = table_frequencies()
    H = {n: strut.frf(f, {n: 200.0}, CHANNELS) for n in ("misalignment.dz_um", "misalignment.dy_um")}
    straight = MisalignmentTable.row(strut, 0.0, np.array([0.0]), f)[0]
    dz, dy = (np.median(np.abs(h[:, 0] / h[:, 1] / straight - 1)) for h in H.values())
    assert dz < dy / 20


@pytest.mark.parametrize(("dx", "dy"), [(0.0, 0.0), (-120.0, 480.0), (60.0, -60.0), (180.0, 540.0)])
def test_a_place_of_the_grid_is_found(strut: Model, table: MisalignmentTable, dx: float, dy: float) -> None:
    assert table.query(plain(strut, dx, dy)).minima(1) == [(dx, dy)]


def test_the_misfit_is_the_weighted_square(
    strut: Model, table: MisalignmentTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The quadratic form on the basis against the sum over bins, at places where the misfit is small and large."""
    monkeypatch.setattr("checks.misalignment.table.SHIFTS", (0.0,))
    data = plain(strut, 60.0, -60.0)
    found = table.query(data).misfit
    bins = data.band(table.f[0], table.f[-1]).thinned(150)
    de, da = bins.H.T
    for x, y in ((0, 0), (12, 10), (20, 20), (10, 3)):
        R = np.interp(np.log(bins.f), np.log(table.f), table.R[x, y])
        direct = np.sum(np.abs(de - R * da) ** 2 / (0.04 * np.abs(de) ** 2 + 0.0025 * np.abs(da) ** 2))
        assert found[x, y] == pytest.approx(direct, rel=0.1, abs=1.0)  # the basis leaves out the smallest shapes


@pytest.mark.parametrize("seed", range(6))
def test_a_drawn_strut_is_found_within_a_basin(strut: Model, table: MisalignmentTable, seed: int) -> None:
    """Other masses, stiffnesses and damping than the table's: within two steps of the check's own, coarser scan."""
    drawn = draw(strut, seed)
    dx, dy = table.query(drawn.first).minima(1)[0]
    assert abs(dx - drawn.dx) <= 100.0
    assert abs(dy - drawn.dy) <= 100.0


def test_minima_come_lowest_first() -> None:
    misfit = np.full((5, 5), 9.0)
    misfit[1, 1], misfit[3, 4], misfit[4, 0] = 2.0, 1.0, 3.0
    found = Likelihood(np.arange(5.0), np.arange(5.0), misfit).minima(2)
    assert found == [(3.0, 4.0), (1.0, 1.0)]


def test_data_elsewhere_are_refused(strut: Model, table: MisalignmentTable) -> None:
    with pytest.raises(ModelError, match="no bin of"):
        table.query(plain(strut, 0.0, 0.0).band(10.0, 60.0))


@pytest.mark.parametrize("size", [(2, 41), (41, 0)])
def test_a_grid_needs_three_by_three(strut: Model, size: tuple[int, int]) -> None:
    with pytest.raises(ModelError, match=f"{size[0]} x {size[1]}"):
        grid(strut, *size)


@pytest.mark.parametrize("name", ["strut", "strut-as-built", "strut-2dof"])
def test_the_limits_of_the_built_in_actuator(name: str) -> None:
    """To the last digit: stored tables and answers of the APA300ML stay what they were."""
    dx, dy = grid(open_model(name), 41, 41)
    np.testing.assert_array_equal(dx, np.linspace(-200.0, 200.0, 41))
    np.testing.assert_array_equal(dy, np.linspace(-600.0, 600.0, 41))


@pytest.mark.takes_data
def test_the_limits_of_the_published_matrices() -> None:
    assert table_limits_um(open_model(NOMINAL)) == (200.0, 600.0)


def taller(tmp_path: Path) -> Model:
    """A strut whose actuator is twice as high: what is misaligned there is so by twice as much."""
    text = (Path(__file__).parents[3] / "specs/models/strut.toml").read_text()
    geometry = "[apa.geometry]\nheight = 0.06\narm_foot_z = 0.0277\n"
    (tmp_path / "tall.toml").write_text(text.replace("[joint]", f"{geometry}\n[joint]", 1))
    return open_model(tmp_path / "tall.toml")


def test_the_limits_follow_the_actuator(tmp_path: Path) -> None:
    """Red before: 200 and 600 um of any actuator, so 900 um of one that is twice as high was refused at the edge."""
    tall = taller(tmp_path)
    assert table_limits_um(tall) == (400.0, 1200.0)
    data = plain(tall, 300.0, -900.0)
    found = estimate_misalignment(tall, data, table_of(tall, 9, 9))
    assert found.reason is None
    assert found.dx.value == pytest.approx(300.0, abs=found.dx.U)
    assert found.dy.value == pytest.approx(-900.0, abs=found.dy.U)


def test_a_model_without_encoder_has_no_table() -> None:
    with pytest.raises(ModelError, match="strut has no encoder"):
        Plan.of(open_model("strut").without_encoder())


# on disk


def test_stored_whole_and_read_again(strut: Model) -> None:
    words: quiet = []
    made = table_for(strut, words.append, 5, 7)
    assert "computing its table" in words[0]
    plan = Plan.of(strut, 5, 7)
    again = read_table(plan)
    assert np.array_equal(made.R, again.R)
    assert not plan.rows.exists()
    words.clear()
    assert np.array_equal(table_for(strut, words.append, 5, 7).R, made.R)
    assert not words


def test_two_processes_give_the_same_table(strut: Model) -> None:
    one = build(Plan.of(strut, 17, 3), quiet().append, 1)
    two = build(Plan.of(strut, 17, 3), quiet().append, 2)
    assert np.allclose(one.R, two.R, rtol=1e-5)


def test_another_models_table_is_refused(strut: Model) -> None:
    plan = Plan.of(strut, 3, 3)
    build(plan, quiet().append)
    other = Plan.of(strut.with_values({"joint.kz_N_per_um": 91.0}), 3, 3)
    assert other.path != plan.path
    with pytest.raises(TableError, match="not of strut as it is now"):
        read_table(other, plan.path)


def test_a_stale_table_is_refused_and_built_anew(strut: Model) -> None:
    """As after a change of the program: the hash of the model is the same, the ratios are not."""
    plan = Plan.of(strut, 3, 3)
    old = build(plan, quiet().append)
    write_table(plan.path, replace(old, R=old.R * np.float32(1.01)))
    with pytest.raises(TableError, match="stale"):
        read_table(plan)
    words: quiet = []
    assert np.allclose(table_for(strut, words.append, 3, 3).R, old.R, rtol=1e-5)
    assert "rebuilding the table" in words[0]


@pytest.mark.parametrize("place", [100, 50_000, -2000])
def test_a_flipped_byte_is_found(strut: Model, place: int) -> None:
    plan = Plan.of(strut, 3, 3)
    build(plan, quiet().append)
    content = bytearray(plan.path.read_bytes())
    content[place] ^= 0x40
    plan.path.write_bytes(content)
    with pytest.raises(TableError):
        read_table(plan)


def test_a_cut_file_is_found(strut: Model) -> None:
    plan = Plan.of(strut, 3, 3)
    build(plan, quiet().append)
    plan.path.write_bytes(plan.path.read_bytes()[:5000])
    with pytest.raises(TableError, match="cannot be read as a table"):
        open_table(plan.path)


def _build_long(plan: Plan) -> None:
    build(plan, quiet().append, 1)


def test_a_killed_build_goes_on(strut: Model) -> None:
    plan = Plan.of(strut, 16, 13)
    process = multiprocessing.get_context("spawn").Process(target=_build_long, args=(plan,))
    process.start()
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and len(list(plan.rows.glob("row_*.npz"))) < 3:
        time.sleep(0.01)
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    assert not plan.path.exists()
    left = len(list(plan.rows.glob("row_*.npz")))
    assert left >= 3
    (plan.rows / "row_001.npz").write_bytes(b"half of it")
    words: quiet = []
    table = build(plan, words.append, 1)
    assert f"{left - 1} of 16 rows are there, going on" in words[0]
    assert np.allclose(
        table.R[1, 5], MisalignmentTable.row(strut, float(plan.dx[1]), plan.dy[5:6], plan.f)[0], rtol=1e-5
    )


def test_the_commands() -> None:
    run = CliRunner().invoke
    assert run(app, ["lookup", "info", "--model", "strut"]).exit_code == 4
    made = run(app, ["lookup", "build", "--model", "strut", "--nx", "3", "--ny", "3"])
    assert made.exit_code == 0
    assert "strut-" in made.stdout
    assert "dz = 200 um" in made.stdout
    assert "there already" in run(app, ["lookup", "build", "--model", "strut", "--nx", "3", "--ny", "3"]).stdout
    known = run(app, ["lookup", "info", "--model", "strut"])
    assert known.exit_code == 0
    assert "yes" in known.stdout
    assert run(app, ["lookup", "build", "--model", "nowhere"]).exit_code == 6
    assert run(app, ["lookup", "build", "--model", "apa-frame", "--nx", "3", "--ny", "3"]).exit_code in (0, 6)


def test_noise_is_as_recorded() -> None:
    assert 5e-9 < noise_m_per_V(np.array([100.0]))[0] < 1e-8
