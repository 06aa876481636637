"""The usual value of a quantity: the median over the last units of the kind, each once."""

from statistics import median

from accept.base.home import home
from accept.judging import load_spec
from accept.store import Store, open_store
from accept.tui.widgets.limit_bar import LIMIT, USUAL, VALUE, LimitBar
from accept.workflow.session.judgements import FEWEST, earlier_values
from accept.workflow.session.open_session import UNITS, earlier_units, open_session
from accept.workflow.worker.judging import judge_whole_unit
from checks.declare import Measured


def judged(store: Store, serial: str, sensor_uF: float) -> None:
    session = open_session(store, home(), load_spec("apa-basic"), "Ann", serial)
    if session.run.attempt is None:
        session.begin({})
    session.entries.take("capacitance", session.step("capacitance").check.inputs["sensor_uF"], Measured(sensor_uF))
    judge_whole_unit(session)
    session.close()


def usual(store: Store, kind: str, but: str = "") -> dict[str, float]:
    return {name: median(values) for name, values in earlier_values(earlier_units(store, kind, but)).items()}


def test_the_median_of_the_last_units_each_once_and_not_this_one():
    with open_store() as store:
        for n in range(FEWEST - 1):
            judged(store, f"A-{n}", 4.90)
        judged(store, "A-0", 4.90)  # again: it is no further unit
        assert usual(store, "apa") == {}
        judged(store, "A-9", 5.30)
        assert usual(store, "apa")["sensor_uF"] == 4.90
        assert usual(store, "apa", but="A-9") == {}
        assert usual(store, "strut") == {}
        for n in range(UNITS):
            judged(store, f"B-{n:02d}", 5.00)
        assert usual(store, "apa")["sensor_uF"] == 5.00  # what is older no longer counts
        session = open_session(store, home(), load_spec("apa-basic"), "Ann", "C-1")
        assert session.judgements.usual["sensor_uF"] == 5.00
        session.close()


def test_the_tick_stands_at_the_usual_value_and_hides_no_limit_and_no_value():
    def bar(usual: float) -> str:
        return LimitBar(4.4, 5.5, 30, 5.2).drawn("green", 0.02, usual).plain

    assert bar(4.8).count(USUAL) == 1
    assert bar(4.8).index(LIMIT) < bar(4.8).index(USUAL) < bar(4.8).index(VALUE)
    assert USUAL not in bar(5.2)
    assert bar(4.4).count(LIMIT) == 2
    assert USUAL not in bar(50.0)
