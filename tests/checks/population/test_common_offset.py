"""Misalignments of a batch, drawn and measured by a generator of its own (linear and normal, in closed form): what all
units have in common is found with a U that holds, no unit that follows the batch is named, and one that lies off is."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy import stats

from accept.models.model_file import open_model
from checks.arrays import Array
from checks.model import Model
from checks.population import Population
from checks.population import learn as learning
from checks.population.learn import population_of_fits
from checks.population.unit_fits import FittedUnits, UnitFit, UnitOfBatch, alone
from tests.soak import SOAK

DX, DY = "misalignment.dx_um", "misalignment.dy_um"
BATCHES = 60 if SOAK else 12
UNITS = 7
OFF_UM = np.array([80.0, -160.0])
SEEN_UM = np.array([5.0, 1.5])  # 1 sd of an offset by the records of a unit, all else known
NAMED = stats.norm.isf(1e-3 / 4 / 90)  # of a pull, as the gap analysis tests ninety of them
OUTSIDE = 1e-3  # of the band of a sound count


@dataclass(frozen=True, eq=False)
class Drawn:
    """A batch: its offset in common [um], the scatter of its units about it, and what was learned."""

    common: Array
    scatter: Array
    found: Population

    def at(self) -> list[int]:
        return [self.found.names.index(n) for n in (DX, DY)]

    def pull(self, rng: np.random.Generator, away: Array) -> float:
        """The farthest pull of one more unit that lies so far off the batch."""
        i, batch = self.at(), self.found.batch
        seen = self.common + away + self.scatter * rng.standard_normal(2) + SEEN_UM * rng.standard_normal(2)
        variance = np.diag(batch.of_one_more)[i] + SEEN_UM**2
        return float(np.max(np.abs(seen - batch.mean[i]) / np.sqrt(variance)))


def model() -> Model:
    return alone(open_model("strut"))


def steps(items: Sequence[Any], words: str) -> Iterable[Any]:
    return items


def fits(rng: np.random.Generator, common: Array, scatter: Array, off: Sequence[Array]) -> tuple[UnitFit, ...]:
    """Posteriors of units measured by forty readings each, with the priors of the file."""
    m = model()
    names, sds = tuple(m.sds), np.array(list(m.sds.values()))
    prior = np.array([m.values[n] for n in names])
    i = [names.index(n) for n in (DX, DY)]
    J = rng.standard_normal((40, len(names))) / sds
    J[:, i] = rng.standard_normal((40, 2)) / (40**0.5 * SEEN_UM)
    J[:, [k for k in range(len(names)) if k not in i]] *= 0.5
    cov = np.linalg.inv(J.T @ J + np.diag(1.0 / sds**2))
    own = np.where([n.startswith("bench.latency") for n in names], 0.3, 0.7 * sds)
    out = []
    for k, away in enumerate(off):
        truth = prior + own * rng.standard_normal(len(names))
        truth[i] = common + away + scatter * rng.standard_normal(2)
        theta = cov @ (J.T @ (J @ truth + rng.standard_normal(40)) + prior / sds**2)
        unit = UnitOfBatch(f"U-{k}", m, None)  # type: ignore[arg-type]
        out.append(UnitFit(unit, m, names, theta, cov, {"de": 0.5}, True, {"de": 0.5}))
    return tuple(out)


def draw(seed: int, common: Sequence[float], scatter: Sequence[float], strays: int = 0) -> Drawn:
    rng = np.random.default_rng(seed)
    off = [OFF_UM * rng.choice([-1.0, 1.0], 2) if k < strays else np.zeros(2) for k in range(UNITS)]
    units = fits(rng, np.array(common), np.array(scatter), off)
    return Drawn(
        np.array(common), np.array(scatter), population_of_fits(FittedUnits(units, None, None), model(), steps)
    )


@pytest.fixture(autouse=True)
def _nothing_is_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(learning, "predicted_gaps", lambda *_: {})


@pytest.mark.parametrize("common", [(0.0, 0.0), (-39.0, 61.0)])
@pytest.mark.parametrize("scatter", [(0.0, 0.0), (3.0, 8.0), (10.0, 30.0)])
def test_what_units_have_in_common_is_found_and_names_none(
    common: tuple[float, float], scatter: tuple[float, float]
) -> None:
    """Units by finite elements were each "misaligned by (-39, 61) um" by a model that seven others had taught."""
    rng = np.random.default_rng(11)
    inside, false = [], 0
    for seed in range(BATCHES):
        batch = draw(seed, common, scatter)
        mean, sd = batch.found.batch.mean, np.sqrt(np.diag(batch.found.batch.mean_cov))
        inside += [abs(mean[i] - c) <= 2.0 * sd[i] for i, c in zip(batch.at(), common, strict=True)]
        false += batch.pull(rng, np.zeros(2)) > NAMED
        assert batch.found.holds
    assert sum(inside) >= stats.binom.ppf(OUTSIDE, len(inside), 0.9545)
    assert false == 0


@pytest.mark.parametrize("common", [(0.0, 0.0), (-39.0, 61.0)])
def test_one_misaligned_unit_of_seven_moves_nothing_and_one_more_is_seen(common: tuple[float, float]) -> None:
    """The median over the batches of what a stray does to the scatter; a unit as far off is seen in nine of ten."""
    rng = np.random.default_rng(12)
    seen, wider = 0, []
    for seed in range(BATCHES):
        sound, stray = draw(seed, common, (3.0, 8.0)), draw(seed, common, (3.0, 8.0), strays=1)
        i, sd = stray.at(), np.sqrt(np.diag(stray.found.batch.mean_cov))
        assert (np.abs(stray.found.batch.mean - sound.found.batch.mean)[i] < 2.0 * sd[i]).all()
        assert "U-0" in [j.serial for j in stray.found.judged if j.belongs]  # misaligned, of the same make
        wider.append(stray.found.batch.scatter[i] / sound.found.batch.scatter[i])
        seen += stray.pull(rng, OFF_UM) > NAMED
        assert stray.pull(rng, np.zeros(2)) < NAMED
    assert (np.median(wider, axis=0) < 4.0).all()
    assert seen >= 0.9 * BATCHES
