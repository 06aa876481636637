"""`accept -v` says what is read and opened, `-vv` every byte on a line, and no value of a passphrase."""

import logging
import os
import subprocess
import sys

import pytest

from accept.base import verbose
from accept.base.home import home
from tests.hw.apart.table import BENCHES, opened

SECRET = "correct horse"


def accept(*words: object) -> subprocess.CompletedProcess[str]:
    env = os.environ | {"ACCEPT_PASSPHRASE": SECRET}
    return subprocess.run(
        [sys.executable, "-m", "accept", *map(str, words)], env=env, capture_output=True, text=True, timeout=120
    )


def test_what_is_read_and_opened_is_on_stderr(tmp_path):
    plain, said = accept("spec", "show", "apa"), accept("-v", "spec", "show", "apa")
    assert said.stdout == plain.stdout
    assert plain.stderr == ""
    assert "apa.toml" in said.stderr
    assert str(home()) in said.stderr
    assert "ACCEPT_PASSPHRASE" in said.stderr
    assert SECRET not in said.stderr
    assert "store.sqlite" in accept("--verbose", "store", "log").stderr


def test_a_screen_is_not_written_over(capsys):
    logger, level = logging.getLogger("accept"), logging.getLogger("accept").level
    try:
        verbose.begin(1, "run")
        logging.getLogger("accept.files").info("read %s", "x\ny")
        logged = (home() / "log" / verbose.NAME).read_text()
        assert "read x\\ny" in logged
        assert "read x" not in capsys.readouterr().err
    finally:
        for handler in list(logger.handlers):
            logger.removeHandler(handler)
            handler.close()
        logger.setLevel(level)


@pytest.mark.parametrize(("level", "seen"), [(logging.DEBUG, True), (logging.INFO, False)])
def test_bytes_on_a_line_are_logged_only_if_asked_for(level, seen, caplog, tmp_path):
    wire, readout = opened(BENCHES["ND 287"], tmp_path, 1)
    try:
        with caplog.at_level(level, logger="accept"):
            readout.connect()
    finally:
        readout.close()
        wire.close()
    assert any("A0000" in r.getMessage() for r in caplog.records if r.name == "accept.line") is seen
