"""Responses of hammer tests: H1, H2 and Hv of known oscillators, what their U covers, windows, several records."""

import numpy as np
import pytest
from scipy.stats import binom

from checks.signals.impact.hammer import ImpactFrf, analyse, analyse_records
from checks.signals.impact.impact_response import impact_frf, impact_modes
from checks.signals.impact.impacts import DOUBLE, LEVEL, OVERLOAD, ImpactRules
from checks.signals.spectral.lpm import lpm
from checks.signals.spectral.transient import concentration, is_transient
from tests.checks.signals.hammer_plant import FS, Struck, clean, noisy
from tests.soak import SOAK

TWO = ((280.0, 0.008, 1e-6), (840.0, 0.008, 1.2e-7))
HITS = tuple((0.5 + 1.2 * k, 70.0 + 9.0 * (k % 3)) for k in range(6))
BAND = (60.0, 2000.0)


def closed_form(f: np.ndarray, modes: tuple, decay: float = 0.0) -> np.ndarray:
    """Response of modes, rotation per force, at s = decay + j 2 pi f: the exponential window shifts the axis."""
    s = decay + 2j * np.pi * f
    w = [2 * np.pi * f0 for f0, _, _ in modes]
    return sum(g * w0**2 / (s**2 + 2 * z * w0 * s + w0**2) for w0, (_, z, g) in zip(w, modes, strict=True))


def tracks(modes: tuple, seed: int, hits: tuple = HITS, **noise: float) -> tuple[np.ndarray, np.ndarray]:
    return noisy(clean(Struck(modes, hits)), np.random.default_rng(seed), **noise)


@pytest.mark.parametrize("estimator", ["h1", "h2", "hv"])
def test_every_estimator_is_the_closed_form(estimator: str) -> None:
    force, y = tracks(TWO, 1)
    frf = impact_frf(analyse_records([(force, (y,))], FS, None, BAND), ("y",), "force", estimator)
    # From 100 Hz to 1.2 kHz, where the impulse-invariant plant is its continuous one to half a percent.
    near = (frf.f > 100.0) & (frf.f < 1200.0) & (frf.coherence[:, 0] > 0.9999)
    assert near.sum() > 200
    truth = closed_form(frf.f[near], TWO)
    assert np.abs(frf.H[near, 0] / truth - 1.0).max() < 0.02
    assert np.median(np.abs(frf.H[near, 0] / truth - 1.0)) < 0.005


@pytest.mark.parametrize(("on_force", "on_response"), [(0.0, 0.3), (0.3, 0.0), (0.3, 0.3)])
def test_noise_on_one_side_biases_the_estimator_that_it_should(on_force: float, on_response: float) -> None:
    """A true response of 2 with noise of 0.3 on either side: H1 = 2/(1 + 0.09), H2 = 2 (1 + 0.09 / 4) by definition."""
    rng = np.random.default_rng(3)

    def normal() -> np.ndarray:
        return (rng.standard_normal((400, 50)) + 1j * rng.standard_normal((400, 50))) / np.sqrt(2.0)

    true = np.ones((400, 50))
    F, Y = true + on_force * normal(), 2.0 * true + on_response * normal()
    H1 = np.sum(Y * F.conj(), axis=0) / np.sum(np.abs(F) ** 2, axis=0)
    frf = ImpactFrf(np.arange(50.0), F, Y, H1, np.ones(50), 0.0)
    low, high = 2.0 / (1.0 + on_force**2), 2.0 * (1.0 + on_response**2 / 4.0)
    wanted = {"h1": low, "h2": high, "hv": np.sqrt(low * high)}
    for estimator, size in wanted.items():
        # 0.3 / sqrt(400) of scatter a bin, over 50 bins: 0.002; six of them.
        assert np.abs(frf.estimate(estimator)[0]).mean() == pytest.approx(size, abs=0.012), estimator


def test_what_each_impact_contributes_is_what_leaving_it_out_changes() -> None:
    """First order in 1/K: the change by leaving one of 40 impacts out is its contribution, to a tenth."""
    rng = np.random.default_rng(5)
    F = 1.0 + 0.1 * (rng.standard_normal((40, 1)) + 1j * rng.standard_normal((40, 1)))
    Y = (2.0 + 0.5j) * F + 0.2 * (rng.standard_normal((40, 1)) + 1j * rng.standard_normal((40, 1)))

    def frf(kept: np.ndarray) -> ImpactFrf:
        H1 = np.sum(Y[kept] * F[kept].conj(), axis=0) / np.sum(np.abs(F[kept]) ** 2, axis=0)
        return ImpactFrf(np.arange(1.0), F[kept], Y[kept], H1, np.ones(1), 0.0)

    for estimator in ("h1", "h2", "hv"):
        H, parts = frf(np.ones(40, bool)).estimate(estimator)
        assert abs(parts.sum()) < 1e-12
        change = np.array([H[0] - frf(np.arange(40) != k).estimate(estimator)[0][0] for k in range(40)])
        assert np.abs(change - parts[:, 0]).max() < 0.1 * np.abs(parts).max(), estimator


REPEATS = 200 if SOAK else 60
COVERED = binom.ppf([0.0005, 0.9995], REPEATS, 0.95)


@pytest.mark.parametrize("estimator", ["h1", "h2", "hv"])
def test_the_stated_region_covers_the_truth(estimator: str) -> None:
    """The disc of 95 % about H at one bin beside the peak, over repeats of noise on force and response."""
    base, inside = clean(Struck(TWO, HITS)), 0
    quiet = impact_frf(analyse_records([(base[0], (base[1],))], FS, None, BAND), ("y",), "force")
    at = int(np.argmin(np.abs(quiet.f - 300.0)))
    for k in range(REPEATS):
        force, y = noisy(base, np.random.default_rng([11, k]), force_N=0.02, rotation=1e-7)
        frf = impact_frf(analyse_records([(force, (y,))], FS, None, BAND), ("y",), "force", estimator)
        inside += bool(abs(frf.H[at, 0] - quiet.H[at, 0]) <= frf.radius(0.95)[at, 0])
    assert COVERED[0] <= inside <= COVERED[1]


def test_poles_cover_the_truth_over_several_records() -> None:
    """Frequency and damping of the first mode, from two records of three hits each."""
    hits = tuple((0.3 + 0.8 * k, 70.0 + 9.0 * k) for k in range(3))
    base, ok = clean(Struck(TWO, hits, duration=2.8)), np.zeros(2, int)
    for k in range(REPEATS):
        rng = np.random.default_rng([12, k])
        records = [(force, (y,)) for force, y in (noisy(base, rng, rotation=2e-7) for _ in range(2))]
        found = analyse_records(records, FS, None, BAND)
        assert found.good == 6
        mode = max(impact_modes(found, ("y",), *BAND)["y"], key=lambda m: m.peak)
        ok[0] += abs(mode.f_Hz - 280.0) <= 2 * np.hypot(mode.u_Hz, mode.u_Hz_model)
        ok[1] += abs(mode.damping_ratio - 0.008) <= 2 * np.hypot(mode.u_damping, mode.u_damping_model)
    assert COVERED[0] <= min(ok) <= max(ok) <= COVERED[1]


def test_the_exponential_window_shifts_the_response_and_not_the_modes() -> None:
    force, y = tracks(TWO[:1], 5)
    for decay in (8.0, 20.0):
        found = analyse_records([(force, (y,))], FS, ImpactRules(window_decay=decay), BAND)
        frf = impact_frf(found, ("y",), "force")
        assert found.frfs[0].added_decay == decay
        near = (frf.f > 250.0) & (frf.f < 310.0)
        assert np.abs(frf.H[near, 0] / closed_form(frf.f[near], TWO[:1], decay) - 1.0).max() < 0.01
        (mode,) = impact_modes(found, ("y",), *BAND)["y"]
        assert mode.damping_ratio == pytest.approx(0.008, rel=2e-3)
        assert any(f"{decay:.4g} 1/s" in note for note in frf.notes)


def test_errors_of_neighbouring_bins_correlate_as_stated() -> None:
    """White noise through the window: the correlation of bins 1 to 3 apart, over 300 draws."""
    base, rules = clean(Struck(TWO, HITS)), ImpactRules(window_decay=3.0)
    quiet = analyse_records([(base[0], (base[1],))], FS, rules, BAND).frfs[0]
    frf = impact_frf(analyse_records([(base[0], (base[1],))], FS, rules, BAND), ("y",), "force")
    n = round(FS / quiet.df)
    window = np.exp(-3.0 * np.arange(n) / FS)
    noise = np.fft.rfft(np.random.default_rng(2).standard_normal((300, n)) * window)[:, 100:400]
    for lag in (1, 2, 3):
        seen = abs(np.mean(noise[:, :-lag] * noise[:, lag:].conj())) / np.mean(np.abs(noise) ** 2)
        assert frf.correlation[lag - 1] == pytest.approx(seen, abs=0.02)


def test_one_estimator_for_one_record_and_for_many() -> None:
    force, y = tracks(TWO, 7)
    one, many = analyse(force, y, FS, None, BAND), analyse_records([(force, (y,))], FS, None, BAND)
    np.testing.assert_array_equal(one.frf.H, many.frfs[0].H)
    assert one.impacts == many.impacts[0]


def test_bad_hits_of_any_record_are_left_out_with_their_reason() -> None:
    good = tracks(TWO, 1)
    bounced = tracks(TWO, 2, ((0.5, 70.0), (0.54, 30.0), (2.0, 75.0)))
    soft = tracks(TWO, 3, ((0.5, 9.0),))  # alone in its record: only the others show its level
    clipped = tracks(TWO, 4, ((0.5, 70.0),))
    force = np.minimum(clipped[0], 40.0)
    records = [(good[0], (good[1],)), (bounced[0], (bounced[1],)), (soft[0], (soft[1],)), (force, (clipped[1],))]
    found = analyse_records(records, FS, None, BAND)
    faults = [[i.fault for i in impacts] for impacts in found.impacts]
    assert faults == [[None] * 6, [DOUBLE, None], [LEVEL], [OVERLOAD]]
    assert found.frfs[0].count == 7


def test_a_channel_that_the_hits_do_not_excite_costs_no_hit() -> None:
    force, y = tracks(TWO, 1)
    dead = 1e-9 * np.random.default_rng(4).standard_normal(y.size)
    found = analyse_records([(force, (y, dead))], FS, None, BAND)
    assert found.good == 6
    frf = impact_frf(found, ("y", "dead"), "force")
    assert np.median(frf.coherence[:, 1]) < 0.5 < np.median(frf.coherence[:, 0])
    assert impact_modes(found, ("y", "dead"), *BAND)["dead"] == ()


@pytest.mark.parametrize(("seconds", "hits"), [(8.0, 5), (2.0, 1), (40.0, 1)])
def test_hits_are_told_from_a_lasting_drive(seconds: float, hits: int) -> None:
    force, _ = tracks(TWO, 1, tuple((0.1 + 1.2 * k, 70.0) for k in range(hits)))
    assert is_transient(force[: round(seconds * FS)])


def test_a_lasting_drive_is_no_transient() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(20_000) / 1e3
    drives = {
        "noise": rng.standard_normal(t.size),
        "sine": np.sin(t),
        "growing sines": t**3 * np.sin(t),
        "sweep": np.sin(2 * np.pi * 5 * t**2),
        "bursts of a tenth": np.where(t % 2 < 0.2, rng.standard_normal(t.size), 0.0),
        "constant": np.ones(t.size),
    }
    assert {name: is_transient(u) for name, u in drives.items()} == dict.fromkeys(drives, False)
    assert concentration(drives["noise"]) == pytest.approx(0.4446, abs=0.01)  # by chi2(3) of normal noise


def test_local_polynomials_refuse_a_hit_at_the_start_of_its_record() -> None:
    """Their regression cannot tell the response from the record's own transient: it gave 0.15 of the true size."""
    fs, n = 512.0, 8192
    rng = np.random.default_rng(1)
    u = 1e-4 * rng.standard_normal(n)
    u[3:6] += (0.5, 1.0, 0.5)
    w0, z = 2 * np.pi * 18.8, 0.003
    t = np.arange(n) / fs
    y = np.convolve(u, np.exp(-z * w0 * t) * np.sin(w0 * t))[:n]
    with pytest.raises(ValueError, match="cannot be distinguished"):
        lpm(u + 1e-3 * rng.standard_normal(n), y, fs, f_lo=5.0, f_hi=200.0, lasting=True)
    lasting = rng.standard_normal(n)
    frf = lpm(lasting, np.convolve(lasting, [1.0, 0.5])[:n], fs, f_lo=5.0, f_hi=200.0, lasting=True)
    assert np.isfinite(frf.var).all()
