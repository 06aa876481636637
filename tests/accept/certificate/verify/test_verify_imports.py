"""The modules that a plain verification does not load: they take longer than the verification itself."""

import subprocess
import sys
from pathlib import Path

import pytest

from accept.certificate.trust import keys
from tests.accept.units.units import make_unit
from tests.shared.command_line import accept

UNUSED = ("aiohttp", "requests", "textual", "matplotlib", "checks.gap.search")
VERIFY = """
import sys
from accept.cli.main import main
sys.argv[1:] = ["verify", {pdf!r}, "--trust", {ca!r}]
try:
    main()
except SystemExit as ended:
    print("exit", ended.code, *sorted(name for name in {unused!r} if name in sys.modules))
"""


def test_a_plain_verification_loads_no_client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bench, pdf = tmp_path / "bench", tmp_path / "a.pdf"
    monkeypatch.setenv("ACCEPT_HOME", str(bench))
    monkeypatch.setenv("ACCEPT_PASSPHRASE", "correct horse")
    keys.init(bench, "correct horse", "Ann")
    unit = make_unit(tmp_path / "u", "A-1")
    assert accept("report", unit, "--spec", "apa-basic", "--out", pdf, "--operator", "Ann").exit_code == 0
    program = VERIFY.format(pdf=str(pdf), ca=str(keys.folder(bench) / "ca.pem"), unused=UNUSED)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-1:] == ["exit 0"], done.stdout + done.stderr


def test_a_client_that_is_asked_for_is_the_real_one() -> None:
    program = """
import accept.certificate
from pyhanko.sign.timestamps import HTTPTimeStamper
from pyhanko_certvalidator.fetchers import _default_fetcher_backend
import sys
assert "aiohttp" not in sys.modules
stamper = HTTPTimeStamper("http://localhost")
assert type(stamper).__module__ == "pyhanko.sign.timestamps.aiohttp_client"
assert type(_default_fetcher_backend()).__name__ == "AIOHttpFetcherBackend"
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
