"""What was measured before an attempt that was not accepted does not replace it, and how the attempts before ended is
stated."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from accept.base.home import home
from accept.certificate import read_contents, rejudge
from accept.certificate.contents.statements import statements
from accept.certificate.trust import encrypted_key, keys
from accept.store import open_store
from accept.store.payloads import AttemptStarted, StepNoted, UnitJudged
from hw.records import csv_bytes
from tests.accept.certificate.verify.verify_help import verify
from tests.accept.units.units import DRIVE, GOOD, LOOPS, make_unit
from tests.checks.acceptance.play_model import Plays
from tests.shared.command_line import accept

WHY = ("--reason", "measured again")
LATER = GOOD.replace("5.10", "5.06").replace("373.2", "150.5").replace("1.70", "1.68").replace("10.03", "9.98")
RECORDED = """
serial = "A-1"
kind = "apa"
[capacitance]
sensor_uF = {sensor}
actuator_uF = 9.85
[hysteresis]
record = "loops.csv"
"""


@pytest.fixture(autouse=True)
def _bench(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encrypted_key, "ITERATIONS", 10)
    monkeypatch.setenv("ACCEPT_PASSPHRASE", "correct horse")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")


def recorded(folder: Path, seed: int, sensor: float = 4.99, share: float = 0.15) -> Path:
    """A unit with a recorded loop. share: of the motion that lags, which is what the check limits."""
    motion = Plays.of(gain=24e-6, share=share, largest=4.5, count=60).response(DRIVE)
    de = motion + 4e-9 * np.random.default_rng(seed).standard_normal(motion.size)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "unit.toml").write_text(RECORDED.format(sensor=sensor))
    columns = {"t": np.arange(de.size) * 1e-3, "Va": DRIVE, "de": 2.5e-9 * np.round(de / 2.5e-9)}
    (folder / "loops.csv").write_bytes(csv_bytes(columns))
    return folder


def judged(folder: Path, spec: Path | str, *words: object) -> str:
    """The verdict of one more attempt."""
    done = accept("batch", folder, "--spec", spec, "--out", folder.parent / "out", "--no-certificates", *words)
    assert done.exit_code in (0, 3, 4), done.output
    with open_store() as store:
        last = store.latest("A-1", UnitJudged.KIND)
    assert last is not None
    return str(UnitJudged.of(last).result.verdict)


def findings() -> dict[str, str]:
    """Check -> verdict in the last judgement."""
    with open_store() as store:
        last = store.latest("A-1", UnitJudged.KIND)
    assert last is not None
    return {f.check: str(f.verdict) for f in UnitJudged.of(last).result.findings}


def test_monday_does_not_replace_tuesday_however_often_it_is_judged(tmp_path: Path) -> None:
    monday = make_unit(tmp_path / "monday", "A-1")
    tuesday = make_unit(tmp_path / "tuesday", "A-1", LATER)
    codes = []
    for number, folder in enumerate((monday, tuesday, monday, monday), 1):
        done = accept("report", folder, "--spec", "apa-basic", "--out", tmp_path / f"{number}.pdf", *WHY)
        codes.append(done.exit_code)
    assert codes == [0, 3, 4, 4]
    for number in (3, 4):
        pdf = tmp_path / f"{number}.pdf"
        assert accept("verify", pdf, "--require", "accepted,current").exit_code == 3
        contents = read_contents(pdf.read_bytes())
        assert contents.result["verdict"] == "conditional"
        assert "measured in attempt 1, before attempt 2, which was rejected" in str(contents.result["nonconformances"])
    assert accept("verify", tmp_path / "1.pdf", "--require", "accepted,current").exit_code == 3


def test_the_page_counts_the_attempts_before_and_the_store_and_the_list_are_asked(tmp_path: Path) -> None:
    for number, folder in enumerate(("monday", "tuesday", "wednesday"), 1):
        text = LATER if folder == "tuesday" else GOOD.replace("373.2", f"37{number}.5")
        unit = make_unit(tmp_path / folder, "A-1", text)
        pdf = tmp_path / f"{number}.pdf"
        accept("report", unit, "--spec", "apa-basic", "--out", pdf, *WHY)
    said = statements(read_contents(pdf.read_bytes()))["Attempt"]
    assert said.startswith("3, replaces 'rejected' of ")
    assert "before: 1 accepted, 1 rejected; last not accepted: attempt 2, rejected on 20" in said
    done = accept("verify", pdf, "--require", "accepted,current")
    assert done.exit_code == 0, done.output
    assert "before: 1 accepted, 1 rejected" in done.stderr
    accept("store", "publish", tmp_path / "list.json")
    done = accept("verify", pdf, "--log", tmp_path / "list.json", "--require", "current")
    assert done.exit_code == 0, done.output


def test_the_first_line_names_the_rejection_before(tmp_path: Path) -> None:
    """Away from the bench it is not seen whether what was measured before it was used again; at the bench judgements in
    between may be invented."""
    for folder, text in (("monday", GOOD), ("tuesday", LATER), ("wednesday", GOOD.replace("373.2", "371.9"))):
        pdf = tmp_path / f"{folder}.pdf"
        accept("report", make_unit(tmp_path / folder, "A-1", text), "--spec", "apa-basic", "--out", pdf, *WHY)
    there = verify(pdf.read_bytes(), [keys.ca(home())], rejudge)
    assert there.valid, there.reason
    assert there.reason.split("; ")[1].startswith("accepted after attempt 2 was rejected on 20"), there.reason
    assert "A-1 accepted; accepted after attempt 2 was rejected on 20" in accept("verify", pdf).stdout
    first = verify((tmp_path / "monday.pdf").read_bytes(), [keys.ca(home())], rejudge)
    assert "after attempt" not in first.reason


BEFORE = {"verdict": "accepted", "time": "2026-05-04T10:00:00+00:00", "certificate": None}
NONE = {"earlier_attempt": 1, "earlier_certificate": "ab" * 32}


@pytest.mark.parametrize("replaces", [BEFORE, BEFORE | {"certificate": "cd" * 32}, BEFORE | NONE])
def test_the_last_one_that_was_not_accepted_stands_in_every_form(tmp_path: Path, replaces: dict[str, object]) -> None:
    pdf = tmp_path / "1.pdf"
    assert accept("report", make_unit(tmp_path / "u", "A-1"), "--spec", "apa-basic", "--out", pdf).exit_code == 0
    contents = read_contents(pdf.read_bytes())
    stopped = {"attempt": 1, "verdict": "rejected", "time": "2026-05-03T10:00:00+00:00"}
    earlier = {"verdicts": {"accepted": 1, "rejected": 1}, "not_accepted": stopped}
    provenance = contents.provenance | {"attempt": 3, "replaces": replaces, "earlier": earlier}
    said = statements(replace(contents, provenance=provenance))["Attempt"]
    assert said.endswith("; before: 1 accepted, 1 rejected; last not accepted: attempt 1, rejected on 2026-05-03")
    assert ("certificate sha256 abababababab of attempt 1; before" in said) is ("earlier_attempt" in replaces)


def test_a_second_acceptance_after_a_rejection_says_why_and_what_was_rejected(tmp_path: Path) -> None:
    """The rejection has a certificate, the acceptance after it has none: what verification demands is asked for."""
    rejected, pdf = make_unit(tmp_path / "monday", "A-1", LATER), tmp_path / "3.pdf"
    assert accept("report", rejected, "--spec", "apa-basic", "--out", tmp_path / "1.pdf", *WHY).exit_code == 3
    assert (
        judged(make_unit(tmp_path / "tuesday", "A-1", GOOD.replace("373.2", "371.9")), "apa-basic", *WHY) == "accepted"
    )
    again = ("report", make_unit(tmp_path / "wednesday", "A-1", GOOD.replace("373.2", "372.4")), "--spec", "apa-basic")
    done = accept(*again, "--out", pdf)
    assert not pdf.exists(), accept("verify", pdf).output
    assert "--reason" in done.stderr
    assert accept(*again, "--out", pdf, *WHY).exit_code == 0
    done = accept("verify", pdf, "--require", "accepted,current")
    assert done.exit_code == 0, done.output
    assert "last not accepted: attempt 1, rejected on 20" in done.stderr


def test_a_new_measurement_replaces_what_was_not_accepted(tmp_path: Path) -> None:
    monday = make_unit(tmp_path / "monday", "A-1")
    assert judged(monday, "apa-basic") == "accepted"
    assert judged(make_unit(tmp_path / "tuesday", "A-1", LATER), "apa-basic") == "rejected"
    wednesday = make_unit(tmp_path / "wednesday", "A-1", GOOD.replace("373.2", "371.9"))
    assert judged(wednesday, "apa-basic") == "accepted"  # what passed may be read as it was before, by chance
    assert judged(wednesday, "apa-basic") == "accepted"


def test_a_rejection_in_between_is_what_counts(tmp_path: Path) -> None:
    """The same folder again, before and after another one was accepted."""
    monday = make_unit(tmp_path / "monday", "A-1")
    for _ in range(2):
        assert judged(monday, "apa-basic") == "accepted"
    assert judged(make_unit(tmp_path / "tuesday", "A-1", GOOD.replace("5.10", "5.12")), "apa-basic") == "accepted"
    assert judged(monday, "apa-basic") == "accepted"


@pytest.mark.parametrize(("disposition", "then"), [("use-as-is", "accepted"), ("measure-again", "conditional")])
def test_only_quality_assurance_lets_it_be_used(tmp_path: Path, disposition: str, then: str) -> None:
    """To measure again is what the technician then has to do."""
    monday = make_unit(tmp_path / "monday", "A-1")
    judged(monday, "apa-basic")
    judged(make_unit(tmp_path / "tuesday", "A-1", LATER), "apa-basic")
    assert judged(monday, "apa-basic") == "conditional"
    done = accept("store", "dispose", "A-1", "--disposition", disposition, "--because", "the probe had slipped")
    assert done.exit_code == 0, done.output
    assert judged(monday, "apa-basic") == then


def test_what_is_to_be_measured_again_is_not_released_by_its_own_recording(tmp_path: Path) -> None:
    """Not in another attempt of the workflow either, which anybody can begin, nor because another value is typed."""
    spec = tmp_path / "loops.toml"
    spec.write_text(LOOPS)
    with open_store() as store:
        store.write(StepNoted("hysteresis", "a wire was loose", nonconformance=True), "A-1", who="Ann")
    assert judged(recorded(tmp_path / "A-1", 1), spec) == "conditional"
    asked = ("store", "dispose", "A-1", "--disposition", "measure-again", "--because", "it was loose")
    done = accept(*asked)
    assert done.exit_code == 0, done.output
    with open_store() as store:
        store.write(AttemptStarted(1, "apa", {}, "measured again"), "A-1", who="Ann")
    assert judged(recorded(tmp_path / "A-1", 1, 4.97), spec) == "conditional"
    done = accept(*asked)  # it holds the unit still, so it can be decided about
    assert done.exit_code == 0, done.output
    assert judged(recorded(tmp_path / "again" / "A-1", 2), spec) == "accepted"


def test_a_void_rejection_supersedes_nothing(tmp_path: Path) -> None:
    monday = make_unit(tmp_path / "monday", "A-1")
    judged(monday, "apa-basic")
    judged(make_unit(tmp_path / "tuesday", "A-1", LATER), "apa-basic")
    assert accept("store", "void", "A-1", 2, "--reason", "another unit was on the bench").exit_code == 0
    assert judged(monday, "apa-basic") == "accepted"


def test_a_recording_of_before_holds_its_own_finding(tmp_path: Path) -> None:
    """Of a unit of which one part is measured anew, and the other is that of Monday."""
    spec = tmp_path / "loops.toml"
    spec.write_text(LOOPS)
    assert judged(recorded(tmp_path / "monday" / "A-1", 1), spec) == "accepted"
    assert judged(recorded(tmp_path / "tuesday" / "A-1", 2, sensor=4.1), spec) == "rejected"
    partly = recorded(tmp_path / "wednesday" / "A-1", 1, sensor=4.97)
    assert judged(partly, spec) == "conditional"
    assert findings() == {"capacitance": "pass", "hysteresis": "conditional"}
    anew = recorded(tmp_path / "thursday" / "A-1", 3, sensor=4.99)
    assert judged(anew, spec) == "conditional"  # what failed on Tuesday is typed as it was on Monday
    assert findings() == {"capacitance": "conditional", "hysteresis": "pass"}
    assert judged(recorded(tmp_path / "friday" / "A-1", 4, sensor=4.98), spec) == "accepted"


def test_evidence_that_the_rejected_attempt_holds_too_is_not_older(tmp_path: Path) -> None:
    """Only what failed is measured anew."""
    spec = tmp_path / "loops.toml"
    spec.write_text(LOOPS)
    folder = recorded(tmp_path / "u" / "A-1", 1)
    assert judged(folder, spec) == "accepted"
    assert judged(recorded(folder, 1, sensor=4.1), spec) == "rejected"
    assert judged(recorded(folder, 1, sensor=4.97), spec) == "accepted"


def test_a_record_that_was_away_and_came_back_is_no_older_measurement(tmp_path: Path) -> None:
    spec = tmp_path / "loops.toml"
    spec.write_text(LOOPS)
    folder = recorded(tmp_path / "u" / "A-1", 1)
    assert judged(folder, spec) == "accepted"
    shutil.move(folder / "loops.csv", tmp_path / "loops.csv")
    (folder / "loops.csv").write_text("no numbers\n")
    assert judged(folder, spec) == "incomplete"
    shutil.move(tmp_path / "loops.csv", folder / "loops.csv")
    assert judged(folder, spec) == "accepted"


def test_a_good_judgement_without_certificate_is_not_finished_after_a_rejection(tmp_path: Path) -> None:
    """Neither by a batch nor by a report, in whatever folder of results."""
    good, bad = make_unit(tmp_path / "g" / "A-1", "A-1"), make_unit(tmp_path / "b" / "A-1", "A-1", LATER)
    assert judged(good, "apa-basic") == "accepted"
    assert accept("report", bad, "--spec", "apa-basic", "--out", tmp_path / "r.pdf").exit_code == 3
    for number in range(2):
        pdf = tmp_path / f"{number}.pdf"
        assert accept("report", good, "--spec", "apa-basic", "--out", pdf, *WHY).exit_code == 4
        assert accept("verify", pdf, "--require", "accepted").exit_code == 3
    out = tmp_path / "o"
    accept("batch", good, "--spec", "apa-basic", "--out", out, *WHY)
    (entry,) = json.loads((out / "results.json").read_text())["units"]
    assert entry["verdict"] == "conditional"
    assert set(entry["superseded"]) == {"capacitance", "stroke", "stiffness"}  # the rejected one has its flatness too


def test_an_attempt_in_which_nothing_was_recorded_speaks_against_older_evidence(tmp_path: Path) -> None:
    """A channel that is constant has no sketch; the recording was made all the same."""
    spec = tmp_path / "loops.toml"
    spec.write_text(LOOPS)
    monday = recorded(tmp_path / "monday" / "A-1", 1)
    assert judged(monday, spec) == "accepted"
    tuesday = recorded(tmp_path / "tuesday" / "A-1", 2, sensor=4.97)
    columns = {"t": np.arange(DRIVE.size) * 1e-3, "Va": DRIVE, "de": np.full(DRIVE.size, 1e-6)}
    (tuesday / "loops.csv").write_bytes(csv_bytes(columns))
    assert judged(tuesday, spec) == "incomplete"
    assert judged(monday, spec) == "conditional"
    assert findings()["hysteresis"] == "conditional"


def measured_twice(typed: bool, place: Path) -> tuple[Path | str, Path, Path]:
    """Return a spec and two measurements of one unit, of values that were typed or of recordings."""
    if typed:
        return "apa-basic", make_unit(place / "u", "A-1"), make_unit(place / "v", "A-1", GOOD.replace("5.10", "5.12"))
    spec = place / "loops.toml"
    spec.write_text(LOOPS)
    return spec, recorded(place / "u" / "A-1", 1), recorded(place / "v" / "A-1", 2, sensor=4.97)


@pytest.mark.parametrize("typed", [False, True])
def test_what_was_simulated_does_not_become_measured(typed: bool, tmp_path: Path) -> None:
    """The line is deleted from unit.toml after the unit was judged. A measurement of its own counts."""
    spec, folder, later = measured_twice(typed, tmp_path)
    text = (folder / "unit.toml").read_text()
    (folder / "unit.toml").write_text("simulated = true\n" + text)
    assert judged(folder, spec) == "accepted"
    assert judged(folder, spec) == "accepted"
    (folder / "unit.toml").write_text(text)
    for _ in range(2):
        assert judged(folder, spec) == "conditional"
        assert set(findings().values()) == {"conditional"}
    with open_store() as store:
        last = store.latest("A-1", UnitJudged.KIND)
    assert last is not None
    assert "measured in attempt 1, which was simulated" in str(UnitJudged.of(last).result.nonconformances)
    assert judged(later, spec) == "accepted"


@pytest.mark.parametrize("now", ["P-4", None])
@pytest.mark.parametrize("typed", [False, True])
def test_what_was_measured_with_another_part_is_not_of_the_unit_as_it_is(
    typed: bool, now: str | None, tmp_path: Path
) -> None:
    """A part is exchanged, or left out, in unit.toml alone. To name one where none was is no exchange."""
    spec, folder, later = measured_twice(typed, tmp_path)
    text = (folder / "unit.toml").read_text()
    assert judged(folder, spec) == "accepted"
    (folder / "unit.toml").write_text(f'{text}[parts]\napa = "P-3"\n')
    assert judged(folder, spec) == "accepted"
    (folder / "unit.toml").write_text(text if now is None else f'{text}[parts]\napa = "{now}"\n')
    assert judged(folder, spec) == "conditional"
    assert set(findings().values()) == {"conditional"}
    with open_store() as store:
        last = store.latest("A-1", UnitJudged.KIND)
    assert last is not None
    assert "measured in attempt 2, with apa P-3" in str(UnitJudged.of(last).result.nonconformances)
    (folder / "unit.toml").write_text(f'{text}[parts]\napa = "P-3"\n')
    assert judged(folder, spec) == "accepted"  # a slip of the pen
    assert judged(later, spec) == "accepted"


def test_a_concession_about_an_exchanged_part_is_none_about_a_later_rejection(tmp_path: Path) -> None:
    """What was conceded before the unit was rejected says nothing of measurements from before that."""
    monday = make_unit(tmp_path / "monday", "A-1")
    text = (monday / "unit.toml").read_text()
    (monday / "unit.toml").write_text(f'{text}[parts]\napa = "P-3"\n')
    assert judged(monday, "apa-basic") == "accepted"
    (monday / "unit.toml").write_text(f'{text}[parts]\napa = "P-4"\n')
    assert judged(monday, "apa-basic") == "conditional"
    said = ("store", "dispose", "A-1", "--disposition", "use-as-is", "--because", "a slip of the pen")
    assert accept(*said).exit_code == 0
    assert judged(monday, "apa-basic") == "accepted"
    assert judged(make_unit(tmp_path / "tuesday", "A-1", LATER), "apa-basic", *WHY) == "rejected"
    assert judged(monday, "apa-basic", *WHY) == "conditional"
