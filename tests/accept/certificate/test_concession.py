"""A concession of quality assurance stays on all that is said of the unit, and covers what it names."""

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from pypdf import PdfReader
from typer.testing import Result

from accept.base.documents.results import UnitHeader
from accept.base.home import home
from accept.certificate import read_contents, rejudge
from accept.certificate.trust import keys
from accept.fleet.errors import FleetError
from accept.fleet.matched_sets import pool
from accept.fleet.measurements import measurements
from accept.fleet.yields import pareto, yields
from accept.judging import load_spec
from accept.judging.reservations.nonconformance import decide, standing
from accept.judging.reservations.parts import part_doubts
from accept.store import open_store
from accept.store.decisions import Signer, in_notes
from accept.store.payloads import CertificateSigned, Disposition, NonconformanceDecided, UnitJudged
from checks.cause import Cause, because
from tests.accept.units.units import GOOD, make_unit
from tests.shared.command_line import accept
from tests.shared.kept_folder import KeptFolder, kept

SCRATCH = "flatness: scratch on the shell (Ann)"
NOTED = GOOD + '[notes]\nflatness = ["NONCONFORMANCE: scratch on the shell (Ann)"]\n'
WHY = "the scratch is outside the joint"
CONCEDED = f"concession by Grace Hopper {{day}}: use as it is: {WHY}; conceded: {SCRATCH}"


def scratched(place: Path) -> Path:
    """A unit folder with a scratch in its notes, at a bench with keys."""
    keys.init(home(), "correct horse", "Ann", "Grace Hopper", "battery staple")
    return make_unit(place / "A", "A", NOTED)


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    return scratched(tmp_path)


def report_scratched(place: Path) -> None:
    assert report(scratched(place))[1].exit_code == 4


once_reported = kept(report_scratched)


@pytest.fixture
def reported(once_reported: KeptFolder, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The unit with its certificate, A.pdf beside it."""
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    return once_reported.put_back(monkeypatch) / "A"


once_judged = kept(lambda place: judged(scratched(place)))


@pytest.fixture
def held(once_judged: KeptFolder, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The unit as it was judged, without a certificate."""
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    return once_judged.put_back(monkeypatch) / "A"


def report(folder: Path, pdf: str = "A.pdf", *more: str) -> tuple[Path, Result]:
    out = folder.parent / pdf
    return out, accept("report", folder, "--out", out, "--spec", "apa-basic", "--operator", "Ann", *more)


def judged(folder: Path) -> dict[str, object]:
    """The unit as a batch hands it on."""
    out = folder.parent / "out"
    done = accept("batch", folder, "--out", out, "--spec", "apa-basic", "--operator", "Ann", "--no-certificates")
    (entry,) = json.loads((out / "results.json").read_text())["units"]
    return entry | {"exit": done.exit_code, "said": done.output, "out": out}


def dispose(choice: str, reason: str = WHY) -> Result:
    done = accept("store", "dispose", "A", "--disposition", choice, "--because", reason)
    assert done.exit_code == 0, done.output
    return done


def change(folder: Path, was: str, now: str) -> None:
    file = folder / "unit.toml"
    text = file.read_text()
    assert was in text
    file.write_text(text.replace(was, now))


def without_the_note(folder: Path) -> None:
    change(folder, NOTED[len(GOOD) :], "")


def page_of(pdf: Path) -> str:
    return " ".join(page.extract_text() for page in PdfReader(pdf).pages).replace("\n", " ")


def day() -> str:
    with open_store() as store:
        event = store.latest("A", NonconformanceDecided.KIND)
    assert event is not None
    return event.time[:10]


def says_the_concession(folder: Path, pdf: Path) -> None:
    words = CONCEDED.format(day=day())
    page = page_of(pdf)
    assert words in page
    assert "ACCEPTED" in page
    assert "BY CONCESSION OF QUALITY ASSURANCE" in page
    checked = accept("verify", pdf)
    assert checked.exit_code == 0, checked.output
    assert checked.stdout.startswith("valid: A accepted by concession; ")
    assert words.replace(";", ",") in checked.stdout  # quoted: it parts no statement of the line
    assert words in accept("history", "A").output.replace("\n", "")


@pytest.mark.parametrize("kept", [True, False], ids=["note kept", "note deleted"])
@pytest.mark.parametrize("countersigned", [True, False], ids=["countersigned", "disposed"])
def test_a_concession_stays_whatever_becomes_of_the_note(reported: Path, kept: bool, countersigned: bool) -> None:
    bench = reported
    if countersigned:
        done = accept("countersign", bench.parent / "A.pdf", "--disposition", "use-as-is", "--because", WHY)
        assert done.exit_code == 0, done.output
    else:
        dispose("use-as-is")
    if not kept:
        without_the_note(bench)
    again, done = report(bench, "again.pdf")
    assert done.exit_code == 0, done.output
    says_the_concession(bench, again)
    entry = judged(bench)
    assert (entry["verdict"], entry["exit"], "nonconformances" in entry) == ("accepted", 0, False)
    assert [each["nonconformances"] for each in entry["dispositions"]] == [[SCRATCH]]
    assert "accepted by concession" in entry["said"]
    change(bench, "5.10", "5.11")  # measured again, and judged once more
    says_the_concession(bench, report(bench, "third.pdf", "--reason", "a digit was exchanged")[0])


def test_the_countersigned_certificate_says_nothing_that_its_decision_refutes(reported: Path) -> None:
    pdf = reported.parent / "A.pdf"
    before = accept("verify", pdf)
    assert (before.exit_code, before.stdout.partition(";")[0]) == (
        0, "NOT AUTHORISED by quality assurance, valid: A held",
    )  # fmt: skip
    many = accept("verify", pdf.parent)  # red before: no word qualified the count
    assert "1 of 1 certificates are valid, 1 of them NOT AUTHORISED by quality assurance" in many.output.replace(
        "\n", " "
    )
    assert accept("countersign", pdf, "--disposition", "use-as-is", "--because", WHY).exit_code == 0
    page = page_of(pdf)
    assert "UNTIL QUALITY ASSURANCE" not in page
    assert "What to do" not in page
    checked = accept("verify", pdf)
    assert checked.exit_code == 0, checked.output
    assert checked.stdout.startswith("valid: A held; quality assurance decided: use as it is; signed by 'Ann'")
    assert f"disposition: 'use as it is: {WHY}'" in checked.stdout


def test_no_words_of_the_page_stay_below_a_signature(reported: Path) -> None:
    """A reader of the text layer, such as a search or a screen reader, found "not signed" on signed certificates."""
    pdf = reported.parent / "A.pdf"
    shown = {}
    for signed in (1, 2):
        reader = PdfReader(pdf)
        assert "not signed" not in page_of(pdf)
        assert "countersignature open" not in page_of(pdf)
        fields = [each.get_object() for each in reader.pages[0]["/Annots"]]
        shown = {str(each["/T"]): each["/AP"]["/N"].get_object() for each in fields}
        if tool := shutil.which("pdftotext"):
            text = subprocess.run([tool, pdf, "-"], capture_output=True, text=True, check=True).stdout
            assert ("countersignature open" in text) == (signed == 1)
            assert "not signed" not in text
        if signed == 1:
            accept("countersign", pdf, "--disposition", "scrap", "--because", WHY)
    assert all("/Stamp" in form["/Resources"]["/XObject"] for form in shown.values())


def test_a_held_unit_is_accepted_nowhere(bench: Path) -> None:
    """Its findings pass, so each way that reads findings must see the nonconformance."""
    entry = judged(bench)
    assert {f["verdict"] for f in entry["findings"]} == {"pass"}
    assert (entry["verdict"], entry["exit"], entry["nonconformances"]) == ("conditional", 4, [SCRATCH])
    assert SCRATCH in entry["said"]
    suites = ElementTree.parse(entry["out"] / "junit.xml").getroot()
    (failure,) = suites.iter("failure")
    assert (suites[0].get("failures"), failure.get("type"), failure.get("message")) == ("1", "held", SCRATCH)
    assert {row.split(",")[2] for row in (entry["out"] / "results.csv").read_text().splitlines()[1:]} == {"conditional"}
    with open_store() as store:
        frame = measurements(store)
        assert part_doubts(store, UnitHeader(serial="S", kind="strut", parts={"apa": "A"}))
    assert tuple(yields(frame, "serial").loc[0, ["first", "last", "conceded"]]) == (False, False, False)
    (cause,) = pareto(frame).to_dict("records")
    assert (cause["quantity"], cause["verdict"], cause["units"]) == ("nonconformance", "held", 1)
    with pytest.raises(FleetError, match="no accepted unit"):
        pool(frame, "apa", ["stroke_um"])
    listed = accept("list").output
    assert "conditional" in listed
    assert "nonconformance" in listed
    assert "accepted" not in listed
    assert "every unit passed" not in accept("yield").output
    flips = accept("rejudge", "--spec", "apa-basic")
    assert "none of 1 units changes its verdict" in flips.output
    assert "unchanged, held" in judged(bench)["said"]


@pytest.mark.parametrize(
    ("choice", "passes", "conceded"),
    [("use-as-is", 1, 1), ("rework", 0, 0), ("measure-again", 0, 0), ("return", 0, 0), ("scrap", 0, 0)],
)
def test_a_yield_counts_the_decided_unit_by_its_decision(held: Path, choice: str, passes: int, conceded: int) -> None:
    dispose(choice)
    with open_store() as store:
        (row,) = yields(measurements(store), "kind").to_dict("records")
    assert (row["units"], row["first"], row["last"], row["conceded"]) == (1, 0, passes, conceded)
    judged(held)
    with open_store() as store:
        (row,) = yields(measurements(store), "kind").to_dict("records")
    assert (row["units"], row["first"], row["last"], row["conceded"]) == (1, 0, passes, conceded)


@pytest.mark.parametrize("choice", ["rework", "measure-again"])
@pytest.mark.parametrize("kept", [True, False], ids=["note kept", "note deleted"])
def test_rework_releases_once_it_was_measured_again(held: Path, choice: str, kept: bool) -> None:
    """A technician who deletes the line and judges the same values once more has not measured again."""
    bench = held
    dispose(choice)
    if not kept:
        without_the_note(bench)
    same = judged(bench)
    assert (same["verdict"], same["nonconformances"]) == ("conditional", [SCRATCH])
    change(bench, "5.10", "5.11")
    after = judged(bench)
    assert (after["verdict"], [d["disposition"]["choice"] for d in after["dispositions"]]) == ("accepted", [choice])
    page = page_of(report(bench)[0])
    assert "disposition by Grace Hopper" in page
    assert "CONCESSION" not in page


@pytest.mark.parametrize("choice", ["return", "scrap"])
def test_what_is_returned_or_scrapped_stays_held(held: Path, choice: str) -> None:
    bench = held
    dispose(choice)
    without_the_note(bench)
    change(bench, "5.10", "5.11")
    assert judged(bench)["verdict"] == "conditional"
    assert "disposition by Grace Hopper" in accept("history", "A").output
    pdf, _ = report(bench)
    assert "A held; quality assurance decided: " in accept("verify", pdf).stdout
    dispose("use-as-is")  # the last decision counts
    assert judged(bench)["verdict"] == "accepted"


def test_a_concession_covers_what_it_names(held: Path) -> None:
    """Neither a scratch that is noted later nor a measurement outside its limits."""
    bench = held
    dispose("use-as-is")
    assert judged(bench)["verdict"] == "accepted"
    change(bench, '(Ann)"]', '(Ann)", "NONCONFORMANCE: lead torn (Ann)"]')
    more = judged(bench)
    assert (more["verdict"], more["nonconformances"]) == ("conditional", ["flatness: lead torn (Ann)"])
    assert [each["nonconformances"] for each in more["dispositions"]] == [[SCRATCH]]
    change(bench, ', "NONCONFORMANCE: lead torn (Ann)"', "")
    assert judged(bench)["verdict"] == "conditional"  # the store keeps it
    dispose("use-as-is", "the lead was soldered")
    change(bench, "5.10", "1.72")
    failed = judged(bench)
    assert (failed["verdict"], failed["exit"]) == ("rejected", 3)
    assert "rejected" in accept("verify", report(bench)[0]).stdout


def test_nobody_but_quality_assurance_concedes_and_no_more_than_it_did(reported: Path) -> None:
    """Decisions that a program of the technician's own writes into the store: one that names more than was signed, one
    of another unit, one whose signature is about a certificate."""
    bench = reported
    pdf = bench.parent / "A.pdf"
    assert accept("countersign", pdf, "--disposition", "use-as-is", "--because", WHY).exit_code == 0
    change(bench, '(Ann)"]', '(Ann)", "NONCONFORMANCE: lead torn (Ann)"]')
    judged(bench)
    torn = "flatness: lead torn (Ann)"
    with open_store() as store:
        decided, signed = (store.latest("A", kind) for kind in (NonconformanceDecided.KIND, CertificateSigned.KIND))
        assert decided is not None
        assert signed is not None
        given, certified = NonconformanceDecided.of(decided), CertificateSigned.of(signed)
        assert certified.disposition is not None
        for forged in (
            replace(given, nonconformances=(*given.nonconformances, torn)),
            replace(given, nonconformances=(torn,), disposition=certified.disposition),
            replace(given, nonconformances=(torn,), disposition=certified.disposition, certificate=certified.before),
            replace(certified, before=certified.sha256),
            given,
        ):
            store.write(forged, "A", who="Grace Hopper")
            assert standing(store, "A", {}).open == (torn,)
    assert judged(bench)["nonconformances"] == [torn]


def test_a_certificate_with_a_forged_concession_is_not_valid(held: Path) -> None:
    """Judged again from what is attached: a concession releases what it names, and only with its signature."""
    dispose("use-as-is")
    contents = read_contents(report(held)[0].read_bytes())
    assert rejudge(contents).verdict == "accepted"
    (given,) = contents.result["dispositions"]
    nothing = {key: value for key, value in contents.result.items() if key != "dispositions"}
    assert rejudge(replace(contents, result=nothing)).verdict == "conditional"  # by the note in unit.toml
    other = nothing | {"dispositions": [given | {"nonconformances": ["flatness: another one (Ann)"]}]}
    assert rejudge(replace(contents, result=other)).verdict == "conditional"
    from accept.certificate.verify.stated_check import check_dispositions

    roots = [keys.ca(home())]
    assert check_dispositions(contents, roots, ()) == []
    decision = given["disposition"] | {"reason": "it shines"}
    for forged in (other, nothing | {"dispositions": [given | {"disposition": decision}]}):
        (step,) = check_dispositions(replace(contents, result=forged), roots, ())
        assert not step.complete


def test_a_certificate_that_hides_the_concession_is_not_plainly_valid(bench: Path) -> None:
    """One that was accepted before the scratch was noted, at the bench that knows the scratch and its concession."""
    without_the_note(bench)
    pdf, done = report(bench)
    assert (done.exit_code, accept("verify", pdf).exit_code) == (0, 0)
    kept = pdf.read_bytes()
    (bench / "unit.toml").write_text((bench / "unit.toml").read_text() + NOTED[len(GOOD) :])
    judged(bench)
    dispose("use-as-is")
    pdf.write_bytes(kept)
    checked = accept("verify", pdf)
    assert checked.exit_code == 4
    assert f"holds a nonconformance that it does not state: {SCRATCH}" in checked.stdout


def test_what_an_earlier_program_stored_is_read_as_it_was(reported: Path) -> None:
    """Its findings are conditional because of the nonconformance, and its decision names a certificate alone."""
    spec = load_spec("apa-basic")
    held = because(Cause.NONCONFORMANCE, detail=SCRATCH)
    credential = keys.unlock(home(), "qa", "battery staple")
    with open_store() as store:
        event = store.latest("A", UnitJudged.KIND)
        assert event is not None
        was = UnitJudged.of(event)
        findings = tuple(
            replace(f, verdict=type(f.verdict).CONDITIONAL, cause=held, reason=str(held)) for f in was.result.findings
        )
        entry = replace(was.result, findings=findings)
        store.write(replace(was, result=entry), "A", who="Ann", spec=f"{spec.name}@{spec.sha256}")
        frame = measurements(store)
        assert tuple(yields(frame, "serial").loc[0, ["first", "last"]]) == (False, False)
        decide(store, "A", Disposition("use-as-is", WHY), lambda: Signer(credential.key, credential.certificate))
        assert tuple(yields(measurements(store), "serial").loc[0, ["last", "conceded"]]) == (True, True)
    from accept.judging.reservations.reservations import Reservations

    assert Reservations.stated(entry).apply(was.result).findings == findings
    assert "changes its verdict" in accept("rejudge", "--spec", "apa-basic").output


@pytest.mark.parametrize("mark", ["NONCONFORMANCE: ", "NONCONFORMANCE:", "Nonconformance : ", " non-conformance: "])
def test_a_nonconformance_is_one_as_people_write_it(mark: str) -> None:
    """Who edits unit.toml by hand leaves the space out, or the capitals; a cracked part is held all the same."""
    assert in_notes({"stroke": [f"{mark}frame cracked", "no nonconformance: looked at twice"]}) == [
        "stroke: frame cracked"
    ]


@pytest.mark.parametrize("also_changed", [False, True])
def test_a_decision_is_the_reason_of_the_certificate_that_it_amends(reported: Path, also_changed: bool) -> None:
    """But not of another value."""
    dispose("use-as-is")
    without_the_note(reported)
    if also_changed:
        change(reported, "stroke_um = 373.2", "stroke_um = 371.2")
    pdf, done = report(reported)
    assert done.exit_code == 0, done.output
    why = "no reason was given" if also_changed else "quality assurance has decided about what held it"
    assert f"replaces certificate A/1: {why}" in page_of(pdf)
