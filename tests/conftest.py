"""Every test has a bench's folder of its own: none touches the keys and events of whoever runs the tests."""

from pathlib import Path

import pytest
from hypothesis import settings

from tests.demo_run import demo_run

__all__ = ["demo_run"]


@pytest.fixture(autouse=True)
def bench_home(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    home = tmp_path_factory.mktemp("home")
    monkeypatch.setenv("ACCEPT_HOME", str(home))
    monkeypatch.setenv("ACCEPT_PASSPHRASE", "correct horse")
    monkeypatch.setenv("ACCEPT_OPERATOR", "Test Technician")
    for name in ("ACCEPT_STORE_URL", "ACCEPT_PASSPHRASE_FILE", "ACCEPT_QA_PASSPHRASE"):
        monkeypatch.delenv(name, raising=False)
    return home


# Seeded like every other test; no deadline: how long an example takes says nothing about whether it is right.
settings.register_profile("accept", derandomize=True, deadline=None)
settings.load_profile("accept")
