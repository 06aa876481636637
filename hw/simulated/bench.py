"""The simulated bench: gauge, LCR meter and probe readout on pseudo-terminals, and the bench file that names them."""

from contextlib import ExitStack
from pathlib import Path

from hw.simulated.heidenhain import HeidenhainDevice
from hw.simulated.lcr800 import Lcr800Device
from hw.simulated.millimar import OptorsDevice
from hw.simulated.server import Server
from hw.simulated.world import BenchSetup, Sources, Stage, StageFile

BENCH_FILE, STAGE_FILE = "bench.toml", "stage.json"
BENCH = Path(__file__).parent / "bench.toml.txt"  # with words in braces; {{ is a brace


class SimulatedBench:
    """Three simulated instruments in a folder; a context manager. timeout_s: for the drivers, in the bench file."""

    def __init__(
        self, world: BenchSetup, folder: Path, *, seed: int = 0, byte_s: float = 0.0, timeout_s: float = 1.0
    ) -> None:
        self.folder, self.stage = folder.resolve(), StageFile(folder.resolve() / STAGE_FILE)
        self._timeout_s = timeout_s
        sources = Sources(world, self.stage, seed)
        self.gauge = self._server("gauge", OptorsDevice(sources.displacement, serial="SIM-GAUGE", unit="um"), byte_s)
        meter = Lcr800Device(sources.capacitance, dissipation=world.dissipation)
        self.lcr = self._server("lcr", meter, byte_s)
        self.probe = self._server("probe", HeidenhainDevice(sources.height), byte_s)
        self._running = ExitStack()

    def _server(self, name: str, device: OptorsDevice | Lcr800Device | HeidenhainDevice, byte_s: float) -> Server:
        return Server(device, self.folder / name, byte_s)

    @property
    def servers(self) -> dict[str, Server]:
        return {"gauge": self.gauge, "lcr": self.lcr, "probe": self.probe}

    @property
    def bench_file(self) -> Path:
        return self.folder / BENCH_FILE

    def __enter__(self) -> "SimulatedBench":
        self.folder.mkdir(parents=True, exist_ok=True)
        for server in self.servers.values():
            self._running.enter_context(server)
        self.stage.write(Stage(probe=1, leads="sensor", stacks="one_stack"))  # so that each has something to measure
        text = BENCH.read_text(encoding="utf-8").format(
            folder=self.folder, stage=self.stage.path, timeout=self._timeout_s, due="2099-12-31"
        )
        self.bench_file.write_text(text, encoding="utf-8")
        return self

    def __exit__(self, *_: object) -> None:
        self._running.close()
