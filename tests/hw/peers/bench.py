"""A bench of peers on pseudo-terminals: `python -m tests.hw.peers.bench UNIT OUT` answers as the documents print until
it is ended, to a program that reads the bench file of the documentation.

What lies in the fixture, and so what is true, comes from the unit's folder and the stage; the protocols are the peers'.
"""

import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from accept.simulate.bench_truth import world_of
from hw.simulated.server import Server
from hw.simulated.world import Sources, Stage, StageFile
from tests.hw.peers.heidenhain import HeidenhainPeer
from tests.hw.peers.lcr800 import Lcr800Peer
from tests.hw.peers.line import Peer
from tests.hw.peers.millimar import MillimarPeer

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "instruments.md"
PORTS = {
    "gauge": "/dev/serial/by-id/usb-FTDI-1",
    "lcr": "/dev/serial/by-id/usb-FTDI-2",
    "probe": "/dev/serial/by-id/usb-FTDI-3",
}


class OnTerminal:
    """A peer as what stands behind a `Server`, measuring what a source says now."""

    def __init__(self, peer: Peer, source: Callable[[], float | None]) -> None:
        self.peer, self.source = peer, source

    def feed(self, data: bytes) -> list[bytes]:
        self._look()
        replies = []
        for delay, reply in self.peer.hear(data):
            time.sleep(delay)
            replies.append(reply)
        return replies

    def unsolicited(self) -> list[bytes]:
        return self.peer.alone(time.monotonic())

    def unplugged(self) -> None:
        self.peer.switch_on()

    def _look(self) -> None:
        truth = self.source()
        if hasattr(self.peer, "no_probe"):
            self.peer.no_probe = truth is None
        self.peer.truth = truth or 0.0


def bench_file(folder: Path, stage: Path) -> str:
    """The documentation's, with the ports of this folder and the stage that a technician's program sets."""
    text = PAGE.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    for name, port in PORTS.items():
        assert port in text, f"{PAGE.name}: no port {port}"
        text = text.replace(port, str(folder / name))
    return f'stage = "{stage}"\n{text}'


def serve(unit: Path, folder: Path, until: threading.Event) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    folder = folder.resolve()
    stage = StageFile(folder / "stage.json")
    stage.write(Stage(probe=1, leads="sensor", stacks="one_stack"))
    sources = Sources(world_of(unit), stage)
    peers = {
        "gauge": OnTerminal(MillimarPeer("OPTORSD"), sources.displacement),
        "lcr": OnTerminal(Lcr800Peer(), sources.capacitance),
        "probe": OnTerminal(HeidenhainPeer(), sources.height),
    }
    servers = [Server(peer, folder / name) for name, peer in peers.items()]  # type: ignore[arg-type]
    for server in servers:
        server.__enter__()
    (folder / "bench.toml").write_text(bench_file(folder, stage.path), encoding="utf-8")
    until.wait()
    for server in servers:
        server.__exit__(None, None, None)


if __name__ == "__main__":
    ended = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: ended.set())
    serve(Path(sys.argv[1]), Path(sys.argv[2]), ended)
