"""What must hold of every check that measures from slow records, whatever the records hold."""

import math

import numpy as np
import pytest

from checks.acceptance import hysteresis, sensor_highpass, stiffness, stroke
from checks.cause import NoResult
from checks.declare import Check, Measured, Series
from checks.record import Record
from specs.spec import CheckSpec, StatedU

CHECKS = {check.name: check for check in (stroke.CHECK, stiffness.CHECK, hysteresis.CHECK, sensor_highpass.CHECK)}
SHAPES = ("noise", "walk", "steps", "sine", "ramp", "spikes", "tiny", "huge", "two levels", "dead but one")


def signal(shape: str, n: int, rng: np.random.Generator) -> np.ndarray:
    t = np.linspace(0, 1, n)
    made = {
        "noise": rng.standard_normal(n),
        "walk": np.cumsum(rng.standard_normal(n)),
        "steps": np.cumsum(rng.random(n) > 0.99) * 1.0,
        "sine": np.sin(2 * np.pi * rng.uniform(0.3, 50) * t),
        "ramp": -20 + 170 * t,
        "spikes": 100.0 * (rng.random(n) > 0.995),
        "tiny": 1e-300 * rng.standard_normal(n),
        "huge": 1e100 * rng.standard_normal(n),
        "two levels": np.sign(t - 0.5),
        "dead but one": np.eye(1, n, n // 2).ravel(),
    }
    return made[shape]


def garbage(check: Check, rng: np.random.Generator) -> dict[str, object]:
    given: dict[str, object] = {}
    n = int(rng.choice([2, 5, 60, 300, 3000]))
    for declared in check.forms[-1].inputs:
        if isinstance(declared, Series):
            channels = {**declared.channels, **declared.optional_channels}
            t = rng.uniform(-5, 5) + np.arange(n) * 10.0 ** rng.uniform(-4, -1)
            made = {c: signal(str(rng.choice(SHAPES)), n, rng) for c in channels if c != "t"}
            given[declared.name] = Record(t, made, {})
        else:
            given[declared.name] = Measured(5.0)
    return given


@pytest.mark.parametrize("name", CHECKS)
def test_garbage_gives_a_reason_or_a_finite_value_with_its_interval(name: str) -> None:
    check = CHECKS[name]
    spec = CheckSpec(required=False, uncertainty={s: StatedU(U_percent=1.0, source="stated") for s in check.stated})
    rng = np.random.default_rng(20264)
    for _ in range(60):
        try:
            outcome = check.measure(garbage(check, rng), spec)
        except NoResult:
            continue
        assert [q.name for q in outcome.quantities] == list(check.quantities)
        for q in outcome.quantities:
            assert q.reason or math.isfinite(q.value)
            assert q.U is None or q.U >= 0


@pytest.mark.parametrize("name", CHECKS)
def test_declaration_is_whole(name: str) -> None:
    check = CHECKS[name]
    assert check.name == name
    assert len(set(check.quantities)) == len(check.quantities)
    assert all(s.meaning and s.name for s in check.settings)
    assert all(i.label for i in check.inputs.values())


@pytest.mark.parametrize("name", CHECKS)
def test_nothing_given_is_no_result(name: str) -> None:
    try:
        outcome = CHECKS[name].measure({}, CheckSpec(required=False))
    except NoResult:
        return
    assert all(q.reason for q in outcome.quantities)
