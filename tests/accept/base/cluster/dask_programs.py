"""A Dask scheduler and workers as programs of their own, on this machine."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from distributed import Client

from tests.accept.batch.killing import TIMEOUT_S
from tests.accept.store.postgres_server import free_port

ROOT = Path(__file__).parents[4]


class Programs:
    """Started here, ended here, by their process ids."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder, free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.running: list[subprocess.Popen[bytes]] = []

    def scheduler(self) -> subprocess.Popen[bytes]:
        return self._start("scheduler", "scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard")

    def worker(
        self, name: str, preload: str = "", code: Path = ROOT, env: Mapping[str, str] | None = None
    ) -> subprocess.Popen[bytes]:
        """One process without a nanny: what kills it kills it. preload: Python that runs in it first."""
        more = []
        if preload:
            script = self.folder / f"{name}_preload.py"
            script.write_text(preload)
            more = ["--preload", str(script)]
        options = ["--name", name, "--nthreads", "1", "--no-nanny", "--no-dashboard", *more]
        kept = {k: v for k, v in os.environ.items() if not k.startswith("ACCEPT_")} | {"PYTHONPATH": str(code)}
        return self._start(name, "worker", self.address, *options, env=kept | dict(env or {}))

    def _start(self, name: str, *words: str, env: Mapping[str, str] | None = None) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *words]
        place = self.folder / name
        place.mkdir(exist_ok=True)
        log = open(self.folder / f"{name}.log", "ab")  # noqa: SIM115
        with log:
            started = subprocess.Popen(command, stdout=log, stderr=log, env=env, cwd=place)
        self.running.append(started)
        return started

    def here(self, workers: int) -> None:
        """Wait until so many workers are there."""
        deadline = time.monotonic() + TIMEOUT_S
        while True:
            try:
                with Client(self.address, timeout=5, set_as_default=False) as client:
                    client.wait_for_workers(workers, timeout=TIMEOUT_S)
                return
            except (OSError, TimeoutError):
                assert time.monotonic() < deadline, self.logs()

    def logs(self) -> str:
        return "\n".join(f"{p.name}:\n{p.read_text()[-2000:]}" for p in self.folder.glob("*.log"))

    def end(self) -> None:
        for program in self.running:
            if program.poll() is None:
                program.send_signal(signal.SIGKILL)
            program.wait()
