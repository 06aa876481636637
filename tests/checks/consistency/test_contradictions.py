"""Measurements that must agree: recorded units never trip, a factor of ten or a foreign record makes both no result."""

from dataclasses import replace
from pathlib import Path

import pytest

from accept.base.documents.results import UnitRecord
from accept.judging import judge_unit, load_spec
from accept.units import unit_folder
from checks.cause import Cause
from checks.consistency.contradictions import RELATIONS, Relation, check_consistency
from checks.quantity import Quantity
from checks.verdict import UnitVerdict, Verdict, judge, unit_verdict
from specs.spec import load
from tests.accept.units.units import DATA
from tests.shared.recorded_units import RecordedUnits
from tests.soak import SOAK

HONEST = ["A-01", "A-03", *(f"S-0{n}" for n in range(1, 7))]
BATCH = [pytest.param(f"P-0{n}", marks=pytest.mark.needs_data) for n in range(1, 9)]
# As recorded of a sound unit; those of [STB] itself stand in the second column.
SOUND = {
    "sensor_capacitance_implied_uF": (5.10, 4.9),
    "sensor_uF": (4.81, 5.1),
    "gain_de_um_per_V": (26.65, 17.5),
    "axial_resonance_Hz": (93.9, 94.0),
    "hysteresis_gain_um_per_V": (24.5, 26.0),
    "stroke_um": (369.2, 373.2),
    "k_resonance_N_per_um": (1.741, 1.744),
    "k_closed_N_per_um": (1.708, 1.68),
}


def known(column: int = 0, **changed: float) -> dict[str, Quantity]:
    values = {name: both[column] for name, both in SOUND.items()} | changed
    return {name: Quantity(name, value, 0.01 * value) for name, value in values.items()}


def recorded(folder: Path, kind: str, only: tuple[str, ...] = ()) -> UnitRecord:
    spec = load_spec("apa" if kind == "apa" else "strut-basic")
    if only:
        spec = spec.model_copy(update={"checks": {name: spec.checks[name] for name in only}})
    return judge_unit(unit_folder.read(folder), spec)


def contradictions(result: UnitRecord) -> list[str]:
    causes = {f.quantity: f.cause.all() if f.cause else () for f in result.findings}
    return [name for name, found in causes.items() if any(r.cause is Cause.CONTRADICTION for r in found)]


@pytest.mark.parametrize("unit", [*HONEST, *BATCH] if SOAK else ["A-01", "S-03"])
def test_recorded_units_do_not_contradict_themselves(unit: str, recorded_units: RecordedUnits) -> None:
    """Of an independent simulation with hysteresis, creep and another permittivity at each frequency."""
    folder = DATA / "population" / unit if "P-" in unit else recorded_units.folder(unit)
    result = recorded(folder, "apa" if "A-" in unit else "strut")
    assert not contradictions(result)
    assert result.verdict in (UnitVerdict.ACCEPTED, UnitVerdict.INCOMPLETE)


@pytest.mark.parametrize("column", [0, 1], ids=["recorded", "published"])
@pytest.mark.parametrize("relation", RELATIONS, ids=lambda r: r.other)
def test_sound_units_agree_and_a_factor_of_ten_does_not(relation: Relation, column: int) -> None:
    assert not relation.is_contradicted(known(column))
    for name in (relation.one, relation.other):
        for factor in (10.0, 0.1):
            value = SOUND[name][column]
            assert relation.is_contradicted(known(column, **{name: factor * value}))


@pytest.mark.parametrize(
    ("wrong", "relation"),
    [
        ({"sensor_uF": 1.72}, "sensor_uF"),  # [STB] 2.2: the unit that went back to the maker, and another's sweep
        ({"stroke_um": 181.7}, "stroke_um"),  # [STB] 2.3: of the same unit, with the responses of a sound one
        ({"gain_de_um_per_V": 13.0}, "hysteresis_gain_um_per_V"),  # one stack of two is driven in one of the records
        ({"k_resonance_N_per_um": 2.12}, "k_closed_N_per_um"),  # a payload of 6.1 kg stated for one of 5.0 kg
        ({"k_closed_N_per_um": 2.3}, "k_closed_N_per_um"),  # the record with open circuit in place of the closed one
    ],
)
def test_records_of_other_units_and_exchanged_ones_contradict(wrong: dict[str, float], relation: str) -> None:
    found = [r.other for r in RELATIONS if r.is_contradicted(known(**wrong))]
    assert relation in found


def test_within_the_band_and_the_uncertainties_nothing_is_said() -> None:
    """A hair beyond the band is within U; what was not measured is not compared."""
    stiffness = next(r for r in RELATIONS if r.other == "k_closed_N_per_um")
    one = known()["k_closed_N_per_um"].value
    assert not stiffness.is_contradicted(known(k_resonance_N_per_um=one * (stiffness.hi + 0.01)))
    assert stiffness.is_contradicted(known(k_resonance_N_per_um=one * (stiffness.hi + 0.05)))
    assert stiffness.ratio({k: q for k, q in known().items() if k != "k_closed_N_per_um"}) is None


def test_both_findings_are_without_a_result_and_what_failed_fails() -> None:
    spec = load("apa")
    there = known(k_resonance_N_per_um=2.3)
    findings = [
        judge(check, there[name], spec.checks[check].limits[name])
        for check, name in (
            ("stiffness", "k_closed_N_per_um"), ("frf", "axial_resonance_Hz"), ("stroke", "stroke_um"),
        )
    ]  # fmt: skip
    assert unit_verdict(findings) is UnitVerdict.ACCEPTED
    k, f, stroke = check_consistency(findings, there)
    assert [x.verdict for x in (k, f, stroke)] == [Verdict.NO_RESULT, Verdict.NO_RESULT, Verdict.PASS]
    assert k.reason == f.reason
    one = there["k_closed_N_per_um"].value
    stated = f"Stiffness, from the resonance = 2.3 N/um and Stiffness, closed circuit = {one:.4g} N/um contradict"
    assert str(k.reason).startswith(stated)
    failed = replace(findings[0], verdict=Verdict.FAIL, reason="x")
    k, f, _ = check_consistency([failed, *findings[1:]], there)
    assert (k.verdict, f.verdict) == (Verdict.FAIL, Verdict.NO_RESULT)
    assert unit_verdict([k, f]) is UnitVerdict.REJECTED


@pytest.mark.needs_data
def test_a_recorded_unit_whose_meter_and_corner_contradict_each_other_stays_rejected() -> None:
    """A-02: 1.72 uF by the meter, 5.1 uF by the corner. It fails by the meter as before; the corner passes no more."""
    result = recorded(DATA / "units" / "A-02", "apa", ("capacitance", "sensor_highpass"))
    found = {f.quantity: f.verdict for f in result.findings}
    assert found == {
        "sensor_uF": Verdict.FAIL,
        "actuator_uF": Verdict.FAIL,
        "sensor_highpass_Hz": Verdict.NO_RESULT,
    }
    assert contradictions(result) == ["sensor_uF", "sensor_highpass_Hz"]
    assert result.verdict is UnitVerdict.REJECTED


def test_the_page_of_checks_states_every_band() -> None:
    page = (Path(__file__).parents[3] / "docs" / "reference" / "checks.md").read_text()
    for relation in RELATIONS:
        assert relation.title in page
        assert f"{relation.lo:g} to {relation.hi:g}" in page
