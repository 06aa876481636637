"""Names and words from outside: none harms a file system, a spreadsheet or a terminal."""

import os
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from accept.base import atomic_files
from accept.base.console import one_line
from accept.base.documents.results import ListedUnit
from accept.base.exit_codes import Exit
from accept.batch.results import csv_rows, findings
from accept.cli.main import app
from accept.units import unit_folder
from accept.units.attach import copy_in
from checks.verdict import Finding, UnitVerdict, Verdict
from hw.records import DEFAULT_LIMITS
from specs.files import read_bounded
from tests.accept.units.units import make_unit


@pytest.mark.parametrize("serial", ["CON", "con.1", "Lpt1", "A-1."])
def test_serials_that_windows_keeps_are_refused(tmp_path: Path, serial: str) -> None:
    (tmp_path / "unit.toml").write_text(f'serial = "{serial}"\nkind = "apa"\n')
    with pytest.raises(unit_folder.UnitError, match="Windows keeps"):
        unit_folder.read(tmp_path)


def test_a_pipe_and_an_endless_device_are_said_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "unit.toml")
    with pytest.raises(unit_folder.UnitError, match="a pipe or a device"):
        unit_folder.read(tmp_path)
    with pytest.raises(OSError, match="a pipe or a device"):
        read_bounded(Path("/dev/zero"))
    (tmp_path / "large").write_bytes(b"x" * 101)
    with pytest.raises(OSError, match="at most 100 are read"):
        read_bounded(tmp_path / "large", 100)


def test_no_cell_is_a_formula_and_no_line_moves_the_cursor() -> None:
    finding = Finding(
        "=1+1", "q", -1.5, "um", None, None, None, "simple", Verdict.FAIL, None, reason="@SUM(A1)\x1b[2J"
    )  # fmt: skip
    unit = ListedUnit(serial="A", kind="apa", verdict=UnitVerdict.REJECTED, findings=(finding,))
    judgement = {"attempt": 1, "time": "2026-11-22T11:02:23+00:00", "operator": "=Ada"}
    text = csv_rows(findings(unit, judgement), header=True).decode()
    assert "'=Ada" in text
    assert "'=1+1" in text
    assert "'@SUM" in text
    assert "-1.5" in text
    assert "'-1.5" not in text
    assert "\x1b" not in text
    assert one_line("a\n2  now\x1b[2J\u202e") == "a\\n2  now\\x1b[2J\\u202e"


def test_files_keep_the_umask(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(atomic_files, "_UMASK", 0o077)
    atomic_files.write_atomic(tmp_path / "a", b"x")
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o600


def test_no_cell_of_a_table_and_no_line_of_the_log_is_forged(capsys: pytest.CaptureFixture[str]) -> None:
    """Names of instruments, specs and persons stand in tables; an error quotes what it met."""
    from rich.table import Table

    from accept.base.console import PlainConsole
    from accept.base.fault_log import log_fault, log_file

    table = Table("who")
    table.add_row("Ada\x1b[2J\x1b[1;1Hforged\u202e")
    PlainConsole(markup=False, width=100).print(table)
    shown = capsys.readouterr().out
    assert "\x1b" not in shown
    assert "\u202e" not in shown
    assert "\\x1b[2J" in shown
    try:
        raise ValueError("bad\n2026-01-01 accept: nothing happened\x1b[2J")
    except ValueError as e:
        log_fault("reading", e)
    written = log_file().read_text()
    assert "\x1b" not in written
    assert not [line for line in written.splitlines() if line.startswith("2026-01-01")]


def test_a_line_break_in_a_name_begins_no_line_of_an_answer(tmp_path: Path) -> None:
    """In the name of a record, of a folder and of a file that is no spec: each is shown, none on a line of its own."""
    from typer.testing import CliRunner

    from accept.cli.main import app
    from tests.accept.units.units import GOOD, make_unit

    forged = "A-9: accepted"
    make_unit(
        tmp_path / "units" / "one",
        "A-1",
        GOOD.replace("stroke_um = 373.2", f'one_stack = "x\\n{forged}"\ntwo_stacks = "y"'),
    )
    make_unit(tmp_path / "units" / f"two\n{forged}", "A-2!")
    words = ["batch", str(tmp_path / "units"), "--spec", "apa-basic", "--out", str(tmp_path / "out")]
    done = [CliRunner().invoke(app, [*words, "--no-certificates"])]
    done += [CliRunner().invoke(app, ["spec", "validate", str(tmp_path / f"none\n{forged}.toml")])]
    done += [CliRunner().invoke(app, ["store", "log"])]
    shown = [line for one in done for line in (*one.stdout.splitlines(), *one.stderr.splitlines())]
    assert sum(forged in line for line in shown) >= 4
    assert not [line for line in shown if line.startswith(forged)]


def test_serials_that_differ_in_case_only_are_one_on_some_file_systems(tmp_path: Path) -> None:
    from typer.testing import CliRunner

    from accept.cli.main import app
    from tests.accept.units.units import make_unit

    for serial in ("a-1", "A-1"):
        make_unit(tmp_path / "units" / f"folder {serial}", serial)
    words = ["batch", str(tmp_path / "units"), "--spec", "apa-basic", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, [*words, "--no-certificates"])
    assert done.stderr.count("serials must be unique") == 2


def test_serials_that_differ_from_a_known_one_in_case_only_are_refused_by_every_way(tmp_path: Path) -> None:
    """Also days later, by batch, report and workflow: their certificates and folders would overwrite each other. The
    known one goes on, and so do both where an older store has both."""
    from typer.testing import CliRunner

    from accept.cli.main import app
    from accept.store import open_store
    from accept.workflow.entry.parse_entry import EntryError
    from accept.workflow.open_bench import open_bench
    from tests.accept.units.units import make_unit

    known, other = make_unit(tmp_path / "known", "APA-1"), make_unit(tmp_path / "other", "apa-1")
    spec, run = ["--spec", "apa-basic", "--out"], CliRunner().invoke
    batch = [*spec, str(tmp_path / "out"), "--no-certificates"]
    assert run(app, ["batch", str(known), *batch]).exit_code == 0
    said = [run(app, ["batch", str(other), *batch]), run(app, ["report", str(other), *spec, str(tmp_path / "a.pdf")])]
    assert [(d.exit_code, "'apa-1' differs from 'APA-1'" in d.stderr) for d in said] == [(6, True)] * 2, said[0].output
    assert not (tmp_path / "a.pdf").exists()
    bench = open_bench("apa-basic")
    with pytest.raises(EntryError, match="'Apa-1' differs from 'APA-1'"):
        bench.session("Apa-1", "apa", "Ada")
    bench.session("APA-1", "apa", "Ada").close()
    bench.close()
    assert run(app, ["batch", str(known), *batch]).exit_code == 0
    with open_store() as store:
        store.append("unit_judged", "apa-1", store.latest("APA-1", "unit_judged").data, who="Ada")
    assert "differs from" not in run(app, ["batch", str(other), *batch]).stderr


@pytest.mark.parametrize("serial", ["\u00c5-1", "A\u030a-1", "\uff21-1", "A-\u0661", "CON", "A-1."])
def test_serials_that_file_systems_write_in_two_ways_are_refused_by_folder_and_workflow(
    tmp_path: Path, serial: str
) -> None:
    """Composed and decomposed letters, wide ones, other digits: a serial is ASCII, so none has two forms."""
    from accept.judging import load_spec
    from accept.workflow.entry.parse_entry import serial_problem

    (tmp_path / "unit.toml").write_text(f'serial = "{serial}"\nkind = "apa"\n')
    with pytest.raises(unit_folder.UnitError, match="serial = "):
        unit_folder.read(tmp_path)
    assert serial_problem(serial, load_spec("apa-basic")) is not None
    assert serial_problem("A-1_attempt-2", load_spec("apa-basic")) is not None  # as the second attempt's certificate


def test_keys_that_others_can_read_are_warned_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from typer.testing import CliRunner

    from accept.base.home import home
    from accept.certificate.trust import keys
    from accept.cli.main import app
    from tests.accept.units.units import make_unit

    unit, out = make_unit(tmp_path / "u", "A-1"), tmp_path / "a.pdf"
    words = ["report", str(unit), "--spec", "apa-basic", "--out", str(out)]
    assert "can be read by others" not in CliRunner().invoke(app, words).stderr
    (keys.folder(home()) / "technician.key.pem").chmod(0o644)
    for told in (words, ["keys", "list"]):
        assert "can be read by others" in CliRunner().invoke(app, told).stderr


def test_every_font_of_a_certificate_is_embedded(tmp_path: Path) -> None:
    from pypdf import PdfReader

    from accept.certificate.page.document import render
    from tests.accept.certificate.certificate_help import certificate_contents

    path = tmp_path / "a.pdf"
    path.write_bytes(render(certificate_contents(tmp_path)))
    fonts = [f.get_object() for page in PdfReader(path).pages for f in page["/Resources"]["/Font"].values()]
    assert fonts
    assert not {str(f["/BaseFont"]) for f in fonts if "/FontFile2" not in f.get("/FontDescriptor", {})}


def sparse(path: Path, size: int) -> None:
    """A file of that size that takes no place."""
    with open(path, "wb") as file:
        file.truncate(size)


def test_a_file_that_no_disk_holds_is_refused_by_its_size(tmp_path: Path) -> None:
    """Red before: its hash was taken first, for half an hour."""
    for serial in ("A-1", "Z-1"):
        make_unit(tmp_path / "units" / serial, serial)
    unit = tmp_path / "units" / "A-1"
    (unit / "unit.toml").write_text('serial = "A-1"\nkind = "apa"\n[stroke]\none_stack = "big.csv"\n')
    sparse(unit / "big.csv", 8 * 10**12)
    began = time.monotonic()
    with pytest.raises(unit_folder.UnitError, match=r"big[.]csv has 8000000000000 bytes, at most 536870912 are read"):
        unit_folder.read(unit)
    words = ["batch", str(tmp_path / "units"), "--spec", "apa-basic", "--out", str(tmp_path / "o"), "--workers", "1"]
    done = CliRunner().invoke(app, words)
    assert "big.csv has 8000000000000 bytes" in done.stderr
    assert (tmp_path / "o" / "certificates" / "Z-1.pdf").exists(), done.stderr
    assert time.monotonic() - began < 60  # on a busy machine; a hash of 8 TB takes hours


def test_a_certificate_that_is_too_large_is_refused_by_its_size(tmp_path: Path) -> None:
    sparse(tmp_path / "a.pdf", 10 * 10**9)
    done = CliRunner().invoke(app, ["verify", str(tmp_path / "a.pdf")])
    assert done.exit_code == Exit.BAD_INPUT
    assert "a.pdf: has 10000000000 bytes, at most 100000000 are read" in done.stderr
    sparse(tmp_path / "record.csv", 8 * 10**12)
    with pytest.raises(OSError, match="has 8000000000000 bytes, at most 536870912"):
        copy_in(tmp_path / "record.csv", tmp_path, DEFAULT_LIMITS.max_bytes)
