"""The simulated bench: gauge, LCR meter and probe readout on pseudo-terminals, and the bench file that names them."""

from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from hw.errors import SettingsError
from hw.simulated.heidenhain import HeidenhainDevice
from hw.simulated.lcr800 import Lcr800Device
from hw.simulated.millimar import OptorsDevice
from hw.simulated.server import FaultKind, LineFault, Server
from hw.simulated.world import BenchSetup, Sources, Stage, StageFile

BENCH_FILE, STAGE_FILE = "bench.toml", "stage.json"
BENCH = Path(__file__).parent / "bench.toml.txt"  # with words in braces; {{ is a brace
INSTRUMENTS = ("gauge", "lcr", "probe")
AT = 4  # bytes of a reply before it is cut


@dataclass(frozen=True)
class BenchFault:
    """A fault of an instrument of the bench, or the instrument that it is exchanged with."""

    instrument: str
    fault: LineFault
    other: str = ""

    @classmethod
    def of(cls, words: str) -> "BenchFault":
        """Parse `gauge:menu_open`, `lcr:half_line:3` (after three replies), `gauge:swapped:probe`. Raises
        SettingsError."""
        name, _, rest = words.partition(":")
        kind, _, more = rest.partition(":")
        kinds = [k.value for k in FaultKind]
        if name not in INSTRUMENTS or kind not in kinds:
            raise SettingsError(
                f"{words}: expected INSTRUMENT:FAULT with one of {', '.join(INSTRUMENTS)} and of {', '.join(kinds)}"
            )
        if kind == FaultKind.SWAPPED:
            if more not in INSTRUMENTS or more == name:
                raise SettingsError(f"{words}: expected what it is exchanged with, as in gauge:swapped:lcr")
            return cls(name, LineFault(FaultKind.SWAPPED), more)
        if more and not more.isdecimal():
            raise SettingsError(f"{words}: '{more}' is not a number of replies before the fault")
        return cls(name, LineFault(FaultKind(kind), after=int(more or 0), at=AT))


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
        return dict(zip(INSTRUMENTS, (self.gauge, self.lcr, self.probe), strict=True))

    def strike(self, faults: Iterable[BenchFault]) -> None:
        for each in faults:
            if each.other:
                self.servers[each.instrument].swap_with(self.servers[each.other])
            else:
                self.servers[each.instrument].inject(each.fault)

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
