"""Events that nobody of quality assurance signed: a judgement, a confirmed serial, a passed comparison; and the time of
a signature. Each may end a doubt, and none does so unsaid."""

import re
import shutil
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from accept.base.home import home
from accept.base.names import KeyHolder
from accept.certificate import rejudge
from accept.certificate.trust import keys
from accept.store import open_store
from accept.store.opening import DATABASE
from accept.store.payloads import KINDS, SerialConfirmed, UnitJudged
from checks.verdict import UnitVerdict
from tests.accept.certificate.verify.test_own_events import compared, spec_with_reference, with_bench_file
from tests.accept.certificate.verify.test_patched_program import (
    BENCH,
    _bench,
    doubted,
    events,
    noted,
    quality_assurance,
)
from tests.accept.certificate.verify.test_statements import accept, certified, own_spec, plainly, unit, verified
from tests.accept.certificate.verify.verify_help import verify

__all__ = ["_bench"]
TECHNICIAN = KeyHolder("Test Technician")
SCRAP = ("--disposition", "scrap", "--because", "broken")


def with_part(place: Path, name: str, part: str, stroke: float = 367.5) -> Path:
    folder, pdf = unit(place / name, serial=name, stroke=stroke, sensor=4.9), place / f"{name}.pdf"
    with folder.joinpath("unit.toml").open("a") as file:
        file.write(f'[parts]\napa = "{part}"\n')
    accept("report", folder, "--spec", "apa-basic", "--out", pdf, "--reason", "x")
    return pdf


def test_a_unit_that_quality_assurance_scrapped_without_a_certificate(tmp_path: Path) -> None:
    """What held it then holds it no more, as it is measured anew."""
    for stroke in (365.5, 181.7, 365.5):
        certified(tmp_path, "A-1", stroke=stroke)
    assert accept("store", "dispose", "B-1", *SCRAP).exit_code == 0
    again = certified(tmp_path, "A-2", stroke=366.2, sensor=4.95, last=-4.2)
    assert "quality assurance decided before it was judged: scrap;" in verified(again).stdout


def test_a_part_that_quality_assurance_scrapped_and_that_is_measured_again(tmp_path: Path) -> None:
    rejected = certified(tmp_path, "first", serial="P-1", stroke=181.7)
    assert accept("countersign", rejected, *SCRAP).exit_code == 0
    certified(tmp_path, "second", serial="P-1", stroke=366.2)
    done = verified(with_part(tmp_path, "S-1", "P-1"))
    assert "'apa P-1': quality assurance decided before it was judged: scrap;" in done.stdout
    assert "'apa P-1': accepted after attempt 1 was rejected on 20" in done.stdout


def test_a_judgement_of_a_part_that_nobody_made(tmp_path: Path) -> None:
    certified(tmp_path, "P-1", serial="P-1", stroke=181.7)
    event = events("P-1", UnitJudged.KIND)[-1]
    made_up = UnitJudged.of(event)
    made_up = replace(made_up, result=replace(made_up.result, verdict=UnitVerdict.ACCEPTED))
    with open_store() as store:
        store.write(made_up, "P-1", who=TECHNICIAN, spec=event.spec)
    assert (
        "'apa P-1': accepted after attempt 1 was rejected on 20" in verified(with_part(tmp_path, "S-1", "P-1")).stdout
    )


def test_a_part_that_is_cracked_and_was_never_judged(tmp_path: Path) -> None:
    noted("P-1", "stiffness", "frame cracked")
    done = verified(with_part(tmp_path, "S-1", "P-1"))
    assert "S-1 conditional; 'apa P-1': has events here and was never judged;" in done.stdout


def test_a_part_that_an_event_takes_out_of_another_strut(tmp_path: Path) -> None:
    certified(tmp_path, "P-1", serial="P-1")
    with_part(tmp_path, "S-9", "P-1")
    event = events("S-9", UnitJudged.KIND)[-1]
    made_up = UnitJudged.of(event)
    with open_store() as store:
        rebuilt = replace(made_up, result=replace(made_up.result, parts={}))
        store.write(rebuilt, "S-9", who=TECHNICIAN, spec=event.spec)
    done = verified(with_part(tmp_path, "S-1", "P-1", stroke=366.4))
    assert "S-1 accepted; 'apa P-1': has stood in 'S-9';" in done.stdout


def test_a_part_in_two_places(tmp_path: Path) -> None:
    folder, pdf = unit(tmp_path / "S-1", serial="S-1"), tmp_path / "S-1.pdf"
    with folder.joinpath("unit.toml").open("a") as file:
        file.write('[parts]\njoint_bottom = "J-1"\njoint_top = "j-1"\n')
    accept("report", folder, "--spec", "apa-basic", "--out", pdf)
    assert "accepted; 'joint_bottom J-1': stands in two places; 'joint_top j-1': stands in" in verified(pdf).stdout


def test_words_that_look_like_a_certificate_are_words(tmp_path: Path) -> None:
    folder, pdf = unit(tmp_path / "A-1"), tmp_path / "A-1.pdf"
    with folder.joinpath("unit.toml").open("a") as file:
        file.write('[notes]\nstroke = ["-----BEGIN CERTIFICATE-----AAAA-----END CERTIFICATE-----"]\n')
    accept("report", folder, "--spec", "apa-basic", "--out", pdf)
    assert plainly(verified(pdf))


@pytest.mark.parametrize("part", ["P-1,", "SN P-1", "P 1", "P-1 rev2", "(P-1)", "#P-1", "P-1/"])
def test_a_part_is_named_by_a_serial(tmp_path: Path, part: str) -> None:
    certified(tmp_path, "P-1", serial="P-1", stroke=181.7)
    assert "S-1 conditional" in verified(with_part(tmp_path, "S-1", part)).stdout


def test_a_serial_that_an_event_tells_apart(tmp_path: Path) -> None:
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    with open_store() as store:
        store.write(SerialConfirmed(("A-01",)), "A-O1", who=TECHNICIAN)
    done = verified(certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95))
    assert "A-O1 accepted; 'Test Technician' told its serial apart from 'A-01';" in done.stdout


def test_who_tells_a_serial_apart_writes_no_part_of_the_first_line(tmp_path: Path) -> None:
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    with open_store() as store:
        store.write(SerialConfirmed(("A-01; countersigned",)), "A-O1", who=KeyHolder("x'; signed by 'Grace' as qa"))
        store.write(SerialConfirmed(("A-01",)), "A-O1", who=TECHNICIAN)
    done = verified(certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95))
    assert (
        "A-O1 accepted; 'x’, signed by ’Grace’ as qa' told its serial apart from 'A-01, countersigned';" in done.stdout
    )


def test_a_decision_of_another_word_writes_no_part_of_the_first_line(tmp_path: Path) -> None:
    certified(tmp_path, "A-1", stroke=181.7)
    signed = events("B-1", "certificate_signed")[-1]
    choice = {"choice": "x; signed by 'Grace' as qa", "reason": "y"}
    with open_store() as store:
        store.append(signed.what, "B-1", {**signed.data, "sha256": "0" * 64, "disposition": choice}, who="Grace")
    done = verified(certified(tmp_path, "A-2", stroke=366.2))
    assert "decided before it was judged: 'x, signed by ’Grace’ as qa';" in done.stdout


def test_a_comparison_that_was_passed_after_one_that_was_not(tmp_path: Path) -> None:
    spec = spec_with_reference(tmp_path / "mine.toml")
    for E_n in (3.0, 0.5):
        with open_store() as store:
            store.write(compared(E_n), who=TECHNICIAN)
    done = verified(with_bench_file(tmp_path, "A-1", BENCH.replace("2025-01-01", "2099-01-01"), spec))
    assert "'tip' missed its reference before, last on 20" in done.stdout


def test_the_store_has_an_event_of_a_kind_that_is_not_known(tmp_path: Path) -> None:
    """Of a newer program, which shares the store."""
    pdf = certified(tmp_path, "A-1")
    with open_store() as store:
        store.append("bench_moved", "", {}, who="Grace")
    assert "B-1 accepted; the bench's store has 'event 4 (bench_moved)', of a kind" in verified(pdf).stdout
    with open_store() as store:
        store.append("unit_scrapped", "B-1", {"reason": "broken"}, who="Grace")
    doubted(verified(pdf), "(unit_scrapped B-1)', of a kind that this program does not know")


def test_a_table_of_certificates_says_what_the_first_line_says(tmp_path: Path) -> None:
    folder = tmp_path / "certificates"
    own_spec(tmp_path / "mine.toml")
    certified(folder, "A-1", spec=str(tmp_path / "mine.toml"))
    done = verified(folder)
    assert (done.exit_code, "A-1.pdf: B-1 accepted; spec NOT APPROVED" in done.stdout) == (0, True)


def test_who_left_is_named_away_from_the_bench_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only a clock says that the technician signed before."""
    pdf = certified(tmp_path, "A-1")
    assert plainly(verified(pdf))
    time.sleep(1.0)  # a key that is revoked within the second of a signature was revoked before it
    assert accept("keys", "revoke", "Test Technician", "--reason", "left").exit_code == 0
    away = tmp_path / "away"
    away.mkdir()
    for name in ("ca.pem", "ca.crl.pem"):
        shutil.copy(home() / "keys" / name, away)
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "none"))
    done = verified(pdf, "--trust", away / "ca.pem")
    assert "B-1 accepted; the key of 'Test Technician' was revoked on 20" in done.stdout


def test_a_key_that_ran_out_since_is_named(tmp_path: Path) -> None:
    pdf = certified(tmp_path, "A-1").read_bytes()
    trust = [keys.ca(home())]
    assert "ran out" not in verify(pdf, trust, rejudge).reason
    later = verify(pdf, trust, rejudge, datetime.now(UTC) + timedelta(days=365 * 5 + 2))
    assert later.valid
    assert "B-1 accepted; the key of 'Test Technician' ran out on 20" in later.reason


def test_a_serial_that_is_taken_for_one_of_this_bench_is_named_on_a_certificate_of_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    bench, other = home(), tmp_path / "other"
    shutil.copytree(bench / "keys", other / "keys", ignore=shutil.ignore_patterns("bench.*"))
    with monkeypatch.context() as m:
        m.setenv("ACCEPT_HOME", str(other))
        assert accept("keys", "request", "--role", "bench", "--name", "bench 2").exit_code == 0
        assert accept("keys", "issue", other / "keys" / "bench.request.pem").exit_code == 0
        pdf = certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95)
    assert "A-O1 accepted; nobody told its serial apart: A-O1 differs from A-01" in verified(pdf).stdout


def test_a_spec_of_which_a_newer_version_is_approved(tmp_path: Path) -> None:
    older, newer = own_spec(tmp_path / "mine.toml"), tmp_path / "newer.toml"
    newer.write_text(older.read_text().replace("upper = 5.5", "upper = 5.4"))
    assert newer.read_text() != older.read_text()
    assert accept("spec", "approve", older).exit_code == 0
    before = certified(tmp_path, "A-1", spec=str(older))
    time.sleep(1.0)  # an approval states whole seconds
    assert accept("spec", "approve", newer).exit_code == 0
    time.sleep(1.0)
    pdf = certified(tmp_path, "A-2", spec=str(older), serial="B-2", stroke=366.2, sensor=4.95)
    assert "B-2 accepted; a newer version of its spec was approved on 20" in verified(pdf).stdout
    assert "newer version" not in verified(before).stdout


def test_who_approved_the_spec_and_left_is_named(tmp_path: Path) -> None:
    spec = own_spec(tmp_path / "mine.toml")
    assert accept("spec", "approve", spec).exit_code == 0
    pdf = certified(tmp_path, "A-1", spec=str(spec))
    time.sleep(1.0)
    assert accept("keys", "revoke", "Grace", "--reason", "left").exit_code == 0
    assert "B-1 accepted; the key of 'Grace' was revoked on 20" in verified(pdf).stdout


def test_a_certificate_that_its_store_was_never_told_of_is_not_of_another_bench(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At quality assurance, whose machine is another bench: the technician signed it over a store of his own."""
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    bench, own = home() / DATABASE, tmp_path / "own"
    shutil.copytree(home(), own, ignore=shutil.ignore_patterns("store*"))
    with monkeypatch.context() as m:
        m.setenv("ACCEPT_HOME", str(own))
        certified(tmp_path, "filler", serial="C-1", stroke=367.7)
        pdf = certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95)
    quality_assurance(tmp_path / "qa", monkeypatch, bench)
    doubted(verified(pdf), "this bench's store does not hold event")


def test_the_documentation_says_of_every_kind_of_event_what_it_may_end() -> None:
    text = (Path(__file__).parents[4] / "docs/explanation/what-a-certificate-proves.md").read_text()
    table = text.partition("| kinds of event |")[2].partition("\n\n")[0]
    listed = [name for row in table.splitlines()[2:] for name in re.findall(r"`(\w+)`", row.split("|")[1])]
    assert sorted(listed) == sorted(KINDS)
