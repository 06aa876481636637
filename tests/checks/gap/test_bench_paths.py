"""A bench whose channels lag each by a time of its own, which no file describes, and whose guide may give way: an
effect beside that is named as if the bench had none, and a sound strut has no name.

Red on the search without the bench's paths: four or five members of the library, of which the hidden one was one; and
on one that calibrates them as if nothing else were missing: beside a large effect or a guide it took them for wrong.
"""

from dataclasses import replace

import numpy as np
import pytest

from checks.arrays import Complex
from checks.gap import workflow
from checks.gap.effects import EFFECTS
from checks.gap.workflow import Inputs, run
from checks.model import LearnedBench
from tests.checks.gap.shared.gap_cases import F, inputs
from tests.checks.gap.test_gap import quiet

LATE_US = (12.0, 31.0, 14.0)  # Vs, de, da: with the filters 37, 56 and 67 us, three lags that no two names explain
AMPLIFIER_HZ, DAMPING_RATIO = 9000.0, 0.7
FILTER_HZ = 8000.0  # of second order, on da
GUIDE_HZ, GUIDE_DAMPING_RATIO = 460.0, 0.01
GAINS = (1.002, 0.998, 1.003)
LAGS = {e.name for e in EFFECTS.values() if e.lags}
NOTHING_LEARNED = LearnedBench(
    np.array([1.0, 2e3]), ("de",), np.zeros((2, 1), dtype=complex), np.full((2, 1), 1e-3), np.full((2, 1), 1e-3)
)


def of_a_bench() -> Complex:
    """What the bench makes of every response (F, 3): latencies, an amplifier of second order, a filter on da, gains."""
    s = 2j * np.pi * F[:, None]
    w, filtered = 2 * np.pi * AMPLIFIER_HZ, 2 * np.pi * FILTER_HZ
    every = w**2 / (s**2 + 2 * DAMPING_RATIO * w * s + w**2) * np.exp(-1e-6 * s * LATE_US) * GAINS
    every[:, 2] *= (filtered**2 / (s**2 + np.sqrt(2) * filtered * s + filtered**2))[:, 0]
    return np.asarray(every)


def of_a_guide(H: Complex) -> Complex:
    """What a guide that gives way adds to responses (F, 3) of Vs, de, da: at its peak a thousandth of the response
    there, three times it and a tenth of it."""
    s, w = 2j * np.pi * F[:, None], 2 * np.pi * GUIDE_HZ
    peaks = np.array([1e-3, 3.0, 0.1]) * np.abs(H[np.argmin(np.abs(F - GUIDE_HZ))])
    return np.asarray(2 * GUIDE_DAMPING_RATIO * peaks * w**2 / (s**2 + 2 * GUIDE_DAMPING_RATIO * w * s + w**2))


def on_a_bench(given: Inputs, gives_way: bool = False) -> Inputs:
    by = of_a_bench()
    A, B = (
        replace(
            d,
            H=(d.H + gives_way * of_a_guide(given.A.H)) * by,
            cov=d.cov * by[:, :, None] * by[:, None, :].conj(),
        )
        for d in (given.A, given.B)
    )
    return replace(given, A=A, B=B)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("misalignment", {"dx_um": -10.0, "dy_um": 25.0}),
        ("misalignment", {"dx_um": -80.0, "dy_um": -345.0}),  # large: a linear look from zero does not reach it
        ("payload_mass", {"kg": 0.8}),
        ("encoder_scale", {"relative": 0.05}),  # a path's gain may not hide it
    ],
)
def test_one_effect_is_named_exactly(effect: str, values: dict[str, float]) -> None:
    found = run(on_a_bench(inputs(3, {effect: values})), quiet)
    assert [n.effect for n in found.named] == [effect]
    assert found.verdict == "ambiguous"  # by the lags alone
    assert {n for a in found.ambiguous for n in a.effects} <= LAGS
    for name, at in found.named[0].parameters.items():
        half = 0.5 * (at.hi - at.lo)
        assert at.lo - half < values[name] < at.hi + half  # twice the 95 % interval: one unit in twenty lies outside


@pytest.mark.parametrize(
    ("effect", "values"), [("misalignment", {"dx_um": -10.0, "dy_um": 60.0}), ("payload_mass", {"kg": 0.8})]
)
def test_an_effect_is_named_beside_a_guide_that_gives_way(effect: str, values: dict[str, float]) -> None:
    found = run(on_a_bench(inputs(3, {effect: values}), gives_way=True), quiet)
    assert [n.effect for n in found.named] == [effect]
    assert found.verdict == "partly_explained"
    assert any(u.channel == "de" for u in found.unnamed)  # the guide's mode
    for name, at in found.named[0].parameters.items():
        half = 0.5 * (at.hi - at.lo)
        assert at.lo - half < values[name] < at.hi + half  # twice the 95 % interval, as above


def test_a_sound_strut_on_a_guide_that_gives_way_has_no_name() -> None:
    found = run(on_a_bench(inputs(4), gives_way=True), quiet)
    assert not found.named
    assert found.verdict in ("partly_explained", "unexplained")
    assert any(u.channel == "de" for u in found.unnamed)


def test_a_sound_strut_lacks_lags_only() -> None:
    found = run(on_a_bench(inputs(4)), quiet)
    assert found.verdict == "ambiguous"
    assert not found.named
    assert {n for a in found.ambiguous for n in a.effects} <= LAGS
    # 2 zeta / w of a filter of second order: 25 us of the amplifier, 28 us of the filter on da
    expected = dict(zip(("Vs", "de", "da"), np.add(LATE_US, (25.0, 25.0, 53.0)).tolist(), strict=True))
    written = {c: found.bench_latency[f"bench.latency_{c}_us"] for c in expected}
    assert written == pytest.approx(expected, abs=3.0)  # us: a filter's phase is no straight line
    assert max(found.written_G.values()) < 5.0  # from 100 and more: latencies alone, without the filters' droop


def test_lags_that_have_names_keep_them() -> None:
    """Two effects are fewer than three paths: no bench is needed to explain them."""
    hidden = {"loop_delay": {"tau_us": 70.0}, "sensor_highpass": {"f_Hz": 9.0}}
    found = run(inputs(3, hidden), quiet)
    assert {n.effect for n in found.named} == set(hidden)


def test_a_learned_bench_has_its_paths_already(monkeypatch: pytest.MonkeyPatch) -> None:
    class SearchBegun(Exception):
        pass

    def begin(*_: object) -> None:
        raise SearchBegun

    def add_paths(*_: object) -> None:
        raise AssertionError("paths beside a learned bench")

    monkeypatch.setattr(workflow, "on_bench", add_paths)
    monkeypatch.setattr(workflow, "explain", begin)
    given = on_a_bench(inputs(4))
    with pytest.raises(SearchBegun):
        run(replace(given, model=replace(given.model, learned=NOTHING_LEARNED)), quiet)


def test_creep_of_the_strut_and_losses_of_the_bench_are_one() -> None:
    """Red before: a sound strut on a bench whose gain falls with log f was called creeping."""
    given = on_a_bench(inputs(4))
    loss = (1j * F[:, None] / 100.0) ** -0.008  # 1 % of magnitude a factor of 3.5, 0.7 degrees
    lossy = replace(given, A=replace(given.A, H=given.A.H * loss), B=replace(given.B, H=given.B.H * loss))
    found = run(lossy, quiet)
    assert "creep" not in {n.effect for n in found.named}
    assert all(a.or_bench for a in found.ambiguous if "creep" in a.effects)


def test_a_lag_of_the_drive_beside_others_has_no_form() -> None:
    """Corners of 3.2 and 4.8 kHz are an amplifier of second order with a damping ratio of 1.02, or one of first order
    on a bench with a filter. Red before: an amplifier of second order."""
    s = 2j * np.pi * F[:, None]
    slow = np.exp(-1e-6 * s * [26.0, 0.0, 0.0]) / ((1.0 + s / (2 * np.pi * 3200.0)) * (1.0 + s / (2 * np.pi * 4800.0)))
    given = inputs(3)
    found = run(replace(given, A=replace(given.A, H=given.A.H * slow), B=replace(given.B, H=given.B.H * slow)), quiet)
    in_drive = {"amplifier_bandwidth", "amplifier_second_order", "loop_delay"}
    assert not {n.effect for n in found.named} & in_drive
    assert any(in_drive <= set(a.effects) for a in found.ambiguous)
