"""No fault of a line and no key that a protocol tells gives a wrong value, at instruments that were written from the
documents alone by a person who had not read the drivers. One case in sixteen here, every case in the heavy lane."""

import pytest

from tests.hw.apart.table import BENCHES, DEADLINE, cases, run
from tests.soak import SOAK

SIXTEENTH = 16


@pytest.mark.slow
@pytest.mark.parametrize("name", BENCHES)
def test_no_fault_gives_a_wrong_value(name):
    every = list(cases(BENCHES[name]))
    chosen = every if SOAK else every[list(BENCHES).index(name) :: SIXTEENTH]
    totals = run(name, chosen)
    for kind in ("wire", "panel"):
        assert totals[kind].wrong == []
    assert [crash for total in totals.values() for crash in total.crashes] == []
    assert max(total.slowest for total in totals.values()) < 2 * DEADLINE + 3.0  # connect and read; a crowded machine
    readings = sum(total.right + total.refused for kind, total in totals.items() if kind != "untold")
    assert readings == 4 * sum(case.kind != "untold" for case in chosen)


@pytest.mark.parametrize("name", BENCHES)
def test_without_a_fault_every_reading_is_right(name):
    kept = [case for case in cases(BENCHES[name]) if case.name.startswith("late, in time, at message")][:1]
    total = run(name, kept)["wire"]
    assert (total.right, total.refused, total.wrong) == (4, 0, [])


@pytest.mark.parametrize("name", ["OPTORSD", "ND 287", "LCR-800", "E4980A", "IDS3010"])
def test_the_table_would_show_a_wrong_value(name, monkeypatch):
    """What no protocol tells, counted as if it were told."""
    held = next(case for case in cases(BENCHES[name]) if case.kind == "untold")
    assert run(name, [held])["untold"].wrong
