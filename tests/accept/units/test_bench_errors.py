"""A bench error is no unit's fault: what a wrong payload moved out of its limits has no result, and it is said what to
do; a unit that is bad stays rejected."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from accept.base.documents.results import Information, UnitRecord
from accept.batch.table import actions
from accept.cli.main import app
from accept.judging import judge_unit, load_spec, without_bench_errors
from accept.judging.advice import ADVICE, action
from accept.models.model_file import open_model
from accept.simulate import FAULTS, UnitRequest, simulate, write
from accept.units import unit_folder
from checks.cause import Cause, because, together
from checks.consistency import PAYLOAD
from checks.quantity import Quantity
from checks.verdict import Finding, Verdict, judge, unit_verdict
from specs.spec import Limit
from tests.soak import SOAK

SHORT = 10.5  # s; the specs ask for 10
# Fault -> (verdict of an APA, whether something is to be put right at the bench). What a fault does to a strut too is
# the same record spoilt by the same code.
APA = {
    "flatness": ("rejected", False),
    "capacitance": ("rejected", False),
    "dead_stack": ("rejected", False),
    "soft": ("rejected", False),
    "soft_bending": ("rejected", False),
    "hysteresis": ("rejected", False),
    "double_hit": ("incomplete", True),
    "wrong_payload": ("incomplete", True),
    "polarity": ("incomplete", True),
    "offset": ("incomplete", True),
    "dead_encoder": ("incomplete", True),
    "clipped": ("incomplete", True),
    "truncated": ("incomplete", True),
}
STRUT = {name: APA[name] for name in ("polarity", "offset", "dead_encoder", "clipped", "truncated")} | {
    "exchanged": ("incomplete", True),
    "wrong_payload": ("rejected", False),  # until the gap analysis has named it: `test_by_the_gap_analysis`
}
LIMITS = {
    "axial_resonance_Hz": ("frf", Limit(lower=80.0, upper=100.0, unit="Hz", rule="guarded", source="test")),
    "k_closed_N_per_um": ("stiffness", Limit(lower=1.5, unit="N/um", rule="guarded", source="test")),
}


# Beside the heavy lane one of each kind: a bad part, a bad record, a wrong bench. All of them are simulated and judged
# in test_simulate.py too, also those of a strut alone.
QUICK = {"apa": ("soft", "clipped", "wrong_payload"), "strut": ("wrong_payload",)}


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "table"), [("apa", APA), ("strut", STRUT)])
def test_every_fault(kind: str, table: Mapping[str, tuple[str, bool]], tmp_path: Path) -> None:
    assert set(table) == {name for name, fault in FAULTS.items() if kind in fault.kinds}
    model = open_model("strut") if kind == "strut" else open_model("apa-frame").with_values({"bench.payload_kg": 5.0})
    found = {}
    tried = [name for name in table if SOAK or name in QUICK[kind]]
    for name in tried:
        made = UnitRequest("T-1", kind, model, 1, fault=name, repeats=False, low_s=SHORT, high_s=SHORT, compact=False)
        result = judge_unit(unit_folder.read(write(simulate(made), tmp_path / name)), load_spec(kind))
        found[name] = str(result.verdict), result.action is not None
        if name == "wrong_payload" and kind == "apa":  # 8 kg instead of 5, by two ways to the stiffness
            assert result.action == "2 to 4 kg more than stated is on the bench: check the payload, measure again"
            assert result.to_json()["action"] == result.action
    assert found == {name: table[name] for name in tried}


def judged(f_Hz: float = 72.5, k: float = 1.75, gap: Mapping[str, Any] | None = None, **doubts: Any) -> UnitRecord:
    """A strut of a stated 5.7 kg with a stiffness by the resonance that goes with it."""
    values = {"axial_resonance_Hz": (f_Hz, 0.1), "k_closed_N_per_um": (k, 0.02)}
    findings: list[Finding] = [
        judge(check, Quantity(name, *values[name]), limit) for name, (check, limit) in LIMITS.items()
    ]
    if doubts:
        why = because(Cause.CONTRADICTION, one="", other="", one_called="", other_called="", U=0.01, **doubts)
        findings = [
            replace(
                f,
                cause=why if f.cause is None else together([f.cause, why]),
                verdict=Verdict.NO_RESULT if f.verdict is Verdict.PASS else f.verdict,
            )
            for f in findings
        ]
    by_resonance = Quantity("k_resonance_N_per_um", 5.7 * (2 * 3.141592653589793 * f_Hz) ** 2 * 1e-6, 0.01)
    return UnitRecord(
        serial="S-1",
        kind="strut",
        verdict=unit_verdict(findings),
        findings=tuple(findings),
        information=(Information.of("frf", by_resonance),),
        gap=gap,
    )


def named(kg: float, U: float = 0.1) -> dict[str, Any]:
    value = {"value": kg, "ci95": [kg - U, kg + U]}
    return {"named": [{"effect": "payload_mass", "parameters": {"kg": value}, "evidence": {}}]}


def test_by_the_gap_analysis() -> None:
    result = without_bench_errors(judged(gap=named(2.3)))
    assert result.verdict == "incomplete"
    assert result.action == "2.3 kg more than stated is on the bench: check the payload, measure again"
    lighter = without_bench_errors(judged(f_Hz=110.0, gap=named(-1.9)))
    assert lighter.action == "1.9 kg less than stated is on the bench: check the payload, measure again"


@pytest.mark.parametrize(
    "gap",
    [
        None,
        {"named": []},
        named(-2.3),  # a lighter payload does not lower the resonance
        named(0.02),  # not enough to explain it
        named(0.05, 0.2),  # perhaps none at all
        named(float("nan")),
        {"named": [{"effect": "misalignment", "parameters": {}, "evidence": {}}]},
        {"named": [], "ambiguous": [{"effects": ["payload_mass", "joint_axial_compliance"]}]},
    ],
)
def test_without_clear_evidence_it_stays_rejected(gap: Mapping[str, Any] | None) -> None:
    result = judged(gap=gap)
    assert without_bench_errors(result) is result
    assert (result.verdict, result.action) == ("rejected", None)


def test_two_ways_to_the_stiffness() -> None:
    """Clear only if that by the added mass passes and the resonance is off in the same direction."""
    doubt = {"title": PAYLOAD.title, "ratio": 0.64, "lo": PAYLOAD.lo, "hi": PAYLOAD.hi}
    clear = without_bench_errors(judged(**doubt))
    assert (clear.verdict, clear.findings[0].cause and clear.findings[0].cause.cause) == (
        "incomplete",
        Cause.PAYLOAD_WRONG,
    )
    for other in (
        judged(k=1.2, **doubt),  # soft by the added mass as well
        judged(**doubt | {"ratio": 1.3}),  # the resonance is low, but its stiffness the larger one
        judged(**doubt | {"title": "Static gain of the frequency response, over that of the whole stroke"}),
    ):
        assert without_bench_errors(other).verdict == "rejected"


def test_what_is_named_is_enough() -> None:
    """A misfit asks for an analysis only if nothing else says what to put right."""
    exchanged = because(Cause.CHANNELS_EXCHANGED, channel="de", other="da", evidence="")
    misfit = because(Cause.MODEL_MISFIT, lo=480.0, hi=700.0, G=1.3e4, data="the fitted data", chance="p below 1e-300")
    limit = LIMITS["axial_resonance_Hz"][1]
    frf, dx = (
        replace(judge(check, Quantity(name, 90.0, 0.1), limit), verdict=Verdict.NO_RESULT, cause=why)
        for check, name, why in (("frf", "axial_resonance_Hz", exchanged), ("misalignment", "dx_um", misfit))
    )
    assert action([dx, frf]) == "exchange the plugs of encoder de and interferometer da, then record again"
    assert action([dx]) == ADVICE[Cause.MODEL_MISFIT]


def test_no_other_failure_is_forgiven() -> None:
    result = judged(gap=named(2.3))
    flat = judge(
        "flatness", Quantity("flatness_um", 14.0, 0.5), Limit(upper=10.0, unit="um", rule="guarded", source="t")
    )
    both = without_bench_errors(replace(result, findings=(*result.findings, flat)))
    assert (both.verdict, both.action) == ("rejected", None)


def test_the_terminal_of_batch_says_what_to_do(tmp_path: Path) -> None:
    record = without_bench_errors(judged(gap=named(2.3)))
    assert actions([record, judged()]) == [f"S-1: what to do: {record.action}"]
    model = open_model("apa-frame").with_values({"bench.payload_kg": 5.0})
    made = UnitRequest("T-1", "apa", model, 1, fault="polarity", low_s=SHORT, high_s=SHORT, compact=False)
    folder = write(simulate(made), tmp_path / "T-1")
    done = CliRunner().invoke(app, ["batch", str(folder), "--out", str(tmp_path / "out"), "--no-certificates"])
    assert done.exit_code == 4, done.output
    assert "T-1: what to do: " in done.stdout
    assert "reverse the connection of" in done.stdout
