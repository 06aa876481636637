"""From a unit's folder to its certificate, `unit.toml` is parsed once and every record is read once."""

import sys
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from accept.batch.judge_batch import BatchRequest, run
from accept.certificate.trust import keys
from accept.gap import analyse_unit
from accept.judging import judge_unit, load_spec
from accept.store import open_store
from accept.units import loaded_unit, unit_folder
from accept.units.loaded_unit import LoadedUnit
from checks.acceptance import misalignment
from checks.errors import RecordError
from checks.gap import GapRefused
from tests.accept.units.test_unit import good_stroke, records_unit
from tests.checks.gap.shared.gap_units import make_strut

PASSPHRASE = "read only once"
opened: Counter[str] = Counter()
watching: list[Path] = []


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open" and watching and isinstance(arguments[0], str) and arguments[0].startswith(str(watching[0])):
        opened[Path(arguments[0]).name] += 1


sys.addaudithook(_audit)  # sees every opening of a file in this process, by whatever function; it cannot be taken back


def test_one_strut_from_records_to_certificate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its frequency responses judged, misalignment and gap prepared, its records attached. The two searches themselves
    are left out: they begin when all is read."""

    def found(*given: object, **more: object) -> None:
        raise GapRefused("not searched")

    monkeypatch.setattr(analyse_unit, "run", found)
    monkeypatch.setattr(misalignment, "estimate_misalignment", found)
    folder = make_strut(tmp_path / "units" / "S-1", "S-1")
    keys.init(tmp_path / "home", PASSPHRASE, "Ada")
    credential = keys.unlock(tmp_path / "home", keys.TECHNICIAN, PASSPHRASE)
    parsed: list[str] = []
    loads = tomllib.loads
    monkeypatch.setattr(tomllib, "loads", lambda text: parsed.append(text) or loads(text))
    request = BatchRequest(
        [folder], tmp_path / "out", {"strut": load_spec("strut")}, "Ada", credential, workers=1, model="strut"
    )
    opened.clear()
    watching[:] = [folder]
    try:
        with open_store(f"sqlite:///{tmp_path / 'store.sqlite'}") as store:
            report = run(request, store, lambda words: None)
    finally:
        watching.clear()
    assert len(report.units) == 1
    assert (report.units[0].gap or {})["reason"] == "not searched"
    assert any("not searched" in (f.reason or "") for f in report.units[0].findings)
    # Once to be judged, and once for the page, whose statements must follow from the attached text alone.
    assert sum('serial = "S-1"' in text for text in parsed) == 2
    assert opened == dict.fromkeys(report.units[0].inputs, 1)
    assert len(opened) >= 5  # unit.toml and both bands in two realisations


def test_what_is_judged_is_what_was_hashed(tmp_path: Path) -> None:
    """A file that is exchanged after it was read is not looked at again, one that is too large to hold is refused."""
    folder = records_unit(tmp_path / "R-1", **good_stroke())
    held = LoadedUnit(unit_folder.read(folder))
    before = judge_unit(LoadedUnit(unit_folder.read(folder)), load_spec("apa-basic"))
    assert held.hashes == before.inputs
    for name in ("one.mat", "two.mat"):
        (folder / name).write_bytes(b"exchanged")
    assert judge_unit(held, load_spec("apa-basic")).to_json() == before.to_json()
    assert LoadedUnit(unit_folder.read(folder)).hashes != before.inputs


def test_a_file_beyond_what_is_held_is_refused_when_it_changed(tmp_path: Path) -> None:
    folder = records_unit(tmp_path / "R-1", **good_stroke())
    small = LoadedUnit(unit_folder.read(folder), held_bytes=10)
    assert small.hashes == LoadedUnit(unit_folder.read(folder)).hashes
    assert set(small.contents) == {"unit.toml"}
    (folder / "two.mat").write_bytes((folder / "two.mat").read_bytes() + b"\0" * 8)
    with pytest.raises(RecordError, match=r"two\.mat"):
        small.values("stroke")


def test_no_unit_is_held_longer_than_it_is_worked_on(tmp_path: Path) -> None:
    folder = records_unit(tmp_path / "R-1", **good_stroke())
    one = unit_folder.read(folder)
    assert loaded_unit.loaded(one) is not loaded_unit.loaded(one)
