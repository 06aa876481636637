"""Records of frequency responses that contradict each other, or the structure, are no result; a little is no fault."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from checks.acceptance.common.sampling_rate import is_round, remarks
from checks.acceptance.frf import CHECK
from checks.cause import Cause
from checks.quantity import Outcome
from checks.record import Record
from checks.verdict import judge
from specs.spec import CheckSpec, load
from tests.causes import causes, no_result
from tests.checks.signals.frf_plant import Plant, noise_drive, record, unit

APA = load("apa").checks["frf"]
FS = 5000.0


@functools.cache
def good() -> dict[str, Record]:
    return unit(Plant(), seed=3)


def again(seed: int = 17, key: str = "low", plant: Plant | None = None) -> Record:
    return unit(plant or Plant(), seed=seed)[key]


def of(old: Record, **channels: np.ndarray) -> Record:
    return replace(old, channels={**old.channels, **channels})


def at_rate(old: Record, share: float) -> Record:
    return replace(old, t=old.t / share)


def scaled(old: Record, share: float) -> Record:
    return of(old, **{c: share * old[c] for c in ("Vs", "de", "da")})


def looped(old: Record) -> Record:
    noise = 1e-3 * np.random.default_rng(5).standard_normal(old.t.size)
    return of(old, Vs=-0.3 * old["Va"] + noise)


def unrelated_low() -> Record:
    """A sound record of a plant without a resonance near that of the other; its gains agree where they are coherent."""
    rng = np.random.default_rng(8)
    return record(Plant(f_Hz=93.9, damping=0.7), noise_drive(rng, 60000, FS, 4.0, 450.0, 0.04), FS, rng, "other.mat")


@functools.cache
def faults() -> dict[str, tuple[dict[str, Record], Cause]]:
    low, high = good()["low"], good()["high"]
    return {
        "another gain in the high record": ({"low": low, "high": scaled(high, 1.25)}, Cause.RECORDS_DISAGREE),
        "time step of the high record twice": ({"low": low, "high": at_rate(high, 0.5)}, Cause.RECORDS_DISAGREE),
        "sensor looped back": ({"low": looped(low), "high": looped(high)}, Cause.CHANNEL_FOREIGN),
        "encoder is the interferometer": ({"low": of(low, de=1.02 * low["da"]), "high": high}, Cause.CHANNEL_COPIED),
        "sensor is the drive": ({"low": low, "high": of(high, Vs=-0.3 * high["Va"])}, Cause.CHANNEL_COPIED),
        "repeat of another gain": ({**good(), "low_repeat": scaled(again(), 1.3)}, Cause.RECORDS_DISAGREE),
        "high repeat of another gain": (
            {**good(), "high_repeat": scaled(again(key="high"), 0.7)},
            Cause.RECORDS_DISAGREE,
        ),
        "repeat without a resonance": ({**good(), "low_repeat": unrelated_low()}, Cause.REPEAT_CONTRADICTS),
        "repeat of a time step 1 % off": ({**good(), "low_repeat": at_rate(again(), 0.99)}, Cause.SAMPLING_RATES),
    }


@pytest.mark.parametrize("fault", faults())
def test_what_contradicts_itself_is_no_result(fault: str) -> None:
    values, cause = faults()[fault]
    with no_result(cause):
        CHECK.measure(values, APA)


@pytest.mark.parametrize(
    ("static", "f_Hz", "verdict"),
    [(1.3e-5, 93.9, "conditional"), (4.5e-5, 80.0, "fail"), (1.8e-5, 93.9, "pass")],
)
def test_a_resonance_of_another_gain_cannot_pass(static: float, f_Hz: float, verdict: str) -> None:
    """One of two stacks dead; a soft shell, which moves more, fails as it should."""
    found = CHECK.measure(unit(Plant(static=static, f_Hz=f_Hz), seed=4), APA)
    quantity = next(q for q in found.quantities if q.name == "axial_resonance_Hz")
    finding = judge("frf", quantity, APA.limits["axial_resonance_Hz"])
    assert finding.verdict.value == verdict
    assert verdict != "conditional" or Cause.WRONG_GAIN in causes(finding.cause)


def resonance(outcome: Outcome) -> float:
    return next(q.value for q in outcome.quantities if q.name == "axial_resonance_Hz")


def test_what_real_actuators_differ_by_is_no_fault() -> None:
    """A tenth between small and large drives is usual for PZT; a repeat a little off in frequency is in the budget."""
    values = {**good(), "high": scaled(good()["high"], 1.1), "low_repeat": again(plant=Plant(f_Hz=94.1))}
    assert resonance(CHECK.measure(values, APA)) == pytest.approx(93.9, rel=2e-3)  # the bilinear rule bends 0.12 %


def with_rates(*rates: float) -> CheckSpec:
    return APA.model_copy(update={"settings": {**APA.settings, "sampling_Hz": list(rates)}})


def test_a_stated_rate_is_held() -> None:
    assert resonance(CHECK.measure(good(), with_rates(10000.0, FS))) > 90.0
    with no_result(Cause.SAMPLING_RATE, expected="10000"):
        CHECK.measure(good(), with_rates(10000.0))
    wrong = {key: at_rate(r, 0.99) for key, r in good().items()}  # 1 %: nothing else in the records contradicts it
    with no_result(Cause.SAMPLING_RATE):
        CHECK.measure(wrong, with_rates(FS))


def test_an_odd_rate_is_remarked_on_where_none_is_stated() -> None:
    odd = {key: at_rate(r, 1 / 1.01) for key, r in good().items()}
    assert [words.split(":")[0] for words in remarks(odd, APA)] == ["low record", "high record"]
    assert not list(remarks(good(), APA))
    assert not list(remarks(odd, with_rates(4950.5)))  # somebody stated it


@pytest.mark.parametrize(("fs", "usual"), [(1e4, True), (5120.0, True), (32768.0, True), (9900.99, False)])
def test_rates_that_clocks_have(fs: float, usual: bool) -> None:
    assert is_round(fs) == usual
