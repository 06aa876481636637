"""The simulated bench: gauge, LCR meter and probe readout on pseudo-terminals, and the bench file that names them."""

from contextlib import ExitStack
from pathlib import Path
from types import TracebackType

from hw.simulated.heidenhain import HeidenhainDevice
from hw.simulated.lcr800 import Lcr800Device
from hw.simulated.millimar import OptorsDevice
from hw.simulated.server import Server
from hw.simulated.world import BenchSetup, Sources, Stage, StageFile

BENCH_FILE, STAGE_FILE = "bench.toml", "stage.json"
BENCH = """# Written by `accept simulate bench`: simulated instruments on pseudo-terminals, valid while it runs.
# The certificates and dates are invented, as the instruments are.
name = "simulated bench"
stage = "{stage}"

[instruments.gauge]
driver = "millimar"
measures = ["stroke"]
model = "C1216"
serial = "SIM-GAUGE"
link = {{ port = "{folder}/gauge", baud = 4800, data_bits = 7, parity = "even", stop_bits = 2, handshake = "none" }}
settings = {{ protocol = "OPTORSD", unit = "um", formula = "+1", range_mm = [-1.0, 1.0], timeout_s = {timeout} }}
calibration = {{ certificate = "SIM-1", due = {due} }}

[instruments.lcr]
driver = "lcr800"
measures = ["capacitance"]
model = "LCR-819"
serial = "SIM-LCR"
link = {{ port = "{folder}/lcr", baud = 38400, data_bits = 8, parity = "none", stop_bits = 1, handshake = "none" }}
settings = {{ timeout_s = {timeout} }}
accuracy = {{ U_percent = 0.2, source = "LCR-819 at 1 kHz, slow (k = 2)" }}
calibration = {{ certificate = "SIM-2", due = {due} }}

[instruments.probe]
driver = "nd287"
measures = ["flatness"]
model = "ND 287"
serial = "SIM-PROBE"
calibration = {{ certificate = "SIM-3", due = {due} }}
link = {{ port = "{folder}/probe", baud = 9600, data_bits = 7, parity = "even", stop_bits = 2, handshake = "none" }}
[instruments.probe.settings]
range_mm = [-1.0, 1.0]
agreement_um = 1.0
axis = "single"
identification = "ND-287"
timeout_s = {timeout}

[instruments.scale]
driver = "offline"
measures = ["stiffness"]
serial = "SIM-SCALE"
calibration = {{ certificate = "SIM-4", due = {due} }}
"""


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
        text = BENCH.format(folder=self.folder, stage=self.stage.path, timeout=self._timeout_s, due="2099-12-31")
        self.bench_file.write_text(text, encoding="utf-8")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._running.close()
