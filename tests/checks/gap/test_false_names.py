"""False names of a sealed run: what was named, and why it has no name now. Each was red before."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from accept.gap.analyse_unit import run_gap
from checks.gap.decision.evidence import NameEvidence
from checks.gap.decision.gates import GATES, Claim
from checks.gap.decision.rivals import early_channels, rivals_by, scale_or_lopsided
from checks.gap.effects import effect_named
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.thresholds import THRESHOLDS
from checks.gap.modelling.unmodelled_modes import levels
from checks.gap.search.candidates import Search
from checks.gap.search.explanation import Explanation
from checks.gap.search.forward import SearchResult, has_needless_effect, is_within_tolerance
from checks.gap.workflow import run
from checks.model import LearnedBench
from tests.checks.gap.shared.gap_cases import F, drawn, inputs, recorded
from tests.checks.gap.test_gap import quiet
from validation.model_files import write_model
from validation.sets import SETS, draw_set

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
SEED = 20270115


def test_a_resonance_of_the_encoder_is_no_scale() -> None:
    """Below its pole a resonance of de multiplies it by 1.05; above, by 1. One unmodelled mode explains all of it."""
    given, w = inputs(3), 2 * np.pi * 484.0
    s = 2j * np.pi * F
    factor = np.ones((F.size, 3), complex)
    factor[:, 1] += 0.05 * w**2 / (s**2 + 2 * 0.01 * w * s + w**2)
    found = run(
        replace(given, A=replace(given.A, H=given.A.H * factor), B=replace(given.B, H=given.B.H * factor)), quiet
    )
    assert not found.named
    (missing,) = found.unnamed
    assert missing.channel == "de"
    assert missing.poles_Hz == pytest.approx([484.0], abs=1.0)  # its interval is some tenths of a hertz


def candidate(at: dict[str, dict[str, float]], true: dict[str, dict[str, float]]) -> Explanation:
    """Return a strut's candidate with effects at values, beside records of the same strut with true ones."""
    model = replace(drawn(3), tolerance=0.01)
    response = Augmented(model, tuple(effect_named(name) for name in at))
    values = {f"{name}.{p}": v for name, own in at.items() for p, v in own.items()}
    start = {p.name: values.get(p.name, p.begin) for p in response.free()}
    return Explanation(response, start, 0.0, recorded(model, 6, true), THRESHOLDS)


MERGE_HZ = 350.0  # between the records of low and high frequencies
BENCH = {"f_Hz": 300.0, "damping_ratio": 0.01}


@pytest.mark.parametrize(("ratio", "needless"), [(1e-4, True), (0.05, False)])
def test_a_second_effect_below_the_tolerance_is_needless(ratio: float, needless: bool) -> None:
    """A mode of the bench that peaks at 0.5 % of the static motion, and one at 250 %."""
    effects = {"sensor_highpass": {"f_Hz": 5.0}, "bench_mode": {**BENCH, "ratio": ratio}}
    both = candidate(effects, effects)
    assert has_needless_effect(both) is needless
    assert not is_within_tolerance(both, effect_named("sensor_highpass"), THRESHOLDS.G)


def test_a_single_effect_is_never_needless() -> None:
    """It has passed the test of chance against a model that has nothing else to explain."""
    alone = {"bench_mode": {**BENCH, "ratio": 1e-4}}
    assert is_within_tolerance(candidate(alone, alone), effect_named("bench_mode"), THRESHOLDS.G)
    assert not has_needless_effect(candidate(alone, alone))


@pytest.mark.parametrize(("ratio", "needless"), [(2e-5, True), (0.05, False)])
def test_on_a_learned_bench_a_single_effect_must_be_beyond_the_tolerance(ratio: float, needless: bool) -> None:
    """It comes from a few units: a mode of the bench of 8e-6 of the static motion was named in a sound strut, with G of
    0.5 and 0.3."""
    alone = {"bench_mode": {**BENCH, "ratio": ratio}}
    found = candidate(alone, alone)
    assert needless_alone(on_learned_bench(found)) is needless
    assert not needless_alone(found)


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize("complete", [True, False])
def test_a_scale_beside_a_gap_may_be_a_lopsided_apa_where_the_file_has_one(stated: bool, complete: bool) -> None:
    """In 5 of 24 lopsided APAs, none with an effect, the encoder's scale was named: 3 to 9 %."""
    scale = {"encoder_scale": {"relative": 0.06}}
    found = candidate(scale, scale if complete else {**scale, "bench_mode": {**BENCH, "ratio": 0.05}})
    model = found.response.model
    sds = {**model.sds, **({"apa.lopsided_x_um": 30.0} if stated else {})}
    found = replace(found, response=replace(found.response, model=replace(model, sds=sds)))
    found = replace(found, at={**{p.name: p.begin for p in found.response.free()}, **found.at})
    assert found.adequate is complete
    assert bool(scale_or_lopsided(found, effect_named("encoder_scale"))) is (stated and not complete)


@pytest.mark.parametrize(("ratio", "needless"), [(2e-5, True), (0.05, False)])
def test_beside_a_hysteresis_at_two_levels_too(ratio: float, needless: bool) -> None:
    """A cubic spring made the records depend on their level; a crosstalk within the tolerance was named beside it."""
    alone = {"bench_mode": {**BENCH, "ratio": ratio}}
    found = candidate(alone, alone)
    response = found.response.with_member(levels(MERGE_HZ, 0.02))
    at = {p.name: found.at.get(p.name, p.begin) for p in response.free()}
    assert needless_alone(replace(found, response=response, at=at)) is needless


@pytest.mark.parametrize(
    ("ratio", "left", "twice"),
    [(0.0, False, False), (2e-4, False, True), (0.05, True, True)],
)
def test_beside_a_disagreement_a_name_explains_a_channel(ratio: float, left: bool, twice: bool) -> None:
    """A scale of the encoder was named that took G of de from 73 to 62 on a lopsided APA, and a misalignment with a
    gain of 20 that was a second mass on the encoder. Here beside a mode of the bench that the explanation lacks."""
    scale = {"encoder_scale": {"relative": 0.1}}
    found = candidate(scale, {**scale, "bench_mode": {**BENCH, "ratio": ratio}})
    evidence = evidence_of(replace(found, beside=True), "encoder_scale")
    (gate,) = (gate for gate in GATES if gate.name == "channel_left")
    assert gate.test(evidence) is not left
    assert evidence.required_gain == (2.0 if twice else 1.0) * THRESHOLDS.delta_lnL


def on_learned_bench(c: Explanation) -> Explanation:
    flat = np.zeros((2, 3))
    learned = LearnedBench(np.array([10.0, 1000.0]), c.unseen.channels, flat + 0j, flat, flat + 0.01)
    return replace(c, response=replace(c.response, model=replace(c.response.model, learned=learned)))


def needless_alone(c: Explanation) -> bool:
    (effect,) = c.response.effects
    return evidence_of(c, effect.name).needless


def evidence_of(c: Explanation, effect: str) -> NameEvidence:
    search = Search(c.unseen, c.unseen, (), THRESHOLDS, quiet)
    return NameEvidence(effect_named(effect), search, SearchResult(c, c, (), ()), c, None, None)


@pytest.mark.parametrize(
    ("tau_us", "drive", "ambiguous"),
    [
        (-16.0, {"loop_delay": {"tau_us": 40.0}}, True),
        (16.0, {"loop_delay": {"tau_us": 40.0}}, False),
        (-16.0, {}, False),
    ],
)
def test_a_channel_that_is_early_beside_a_lag_of_the_drive_may_be_the_others_late(
    tau_us: float, drive: dict[str, dict[str, float]], ambiguous: bool
) -> None:
    """Vs and de 16 us late behind an amplifier; a latency of da of -16 us was named."""
    effects = {**drive, "channel_latency_da": {"tau_us": tau_us}}
    found = candidate(effects, effects)
    claims = [Claim(effect_named(name), 1e3, 0.0, ()) for name in effects]
    names = [a.effects for a in rivals_by([early_channels], found, claims)]
    assert names == [("channel_latency_Vs", "channel_latency_da", "channel_latency_de")] * ambiguous
    # there it is one from what its units have in common
    assert not rivals_by([early_channels], on_learned_bench(found), claims)


@pytest.mark.needs_data
@pytest.mark.skipif(not SOAK, reason="twenty seconds: runs in make soak")
def test_two_halves_of_one_mode_have_no_name(tmp_path: Path) -> None:
    """A neighbour's voltage in Vs near the axial mode: a mode of all channels, and one of the bench with its pole that
    takes it back in de and da."""
    gap = analysed("outsiders", "outsiders-009", tmp_path)
    assert "bench_mode" not in [n["effect"] for n in gap["named"]]


@pytest.mark.needs_data
@pytest.mark.skipif(not SOAK, reason="thirty seconds: runs in make soak")
def test_rivals_are_compared_with_the_same_form_of_damping(tmp_path: Path) -> None:
    """A filter of de on a bench that was not learned is as well a latency."""
    gap = analysed("laboratory-unlearned", "laboratory-unlearned-003", tmp_path)
    assert "channel_latency_de" not in [n["effect"] for n in gap["named"]]
    assert {"channel_latency_de", "channel_lowpass_de"} in [set(a["effects"]) for a in gap["ambiguous"]]


def analysed(name: str, serial: str, place: Path) -> dict:
    case = next(c for batch in draw_set(name, SEED) for c in batch.judge if c.serial == serial)
    return dict(run_gap(case.write(place), write_model(SETS[name], place / "model"), None))
