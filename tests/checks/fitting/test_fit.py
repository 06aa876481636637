"""Fits: what is simulated is recovered, intervals hold what they promise, recorded struts give their parameters."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from accept.models.model_file import open_model
from checks.declare import Series
from checks.errors import ModelError, NotHeld
from checks.fitting.calibrate import calibrate
from checks.fitting.coordinates import Coordinates, Free
from checks.fitting.dataset import Dataset, simulated
from checks.fitting.fit import Fit, FitPoint, coarse_fits, finish, fit, free_of
from checks.fitting.goodness import gaps
from checks.fitting.response import Channels, Response, Values
from checks.gap import with_effects
from hw.records import read
from tests.checks.fitting.function_response import FunctionResponse
from tests.checks.model.units_model import nominal_model, true_values
from tests.shared.recorded_units import RecordedUnits
from tests.soak import SOAK

REPEATS = 1000 if SOAK else 40
BAND = stats.binom.interval(0.999, REPEATS, 0.95)
F = np.arange(10.0, 400.0, 3.0)


def drawn(free: list[Free], rng: np.random.Generator) -> dict[str, float]:
    """Parameters from their priors, within their bounds."""
    while True:
        values = {p.name: float(rng.normal(p.prior, p.sd)) for p in free}
        if all(p.lo <= values[p.name] <= p.hi for p in free):
            return values


def noise_of(H: np.ndarray, relative: float) -> np.ndarray:
    """(F, C, C) flat noise, a part of the median of H (F, C), alike in the channels."""
    sd = relative * np.median(np.abs(H), axis=0)
    mixed = np.eye(sd.size) + 0.4 * (np.ones((sd.size, sd.size)) - np.eye(sd.size))
    return np.tile(mixed * np.outer(sd, sd), (len(H), 1, 1)).astype(complex)


def covered(fits: list[tuple[Fit, dict[str, float]]]) -> dict[str, int]:
    names = fits[0][0].names
    inside = dict.fromkeys(names, 0)
    for found, truth in fits:
        for n in names:
            lo, hi = found.interval(n)
            inside[n] += lo <= truth[n] <= hi
    return inside


def two_peaks(v: dict[str, float], f: np.ndarray, channels: tuple[str, ...]) -> np.ndarray:
    """(F, 3) of a unit in little: a stiffness, two masses behind it, two dampings, two constants."""
    s = 2j * np.pi * f
    inner = v["m2"] * s * s * (v["k2"] + v["c"] * s) / (v["m2"] * s * s + v["c"] * s + v["k2"])
    x = v["ga"] / (v["m1"] * s * s + v["c"] * s + v["k1"] + inner)
    return np.array([v["gs"] * (x * v["k1"] + v["ga"]), x, x * (1 + v["m2"] * s * s / v["k2"])]).T


LITTLE = [
    Free("k1", 1.8e6, 2e5, lo=0.0),
    Free("k2", 4e5, 4e4, lo=0.0),
    Free("m1", 5.7, 0.06, lo=0.0),
    Free("m2", 0.6, 0.06, lo=0.0),
    Free("c", 30.0, 8.0, lo=0.0),
    Free("ga", -32.2, 3.0),
    Free("gs", 0.088, 0.01),
]
PEAKS = FunctionResponse(two_peaks, {p.name: 1e-5 * abs(p.prior) for p in LITTLE})
CHANNELS = ("Vs", "de", "da")


def repeats(count: int, tolerance: float, error: str, seed: int, told: bool = True) -> list[tuple[Fit, dict]]:
    """Fits to data with all parameters drawn, noise, and a model error of one scale, which the fit is told of or not.
    In full on the model of an APA, else on two masses."""
    rng = np.random.default_rng(seed)
    response: Response = open_model("apa-2dof") if SOAK else PEAKS
    free = free_of(open_model("apa-2dof")) if SOAK else LITTLE
    out = []
    for _ in range(count):
        truth = drawn(free, rng)
        H = response.frf(F, truth, CHANNELS)
        data = simulated(F, H * (1 + wrong_by(error, tolerance, rng)), CHANNELS, noise_of(H, 0.01), rng)
        out.append((fit(response, replace(data, tolerance=tolerance if told else 0.0), free), truth))
    return out


def wrong_by(scale: str, tolerance: float, rng: np.random.Generator) -> np.ndarray:
    """(F, 3) relative model error, anywhere within |d| <= tolerance, smooth over a range of frequencies."""
    if scale == "none":
        return np.zeros((F.size, 3))
    octaves = {"gain": 100.0, "octave": 1.0, "third": 1 / 3, "mode": 0.03}[scale]
    x = np.log2(F / F[0])
    knots = np.arange(-rng.uniform() * octaves, x[-1] + 2 * octaves, octaves)
    d = np.sqrt(rng.uniform(size=(knots.size, 3))) * np.exp(2j * np.pi * rng.uniform(size=(knots.size, 3)))
    if scale == "gain":
        return np.tile(tolerance * d[:1], (F.size, 1))
    return tolerance * np.array([np.interp(x, knots, d[:, c]) for c in range(3)]).T


@pytest.mark.slow
def test_intervals_cover_as_they_say_with_noise_alone() -> None:
    inside = covered(repeats(REPEATS, 0.0, "none", seed=11))
    assert all(BAND[0] <= n <= BAND[1] for n in inside.values()), inside


@pytest.mark.parametrize("error", ["none", "gain", "octave", "mode"])
def test_intervals_hold_for_a_model_that_is_a_little_wrong(error: str) -> None:
    """Exact, or one percent off over any range of frequencies: never less than promised; more is allowed."""
    count = 400 if SOAK else 40
    lowest = stats.binom.ppf(0.0005, count, 0.95)
    inside = covered(repeats(count, 0.01, error, seed=12))
    assert all(n >= lowest for n in inside.values()), inside


def test_intervals_without_the_tolerance_would_not_hold() -> None:
    """The same error, kept from the fit: the test above can fail."""
    assert min(covered(repeats(40, 0.05, "octave", seed=13, told=False)).values()) < 30


@pytest.mark.parametrize("seed", range(20 if SOAK else 2))
def test_the_strut_is_recovered(seed: int) -> None:
    model, rng = open_model("strut"), np.random.default_rng(100 + seed)
    free, f = free_of(model), np.geomspace(10.0, 1200.0, 400)
    true = drawn(free, rng)
    H = model.frf(f, true)
    data = simulated(f, H, model.channels, noise_of(H, 0.003), rng)
    found = fit(model, data, free)
    assert found.converged
    off = np.array([(true[p.name] - p.prior) / p.sd for p in free])
    at_truth = 0.5 * (np.sum(data.whitener(data.H - H) ** 2) + off @ off)
    # twice the gain in likelihood over the truth is chi-square of as many as are free; below 0 never
    assert 0.0 <= 2 * (at_truth - found.cost) < stats.chi2.isf(1e-4, len(free))
    assert all(gap.p > 1e-4 for gap in found.gaps.values())


def test_the_covariance_is_absolute() -> None:
    """Data twice as noisy as they say give G = 4 and the same intervals: missing physics must not hide in them."""
    H = PEAKS.frf(F, {p.name: p.prior for p in LITTLE}, CHANNELS)
    cov = noise_of(H, 0.01)
    sizes = []
    for factor in (1.0, 2.0):
        data = simulated(F, H, CHANNELS, factor**2 * cov, np.random.default_rng(3))
        found = fit(PEAKS, replace(data, cov=cov), LITTLE)
        sizes.append(np.sqrt(np.diag(found.cov)))
        assert np.mean([g.G for g in found.gaps.values()]) == pytest.approx(factor**2, rel=0.15)  # 3 x 130 bins: 5 %
    np.testing.assert_allclose(sizes[0], sizes[1], rtol=0.05)  # the derivatives are those at the fitted values


def test_what_the_data_do_not_tell_keeps_its_prior() -> None:
    model = open_model("apa-2dof")
    data = simulated(F, model.frf(F), model.channels, noise_of(model.frf(F), 0.01), np.random.default_rng(0))
    low = data.band(10.0, 20.0).select(["da"])
    found = fit(model, low, free_of(model))
    assert found.sds["bench.payload_kg"] == pytest.approx(model.sds["bench.payload_kg"], rel=0.05)
    assert found.sds["constants.gs_V_per_N"] == pytest.approx(model.sds["constants.gs_V_per_N"], rel=1e-6)
    assert found.at["constants.gs_V_per_N"] == pytest.approx(model.values["constants.gs_V_per_N"], rel=1e-6)


def peak(values: dict[str, float], f: np.ndarray, channels: tuple[str, ...]) -> np.ndarray:
    x = 1j * f / values["f0"]
    return np.array([1 / (1 + 0.02 * x + x * x)] * len(channels)).T * values["gain"]


def plain_data(values: dict[str, float], sigma: float = 1e-3) -> Dataset:
    f = np.linspace(20.0, 300.0, 400)
    cov = np.tile(np.eye(1) * sigma**2, (f.size, 1, 1)).astype(complex)
    return simulated(f, peak(values, f, ("y",)), ("y",), cov, np.random.default_rng(1))


def test_any_function_can_be_fitted_and_a_far_peak_is_found() -> None:
    """The peak begins a hundred of its widths from the true one: differences alone would leave it where it is."""
    data = plain_data({"f0": 200.0, "gain": -1.5})
    response = FunctionResponse(peak, {"f0": 1e-3, "gain": 1e-5})
    free = [Free("f0", 100.0, 60.0, lo=1.0), Free("gain", -1.0, scale=0.3)]
    for starts in (1, 5):
        found = fit(response, data, free, starts=starts, seed=1)
        assert len(found.starts) == starts
        assert found.at["f0"] == pytest.approx(200.0, abs=4 * found.sds["f0"])
        assert found.at["gain"] == pytest.approx(-1.5, abs=4 * found.sds["gain"])
        assert found.gaps["y"].G < 1.2


def test_a_value_on_its_bound_is_said() -> None:
    data = plain_data({"f0": 200.0, "gain": -1.5})
    response = FunctionResponse(peak, {"f0": 1e-3, "gain": 1e-5})
    found = fit(response, data, [Free("f0", 199.0, 5.0, hi=199.5), Free("gain", -1.0)])
    assert found.at_bound == ("f0",)
    assert found.at["f0"] <= 199.5
    assert found.gaps["y"].G > 2


def test_coordinates_turn_back() -> None:
    free = [Free("a", -30.0, 3.0, hi=0.0), Free("b", 1.0, 1.0, lo=0.0), Free("c", 5.0, 0.1, lo=1.0, hi=9.0)]
    at = Coordinates.of(free)
    np.testing.assert_array_equal(at.log, [True, False, True])
    for x in (np.zeros(3), np.array([0.5, 2.0, -3.0])):
        np.testing.assert_allclose(at.x(at.values(x)), x, atol=1e-12)
        steps = np.array([(at.values(x + h) - at.values(x - h)) / 2e-5 for h in 1e-5 * np.eye(3)]).diagonal()
        np.testing.assert_allclose(at.slope(x), steps, rtol=1e-6)
    np.testing.assert_array_equal(at.values(np.zeros(3)), [-30.0, 1.0, 5.0])


def test_the_covariance_of_a_fit_does_not_depend_on_where_it_began() -> None:
    """From almost nothing, where a search before had ended: a step of its logarithm was 2e13 times its value, and what
    was inverted lost every other parameter."""
    f0, gain = Free("f0", 200.0, 5.0, lo=5e-324), Free("gain", 1.0, 0.2, lo=5e-324)
    data, response = plain_data({"f0": 200.0, "gain": 1.0}), FunctionResponse(peak, {"f0": 1e-3, "gain": 1e-5})
    whole, astray = (finish(response, data, FitPoint((f0, replace(gain, start=at)), np.inf)) for at in (1.0, 1e-14))
    np.testing.assert_allclose(astray.values, whole.values, rtol=1e-4)
    np.testing.assert_allclose(astray.cov, whole.cov, rtol=1e-2, atol=1e-2 * np.abs(whole.cov).min())


def test_the_form_of_damping_that_made_the_data_is_found() -> None:
    model = open_model("strut")
    f = np.geomspace(10.0, 1200.0, 200)
    for made, begun in (("full", "modal"), ("modal", "full"))[: None if SOAK else 1]:
        truth = replace(model, damping=made)
        data = simulated(f, truth.frf(f), model.channels, noise_of(model.frf(f), 1e-3), np.random.default_rng(2))
        found = calibrate(replace(model, damping=begun), data)
        assert found.model.damping == made
        assert max(g.G for g in found.fit.gaps.values()) < 1.3


def test_nothing_to_fit_is_refused() -> None:
    model = open_model("apa-2dof")
    data = simulated(F, model.frf(F), model.channels, noise_of(model.frf(F), 0.01), np.random.default_rng(0))
    with pytest.raises(ModelError, match="0 free parameters"):
        fit(model, data, [])
    with pytest.raises(ModelError, match=r"no parameter 'joint\.kz'"):
        free_of(model, ["joint.kz"])


@pytest.mark.parametrize("serial", ["S-01"] if not SOAK else ["S-01", "S-02", "S-03", "S-04"])
def test_true_parameters_of_recorded_struts_lie_in_their_intervals(serial: str, recorded_units: RecordedUnits) -> None:
    truth, folder = recorded_units.truth(serial), recorded_units.folder(serial)
    model = with_effects(nominal_model(), list(truth["effects"].items()))
    calibration = calibrate(model, recorded(folder, model.tolerance))
    chosen, found = calibration.model, calibration.fit
    assert chosen.damping == "modal"  # the bench simulation integrates modes, each with its own damping
    true = true_values(truth)
    outside = [n for n in found.names if not found.interval(n)[0] <= true[n] <= found.interval(n)[1]]
    assert len(outside) <= 1, outside  # 14 intervals of 95 %: two outside once in 6
    for n in found.names:
        assert abs(found.at[n] - true[n]) < 3.5 * found.sds[n], n
    repeat = recorded(folder, model.tolerance, "_2")
    H = chosen.frf(repeat.f, found.at)
    assert all(gap.G <= 1.1 for gap in gaps([repeat.around(H)], [repeat.H - H]).values())


def recorded(folder: Path, tolerance: float, which: str = "") -> Dataset:
    series = Series("frf", "records", {"t": "s", "Va": "V", "Vs": "V", "de": "m", "da": "m"})
    names = (f"frf_noise{which}.mat", f"frf_noise_hf{which}.mat")
    low, high = (read(folder / name, series) for name in names)
    return Dataset.from_records(low, high, 350.0, tolerance=tolerance)


def test_the_wrong_model_file_shows(recorded_units: RecordedUnits) -> None:
    """The two-spring strut knows no spurious modes: G says so, in the channel that sees them."""
    model = open_model("strut-2dof")
    found = fit(model, recorded(recorded_units.folder("S-02"), model.tolerance).thinned(400), free_of(model))
    assert found.gaps["de"].G > 3


class Falls(FunctionResponse):
    """Stands at the priors; every derivative is taken where nothing does."""

    def jacobian(self, *args: object, **more: object) -> np.ndarray:
        raise NotHeld(-3.0)


def test_a_search_led_to_what_cannot_stand_says_what_to_look_for_in_the_records() -> None:
    """As a record whose samples were halved but not its times: a bare eigenvalue tells nobody."""
    free = [Free("k", 1.0, 0.1, 0.0, 10.0)]
    H = np.ones((5, 1), dtype=complex)
    data = Dataset(F[:5], 2.0 * H, ("de",), np.full((5, 1, 1), 1e-4 + 0j), np.full(5, 30.0), name="S-9 low")
    with pytest.raises(ModelError, match=r"S-9 low: no values of the model come near .* time base .* same unit"):
        fit(Falls(lambda v, f, channels: v["k"] * H[: f.size], {"k": 1e-3}), data, free)


@pytest.mark.parametrize(("also", "ends_at"), [((), -3.0), (({"a": 2.0},), 3.0)])
def test_of_several_places_to_begin_at_the_lowest_search_on_ratios_goes_on(
    also: tuple[dict[str, float], ...], ends_at: float
) -> None:
    """a and -a do nearly the same, and no step leads from one to the other: from -2 the search ends near -3, where a
    hundredth is left, and what was measured is 3."""

    def call(values: Values, f: np.ndarray, _: Channels) -> np.ndarray:
        a = values["a"]
        return np.tile(np.array([[a * a, 1.0 + 0.01 * a]]), (f.size, 1)).astype(complex)

    H = call({"a": 3.0}, F, ("de", "da"))
    data = simulated(F, H, ("de", "da"), noise_of(H, 1e-3), np.random.default_rng(1), tolerance=1e-3)
    free = [Free("a", 0.0, start=-2.0, scale=1.0)]
    (point,) = coarse_fits(FunctionResponse(call, {"a": 1e-4}), data, free, also=also)
    assert point.at["a"] == pytest.approx(ends_at, abs=0.1)  # a tenth beside six between the two
