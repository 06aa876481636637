"""A spec that bounds the age of a learned bench never lets a finding by an older one pass."""

from datetime import date, timedelta
from pathlib import Path

import pytest

from accept.judging import judge as judging
from accept.judging import judge_unit, load_spec
from accept.judging.rules import learned_bench_problem
from accept.models.evidence import Models
from accept.units.unit_folder import read
from checks.cause import Cause
from checks.quantity import Outcome, Quantity
from checks.verdict import Verdict
from specs.model_sections import LearnedBenchRecord
from specs.spec import LearnedBenchLimits

OF_A_CHANNEL = {"real": [0.0, 0.0], "imag": [0.0, 0.0], "sd": [0.0, 0.0], "tolerance": [0.0, 0.0]}


def learned(on: str | None = "2026-11-02", units: int = 3) -> LearnedBenchRecord:
    return LearnedBenchRecord.model_validate(
        {
            "f_Hz": [10.0, 20.0],
            "channels": {"Vs": OF_A_CHANNEL},
            "units": [f"S-{k}" for k in range(units)],
            "learned_on": on,
        }
    )


@pytest.mark.parametrize(
    ("record", "measured", "fits"),
    [
        (learned(), "2026-11-02", True),
        (learned(), "2026-12-02", True),  # 30 days
        (learned(), "2026-12-03", False),
        (learned(), "2026-10-01", True),  # learned after the unit was measured
        (learned(units=2), "2026-11-02", False),
        (learned(on=None), "2026-11-02", False),
        (learned(on="soon"), "2026-11-02", False),
        (learned(), None, False),
        (None, "2026-11-02", False),
    ],
)
def test_age_and_number_of_units(record: LearnedBenchRecord | None, measured: str | None, fits: bool) -> None:
    problem = learned_bench_problem(LearnedBenchLimits(within_days=30, from_units=3), record, measured)
    assert (problem is None) == fits


def test_a_finding_by_a_bench_that_is_too_old_is_conditional(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The same values pass with a fresh bench, and without a demand in the spec. What a check measures and the opened
    model stand in for records; all else is the judgement of a unit folder."""
    values = Outcome(tuple(Quantity(name, 1.0, 0.5) for name in ("dx_um", "dy_um")))
    monkeypatch.setattr(judging, "_outcome", lambda *_: values)
    monkeypatch.setattr(Models, "learned_bench", lambda *_: learned())
    spec = load_spec("strut")
    spec = spec.model_copy(update={"checks": {"misalignment": spec.checks["misalignment"]}})
    verdicts = {}
    for asked, days in ((None, 400), (30, 30), (30, 31)):
        day = date(2026, 11, 2) + timedelta(days)
        (tmp_path / "unit.toml").write_text(
            f'serial = "S-9"\nkind = "strut"\n[measured]\nfrf = {day}\n[frf]\nlow = "low.mat"\nhigh = "high.mat"\n'
        )
        limits = None if asked is None else LearnedBenchLimits(within_days=asked)
        found = judge_unit(read(tmp_path, latest=date.max), spec.model_copy(update={"learned_bench": limits})).findings
        assert {f.quantity for f in found} == {"dx_um", "dy_um"}
        verdicts[asked, days] = {f.verdict for f in found}
        causes = {f.cause.cause for f in found if f.cause is not None}
        assert (Cause.LEARNED_BENCH in causes) == (days == 31)
    assert verdicts == {(None, 400): {Verdict.PASS}, (30, 30): {Verdict.PASS}, (30, 31): {Verdict.CONDITIONAL}}
