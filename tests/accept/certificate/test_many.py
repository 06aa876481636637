"""Many certificates in one command: verified as a table, countersigned with one passphrase."""

import csv
import hashlib
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from accept.base.home import home
from accept.base.runner import GivenUp, Processes
from accept.certificate.evidence import GONE, differences, evidence_in
from accept.certificate.trust import authority, keys
from accept.commands.trust import verify
from tests.accept.units.units import GOOD, make_unit
from tests.shared.command_line import accept
from tests.shared.kept_folder import KeptFolder, kept

VALUES = {"A": GOOD, "B": GOOD.replace("5.10", "5.09"), "C": GOOD.replace("5.10", "1.72")}
SIGNED = ("report", "--spec", "apa-basic", "--operator", "Ann")


def sign_three(place: Path) -> None:
    """Certificates of two accepted units and a rejected one, in two folders."""
    keys.init(home(), "correct horse", "Ann", "Grace Hopper", "battery staple")
    for serial, text in VALUES.items():
        folder = make_unit(place / "units" / serial, serial, text)
        why = ("--reason", "for the archive") if serial == "C" else ()
        out = place / "signed" / ("rest" if serial == "C" else "") / f"{serial}.pdf"
        out.parent.mkdir(parents=True, exist_ok=True)
        done = accept(*SIGNED[:1], folder, "--out", out, *SIGNED[1:], *why)
        assert out.exists(), done.output


signed = kept(sign_three)


@pytest.fixture
def place(signed: KeptFolder, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    monkeypatch.setenv("COLUMNS", "200")
    return signed.put_back(monkeypatch) / "signed"


def test_a_folder_is_verified_as_a_table_and_the_worst_decides(place: Path) -> None:
    done = accept("verify", place, "--json", place / "all.json")
    assert done.exit_code == 0, done.output
    assert "3 of 3 certificates are valid" in done.output
    (place / "B.pdf").write_bytes((place / "B.pdf").read_bytes().replace(b"/Type", b"/Tepy", 1))
    (place / "note.pdf").write_bytes(b"no certificate")
    done = accept("verify", place, "--json", place / "all.json")
    assert done.exit_code == 3
    assert "2 of 4 certificates are valid" in done.output
    assert f"{place / 'note.pdf'}: " in done.output
    told = {Path(each["certificate"]).name: each["outcome"] for each in json.loads((place / "all.json").read_text())}
    assert told == {"A.pdf": "valid", "B.pdf": "not_valid", "note.pdf": "not_valid", "C.pdf": "valid"}


@pytest.mark.slow
def test_two_processes_say_what_one_says(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the same order, with every refusal; a store whose password only this process has is asked by this one."""
    (place / "B.pdf").write_bytes((place / "B.pdf").read_bytes().replace(b"/Type", b"/Tepy", 1))
    (place / "gone.pdf").symlink_to(place / "nowhere")
    monkeypatch.setattr(verify, "LEAST_FOR_EACH", 2)
    counts = list[int]()

    def counted(count: int) -> Processes:
        counts.append(count)
        return Processes(count)

    monkeypatch.setattr(verify, "Processes", counted)
    said = list[str]()
    for cores in (1, 2):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        done = accept("verify", place, "--json", place / "all.json")
        said.append(f"{done.exit_code} {done.output} {(place / 'all.json').read_text()}")
    assert said[0] == said[1]
    assert said[0].startswith("3 ")
    assert "2 of 4 certificates are valid" in said[0]
    assert counts == [2]
    monkeypatch.setenv("ACCEPT_STORE_URL", f"sqlite:///{home() / 'store.sqlite'}")
    assert "2 of 4 certificates are valid" in accept("verify", place).output
    assert counts == [2]


def test_what_no_process_could_verify_is_not_valid(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Dying:
        def __init__(self, count: int) -> None:
            pass

        def unordered(self, work: object, items: list[Any]) -> Iterator[tuple[Any, GivenUp]]:
            return ((item, GivenUp("the process that worked on it died")) for item in items)

    monkeypatch.setattr(verify, "LEAST_FOR_EACH", 1)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(verify, "Processes", Dying)
    done = accept("verify", place)
    assert done.exit_code == 3
    assert "it could not be verified: the process that worked on it died" in done.output
    assert "0 of 3 certificates are valid" in done.output


def test_each_is_held_against_what_is_required(place: Path) -> None:
    done = accept("verify", place / "A.pdf", place / "rest", "--require", "accepted")
    assert done.exit_code == 3
    assert "the unit is rejected, not accepted" in done.output
    assert "1 of 2 certificates are valid and as required" in done.output


def test_one_file_is_told_as_before(place: Path) -> None:
    done = accept("verify", place / "A.pdf", "--json", place / "one.json")
    assert done.output.splitlines()[-1].startswith("valid: A accepted; signed by ")
    assert json.loads((place / "one.json").read_text())["serial"] == "A"


def test_one_file_is_a_row_of_a_table_if_asked(place: Path) -> None:
    done = accept("verify", place / "A.pdf", "--table", "--json", place / "one.json")
    assert done.exit_code == 0, done.output
    assert "1 of 1 certificates are valid" in done.output
    assert [each["serial"] for each in json.loads((place / "one.json").read_text())] == ["A"]
    both = (accept("verify", place, *more).output for more in ((), ("--table",)))
    assert len({*both}) == 1  # a folder is one anyway


def test_a_file_that_is_gone_stops_no_other(place: Path) -> None:
    done = accept("verify", place / "A.pdf", place / "gone.pdf")
    assert done.exit_code == 3
    assert "cannot be read" in done.output
    assert "1 of 2 certificates are valid" in done.output


def test_quality_assurance_signs_all_that_are_accepted_and_no_other(place: Path) -> None:
    rejected = (place / "rest" / "C.pdf").read_bytes()
    (place / "note.pdf").write_bytes(b"no certificate")
    done = accept("countersign", place)
    assert done.exit_code == 4, done.output
    assert "2 of 4 countersigned by Grace Hopper" in done.output
    assert "rejected; countersign it alone, with a disposition" in done.output
    assert (place / "rest" / "C.pdf").read_bytes() == rejected
    for name in ("A.pdf", "B.pdf"):
        assert accept("verify", place / name, "--require", "countersigned").exit_code == 0
    again = accept("countersign", place / "A.pdf", place / "B.pdf")
    assert (again.exit_code, again.output.count("countersigned already")) == (4, 2)


def test_of_two_certificates_of_a_unit_the_second_is_left(place: Path) -> None:
    (place / "copy.pdf").write_bytes((place / "A.pdf").read_bytes())
    done = accept("countersign", place / "A.pdf", place / "copy.pdf")
    assert "1 of 2 countersigned" in done.output
    assert done.exit_code == 4


def test_a_disposition_is_about_one_unit(place: Path) -> None:
    done = accept("countersign", place, "--disposition", "use-as-is", "--because", "harmless")
    assert done.exit_code == 6
    assert "about one unit" in done.output


def test_nothing_is_signed_with_a_wrong_passphrase(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = (place / "A.pdf").read_bytes()
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "something else")
    assert accept("countersign", place).exit_code == 6
    assert (place / "A.pdf").read_bytes() == before


def test_a_folder_without_certificates_is_a_wrong_order(tmp_path: Path) -> None:
    for command in ("verify", "countersign"):
        done = accept(command, tmp_path)
        assert done.exit_code == 6
        assert "holds no certificate (no file that ends in .pdf)" in done.output.replace("\n", " ")


# --- everything that an auditor needs, in one folder ------------------------------------------------------------------


def pack(place: Path) -> None:
    """The evidence of A, whose certificate was amended, and of B."""
    sign_three(place)
    signed, unit = place / "signed", place / "units" / "A" / "unit.toml"
    accept("countersign", signed / "A.pdf", signed / "B.pdf", code=0)
    unit.write_text(unit.read_text().replace("5.10", "5.11"))
    accept("report", unit.parent, "--out", signed / "A.pdf", *SIGNED[1:], "--reason", "a digit was exchanged", code=0)
    accept("countersign", signed / "A.pdf", code=0)
    accept("evidence", place / "evidence", "--units", "A", "--units", "B", code=0)


packed = kept(pack, ACCEPT_QA_PASSPHRASE="battery staple")


@pytest.fixture
def package(packed: KeptFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Read in a home that has neither keys nor store."""
    monkeypatch.setenv("COLUMNS", "200")
    made = packed.put_back(monkeypatch) / "evidence"
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "auditor"))
    return made


def test_a_package_is_checked_by_one_command_with_what_lies_in_it(package: Path) -> None:
    done = accept("verify", package)
    assert done.exit_code == 0, done.output
    assert "3 of 3 certificates are valid" in done.output
    assert "authority in this folder" in done.output
    assert authority.fingerprint(keys.certificate_of(package / "ca.pem")) in done.output.replace("\n", "")
    names = {path.relative_to(package).as_posix() for path in package.rglob("*") if path.is_file()}
    assert names == {
        "README.md", "ca.crl.pem", "ca.pem", "certificates/A.pdf", "certificates/B.pdf", "evidence.json", "head.json",
        "history.txt", "list.json", "summary.csv", "superseded/A-1.pdf",
    }  # fmt: skip
    rows = list(csv.DictReader((package / "summary.csv").read_text().splitlines()))
    assert [(r["serial"], r["attempt"], r["verdict"]) for r in rows] == [
        ("A", "1", "accepted"), ("A", "2", "accepted"), ("B", "1", "accepted"),
    ]  # fmt: skip
    assert {r["countersigned_by"] for r in rows} == {"Grace Hopper"}
    assert "a digit was exchanged" in (package / "history.txt").read_text()
    assert accept("verify", package, "--require", "countersigned,current").exit_code == 0


def test_what_was_taken_out_of_a_package_or_changed_is_named(package: Path) -> None:
    stated = evidence_in(package)
    assert stated is not None
    for name in stated.files:
        before = (package / name).read_bytes()
        (package / name).write_bytes(before + b"\n")
        assert list(differences(package, stated)) == [f"{name}: it was changed since the package was made"]
        (package / name).unlink()
        assert list(differences(package, stated)) == [f"{name}: {GONE}"]
        (package / name).write_bytes(before)
    (package / "more.pdf").write_bytes(b"")
    assert list(differences(package, stated)) == ["more.pdf: it was added since the package was made"]
    (package / "more.pdf").unlink()
    (package / "summary.csv").unlink()
    done = accept("verify", package)
    assert (done.exit_code, f"summary.csv: {GONE}" in done.output) == (3, True)


def test_a_folder_does_not_make_a_certificate_one_that_was_replaced(package: Path) -> None:
    old, moved = package / "certificates" / "B.pdf", package / "superseded" / "B-1.pdf"
    old.rename(moved)
    stated = (package / "evidence.json").read_text()
    (package / "evidence.json").write_text(stated.replace("certificates/B.pdf", "superseded/B-1.pdf"))
    done = accept("verify", package)
    assert done.exit_code == 3, done.output  # the bench signed where each lies
    assert done.output.count("replaced since") == 1  # that of A, as the list says


def test_a_bench_with_keys_trusts_its_own_authority_and_not_the_one_of_a_package(
    package: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "another"))
    keys.init(home(), "correct horse", "Eve")
    done = accept("verify", package)
    assert done.exit_code == 6  # its list is of no bench of this authority
    assert accept("verify", package, "--trust", package / "ca.pem").exit_code == 0


def test_what_a_package_lacks_is_said_when_it_is_made(place: Path, tmp_path: Path) -> None:
    (place / "B.pdf").write_bytes(b"something else")
    done = accept("evidence", tmp_path / "evidence", "--units", "A", "--units", "B", "--units", "Z")
    assert done.exit_code == 4
    assert "Z: this bench's store knows no judgement of it" in done.output
    assert "B: the certificate of attempt 1 is not at " in done.output
    told = json.loads((tmp_path / "evidence" / "evidence.json").read_text())
    assert len(told["missing"]) == 2
    checked = accept("verify", tmp_path / "evidence")
    assert (checked.exit_code, "Z: this bench's store knows no judgement of it" in checked.output) == (4, True)
    assert accept("evidence", tmp_path / "evidence").exit_code == 6  # nothing is written over


def test_an_attempt_that_quality_assurance_did_not_sign_is_evidence_too(place: Path, tmp_path: Path) -> None:
    """Judged again before the countersignature, as a unit is that was held or repaired."""
    unit = place.parent / "units" / "A" / "unit.toml"
    unit.write_text(unit.read_text().replace("5.10", "5.11"))
    for _ in range(2):
        again = accept("report", unit.parent, "--out", place / "A.pdf", *SIGNED[1:], "--reason", "a digit")
        assert again.exit_code == 0, again.output
    assert {path.stem for path in place.glob("*.pdf")} == {"A", "A_superseded-1", "A_superseded-2", "B"}
    done = accept("countersign", place)
    assert "2 of 3 countersigned" in done.output, done.output  # C is rejected; what was replaced nobody signs
    done = accept("verify", place)
    assert (done.exit_code, done.output.count("replaced since")) == (0, 2), done.output
    assert accept("verify", place / "A_superseded-1.pdf").exit_code == 4  # alone it is no certificate of the unit now
    done = accept("evidence", tmp_path / "evidence", "--units", "A")
    assert done.exit_code == 0, done.output
    done = accept("verify", tmp_path / "evidence")
    assert (done.exit_code, done.output.count("replaced since")) == (0, 2), done.output
    (place / "B.pdf").rename(place / "B_superseded-1.pdf")
    assert accept("verify", place).output.count("replaced since") == 2  # the store decides, not the name


def test_a_certificate_that_was_set_aside_is_found_whatever_its_name(place: Path, tmp_path: Path) -> None:
    unit, named = place.parent / "units" / "A" / "unit.toml", place / "A [1].pdf"
    for reading in ("5.11", "5.12"):
        unit.write_text(unit.read_text().replace("5.10", reading).replace("5.11", reading))
        done = accept("report", unit.parent, "--out", named, *SIGNED[1:], "--reason", "a digit was exchanged")
        assert done.exit_code == 0, done.output
        assert accept("countersign", named).exit_code == 0  # one that is not is written over
    done = accept("evidence", tmp_path / "evidence", "--units", "A")
    assert done.exit_code == 0, done.output


def edited(package: Path, name: str, content: bytes) -> None:
    """With its hash, as if it had been made so."""
    (package / name).write_bytes(content)
    stated = json.loads((package / "evidence.json").read_text())
    stated["files"][name] = hashlib.sha256(content).hexdigest()
    (package / "evidence.json").write_text(json.dumps(stated))


@pytest.mark.parametrize("name", ["summary.csv", "history.txt", "README.md", "tsa.pem"])
def test_evidence_that_was_edited_with_its_hash(package: Path, name: str) -> None:
    edited(package, name, b"B is accepted\n" if name != "tsa.pem" else (package / "ca.pem").read_bytes())
    done = accept("verify", package)
    assert done.exit_code == 3, done.output
    assert "evidence.json: was changed after the bench signed it" in done.stdout


def test_a_unit_that_was_taken_out_of_the_evidence(package: Path) -> None:
    stated = json.loads((package / "evidence.json").read_text())
    stated["units"].remove("B")
    stated["files"].pop("certificates/B.pdf")
    (package / "certificates" / "B.pdf").unlink()
    (package / "evidence.json").write_text(json.dumps(stated))
    assert accept("verify", package).exit_code == 3


def test_evidence_that_nobody_signed(package: Path) -> None:
    stated = json.loads((package / "evidence.json").read_text())
    (package / "evidence.json").write_text(json.dumps({k: v for k, v in stated.items() if k != "signature"}))
    done = accept("verify", package)
    assert done.exit_code == 4, done.output
    assert "evidence.json: no bench signed it; only the certificates and list.json are proven" in done.stdout


def test_evidence_reads_what_lies_in_it_and_no_more(package: Path, tmp_path: Path) -> None:
    """Nothing outside, and no file that fills the memory."""
    outside = tmp_path / "outside.txt"
    outside.write_bytes(b"of somebody else")
    digest = hashlib.sha256(outside.read_bytes()).hexdigest()
    (package / "link").symlink_to(outside)
    with (package / "sparse").open("wb") as file:
        file.truncate(3 << 30)
    os.mkfifo(package / "pipe")
    stated = json.loads((package / "evidence.json").read_text())
    stated["files"] |= dict.fromkeys(["../outside.txt", str(outside), "link", "sparse", "pipe"], digest)
    (package / "evidence.json").write_text(json.dumps(stated))
    done = accept("verify", package)
    assert done.exit_code == 3
    for name in ("../outside.txt", str(outside), "link"):
        assert f"{name}: lies outside the package, and was not read" in done.stdout
    assert "sparse: cannot be read (has 3221225472 bytes" in done.stdout
    assert "pipe: cannot be read (is a pipe or a device" in done.stdout


def test_a_certificate_is_set_aside_only_beside_the_one_that_stands(place: Path, tmp_path: Path) -> None:
    """Red before: an accepted certificate of a unit that was rejected since, renamed and given alone, was `valid and as
    required`, exit 0."""
    unit = place.parent / "units" / "A" / "unit.toml"
    unit.write_text(unit.read_text().replace("373.2", "150.5").replace("5.10", "5.06"))
    done = accept("report", unit.parent, "--out", place / "A.pdf", *SIGNED[1:], "--reason", "dropped")
    assert done.exit_code == 3, done.output
    (old,) = place.glob("A_superseded-*.pdf")
    for moved in (tmp_path / "given" / old.name, tmp_path / "superseded" / "A.pdf"):
        moved.parent.mkdir()
        shutil.copy(old, moved)
        for required in ((), ("--require", "accepted,current")):
            for asked in ((moved.parent,), (moved, "--table")):
                done = accept("verify", *asked, *required)
                assert done.exit_code == (3 if required else 4), done.output
                assert "0 of 1 certificates are valid" in done.output
                assert "this bench's store knows a later attempt" in done.output
    shutil.copy(place / "A.pdf", tmp_path / "given" / "A.pdf")
    (tmp_path / "given" / "folder.pdf").mkdir()  # red before: nothing in the folder was verified
    done = accept("verify", tmp_path / "given")
    assert (done.exit_code, done.output.count("replaced since")) == (0, 1), done.output
