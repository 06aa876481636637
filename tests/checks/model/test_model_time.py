"""The model in time: exact paths and steady answers, loops, creep, masses put down, hits of the hammer."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg

from accept.models.model_file import open_model
from accept.simulate.apa import mass_steps
from accept.simulate.hammer_records import ShellMode, hammer_record
from checks.errors import ModelError
from checks.gap import with_effects
from checks.model.dynamics.complex_modes import modal
from checks.model.model import Model
from checks.model.time.hysteresis_creep import creep, loops_of, stroke_of
from checks.model.time.partial_fractions import Fractions, _motion_fractions, paths
from checks.model.time.time_response import time_simulation
from tests.checks.model.units_model import EVERYTHING


@pytest.fixture(scope="module")
def strut() -> Model:
    return open_model("strut")


# --- exact in time


@pytest.mark.parametrize("name", ["strut", "strut-2dof", "apa-frame", "apa-2dof"])
def test_paths_are_the_model(name: str) -> None:
    """The sum over poles is another way to the same response: only round-off is between them."""
    model = open_model(name)
    held = {effect for effect, _ in EVERYTHING} - (set() if "strut" in name else {"misalignment"})
    known = [(e, p) for e, p in EVERYTHING if e in held and not (e.startswith("encoder") and "apa" in name)]
    model = with_effects(model, known)
    f = np.geomspace(0.5, 4900.0, 300)
    late = np.exp(2j * np.pi * f * 1e-6 * model.values["delay.tau_us"])
    for channel, path in paths(model).items():
        H = model.frf(f, channels=(channel,))[:, 0] * late
        np.testing.assert_allclose(path.at(2j * np.pi * f), H, rtol=1e-8, atol=1e-9 * np.abs(H).max())


def test_a_held_drive_against_the_matrix_exponential() -> None:
    """Truth by another way: the states of M, C, K stepped by expm."""
    system, fs = open_model("apa-2dof").system(), 1e4
    # a coordinate without mass cannot be stepped: give each a gram, here and there
    M = system.M + 1e-3 * np.eye(len(system.M))
    form, n = modal(replace(system, M=M)), len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, system.K), -np.linalg.solve(M, system.C)]])
    b = np.concatenate([np.zeros(n), np.linalg.solve(M, system.force)])
    step = linalg.expm(np.block([[A, b[:, None]], [np.zeros((1, 2 * n + 1))]]) / fs)
    u = np.random.default_rng(3).standard_normal(400)
    states = np.zeros((u.size, 2 * n))
    for k in range(u.size - 1):
        states[k + 1] = step[:-1, :-1] @ states[k] + step[:-1, -1] * u[k]
    for i, channel in enumerate(form.channels):
        truth = states[:, :n] @ system.outputs[i]
        np.testing.assert_allclose(
            _motion_fractions(form, channel).held(u, fs), truth, rtol=0, atol=1e-9 * np.abs(truth).max()
        )


@pytest.mark.parametrize("tau_us", [0.0, 30.0, 100.0, 170.0])
def test_a_delay_of_any_part_of_a_sample(tau_us: float) -> None:
    """What is held for a sample may be held for ten samples of a tenth: at the finer rate every delay here is whole,
    and a whole delay is a shift."""
    path = paths(with_effects(open_model("strut"), EVERYTHING[:2]))["de"]
    u = np.random.default_rng(4).standard_normal(500)
    fine = path.held(np.repeat(u, 10), 1e5)
    late = round(tau_us / 10.0)
    expected = np.concatenate([np.zeros(late), fine])[::10][: u.size]
    np.testing.assert_allclose(path.held(u, 1e4, 1e-6 * tau_us), expected, atol=1e-9 * np.abs(fine).max())


def test_what_is_joined_up_is_the_response_of_a_steady_sine(strut: Model) -> None:
    model = with_effects(strut, EVERYTHING)
    fs, f = 1e4, 130.0
    t = np.arange(60_000) / fs
    y = time_simulation(model, t.size, fs)(np.sin(2 * np.pi * f * t))
    H = model.frf([f])[0]
    late = t > 5.0  # what rang at the start has died away to 1e-6
    for i, channel in enumerate(model.channels):
        truth = np.abs(H[i]) * np.sin(2 * np.pi * f * t[late] + np.angle(H[i]))
        np.testing.assert_allclose(y[channel][late], truth, atol=2e-4 * np.abs(H[i]))  # the sine starts with a kink


def test_joined_and_held_agree_below_the_sampling(strut: Model) -> None:
    """A slow drive is the same either way, half a sample apart."""
    fs = 1e4
    t = np.arange(30_000) / fs
    Va = np.sin(2 * np.pi * 3.0 * t) * np.minimum(t, 1.0) ** 2
    one, two = (time_simulation(strut, t.size, fs, hold=hold)(Va) for hold in (False, True))
    for channel in ("de", "da"):
        half = np.interp(t - 0.5 / fs, t, one[channel])
        np.testing.assert_allclose(two[channel][10:], half[10:], atol=1e-4 * np.abs(half).max())


def test_answers_refuse_what_they_cannot_give(strut: Model) -> None:
    with pytest.raises(ModelError, match="20000 Hz"):
        time_simulation(strut, 100, 2e4)
    with pytest.raises(ModelError, match="101"):
        time_simulation(strut, 100, 1e4)(np.zeros(101))
    with pytest.raises(ModelError, match="before its cause"):
        time_simulation(strut.with_values({"delay.tau_us": -5.0}), 100, 1e4, hold=True)


# --- slow


@pytest.mark.parametrize("width", [0.0, 0.02, 0.1, 0.3])
def test_loops_open_as_stated(width: float) -> None:
    """Read off directly: drive at its middle, on the way up and on the way down."""
    amplitude = 2.0
    turns = np.arange(4000) / 1000.0
    v = amplitude * np.sin(2 * np.pi * turns)
    y = loops_of(width, amplitude)(v)
    up, down = y[3000], y[3500]  # both at v = 0, after the first rise has been forgotten
    assert (down - up) / np.ptp(y[2000:]) == pytest.approx(width, abs=2e-4)  # 120 plays
    small = 0.01 * v
    assert np.ptp(loops_of(width, amplitude)(small)) == pytest.approx(np.ptp(small), rel=0.02)


def test_a_stroke_is_reached_on_the_first_rise_and_loops_open() -> None:
    v = 85.0 - 85.0 * np.cos(2 * np.pi * np.arange(2001) / 1000.0)
    d = stroke_of(360e-6, 170.0, 0.1)(v)
    assert d.max() == pytest.approx(360e-6, rel=1e-4)
    assert (d[750] - d[1250]) / (d[500:1501].max() - d[500:1501].min()) == pytest.approx(0.1, abs=3e-4)


def test_hysteresis_does_not_know_the_rate() -> None:
    rng = np.random.default_rng(0)
    turning = rng.standard_normal(40)
    slow = np.interp(np.linspace(0, 39, 4000), np.arange(40), turning)
    bend = loops_of(0.1, 2.0)
    np.testing.assert_allclose(bend(np.repeat(slow, 3))[::3], bend(slow), atol=1e-12)


def test_creep_grows_with_log_time() -> None:
    path = creep(0.02)
    t = np.logspace(-2, 2, 200)
    share = (path.residues / -path.poles).real
    step = path.direct + (share[:, None] * (1 - np.exp(np.outer(path.poles.real, t)))).sum(axis=0)
    slope = np.polyfit(np.log10(t), step, 1)[0]
    assert slope == pytest.approx(0.02, rel=0.02)
    assert path.at(np.array([2e9j]))[0] == pytest.approx(1.0, abs=1e-4)  # of what follows at once


def test_mass_steps_are_stated_at_a_tenth_of_a_second() -> None:
    t = np.arange(3000) / 100.0
    y = mass_steps(t, (15.0, 22.0), -4e-5, 0.0)
    assert y[t < 15].max() == 0.0
    assert y[(t > 18) & (t < 22)] == pytest.approx(-4e-5)
    assert y[t > 25] == pytest.approx(0.0, abs=1e-12)


def test_mass_steps_creep_from_there() -> None:
    t = np.arange(3000) / 100.0
    y = mass_steps(t, (15.0, 22.0), -4e-5, 0.02)
    np.testing.assert_allclose(y[[1600, 2100]] / -4e-5, [1.02, 1.02 + 0.02 * np.log10(6.0)], rtol=1e-5)  # 1 s, 6 s on


def test_hits_are_as_hard_as_asked() -> None:
    force, angle = hammer_record([ShellMode(280.0, 0.008, 3e-7)], np.random.default_rng(1))
    peaks = force.reshape(12, -1).max(axis=1)[:11]
    assert np.all((peaks > 0.8 * 75.0) & (peaks < 1.05 * 130.0))  # 0.6 ms at 5 kHz: the crest falls between samples
    # a hit of p = F 2 T / pi sets the mode off at p w k, at most that
    assert np.abs(angle).max() < 130.0 * 2 * 6e-4 / np.pi * (2 * np.pi * 280.0) * 3e-7 * 1.02


def test_fractions_in_a_row_and_side_by_side() -> None:
    """Products and sums of simple fractions against the same done with numbers."""
    one = Fractions(np.array([-3.0 + 0j, -1.0 + 20.0j]), np.array([2.0 + 0j, 1.0 - 4.0j]), 0.5)
    two = Fractions(np.array([-7.0 + 0j]), np.array([5.0 + 0j]), -0.2)
    s = np.array([0.3 + 1.0j, 5.0j, 2.0 + 0j])
    np.testing.assert_allclose(one.times(two).at(s), one.at(s) * two.at(s), rtol=1e-12)
    np.testing.assert_allclose(one.plus(two).at(s), one.at(s) + two.at(s), rtol=1e-12)
