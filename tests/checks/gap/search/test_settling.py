"""One experiment settles what a first answer leaves open: the proposal separates every member of the class, elements
too, and after it the class is smaller, holds the truth, and names nothing that is refuted."""

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from checks.errors import ModelError
from checks.gap.conditions.kinds import EXPERIMENT_KINDS, REMOVED, SIDE_MASSES
from checks.gap.conditions.trial import ConditionTrial, together, under_experiment
from checks.gap.decision.next_experiment import every_experiment
from checks.gap.decision.result import Result
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.element import element
from checks.gap.workflow import run
from checks.model import Model
from tests.checks.gap.search.test_elements import BELLOWS, exact, found, hiding, parts, truth
from tests.checks.gap.shared.gap_cases import CHANNELS, F, recorded
from validation.model_files import write_model
from validation.sets import Set
from validation.shell import PUBLIC
from validation.studies.settling import draw, settle

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
ENTRY = re.compile(r'kind = "([^"]+)"(?:, \w+ = ([\d.]+))?')
PULLED = {"element.top_interface.z.spring_N_per_um": 0.1}


def trial(model: Model, kind: str, value: float | None, seed: int) -> ConditionTrial:
    changed = under_experiment(model, EXPERIMENT_KINDS[kind], value)
    return ConditionTrial(kind, EXPERIMENT_KINDS[kind], value, *(recorded(changed, seed + k) for k in (0, 1)))


def asked(result: Result) -> tuple[str, float | None]:
    found = ENTRY.search(result.elements[0].experiment)
    assert found is not None, result.elements[0].experiment
    return found[1], float(found[2]) if found[2] else None


def second(elements: dict[str, float], *given: ConditionTrial) -> Result:
    return run(replace(hiding(elements), trials=given), lambda _: None)


@pytest.mark.parametrize(("hidden", "at_top"), [(BELLOWS, False), (PULLED, True)])
def test_the_experiment_that_is_asked_for_leaves_the_right_place(
    hidden: dict[str, float], at_top: bool, of_bellows: Result
) -> None:
    """Red while the proposal knew no elements: "removed, one part after the other", without an entry."""
    before = found(hidden) if at_top else of_bellows
    true = ("top interface" if at_top else "payload", "ground")
    assert len(parts(before)) > 1
    assert true in parts(before)
    assert before.elements[0].experiment in every_experiment()
    assert any(n.startswith("by the experiment the nearest two of") for n in before.notes)
    answer, given = before, []
    for k in range(2):  # the second, if the first leaves two places
        kind, value = asked(answer)
        given.append(trial(truth().with_elements(hidden), kind, value, 900 + 10 * k))
        left, answer = parts(answer), second(hidden, *given)
        assert set(parts(answer)) < set(left)
        assert true in parts(answer)
        assert (answer.named, [t.holds for t in answer.experiments]) == ((), [True] * len(given))
        if len(parts(answer)) == 1:
            break
    assert parts(answer) == [true]
    assert (answer.verdict, answer.elements[0].kind) == ("explained", "spring")
    k_N_per_um = answer.elements[0].parameters["k_N_per_um"]
    assert k_N_per_um.lo - 0.01 < 0.1 < k_N_per_um.hi + 0.01


def test_an_element_that_an_experiment_refutes_is_not_stated() -> None:
    """Whatever is at the payload was said to be removed, and nothing has changed, with a class of one place before."""
    only = replace(hiding(BELLOWS), model=exact())
    held = ConditionTrial("added_mass", EXPERIMENT_KINDS["added_mass"], 0.5, only.A, only.B)  # no mass was added
    answer = run(replace(only, trials=(held,)), lambda _: None)
    assert (answer.named, answer.elements) == ((), ())
    assert not answer.experiments[0].holds
    assert answer.verdict == "unexplained"


class TestConditions:
    @pytest.mark.parametrize("kind", SIDE_MASSES)
    def test_a_mass_beside_the_axis_is_one_at_its_point(self, kind: object) -> None:
        place, side = kind.place[:-2], kind.place[-2:]  # type: ignore[attr-defined]
        x, y = {"+x": (30.0, 0.0), "-x": (-30.0, 0.0), "+y": (0.0, 30.0), "-y": (0.0, -30.0)}[side]
        at = {f"element.{place}.{d}.{n}": v for d in "xyz" for n, v in (
            ("added_kg", 0.5), ("point_x_mm", x), ("point_y_mm", y))}  # fmt: skip
        heavy = under_experiment(truth(), kind, 0.5)  # type: ignore[arg-type]
        np.testing.assert_allclose(heavy.frf(F), truth().with_elements(at).frf(F), rtol=1e-9)
        assert np.max(np.abs(heavy.frf(F) / truth().frf(F) - 1.0)) > 0.01

    def test_beside_an_element_at_the_same_place_a_mass_has_its_own_point(self) -> None:
        holder = truth().with_elements({**PULLED, "element.top_interface.z.point_y_mm": -16.0})
        response = Augmented(exact()).with_member(element("top_interface", "z", "holder"))
        heavy = trial(holder, "mass_on_top_interface+y", 0.5, 1)
        every = together(response, [heavy])
        at = {p.name: p.begin for p in every.free()}
        at |= {"holder_top_interface_z.k_N_per_um": 0.1, "holder_top_interface_z.y_mm": -16.0}
        direct = exact().with_elements({**PULLED, "element.top_interface.z.point_y_mm": -16.0})
        direct = under_experiment(direct, heavy.kind, 0.5)
        np.testing.assert_allclose(every.frf(F, at, ("de@" + heavy.name,)), direct.frf(F, channels=("de",)), rtol=1e-9)

    @pytest.mark.parametrize("kind", [k for k in REMOVED if k.place in ("payload", "top_interface", "head")])
    def test_what_is_removed_is_gone_and_all_else_stays(self, kind: object) -> None:
        hung = {f"element.{p}.z.{n}": v for p in ("payload", "top_interface", "head") for n, v in (
            ("hung_kg", 0.05), ("hung_Hz", 90.0), ("hung_damping_ratio", 0.02), ("spring_N_per_um", 0.1))}  # fmt: skip
        removed = under_experiment(truth().with_elements(hung), kind, None)  # type: ignore[arg-type]
        rest = {n: v for n, v in hung.items() if n.split(".")[1] != kind.place}  # type: ignore[attr-defined]
        H = truth().with_elements(rest).frf(F, channels=CHANNELS)
        np.testing.assert_allclose(removed.frf(F, channels=CHANNELS), H, rtol=2e-4)  # a millionth of it is left

    def test_a_cable_of_its_own_ends_what_couples_into_it(self) -> None:
        coupled = truth().with_values({"sensor.crosstalk_V_per_V": 0.02, "sensor.pickup_us": 3.0})
        np.testing.assert_allclose(
            under_experiment(coupled, EXPERIMENT_KINDS["own_return"], None).frf(F), truth().frf(F), rtol=1e-12
        )
        assert under_experiment(truth(), EXPERIMENT_KINDS["drive_level"], 0.5) is truth()

    def test_derivatives_are_those_of_the_response(self) -> None:
        """Central differences; 1e-4 of the largest: their own truncation and rounding."""
        e = element("payload", "z", "spring")
        response = Augmented(exact(), (EFFECTS["crosstalk"],)).with_member(e)
        given = [trial(truth(), k, v, 1) for k, v in (
            ("removed_from_payload", None), ("own_return", None), ("mass_on_top_interface+y", 0.2))]  # fmt: skip
        every = together(response, given)
        at = {p.name: p.begin for p in every.free()} | {f"{e.name}.k_N_per_um": 0.1, "crosstalk.V_per_V": 0.01}
        names = [f"{e.name}.k_N_per_um", "crosstalk.V_per_V", "joint.kz_N_per_um"]
        for t in given:
            channels = tuple(f"{c}@{t.name}" for c in CHANNELS)
            D = every.jacobian(F[:40], names, at, channels)
            for d, n in zip(D, names, strict=True):
                gone = t.kind in REMOVED and n == names[0]  # a millionth is left, in proportion
                h = (0.5 if gone else 1e-4) * abs(at[n])
                ends = [every.frf(F[:40], at | {n: at[n] + s * h}, channels) for s in (1.0, -1.0)]
                slope = (ends[0] - ends[1]) / (2.0 * h)
                np.testing.assert_allclose(d, slope, atol=1e-4 * max(np.abs(slope).max(), 1e-12))

    def test_a_mass_without_its_value_is_refused(self) -> None:
        with pytest.raises(ModelError, match="given without its value"):
            under_experiment(truth(), SIDE_MASSES[0], None)


@pytest.mark.slow
@pytest.mark.takes_data
@pytest.mark.skipif(not PUBLIC.exists(), reason="the matrices of the shell are not there")
@pytest.mark.parametrize("scatter", [0.0, *([0.01] if SOAK else [])])
def test_no_truth_is_refuted_end_to_end(scatter: float, tmp_path: Path) -> None:
    """By the independent generator: hidden element, first answer, the experiment that it asks for, second answer."""
    model = write_model(Set(0, {}, scatter, scatter), tmp_path / "model")
    drawn = draw(12 if SOAK else 1, 77, scatter)
    said = [settle(case, true, model, 77_000 + 10 * k, 2)["outcomes"] for k, (_, case, true) in enumerate(drawn)]
    several = [outcomes for outcomes in said if not outcomes[0].startswith("not several")]
    assert several
    assert not any(o in ("false name", "truth refuted") for outcomes in said for o in outcomes)
    settled = [outcomes for outcomes in several if outcomes[-1] == "one and right"]
    assert len(settled) >= 0.8 * len(several)
