"""Orders that cannot be carried out: refused before the work, in one line that names what is wrong, exit 6."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from accept.base.atomic_files import ReplaceError, check_place, check_table, write_atomic
from accept.base.version import code_sha256, version
from accept.cli.main import app
from tests.accept.units.units import make_unit
from tests.shared.command_line import accept


def refused(*words: object) -> str:
    """What is said on stderr, a single line."""
    done = CliRunner().invoke(app, [str(w) for w in words])
    assert done.exit_code == 6, done.output + str(done.exception)
    assert done.stderr.count("\n") == 1
    return done.stderr


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    return make_unit(tmp_path / "unit", "T-01")


def test_a_model_that_is_named_must_be_there(unit: Path, tmp_path: Path) -> None:
    """A spec's own model that is missing leaves the unit judged; one that was asked for does not pass in silence."""
    for command in (("batch", unit, "--out", tmp_path / "out"), ("report", unit, "--out", tmp_path / "x.pdf")):
        assert "nope: no such model" in refused(*command, "--model", "nope")
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "x.pdf").exists()


def test_a_place_that_cannot_be_written_is_said_first(unit: Path, tmp_path: Path) -> None:
    assert "is a folder, expected a file" in refused("report", unit, "--out", tmp_path)
    (tmp_path / "file").write_text("")
    assert "is a file, expected a folder" in refused("report", unit, "--out", tmp_path / "file" / "x.pdf")
    assert "is a file, expected a folder" in refused("model", "fit", unit, "--out", tmp_path / "file")
    check_place(tmp_path / "new" / "deep" / "x.pdf")  # folders that are missing are made


def test_no_output_replaces_evidence(unit: Path, tmp_path: Path) -> None:
    """A recording, or unit.toml itself, whatever it is called."""
    evidence = unit / "unit.toml", unit / "sub" / "loops.json", unit / "notes.csv"
    evidence[1].parent.mkdir()
    evidence[1].write_text("{}")
    evidence[2].write_text("t,de\n0,1\n")
    evidence[0].write_text(evidence[0].read_text() + '[hysteresis]\nrecord = "sub/loops.json"\n')
    before = [file.read_bytes() for file in evidence]
    for file in evidence[:2]:
        assert "is evidence of the unit in" in refused("report", unit, "--out", file)
        assert "is evidence of the unit in" in refused("spec", "list", "--json", file)
        assert "is evidence of the unit in" in refused("list", "--csv", file)
    assert "is not an earlier .csv output" in refused("list", "--csv", evidence[2])
    assert [file.read_bytes() for file in evidence] == before


def test_no_table_replaces_a_recording_that_belongs_to_no_unit(tmp_path: Path) -> None:
    place = tmp_path / "lone.csv"
    for header in (b"t,Va,Vs", b"time,de", b"0.0,1.0"):
        place.write_bytes(header + b"\n0,1,2\n")
        assert "is not an earlier .csv output" in refused("excite", "sweep", "--out", place)
        for table in (b"serial,kind\nA-1,apa\n", b"f,de_real\n1,2\n"):
            with pytest.raises(ReplaceError, match=r"not an earlier \.csv output"):
                check_table(place, table)
        assert place.read_bytes().startswith(header)
    place.unlink()
    for duration in ("2", "3"):
        assert accept("excite", "sweep", "--duration", duration, "--out", place).exit_code == 0
    place.write_bytes(b"serial,kind\n")
    check_table(place, b"serial,kind,verdict\n")


@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("results.csv", ["batch", "{unit}", "--no-certificates", "--out", "{unit}"]),
        ("junit.xml", ["batch", "{unit}", "--no-certificates", "--out", "{unit}"]),
        ("index.html", ["site", "--out", "{unit}"]),
        ("loops.mat", ["excite", "sweep", "--out", "{unit}/loops.mat"]),
        ("left.mat", ["excite", "sweep", "--out", "{unit}/left.mat"]),
    ],
)
def test_no_folder_of_outputs_replaces_evidence(unit: Path, name: str, command: list[str]) -> None:
    """Nor does a command that has no place of its own to check."""
    (unit / name).write_bytes(b"measured")
    if name != "left.mat":  # beside unit.toml, which does not name it yet
        (unit / "unit.toml").write_text((unit / "unit.toml").read_text() + f'[hysteresis]\nrecord = "{name}"\n')
    if command[0] == "site":
        accept("batch", unit, "--no-certificates", "--out", unit.parent / "out")
    done = accept(*(word.format(unit=unit) for word in command))
    assert done.exit_code == 6, done.output
    assert (unit / name).read_bytes() == b"measured"


@pytest.mark.parametrize(("kind", "ours", "other"), [(".pdf", b"%PDF-1.7", b"MATLAB 5.0"), (".json", b" {", b"t,de")])
def test_an_output_replaces_only_one_of_its_kind(tmp_path: Path, kind: str, ours: bytes, other: bytes) -> None:
    place = tmp_path / "x"
    for content in (ours, b""):
        place.write_bytes(content)
        check_place(place, kind)
    place.write_bytes(other)
    with pytest.raises(ReplaceError, match=f"not an earlier {kind} output"):
        check_place(place, kind)


def test_a_unit_is_a_folder(unit: Path, tmp_path: Path) -> None:
    assert "is a file; expected a unit folder" in refused("misalign", unit / "unit.toml")
    assert "does not exist; expected a unit folder" in refused("report", tmp_path / "no", "--out", tmp_path / "x.pdf")


def test_a_failed_write_names_the_file_that_was_asked_for(tmp_path: Path) -> None:
    """Not the temporary one beside it, which nobody knows."""
    too_long = tmp_path / ("x" * 250)
    with pytest.raises(OSError, match="x" * 250) as caught:
        write_atomic(too_long, b"")
    assert caught.value.filename == str(too_long)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("model", ["apa-frame", "apa-2dof"])
def test_no_table_of_a_model_without_joints(model: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "home"))
    assert "has no joints" in refused("lookup", "build", "--model", model)


def test_an_empty_store_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "home"))
    done = CliRunner().invoke(app, ["store", "log", "T-01"])
    assert (done.exit_code, done.stdout) == (0, "")
    assert "no event of a unit 'T-01'" in done.stderr


def test_no_bench_file_is_said_with_the_way_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "home"))
    assert "no bench file found; write one or name it with --bench" in refused("hw", "list")


@pytest.mark.parametrize(
    "group", [(), ("excite",), ("model",), ("hw",), ("simulate",), ("spec",), ("store",), ("product",)]
)
def test_the_list_of_commands_is_cut_nowhere(group: tuple[str, ...]) -> None:
    done = CliRunner().invoke(app, [*group, "--help"], env={"COLUMNS": "80"})
    listed = done.stdout.split("Show this message and exit.")[1]
    assert "..." not in listed
    assert all(line.strip().endswith((".", "?")) for line in listed.splitlines() if line.startswith("  "))


def test_version_names_the_code() -> None:
    done = CliRunner().invoke(app, ["--version"])
    assert done.exit_code == 0
    assert done.stdout == f"accept {version()}, code {code_sha256()[:12]}\n"


def test_a_section_without_instrument_is_bad_input_and_begins_nothing(tmp_path: Path) -> None:
    """Exit 5 is kept for instruments that do not answer."""
    words = refused(
        "hw", "measure", tmp_path / "new", "sensor_highpass", "--begin", "N-1", "--bench", tmp_path / "none.toml"
    )
    assert "'sensor_highpass' is not measured by an instrument here (known: flatness" in words
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("order", "said"),
    [
        (("modes", "--f-max", -1), "--f-max -1: expected a frequency above 0 Hz"),
        (("modes", "--f-max", "nan"), "--f-max nan"),
        (("frf", "--points", 10**12), "expected 2 to 1000000 of them"),
        (("frf", "--f-hi", "inf"), "to inf Hz"),
        (("sweep", "nope"), "name them with --value "),
    ],
)
def test_what_no_model_can_be_asked_for(order: tuple[object, ...], said: str) -> None:
    assert said in refused("model", *order)
