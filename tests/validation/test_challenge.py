"""The blind test's own test: every score is met by a workflow that is always right and not met by one that is wrong in
just that; then a few blind units through the real workflow. `make challenge` runs the 300."""

import copy
import json
import math
import shutil
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.soak import SOAK
from validation import challenge
from validation.cases import Case, counts, draw_cases, seal
from validation.challenge import control_jobs
from validation.effects import LIBRARY, OUTSIDE
from validation.model_files import write_model
from validation.run_cases import METHOD, Job, run_all
from validation.scoring.report import report_of_set
from validation.scoring.results_store import Mixed, Store, stamp
from validation.scoring.scores import (
    Outcome,
    Score,
    confusion,
    controls,
    power,
    scores,
    shuffled_labels,
    single,
    wilson,
)
from validation.sets import SETS

Json = dict[str, Any]
pytestmark = pytest.mark.takes_data
BLIND = 24 if SOAK else 4
SEED = 7  # of development: what `make challenge` reports is drawn from another


# --- results made up --------------------------------------------------------------------------------------------------


def made_up_truths() -> list[Json]:
    rng, names, strange = np.random.default_rng(0), cycle(LIBRARY), cycle(OUTSIDE)
    truths = []
    for kind, n in {**counts(300), "weak": 30}.items():
        for _ in range(n):
            inside = [next(names) for _ in range({"one": 1, "two": 2, "weak": 1}.get(kind, 0))]
            outside = {next(strange): {}} if kind == "outside" else {}
            seen = 0.0 if kind == "none" else float(rng.uniform(25, 5000))
            effects = {name: LIBRARY[name].draw(rng) for name in inside}
            truths.append({"kind": kind, "effects": effects, "outside": outside, "alike": [], "detectability": seen})
    return truths


def perfect(truth: Json, k: int) -> Json:
    """gap.json of a workflow that knows; every twentieth interval misses, as 95 % intervals do."""
    if truth["kind"] == "none":
        return {"verdict": "no_missing_effect", "named": [], "ambiguous": []}
    if truth["kind"] == "outside":
        return {"verdict": "unexplained", "named": [], "ambiguous": []}

    def said(value: float) -> Json:
        off = 0.01 * abs(value) * (2.5 if k % 20 == 0 else 0.5)
        return {"value": value + off, "ci95": [value + off - 0.02 * abs(value), value + off + 0.02 * abs(value)]}

    named = [
        {"effect": e, "parameters": {p: said(v) for p, v in values.items()}} for e, values in truth["effects"].items()
    ]
    after = {"G": 1.0, "channels": {"de": 1.0, "da": 1.01, "Vs": 0.99}}
    return {"verdict": "explained", "named": named, "ambiguous": [], "gap_after": after}


@pytest.fixture(scope="module")
def right() -> list[Outcome]:
    return [Outcome(f"B-{k:03d}", t, perfect(t, k), 5.0) for k, t in enumerate(made_up_truths())]


@pytest.fixture(scope="module")
def removed(right: list[Outcome]) -> list[Outcome]:
    single = [o for o in right if o.kind == "one"][:30]
    return [Outcome(o.serial, o.truth, {"verdict": "unexplained"}, 5.0, None, tuple(o.true)) for o in single]


def spoilt(
    outcomes: Sequence[Outcome], kinds: Sequence[str], every: int, change: Callable[[Json], None]
) -> list[Outcome]:
    """The outcomes with every so many-th of these kinds changed."""
    out, seen = [], 0
    for o in outcomes:
        gap = copy.deepcopy(dict(o.gap))
        if o.kind in kinds:
            seen += 1
            if seen % every == 0:
                change(gap)
        out.append(Outcome(o.serial, o.truth, gap, o.seconds, o.error, o.without))
    return out


def by_name(rows: Sequence[Score]) -> dict[str, Score]:
    return {s.name: s for s in rows}


def test_a_workflow_that_is_right_meets_every_target(right: list[Outcome], removed: list[Outcome]) -> None:
    assert [s.name for s in (*scores(right), *controls(right, removed)) if not s.met] == []


def test_nothing_measured_meets_nothing() -> None:
    assert [s.name for s in (*scores([]), *controls([], [])) if s.met] == []


def name_falsely(gap: Json) -> None:
    gap["named"] = [{"effect": "no_such_effect", "parameters": {}}, *gap.get("named", [])]


def say(verdict: str) -> Callable[[Json], None]:
    return lambda gap: gap.update(verdict=verdict, named=[])


def move(factor: float) -> Callable[[Json], None]:
    def change(gap: Json) -> None:
        for each in gap["named"]:
            for p in each["parameters"].values():
                p["value"] *= factor

    return change


def narrow(gap: Json) -> None:
    for each in gap["named"]:
        for p in each["parameters"].values():
            p["ci95"] = [p["value"], p["value"]]


def widen(gap: Json) -> None:
    for each in gap["named"]:
        for p in each["parameters"].values():
            p["ci95"] = [-math.inf, math.inf]


def blur(gap: Json) -> None:
    gap["ambiguous"] = [{"effects": [gap["named"][0]["effect"], "another"]}]
    gap.update(verdict="ambiguous", named=[])


def leave(gap: Json) -> None:
    gap["gap_after"]["channels"]["Vs"] = 1.2


def leave_a_mode(gap: Json) -> None:
    gap["gap_after"]["modes"] = [{"channel": "de", "f_Hz": 191.0, "G": 1.3}]


def lose_after(gap: Json) -> None:
    gap["gap_after"] = None


def drop_second(gap: Json) -> None:
    gap["named"] = gap["named"][:1]


def turn(gap: Json) -> None:
    gap["named"] = gap["named"][::-1]


FAULTS = [
    ("false alarm, nothing missing", ["none"], 45, say("unexplained")),
    ("a false name, all cases", ["none", "one", "two", "outside"], 20, name_falsely),
    ("outside: called unnamed", ["outside"], 8, say("no_missing_effect")),
    ("outside: falsely named", ["outside"], 15, name_falsely),
    ("one effect: first name right", ["one"], 15, name_falsely),
    ("one effect: in the class", ["one"], 20, say("unexplained")),
    ("one effect: median class", ["one"], 1, blur),
    ("two effects: exact set", ["two"], 3, drop_second),
    ("95 % intervals cover", ["one", "two"], 10, narrow),
    ("95 % intervals cover", ["one", "two"], 1, widen),
    ("parameter error, median", ["one", "two"], 1, move(1.1)),
    ("parameter error, median", ["one", "two"], 50, move(math.nan)),
    ("G after <= 1.1, of the explained", ["one", "two"], 8, leave),
    ("G after <= 1.1, of the explained", ["one", "two"], 8, leave_a_mode),
    ("G after <= 1.1, of the explained", ["one", "two"], 8, lose_after),
    ("misalignment dx_um: RMS error", ["one", "two"], 1, move(1.1)),
    ("misalignment dy_um: RMS error", ["one", "two"], 1, move(1.1)),
]


@pytest.mark.parametrize(
    ("name", "kinds", "every", "change"), FAULTS, ids=[f"{k}-{f[0]}" for k, f in enumerate(FAULTS)]
)
def test_each_score_can_fail(
    right: list[Outcome], name: str, kinds: list[str], every: int, change: Callable[[Json], None]
) -> None:
    assert by_name(scores(right))[name].met
    assert not by_name(scores(spoilt(right, kinds, every, change)))[name].met


def test_an_error_counts_against_everything_it_touches(right: list[Outcome]) -> None:
    broken = [Outcome(o.serial, o.truth, {}, 5.0, "ValueError: x") for o in right]
    met = [s.name for s in scores(broken) if s.met]
    # an error names nothing, and takes its time
    assert met == ["a false name, all cases", "outside: falsely named", "seconds, 95 % of the units"]


def test_slow_units_fail_the_time(right: list[Outcome]) -> None:
    slow = [Outcome(o.serial, o.truth, o.gap, 16.0 if k % 10 == 0 else 5.0) for k, o in enumerate(right)]
    assert not by_name(scores(slow))["seconds, 95 % of the units"].met
    lost = [Outcome(o.serial, o.truth, o.gap, math.nan if k == 0 else 5.0) for k, o in enumerate(right)]
    assert not by_name(scores(lost))["seconds, 95 % of the units"].met


def test_controls_can_fail(right: list[Outcome], removed: list[Outcome]) -> None:
    weak = spoilt(right, ["weak"], 10, name_falsely)
    assert [s.name for s in controls(weak, removed) if not s.met] == ["weak effects: a false name"]
    assert scores(weak) == scores(right)
    wrong = spoilt(removed, ["one"], 5, name_falsely)
    assert [s.name for s in controls(right, wrong) if not s.met] == [
        "effect not in the library: unnamed",
        "effect not in the library: a false name",
    ]
    # a workflow that gives every unit the same name is as good with shuffled labels as with the true ones: at chance
    same = [
        Outcome(o.serial, o.truth, {"verdict": "explained", "named": [{"effect": "creep", "parameters": {}}]})
        for o in right
    ]
    true, mixed, chance = shuffled_labels(same)
    assert true == pytest.approx(mixed) == pytest.approx(chance)
    assert shuffled_labels(right)[1] == pytest.approx(1 / len(LIBRARY), abs=0.01)


def test_an_alike_name_is_neither_false_nor_unnamed() -> None:
    truth = {
        "kind": "outside",
        "effects": {},
        "outside": {"channel_lag": {}},
        "alike": ["sample_offset"],
        "detectability": 50.0,
    }
    o = Outcome("B-0", truth, {"verdict": "explained", "named": [{"effect": "sample_offset", "parameters": {}}]})
    assert o.false_names == []
    assert not o.unnamed


def test_wilson_is_the_printed_one() -> None:
    """[NEWCOMBE98] table I, method 3: 81 of 263, 15 of 148, 0 of 20, 1 of 29."""
    for hits, n, lo, hi in (
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):
        np.testing.assert_allclose(wilson(hits, n), (lo, hi), atol=5e-5)
    assert wilson(0, 0) == (0.0, 1.0)


def test_confusion_and_power_count_every_single_effect(right: list[Outcome]) -> None:
    table = confusion(right)
    assert set(table) == {"nothing", *LIBRARY, *OUTSIDE}
    assert sum(sum(row.values()) for row in table.values()) == 90 + 120 + 45
    hidden = Counter(name for o in right if o.truth["kind"] == "one" for name in o.truth["effects"])
    assert set(hidden) == set(LIBRARY)
    assert all(table[name] == {name: hidden[name]} for name in LIBRARY)
    groups = power(right)
    assert sum(s.n for _, _, s in groups) == 150
    assert all(lo <= hi and s.value == 1.0 for lo, hi, s in groups)


def test_weak_effects_are_a_matter_of_power_and_not_of_names(right: list[Outcome]) -> None:
    weak = [Outcome(o.serial, {**o.truth, "detectability": 1.0}, {"verdict": "no_missing_effect"}, 5.0) for o in right]
    assert by_name(scores(weak))["one effect: first name right"].n == 0
    assert all(s.value == 0.0 for _, _, s in power(weak))


# --- the runner -------------------------------------------------------------------------------------------------------


def nothing(folder: Path, model: Path, *, without: Sequence[str] = ()) -> Json:
    """A workflow that never sees anything, and notes what it was given."""
    assert sorted(p.name for p in folder.parent.iterdir()) == [folder.name]
    assert not any("truth" in p.name for p in folder.iterdir())
    assert model.name == "model.toml"
    return {"verdict": "no_missing_effect", "named": [], "without": list(without)}


def crash(folder: Path, model: Path, *, without: Sequence[str] = ()) -> Json:
    raise ValueError(f"cannot read {folder.name}")


def not_json(folder: Path, model: Path, *, without: Sequence[str] = ()) -> Json:
    return {"verdict": "no_missing_effect", "named": [], "flag": np.bool_(True)}


@pytest.fixture(scope="module", autouse=True)
def written_once(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A unit is recorded once for all tests here, and each workflow is given its own copy."""
    place, made, seen = tmp_path_factory.mktemp("recorded"), {}, {}
    write, detectability = Case.write, Case.detectability

    def copy_of(case: Case, parent: Path) -> Path:
        if case.serial not in made:
            made[case.serial] = write(case, place)
        return Path(shutil.copytree(made[case.serial], parent / made[case.serial].name))

    def seen_once(case: Case) -> float:
        return seen[case.serial] if case.serial in seen else seen.setdefault(case.serial, detectability(case))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Case, "write", copy_of)
        patch.setattr(Case, "detectability", seen_once)
        yield


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_model(SETS["exact"], tmp_path_factory.mktemp("model"))


def jobs(number: int, workflow: str, model: Path) -> list[Job]:
    """The first of those that are drawn for all tests here."""
    cases = draw_cases(BLIND, SEED)[:number]
    truth = json.loads(seal(cases)[0])
    return [Job(case, truth[case.serial], workflow, model=model) for case in cases]


def test_the_runner_hands_over_folders_and_keeps_what_was_said(tmp_path: Path, model: Path) -> None:
    store = Store(tmp_path, stamp("sealed"))
    made = jobs(4, "tests.validation.test_challenge:nothing", model)
    every = [*made, *control_jobs(made, 1)]
    outcomes = run_all(every, workers=0, store=store)
    assert [o.error for o in outcomes] == [None] * 5
    assert outcomes[4].gap["without"] == list(outcomes[4].true)
    assert run_all(every, workers=0, store=store) == outcomes  # from the files: times and all
    said, met = report_of_set("exact", outcomes[:4], outcomes[4:])
    assert not met
    assert "NOT MET" in said
    assert "false alarm" in said


def test_a_stopped_run_goes_on_and_never_mixes_versions(tmp_path: Path, model: Path) -> None:
    made = jobs(2, "tests.validation.test_challenge:nothing", model)
    now = stamp("sealed")
    first = run_all(made[:1], workers=0, store=Store(tmp_path, now))
    later = [Job(job.case, job.truth, "tests.validation.test_challenge:crash", model=model) for job in made]
    every = run_all(later, workers=0, store=Store(tmp_path, now))
    assert every[:1] == first
    assert [bool(o.error) for o in every] == [False, True]
    for changed in ("thresholds", "code", "sealed"):
        with pytest.raises(Mixed, match=changed):
            run_all(made, workers=0, store=Store(tmp_path, replace(now, **{changed: "0" * 64})))
    other = [replace(job, case=replace(job.case, seed=job.case.seed + 1)) for job in made]
    with pytest.raises(Mixed, match="seed"):
        run_all(other, workers=0, store=Store(tmp_path, now))


def test_a_crash_of_the_workflow_is_an_outcome(model: Path) -> None:
    (outcome,) = run_all(jobs(4, "tests.validation.test_challenge:crash", model)[:1], workers=0)
    assert outcome.verdict == "error"
    assert outcome.error == f"ValueError: cannot read {outcome.serial}"


def test_what_is_no_json_is_an_error_too(model: Path) -> None:
    (outcome,) = run_all(jobs(4, "tests.validation.test_challenge:not_json", model)[:1], workers=0)
    assert outcome.verdict == "error"


def test_reported_and_development_seeds_differ() -> None:
    assert challenge.REPORTED_SEED not in challenge.DEVELOPMENT_SEEDS
    assert SEED in challenge.DEVELOPMENT_SEEDS


# --- the workflow itself, reduced -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def blind(model: Path) -> list[Outcome]:
    """Units of the mix through the real workflow: four, one of every kind; with ACCEPT_SOAK=1 twenty-four."""
    return run_all(jobs(BLIND, METHOD, model), workers=0)


def test_blind_units_get_no_false_name_and_no_false_alarm(blind: list[Outcome]) -> None:
    assert [f"{o.serial}: {o.error}" for o in blind if o.error] == []
    assert [f"{o.serial}: {o.false_names}, was {dict(o.truth['effects'])}" for o in blind if o.false_names] == []
    assert {o.verdict for o in blind if o.kind == "none"} == {"no_missing_effect"}


def test_blind_units_get_their_right_name(blind: list[Outcome]) -> None:
    """At most one wrong: at the 95 % that the method asks, more happen in 4 of 100 seeds; this is fixed."""
    rows = [(e, o.label) for o, e in single(blind) if o.label != e]
    assert len(rows) <= 1, rows
    assert {o.kind for o in blind} == {"none", "one", "two", "outside"}
