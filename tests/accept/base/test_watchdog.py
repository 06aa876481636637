"""One file from outside never stops the line: bounds before parsing, and a limit of time on what is left."""

import contextlib
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from accept.base import watchdog
from accept.base.watchdog import TimeLimitExceeded, judging_s, time_limit
from accept.batch.job import UnitJob
from accept.cli.main import app
from specs.patterns import pattern_problem
from specs.strict import MAX_KEY_PARTS, toml_of
from tests.accept.certificate.verify.hostile_files import plain
from tests.accept.certificate.verify.verify_help import made_bench
from tests.accept.units.units import make_unit


def _catches_every_fault() -> None:
    while True:
        with contextlib.suppress(Exception):
            time.sleep(5)


def test_work_is_stopped_and_other_faults_do_not_catch_it() -> None:
    began = time.monotonic()
    with pytest.raises(TimeLimitExceeded), time_limit(0.2):
        _catches_every_fault()
    assert time.monotonic() - began < 3
    with time_limit(0.05):
        pass
    time.sleep(0.1)  # the limit of before is gone


def test_the_limit_can_be_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    for given, expected in (("90", 90.0), ("nonsense", watchdog.JUDGING_S), ("-3", 1.0)):
        monkeypatch.setenv("ACCEPT_UNIT_S", given)
        assert judging_s() == expected


def test_a_unit_that_takes_too_long_is_refused_and_the_others_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = UnitJob.judge

    def slow(job, *rest):  # type: ignore[no-untyped-def]
        if job.unit.serial == "A-1":
            time.sleep(60)
        return whole(job, *rest)

    monkeypatch.setattr(UnitJob, "judge", slow)
    monkeypatch.setenv("ACCEPT_UNIT_S", "6")  # the other one takes two, with the libraries that it loads
    for serial in ("A-1", "Z-1"):
        make_unit(tmp_path / "units" / serial, serial)
    words = ["batch", str(tmp_path / "units"), "--out", str(tmp_path / "out"), "--spec", "apa-basic", "--workers", "1"]
    done = CliRunner().invoke(app, words)
    assert "A-1: judging it took more than 6 s" in done.stderr, done.output
    assert (tmp_path / "out" / "certificates" / "Z-1.pdf").exists()


def test_a_certificate_that_takes_too_long_is_not_valid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = made_bench(tmp_path)
    monkeypatch.setenv("ACCEPT_UNIT_S", "1")
    report = bench.check(bench.signed, rejudge=lambda _: time.sleep(60))
    assert not report.valid
    assert "could not be verified within 1 s" in report.reason


@pytest.mark.parametrize(
    "text",
    [
        ".".join(["a"] * 450_000) + " = 1",
        "[" + ".".join(["a"] * 450_000) + "]",
        " . ".join(['"a"'] * 200_000) + " = 1",
        "x = {" + ".".join(["a"] * 200_000) + " = 1}",
        "x = " + "[" * 100_000,
        "a = " + "1" * 5000,
    ],
    ids=["dotted", "header", "quoted", "inline", "nested", "digits"],
)
def test_toml_that_would_take_long_is_refused_before_it_is_parsed(text: str) -> None:
    began = time.monotonic()
    with pytest.raises(ValueError):
        toml_of(text.encode())
    assert time.monotonic() - began < 2


def test_toml_of_measurements_is_read() -> None:
    values = ", ".join(f"{n}.5" for n in range(20 * MAX_KEY_PARTS))
    assert len(toml_of(f"z_um = [{values}]".encode())["z_um"]) == 20 * MAX_KEY_PARTS


@pytest.mark.parametrize("pattern", ["(a+)+x", "(a|a)*b", "(a*)*", r"(a)\1+", "(?=a+)a", "a*b*c*d*e*", "x" * 300, "("])
def test_patterns_that_may_take_for_ever_are_refused(pattern: str) -> None:
    assert pattern_problem(pattern)


@pytest.mark.parametrize("pattern", [r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", r"(?:APA|S)-\d+", r"(LOT-)?\d{4}-[A-Z]+", "A"])
def test_patterns_of_serials_are_taken(pattern: str) -> None:
    assert pattern_problem(pattern) is None


def test_a_form_of_very_many_paths_is_refused_at_once(tmp_path: Path) -> None:
    """3 KB, 2^40 paths."""
    bench = made_bench(tmp_path)
    fields = {n: b"<< /T (a) /Kids [%d 0 R %d 0 R] >>" % (n + 1, n + 1) for n in range(2, 42)}
    form = {1: b"<< /Type /Catalog /AcroForm << /Fields [2 0 R] >> >>", 42: b"<< /T (technician) /FT /Sig >>"}
    loop = {1: form[1], 2: b"<< /T (qa) /FT /Sig /Kids [2 0 R] >>"}
    began = time.monotonic()
    for objects in (dict(sorted((form | fields).items())), loop):
        report = bench.check(plain(objects))
        assert not report.valid
        assert "fields" in report.reason
    assert time.monotonic() - began < 10
