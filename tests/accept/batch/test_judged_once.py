"""Whatever the store knows against a unit, it is judged, and searched for what is missing, once in a run."""

from collections import Counter
from pathlib import Path

import pytest

from accept import gap
from accept.base.documents.results import UnitRecord
from accept.base.home import home
from accept.batch import job
from accept.batch.judge_batch import BatchRequest, run
from accept.certificate.page import document
from accept.certificate.trust import keys
from accept.judging import load_spec
from accept.store import fold, open_store
from tests.accept.batch.test_copies import UNIT, accept, unit, verdicts
from tests.accept.batch.test_parts import BAD, STRUT
from tests.accept.units.units import LOOPS, make_unit

SEARCHED = '[gap]\nmodel = "strut"\n'
RESPONSES = '[frf]\nlow = "{{file}}"\nhigh = "{{file}}"\n'


@pytest.fixture
def done(monkeypatch: pytest.MonkeyPatch) -> Counter[tuple[str, str]]:
    """(what, serial) -> how often."""
    count: Counter[tuple[str, str]] = Counter()
    judge, draw = job.judge_unit, document.render

    def judged(held, *given):
        count["judged", held.folder.serial] += 1
        return judge(held, *given)

    def searched(result: UnitRecord, *_: object) -> UnitRecord:
        count["searched", result.serial] += 1
        return result

    def drawn(contents, *given):
        count["drawn", contents.serial] += 1
        return draw(contents, *given)

    monkeypatch.setattr(job, "judge_unit", judged)
    monkeypatch.setattr(gap, "explain_result", searched)
    monkeypatch.setattr(document, "render", drawn)
    return count


def test_copies_in_one_batch(tmp_path: Path, done: Counter[tuple[str, str]]) -> None:
    """The first of two was certified before the second one came: it is settled again from what was found."""
    spec = tmp_path / "loops.toml"
    spec.write_text(LOOPS)
    units, out = tmp_path / "units", tmp_path / "out"
    for serial, seed in (("A-1", 1), ("B-1", 1), ("C-1", 2)):
        unit(units / serial, serial, seed)
    accept("batch", units, "--spec", spec, "--out", out, "--workers", 1)
    assert verdicts(out) == {"A-1": "incomplete", "B-1": "incomplete", "C-1": "accepted"}
    assert {serial: done["judged", serial] for serial in verdicts(out)} == {"A-1": 1, "B-1": 1, "C-1": 1}
    assert done["drawn", "C-1"] == 1
    assert accept("verify", out / "certificates" / "A-1.pdf").exit_code == 0
    done.clear()
    unit(units / "A-1", "A-1", 1, text=UNIT.replace("4.99", "4.98"))
    accept("batch", units, "--spec", spec, "--out", out, "--workers", 1, "--reason", "measured again")
    assert done == {("judged", "A-1"): 1, ("drawn", "A-1"): 1}  # that it is a copy was known before


@pytest.mark.parametrize("known_before", [True, False])
def test_a_doubted_part(known_before: bool, tmp_path: Path, done: Counter[tuple[str, str]]) -> None:
    """Judged before the strut, or after it in the same batch, when its page is drawn again."""
    spec = tmp_path / "loops.toml"
    loops = LOOPS.index("[checks.hysteresis")
    head = LOOPS[: LOOPS.index("[checks.capacitance")].replace('"apa"', '"strut"')
    spec.write_text(head + SEARCHED + LOOPS[loops:])
    units, out = tmp_path / "units", tmp_path / "out"
    unit(units / "A-S", "A-S", 1, text=(STRUT + RESPONSES).format(apa="X-1"))
    bad = make_unit((tmp_path if known_before else units) / "X-1", "X-1", BAD)
    if known_before:
        accept("batch", bad, "--spec", "apa-basic", "--out", tmp_path / "first", "--workers", 1)
    if not known_before:
        keys.init(home(), "correct horse", "Test Technician")
    specs = {"apa": load_spec("apa-basic"), "strut": load_spec(str(spec))}
    credential = keys.unlock(home(), keys.TECHNICIAN, "correct horse")
    with open_store() as store:
        asked = BatchRequest([units], out, specs, "Test Technician", credential, workers=1)
        run(asked, store, lambda _: None)
    assert verdicts(out)["A-S"] == "conditional"
    assert (done["judged", "A-S"], done["searched", "A-S"]) == (1, 1)
    assert done["drawn", "A-S"] == (1 if known_before else 2)


def test_another_version_of_the_program_judges_once_more(
    tmp_path: Path, done: Counter[tuple[str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = tmp_path / "loops.toml"
    spec.write_text(LOOPS)
    unit(tmp_path / "units" / "A-1", "A-1", 1)
    attempts = []
    for code in (None, None, "f" * 64, "f" * 64):
        if code is not None:
            monkeypatch.setattr("accept.batch.pipeline.code_sha256", lambda code=code: code)
        accept("batch", tmp_path / "units", "--spec", spec, "--out", tmp_path / "out", "--workers", 1)
        with open_store() as store:
            state = fold(store.events("A-1"))
        assert state is not None
        attempts.append((state.attempts, done["judged", "A-1"]))
    assert attempts == [(1, 1), (1, 1), (2, 2), (2, 2)]  # no reason is asked for: the result is the same
    assert verdicts(tmp_path / "out") == {"A-1": "accepted"}
