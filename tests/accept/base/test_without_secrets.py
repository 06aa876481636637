"""No message, log or table shows the secret of an address, in whatever form it stands there."""

import logging
from pathlib import Path
from types import ModuleType

import pytest
from typer.testing import CliRunner

from accept.base import fault_log, verbose
from accept.base.exit_codes import Exit
from accept.base.plain_text import without_secrets
from accept.cli.main import app

PW = "s3cr3tpw"
ADDRESSES = [
    f"postgresql://bob:{PW}@db:5432/accept",
    f"postgresql://bob:x@{PW}@db:5432/accept",
    f"postgresql://bob:x/{PW}@db:5432/accept",
    f"postgresql://bob:x?{PW}@db:5432/accept",
    f"postgresql://bob:x#{PW}@db:5432/accept",
    f"postgresql://db/accept?user=bob&password={PW}",
    f"postgresql://db/accept?sslmode=require&sslpassword={PW}",
    f"https://{PW}@host/units",
    f"https://host/units?sig={PW}",
    f"https://host/units?x=1&token={PW}",
    f"https://host/units#access_token={PW}",
    f"https://bucket.s3.amazonaws.com/u.zip?X-Amz-Credential=AK&X-Amz-Signature={PW}",
    f"https://acc.blob.core.windows.net/c/u.zip?sv=2024&se=2026&sr=b&sp=r&sig={PW}%3D",
    f"https://storage.googleapis.com/b/u.zip?X-Goog-Algorithm=GOOG4&X-Goog-Signature={PW}",
    f"s3://key:{PW}@bucket/units",
    f"zip://*::https://bob:{PW}@host/u.zip?sig={PW}",
    f"zip://a/b::s3://key:{PW}@bucket/u.zip",
    f"sqlserver://host:1433;user=sa;password={PW}",
    f"host=db user=bob password={PW} dbname=accept",
    f"connect: sslpassword={PW}",
]


@pytest.mark.parametrize("address", ADDRESSES)
def test_no_form_shows_it(address: str) -> None:
    shown = without_secrets(f"cannot be reached: {address} (refused)")
    assert PW not in shown
    assert shown.startswith("cannot be reached: ")
    assert shown.endswith(" (refused)")


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("https://host:8080/a/b.zip", "https://host:8080/a/b.zip"),
        ("zip://x::https://ada:pw@host/u.zip: gone", "zip://x::https://host/u.zip: gone"),
        ("s3://bucket/units/A-1, s3://k:s@bucket/B", "s3://bucket/units/A-1, s3://bucket/B"),
        ("the key of ada@example.org: 3 = 4; sigma=2", "the key of ada@example.org: 3 = 4; sigma=2"),
    ],
)
def test_what_is_no_secret_stays(given: str, expected: str) -> None:
    assert without_secrets(given) == expected


@pytest.mark.parametrize(
    ("url", "words"),
    [
        (f"postgresql://bob:{PW}@:x/db", "is no address of a database"),
        (f"postgresql://bob:x@{PW}@127.0.0.1:1/db", "'@' and ':' in a password as %40 and %3A"),
        (PW, "is no address of a database"),
        (f"mysql://h/db?password={PW}", "mysql://h/db: its database driver is not installed"),
    ],
)
def test_an_address_of_the_store_that_is_wrong_is_one_line(
    url: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACCEPT_STORE_URL", url)
    done = CliRunner().invoke(app, ["store", "log"])
    assert done.exit_code == Exit.BAD_INPUT
    assert words in done.stderr
    assert PW not in done.output
    assert "Traceback" not in done.output


def test_a_place_that_does_not_answer_is_said_without_its_signature(tmp_path: Path) -> None:
    pytest.importorskip("fsspec")
    done = CliRunner().invoke(app, ["batch", f"https://127.0.0.1:1/u?sig={PW}", "--out", str(tmp_path / "o")])
    assert done.exit_code == Exit.BAD_INPUT
    assert "https://127.0.0.1:1/u: cannot be listed" in done.stderr
    assert PW not in done.output


@pytest.mark.parametrize("log", [verbose, fault_log])
def test_no_log_shows_it(log: ModuleType) -> None:
    record = logging.makeLogRecord({"msg": "GET %s", "args": (ADDRESSES[8],)})
    assert log._Plain("%(message)s").format(record) == "GET https://host/units"
