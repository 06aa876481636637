"""Every test has a bench's folder of its own: none touches the keys and events of whoever runs the tests. What a test
needs beside the program is said by a mark, and the test is skipped where that is not there."""

import gc
import shutil
import zlib
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from numpy.typing import ArrayLike
from scipy.io.matlab import _mio5
from sqlalchemy import URL, Engine, create_engine

from accept.certificate.trust import encrypted_key
from accept.certificate.verify import structure
from accept.simulate import unit
from accept.store import engine as store_engine
from tests.shared.demo_run import demo_run
from tests.shared.gap_run import gap_run
from tests.shared.recorded_units import recorded_units
from tests.soak import is_heavy, runs, unknown

__all__ = ["demo_run", "gap_run", "recorded_units"]

DATA = Path(__file__).parent.parent / "../shared/data"
CHROMIUM = next((p for name in ("chromium", "chromium-browser", "google-chrome") if (p := shutil.which(name))), None)
NEEDS = {
    "needs_data": (DATA.is_dir(), "the recorded units (../shared/data) are not beside the repository"),
    "browser": (CHROMIUM is not None, "no Chromium (Debian: apt install chromium)"),
    "terminal": (shutil.which("tmux") is not None, "no tmux (Debian: apt install tmux)"),
}


gc.disable()  # a fifth of the time that collecting takes, and what is collected stays anyway


def pytest_collection_finish() -> None:
    """What is loaded by now stays to the end: the garbage collector need not walk over it again and again."""
    gc.collect()
    gc.freeze()
    gc.enable()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the heavy proofs, and what reads the recorded data if they are there; put first what waits for programs: it
    is never what is left at the end, when other processes have no more."""
    for item in items:
        takes = "recorded_units" in getattr(item, "fixturenames", ()) or item.get_closest_marker("takes_data")
        if takes and DATA.is_dir():
            item.add_marker("needs_data")
        if is_heavy(item.nodeid):
            item.add_marker("soak")
    if not any("::" in argument for argument in config.args):
        gone = unknown([item.nodeid for item in items])
        if gone:
            raise pytest.UsageError(f"tests/soak.py names tests that are not there: {', '.join(gone)}")
    waiting = {item.path for item in items if item.get_closest_marker("terminal") or item.get_closest_marker("browser")}
    items.sort(key=lambda item: item.path not in waiting)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what cannot run here, in the words of what is missing."""
    if item.get_closest_marker("soak") and not runs(item.nodeid):
        pytest.skip("a heavy proof: make soak")
    for mark, (there, reason) in NEEDS.items():
        if not there and item.get_closest_marker(mark):
            pytest.skip(reason)


@pytest.fixture(scope="session", autouse=True)
def rounds() -> Iterator[int]:
    """Keys that tests make open at once: a passphrase that stands in a test is worth no 600 000 rounds. Gives the
    number of the product; what runs in a process of its own takes that."""
    with pytest.MonkeyPatch.context() as patch:
        product = encrypted_key.ITERATIONS
        patch.setattr(encrypted_key, "ITERATIONS", 1000)
        yield product


@pytest.fixture(scope="session", autouse=True)
def packing() -> Iterator[None]:
    """Files of simulated units that tests make are packed quickly, which was most of the time of making them: the same
    samples in a tenth more bytes. What runs in a process of its own packs as the product does."""
    quick, pack = SimpleNamespace(compress=partial(zlib.compress, level=1)), unit.mat_bytes

    def mat_bytes(columns: Mapping[str, ArrayLike], compact: bool = False) -> bytes:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(_mio5, "zlib", quick)
            return pack(columns, compact)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(unit, "mat_bytes", mat_bytes)
        yield


@pytest.fixture(scope="session", autouse=True)
def reading() -> Iterator[None]:
    """Tests read certificates in their own process: a copy of one that has grown takes longer to make than to read.
    `test_verify.py` and what runs in a process of its own read as the product does, under limits."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(structure, "bounded", lambda work, *given, **_limits: work(*given))
        yield


@pytest.fixture(scope="session", autouse=True)
def questions() -> Iterator[None]:
    """What one store's connection has made of a question to the database, all stores of a test process use: thousands
    are opened, and to make it again for each was a tenth of the time of tests that open some."""
    first = create_engine("sqlite://")
    first.connect().close()  # it knows what SQLite can do from its first connection

    def made(url: URL, **options: Any) -> Engine:
        engine = create_engine(url, **options)
        if url.get_backend_name() == "sqlite":
            engine.dialect = engine.pool._dialect = first.dialect
            engine._compiled_cache = first._compiled_cache
        return engine

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store_engine, "create_engine", made)
        yield
    first.dispose()


@pytest.fixture(scope="session")
def homes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where no folder is yet. (`mktemp` reads all names each time, and there are thousands.)"""
    place = tmp_path_factory.mktemp("homes")
    return (place / str(n) for n in count())


@pytest.fixture(autouse=True)
def bench_home(homes: Iterator[Path], monkeypatch: pytest.MonkeyPatch) -> Path:
    home = next(homes)
    home.mkdir()
    monkeypatch.setenv("ACCEPT_HOME", str(home))
    monkeypatch.setenv("ACCEPT_PASSPHRASE", "correct horse")
    monkeypatch.setenv("ACCEPT_OPERATOR", "Test Technician")
    for name in ("ACCEPT_STORE_URL", "ACCEPT_PASSPHRASE_FILE", "ACCEPT_QA_PASSPHRASE"):
        monkeypatch.delenv(name, raising=False)
    return home


# Seeded like every other test; no deadline: how long an example takes, or drawing it on a busy machine, says nothing
# about whether it is right.
settings.register_profile("accept", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("accept")
