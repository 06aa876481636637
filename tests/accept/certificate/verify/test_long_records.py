"""What the records of a certificate expand to is bounded before they are read: small files may declare many samples."""

from dataclasses import replace
from pathlib import Path

import pytest

from accept.certificate import read_contents
from accept.certificate.verify import attachments
from accept.units.loaded_unit import LoadedUnit
from checks.declare import Series
from checks.record import Record
from hw.records import Source, declared_samples
from tests.accept.certificate import test_newest_measurement
from tests.accept.certificate.test_newest_measurement import accept, recorded
from tests.accept.units.units import LOOPS

_bench = test_newest_measurement._bench


@pytest.fixture
def certified(tmp_path: Path) -> tuple[Path, Path]:
    """A certificate and the folder of its unit, whose record has 18 000 numbers."""
    folder, spec = recorded(tmp_path / "A-1", 1), tmp_path / "loops.toml"
    spec.write_text(LOOPS)
    assert accept("report", folder, "--spec", spec, "--out", tmp_path / "a.pdf").exit_code == 0
    return tmp_path / "a.pdf", folder


def test_a_record_of_too_many_samples_is_not_read(
    certified: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    pdf, folder = certified
    done = accept("verify", pdf)
    assert done.exit_code == 0, done.output
    monkeypatch.setattr(attachments, "MOST_SAMPLES", 17_000)
    read: list[str] = []
    record = LoadedUnit._record

    def noted(held: LoadedUnit, source: Source, declared: Series) -> Record:
        read.append(source.file)
        return record(held, source, declared)

    monkeypatch.setattr(LoadedUnit, "_record", noted)
    done = accept("verify", pdf)
    assert (done.exit_code, read) == (4, [])
    assert "not judged again: hysteresis (loops.csv not attached, or too long;" in done.output
    done = accept("verify", pdf, "--records", folder)
    assert (done.exit_code, set(read)) == (0, {"loops.csv"}), done.output


def test_the_shorter_ones_are_judged(certified: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    contents = read_contents(certified[0].read_bytes())
    raw = contents.files["loops.csv"]
    files = {"unit.toml": b"", "loops.csv": raw, "other.csv": raw, "long.csv": raw + raw}
    longer = replace(contents, files=files)
    declared = declared_samples("loops.csv", raw, 10**6)
    for most, kept in ((3.9, 2), (1.9, 1), (0.9, 0), (4.1, 3)):
        monkeypatch.setattr(attachments, "MOST_SAMPLES", int(most * declared))
        left = attachments.within_samples(longer).files
        assert [n for n in ("loops.csv", "other.csv", "long.csv") if n in left] == [
            "loops.csv",
            "other.csv",
            "long.csv",
        ][:kept]
        assert "unit.toml" in left
