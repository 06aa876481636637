"""Two bands become one response; its pictures show what is known and where they meet."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from checks.picture import Band, Line, Mark
from checks.signals.spectral.bode import MAX_POINTS, bode, thinned
from checks.signals.spectral.frf import Frf, h1
from checks.signals.spectral.lpm import lpm
from checks.signals.spectral.merge import merge

FS = 1000.0


def two_bands(seed: int, n: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
    """Drives (2, n): low-passed and high-passed at 100 Hz."""
    white = np.random.default_rng(seed).standard_normal((2, n))
    return (
        signal.sosfilt(signal.butter(4, 100.0, fs=FS, output="sos"), white[0]),
        signal.sosfilt(signal.butter(4, 100.0, "high", fs=FS, output="sos"), white[1]),
    )


def measured(u: np.ndarray, seed: int) -> dict[str, np.ndarray]:
    """Two outputs: a short filter and a delay, with noise."""
    e = 0.3 * np.random.default_rng(10_000 + seed).standard_normal((2, u.size))
    return {"de": signal.lfilter([1.0], [1.0, -0.5], u) + e[0], "Vs": np.roll(u, 1) + e[1]}


@pytest.fixture(scope="module")
def pair() -> tuple[Frf, Frf]:
    low, high = two_bands(1)
    return h1(low, measured(low, 1), FS, 1000), h1(high, measured(high, 2), FS, 1000)


def test_split_takes_each_side_as_it_is(pair: tuple[Frf, Frf]) -> None:
    low, high = pair
    both = merge(low, high, 100.0)
    below = both.f <= 100.0
    assert (both.f == low.f).all()
    assert (both.H[below] == low.H[below]).all()
    assert (both.H[~below] == high.H[~below]).all()
    assert both.cov[below] == pytest.approx(low.cov[below], rel=1e-12)
    assert both.cov[~below] == pytest.approx(high.cov[~below], rel=1e-12)
    assert (both.coherence[~below] == high.coherence[~below]).all()
    assert both.nu == pytest.approx(low.nu)
    assert both.notes == ("merged at 100 Hz",)
    assert both.stride == 3


def test_bands_that_only_touch(pair: tuple[Frf, Frf]) -> None:
    low, high = pair
    both = merge(low.band(5.0, 120.0), high.band(90.0, 400.0), 100.0)
    assert both.f[[0, -1]] == pytest.approx([5.0, 400.0])
    assert both.usable.all()
    assert (both.H[:96] == low.H[5:101]).all()
    assert (both.H[96:] == high.H[101:401]).all()
    assert (both.nu[:96] == low.nu[5:101]).all()
    assert merge(low.band(5.0, 99.0), high.band(100.0, 400.0), 99.5).usable.all()


def test_what_is_unusable_on_one_side_is_not_taken_from_the_other(pair: tuple[Frf, Frf]) -> None:
    low, high = pair
    cov = low.cov.copy()
    cov[200:, [0, 1], [0, 1]] = np.inf
    blind = replace(low, cov=cov)
    assert merge(blind, high, 199.0).usable.all()
    late = merge(blind, high, 300.0)
    assert not late.usable[200:301].any()
    assert (late.H[200:301] == 0).all()
    assert late.usable[301:].all()


def test_refusals(pair: tuple[Frf, Frf]) -> None:
    low, high = pair
    u = two_bands(1)[1]
    with pytest.raises(ValueError, match="bins are 1 and 2 Hz apart"):
        merge(low, h1(u, measured(u, 2), FS, 500), 100.0)
    with pytest.raises(ValueError, match="channels"):
        merge(low, high.select("Vs", "de"), 100.0)
    with pytest.raises(ValueError, match="estimator h1 and lpm differ"):
        merge(low, lpm(u, measured(u, 2), FS), 100.0)
    with pytest.raises(ValueError, match="cannot merge at 600 Hz"):
        merge(low, high, 600.0)
    with pytest.raises(ValueError, match=r"a gap lies between 5..80 and 90..400 Hz"):
        merge(low.band(5, 80), high.band(90, 400), 85.0)
    with pytest.raises(ValueError, match=r"start at 5 and 90\.5 Hz"):
        merge(low.band(5, 100), replace(high.band(90, 400), f=high.band(90, 400).f + 0.5), 95.0)
    with pytest.raises(ValueError, match="two or more"):
        merge(low.band(5, 5), high, 5.0)


def test_pictures(pair: tuple[Frf, Frf]) -> None:
    both = merge(*pair, 100.0)
    panels = bode(both, {"de": "m/V", "Vs": "V/V"}, merge_Hz=100.0)
    assert list(panels) == ["de magnitude", "de phase", "Vs magnitude", "Vs phase", "coherence"]
    size = panels["de magnitude"]
    assert size.x_log
    assert size.y_log
    assert size.y_label == "magnitude [m/V]"
    band = next(i for i in size.items if isinstance(i, Band))
    (line,) = (i for i in size.items if isinstance(i, Line))
    assert (band.lo > 0).all()
    assert ((band.lo <= line.y) & (line.y <= band.hi)).all()
    assert line.x.min() > 0
    for panel in panels.values():
        assert [i.at for i in panel.items if isinstance(i, Mark)] == [100.0]
    phase = panels["Vs phase"]
    angle = next(i for i in phase.items if isinstance(i, Line))
    # One sample late: -0.36 degrees per Hz; 0.3 of noise at this averaging is at most some degrees.
    inside = (angle.x > 5) & (angle.x < 450)
    assert angle.y[inside] == pytest.approx(-0.36 * angle.x[inside], abs=30)
    coherence = panels["coherence"]
    assert [i.label for i in coherence.items if isinstance(i, Line)] == ["de", "Vs"]


def test_picture_of_nothing_usable_is_empty_and_finite() -> None:
    frf = h1(np.zeros(3000), np.random.default_rng(1).standard_normal(3000), FS, 500)
    panels = bode(frf)
    assert all(i.x.size == 0 for i in panels["y0 magnitude"].items if isinstance(i, Line))


def test_thinning_keeps_the_ends_and_the_spread() -> None:
    f = np.arange(1, 40_001) * 0.05
    at = thinned(f, f > 1.0)
    assert at.size <= MAX_POINTS
    assert f[at[0]] == pytest.approx(1.05)
    assert f[at[-1]] == pytest.approx(2000.0)
    assert np.diff(np.log(f[at])).max() < 0.06
    assert thinned(f[:100], f[:100] > 1.0).size == 80
