"""The gap workflow on drawn struts (frequency domain) and on the recorded ones (raw records)."""

import ast
import json
import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from accept.gap.analyse_unit import run_gap
from accept.models.model_file import open_model
from checks.gap import effects as library
from checks.gap.conditions.trial import check_same_unit
from checks.gap.effects import EFFECTS, Effect, with_effects
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.thresholds import THRESHOLDS, digest
from checks.gap.modelling.unmodelled_modes import unmodelled_modes
from checks.gap.preparation import record_faults as early
from checks.gap.search.candidates import Search
from checks.gap.statistics.projected_residual import judge, project
from checks.gap.workflow import GapRefused, run
from checks.model import Model
from tests.checks.gap.shared.gap_cases import CHANNELS, FS, F, drawn, inputs, recorded, strut
from tests.checks.model.units_model import NOMINAL
from tests.shared.recorded_units import RecordedUnits
from tests.shared.source_trees import nodes

SOAK = os.environ.get("ACCEPT_SOAK") == "1"


HEAVY = (
    ("encoder_scale", {"relative": 0.08}),
    ("loop_delay", {"tau_us": 60.0}),
    ("encoder_bracket_mode", {"f_Hz": 900.0, "damping_ratio": 0.02}),
    ("amplifier_second_order", {"f_Hz": 2500.0, "damping_ratio": 0.4}),
    ("charge_highpass", {"f_Hz": 20.0, "damping_ratio": 0.5}),
    ("sensor_pickup", {"tau_us": 4.0}),
)


@cache
def as_built() -> Model:
    return open_model("strut-as-built")


def holding(effect: Effect) -> Model:
    """The model of the exact modes, or that of struts as built where only it has what the effect changes."""
    asked = [n for p in effect.parameters for n in (*p.sets, *p.adds)]
    return strut() if not asked or effect.stands_for(strut()) else as_built()


def file_of(name: str) -> str:
    """The effects of single channels share a file."""
    head, _, channel = name.rpartition("_")
    return head if channel in CHANNELS else name


def quiet(words: str) -> None:
    del words


class TestLibrary:
    def test_every_file_is_in_the_library(self) -> None:
        files = {p.stem for p in Path(library.__file__).parent.rglob("*.py")} - {"__init__"}
        assert files == {file_of(name) for name in EFFECTS}

    def test_no_effect_is_known_by_name_outside_its_file(self) -> None:
        root = Path(library.__file__).parents[3]
        files = [p for package in ("accept", "checks", "hw", "specs") for p in (root / package).rglob("*.py")]
        compared = []
        for path in (p for p in files if Path(library.__file__).parent not in p.parents):
            for node in nodes(path) if any(name in path.read_text("utf-8") for name in EFFECTS) else ():
                if isinstance(node, ast.Compare):
                    words = [c.value for part in ast.walk(node) if isinstance(c := part, ast.Constant)]
                    compared += [
                        f"{path.name}:{node.lineno}: {w}" for w in words if isinstance(w, str) and w in EFFECTS
                    ]
        assert compared == []

    @pytest.mark.parametrize("name", sorted(EFFECTS))
    def test_declares_itself(self, name: str) -> None:
        effect = EFFECTS[name]
        (module,) = Path(library.__file__).parent.rglob(f"{file_of(name)}.py")
        doc = ast.get_docstring(ast.parse(module.read_text()))
        assert doc is not None
        assert effect.sources
        assert effect.sign
        assert effect.channels
        enters = [effect.factor, effect.turns, effect.stands_for(holding(effect)), effect.bends]
        assert sum(map(bool, enters)) == 1
        for p in effect.parameters:
            assert p.lo < p.hi
            assert p.lo <= p.start <= p.hi
            assert "{" + p.name + "}" in effect.sentence

    @pytest.mark.parametrize("name", sorted(n for n, e in EFFECTS.items() if e.in_model and e.parameters))
    def test_what_is_fitted_is_the_model_with_the_effect(self, name: str) -> None:
        effect = EFFECTS[name]
        values = {p.name: p.start + 0.5 * p.scale for p in effect.parameters}
        response = Augmented(holding(effect), (effect,))
        fitted = response.frf(F, {f"{name}.{k}": v for k, v in values.items()}, CHANNELS)
        built_in = with_effects(holding(effect), [(name, values)])
        np.testing.assert_allclose(fitted, built_in.frf(F, channels=CHANNELS), rtol=1e-12)

    @pytest.mark.parametrize("name", sorted(n for n, e in EFFECTS.items() if e.path and e.factor))
    def test_what_is_simulated_is_what_is_fitted(self, name: str) -> None:
        """Red before: simulated creep ended at 1 ms, and 6 % per decade of it was unidentified."""
        effect, s = EFFECTS[name], 2j * np.pi * F
        assert effect.path is not None
        assert effect.factor is not None
        values = {p.name: p.start + 0.5 * p.scale for p in effect.parameters}
        # relaxations at two places a decade leave 3 % of what creep adds in one
        np.testing.assert_allclose(effect.path(values).at(s), effect.factor(values, s), rtol=2e-4)

    @pytest.mark.parametrize("member", [*EFFECTS.values(), *unmodelled_modes(CHANNELS)], ids=lambda m: m.name)
    def test_derivatives(self, member) -> None:
        model = holding(member) if isinstance(member, Effect) else strut()
        if not getattr(member, "fits", lambda m: True)(model):
            pytest.skip("shows in no response")
        response = Augmented(model, (member,))
        at = {f"{member.name}.{p.name}": p.start + 0.3 * p.scale for p in member.parameters}
        J = response.jacobian(F, list(at), at, CHANNELS)
        for name, d in zip(at, J, strict=True):
            h = 1e-4 * next(p.scale for p in member.parameters if name.endswith("." + p.name))
            up, down = (response.frf(F, {**at, name: at[name] + s * h}, CHANNELS) for s in (1, -1))
            # truncation and rounding of a central difference of 1e-4 of the scale
            np.testing.assert_allclose(d, (up - down) / (2 * h), atol=1e-4 * np.abs(d).max())


def test_calibration_from_far_away() -> None:
    """A sharp mode far from the model's is found: every drawn strut is calibrated down to its noise."""
    for seed in range(8 if SOAK else 4):
        case = inputs(seed)
        search = Search(case.A, case.B, (), THRESHOLDS, quiet)
        c = search.fit(Augmented(case.model, ()), {})
        n = 2 * F.size * 3
        assert 2 * c.cost < stats.chi2.isf(1e-6, n)


def test_null_is_honest() -> None:
    """Model and noise as stated: the global p is hardly ever below 0.001, and not absurdly conservative."""
    p = []
    for seed in range(120 if SOAK else 30):
        case = inputs(seed)
        response = Augmented(case.model, ())
        at = {q.name: drawn(seed).values[q.name] for q in response.free()}
        p.append(judge(project(response, case.B, at), 1e-3).p)
    assert sum(x < 1e-3 for x in p) <= stats.binom.isf(1e-4, len(p), 1e-3)


class TestRun:
    def test_nothing_missing(self) -> None:
        result = run(inputs(3), quiet)
        assert result.verdict == "no_missing_effect"
        assert not result.named
        assert result.detection_limits["loop_delay"]["tau_us"] < 10.0
        assert max(g.G for g in result.gap_after.channels.values()) < 1.1

    @pytest.mark.parametrize(
        ("effect", "values"),
        [
            ("crosstalk", {"V_per_V": 0.02}),
            *(HEAVY if SOAK else ()),
        ],
    )
    def test_one_effect(self, effect: str, values: dict[str, float]) -> None:
        result = run(inputs(5, {effect: values}), quiet)
        assert [n.effect for n in result.named] == [effect]
        assert not result.elements
        assert result.verdict == "explained"
        for name, value in values.items():
            found = result.named[0].parameters[name]
            half = found.hi - found.value
            assert abs(found.value - value) < 2 * half  # twice the half-width: 1 in 10,000

    def test_a_latency_is_not_told_from_a_filter_far_above_the_band(self) -> None:
        result = run(inputs(5, {"channel_latency_Vs": {"tau_us": 40.0}}), quiet)
        assert result.verdict == "ambiguous"
        assert [set(a.effects) for a in result.ambiguous] == [{"channel_latency_Vs", "channel_lowpass_Vs"}]

    @pytest.mark.skipif(not SOAK, reason="heavy: ACCEPT_SOAK=1 runs it")
    def test_without_the_effect_no_other_name(self) -> None:
        case = inputs(5, {"encoder_bracket_mode": {"f_Hz": 900.0, "damping_ratio": 0.02}}, ("encoder_bracket_mode",))
        result = run(case, quiet)
        assert result.verdict == "unexplained"
        assert not result.named

    def test_what_only_a_value_far_off_explains_is_said(self) -> None:
        """Ten standard deviations of its prior: every channel agrees, and nothing in the library does it."""
        truth = drawn(5).with_values({"joint.cR_Nm_s_per_rad": 0.011})
        result = run(replace(inputs(5), A=recorded(truth, 10), B=recorded(truth, 11)), quiet)
        assert result.verdict == "unexplained"
        assert any("a calibrated value is far" in note and "bending damping cR" in note for note in result.notes)

    def test_polarity_and_offset_first(self) -> None:
        case = inputs(6)
        A, B = (early.with_signs(d, ("Vs",)) for d in (case.A, case.B))
        A, B = (early.with_offsets(d, {"de": -2}, FS) for d in (A, B))
        result = run(replace(case, A=A, B=B), quiet)
        assert {n.effect for n in result.named} == {"sensor_polarity", "sample_offset"}
        offset = next(n for n in result.named if n.effect == "sample_offset")
        assert offset.parameters["samples"].value == 2.0
        assert result.verdict == "explained"

    def test_exchanged_channels(self) -> None:
        case = inputs(6, {"misalignment": {"dx_um": 0.0, "dy_um": 200.0}})
        assert early.find_exchanged(case.A, case.model) is None
        swapped = early.with_names(case.A, ("Vs", "de"))
        assert early.find_exchanged(swapped, case.model) == ("Vs", "de")

    def test_other_units_records_are_refused(self) -> None:
        case = inputs(7)
        with pytest.raises(GapRefused, match="not records of one unit"):
            check_same_unit(
                case.A, recorded(drawn(8), 9, {"encoder_scale": {"relative": 0.3}, "crosstalk": {"V_per_V": 0.3}})
            )


def test_thresholds_are_one_table() -> None:
    assert digest() == digest(THRESHOLDS)
    assert digest(replace(THRESHOLDS, p_global=0.01)) != digest()


FOUND = {
    "S-01": ("no_missing_effect", set()),
    "S-02": ("explained", {"misalignment"}),
    "S-03": ("explained", {"amplifier_bandwidth"}),
    "S-04": ("explained", {"bench_mode"}),
    "S-05": ("explained", {"misalignment", "sensor_highpass"}),
    "S-06": ("unexplained", set()),
}


@pytest.mark.parametrize("serial", sorted(FOUND) if SOAK else ["S-01", "S-02", "S-06"])
def test_recorded_unit(serial: str, recorded_units: RecordedUnits) -> None:
    verdict, effects = FOUND[serial]
    found = run_gap(recorded_units.folder(serial), NOMINAL)
    assert found["verdict"] == verdict
    assert {n["effect"] for n in found["named"]} == effects
    outside = 0
    for named in found["named"]:
        for key, value in recorded_units.truth(serial)["effects"][named["effect"]].items():
            p = named["parameters"][key]
            lo, hi = p["ci95"]
            outside += not lo <= value <= hi
            assert abs(value - p["value"]) <= hi - lo
    assert outside <= 1
    if serial == "S-02":  # misalignment shows in de, hardly in da and Vs ([STB] 6.2): so must the gap before it
        before = found["gap_before"]["channels"]
        assert before["de"] > 1000 * before["da"]
        assert before["Vs"] < 1
    if verdict != "unexplained":
        assert max(found["gap_after"]["channels"].values()) <= 1.1
        assert max(m["G"] for m in found["gap_after"]["modes"]) <= 1.1
    else:
        assert found["candidates"]
        pole = found["unnamed"][0]["poles_Hz"][0]
        assert found["unnamed"][0]["channel"] == "Vs"
        assert pole == pytest.approx(recorded_units.truth(serial)["outside_the_library"]["f_Hz"], rel=0.01)
    json.dumps(found, allow_nan=False)


@pytest.mark.skipif(not SOAK, reason="heavy: ACCEPT_SOAK=1 runs it")
@pytest.mark.parametrize(
    ("serial", "without", "verdicts", "left"),
    [
        ("S-02", "misalignment", {"unexplained", "ambiguous"}, set()),
        ("S-03", "amplifier_bandwidth", {"unexplained", "ambiguous"}, set()),
        ("S-04", "bench_mode", {"unexplained", "ambiguous"}, set()),
        ("S-05", "misalignment", {"partly_explained"}, {"sensor_highpass"}),
        ("S-05", "sensor_highpass", {"partly_explained"}, {"misalignment"}),
    ],
)
def test_never_another_name(
    serial: str, without: str, verdicts: set[str], left: set[str], recorded_units: RecordedUnits
) -> None:
    found = run_gap(recorded_units.folder(serial), NOMINAL, without=(without,))
    assert {n["effect"] for n in found["named"]} == left
    assert found["verdict"] in verdicts
