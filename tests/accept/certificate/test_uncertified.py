"""A judgement that was stored and not certified: its certificate is made up for as the same attempt, whatever came
between; anything else is another attempt, which names the certificate that is still about."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

import pytest

from accept.batch.pipeline import Pipeline
from accept.certificate.trust import encrypted_key, keys
from accept.store import Event, NewEvent, Store, open_store
from tests.accept.units.units import GOOD, make_unit
from tests.shared.command_line import accept


@pytest.fixture(autouse=True)
def quick_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encrypted_key, "ITERATIONS", 10)


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    return make_unit(tmp_path / "u", "A-1")


def certify_by(command: str, unit: Path, *more: object) -> Path:
    """The certificate of `accept batch` or `accept report`."""
    out = unit.parent / "out"
    place = out if command == "batch" else out / "certificates" / "A-1.pdf"
    done = accept(command, unit, "--spec", "apa-basic", "--out", place, *more)
    assert done.exit_code == 0, done.output
    return out / "certificates" / "A-1.pdf"


def attempt_on(pdf: Path, exit_code: int = 0) -> str:
    done = accept("verify", pdf)
    assert done.exit_code == exit_code, done.output
    return next(line.strip() for line in done.stderr.splitlines() if line.strip().startswith("attempt:"))


def judgements() -> int:
    with open_store() as store:
        return len(list(store.events("A-1", "unit_judged")))


@pytest.mark.parametrize("command", ["batch", "report"])
def test_stopped_after_the_file_and_before_its_event(command: str, unit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The signed file lies there and nobody was told of it: the next run makes it again, as the first attempt."""

    append_many = Store.append_many

    def stopped(store: Store, entries: Sequence[NewEvent], *, who: str) -> list[Event]:
        if any(entry.what == "certificate_signed" for entry in entries):
            raise OSError("stopped here")
        return append_many(store, entries, who=who)

    with monkeypatch.context() as cut:
        cut.setattr(Store, "append_many", stopped)
        with pytest.raises(AssertionError, match="stopped here"):
            certify_by(command, unit)
    assert attempt_on(unit.parent / "out" / "certificates" / "A-1.pdf", 4) == "attempt: 1"  # the store does not know it
    assert attempt_on(certify_by(command, unit)) == "attempt: 1"
    assert judgements() == 1


def test_a_certificate_that_is_wanted_later_is_of_the_same_attempt(unit: Path) -> None:
    certify_by("batch", unit, "--no-certificates")
    assert attempt_on(certify_by("batch", unit)) == "attempt: 1"
    assert judgements() == 1


def test_another_person_or_another_result_is_another_attempt(unit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    certify_by("batch", unit, "--no-certificates", "--operator", "Grace")
    assert attempt_on(certify_by("batch", unit)).startswith("attempt: 2, replaces 'accepted' of")
    unit.joinpath("unit.toml").write_text(GOOD.format(serial="A-1").replace("5.10", "5.09"))
    certify_by("batch", unit, "--no-certificates")
    monkeypatch.setattr(Pipeline, "_is_stored", lambda *_: False)  # e.g. its recording stands elsewhere too by now
    words = ("--reason", "measured again")
    assert attempt_on(certify_by("batch", unit, *words)).startswith("attempt: 4, replaces 'accepted' of")
    assert judgements() == 4


def test_the_certificate_that_is_still_about_is_named(unit: Path) -> None:
    """Between it and this one stands a judgement without a certificate."""
    first = hashlib.sha256(certify_by("batch", unit).read_bytes()).hexdigest()[:12]
    for sensor, more in (("5.09", ["--no-certificates"]), ("5.08", [])):
        unit.joinpath("unit.toml").write_text(GOOD.format(serial="A-1").replace("5.10", sensor))
        pdf = certify_by("batch", unit, "--reason", "measured again", *more)
    said = attempt_on(pdf)
    assert said.startswith("attempt: 3, replaces 'accepted' of")
    assert said.endswith(f"which had no certificate, and certificate sha256 {first} of attempt 1; before: 2 accepted")


def test_keys_that_another_run_makes_meanwhile_are_used(unit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs in a new home: both find no keys, one of them makes them first."""
    place = keys._place

    def slower(files: dict[str, bytes], target: Path) -> None:
        place(files, target)
        place(files, target)  # the folder is there by now

    monkeypatch.setattr(keys, "_place", slower)
    assert attempt_on(certify_by("batch", unit)) == "attempt: 1"
