"""Causes: each is made with the parameters that its sentence and its advice show, and survives results.json."""

import ast
import json
import pickle
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

import pytest

from accept.judging.advice import ADVICE, lines
from checks.acceptance import CHECKS
from checks.cause import Cause, NoResult, Reason, because, together
from tests.shared.source_trees import nodes

ROOT = Path(__file__).parents[2]
ABOUT = {"record", "file"}


def fields(template: str) -> set[str]:
    """Its parameters; the unit behind a number is made of `unit`, a value beside its U of both."""
    made_of = {"in_unit": {"unit"}, "value_and_U": {"value", "U"}}
    return set().union(*(made_of.get(name, {name}) for _, name, _, _ in Formatter().parse(template) if name))


def made() -> Iterator[tuple[str, Cause, set[str] | None]]:
    """(place, cause, its parameters; None where they are unpacked from a mapping) of every cause in the code."""
    for path in (p for package in ("accept", "checks", "hw") for p in (ROOT / package).rglob("*.py")):
        for node in nodes(path):
            match node:
                case ast.Call(args=args, keywords=keywords):
                    for arg in args:
                        if (
                            isinstance(arg, ast.Attribute)
                            and isinstance(arg.value, ast.Name)
                            and arg.value.id == "Cause"
                        ):
                            names = [k.arg for k in keywords]
                            given = None if None in names else {str(n) for n in names}
                            yield f"{path.name}:{node.lineno}", Cause[arg.attr], given


def test_every_cause_is_made_with_the_parameters_of_its_sentence() -> None:
    found = list(made())
    assert len(found) > 100
    wrong = [
        (place, cause.name, fields(cause.value) - given)
        for place, cause, given in found
        if given is not None and fields(cause.value) - given
    ]
    assert not wrong
    assert set(Cause) == {cause for _, cause, _ in found}


@pytest.mark.parametrize("cause", ADVICE, ids=lambda c: c.name)
def test_advice_shows_what_its_cause_knows(cause: Cause) -> None:
    assert fields(ADVICE[cause]) <= fields(cause.value)


def test_a_parameter_that_is_missing_shows_where_the_reason_is_made() -> None:
    with pytest.raises(KeyError, match="reference"):
        because(Cause.CHANNEL_NOT_DRIVEN, channel="de")


def test_a_reason_survives_results_json_and_another_process() -> None:
    clipped = because(
        Cause.CHANNEL_CLIPPED, record="low", file="a.mat", channel="Vs", count=60, end="largest", value=10.0, where=""
    )
    reason = together([clipped, because(Cause.U_UNKNOWN), clipped])
    assert str(reason).startswith("low record (a.mat): sensor stack Vs is clipped: 60 samples")
    assert [r.cause for r in reason.all()] == [Cause.CHANNEL_CLIPPED, Cause.U_UNKNOWN]
    assert Reason.from_json(json.loads(json.dumps(reason.to_json()))) == reason
    error = pickle.loads(pickle.dumps(NoResult(reason)))
    assert (error.reason, str(error)) == (reason, str(reason))


def test_advice_names_the_record_and_every_channel_that_is_wrong() -> None:
    turned = [
        because(Cause.CHANNEL_REVERSED, record="low", channel=c, reference="Va", found="with", expected="against")
        for c in ("Vs", "de")
    ]
    told = lines(CHECKS["frf"], together(turned))
    assert len(told) == 2
    assert "sensor stack Vs" in told[0]
    assert "encoder de" in told[1]
    assert told[0].startswith(CHECKS["frf"].inputs["low"].called)
