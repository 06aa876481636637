"""Every fault at every driver: right, refused, or wrong. `python -m tests.hw.apart.table` prints the manual's table.

A reading is right if it lies within the instrument's stated uncertainty of what the peer measured at that time, refused
if the driver gives an InstrumentError, and wrong otherwise. What no protocol tells stands apart: the daily reference
shows it (`tests/accept/commands/test_reference_apart.py`)."""

import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hw.errors import InstrumentError
from hw.instruments import open_instrument
from specs.bench import InstrumentEntry
from tests.hw.apart.gauge import M1240, Optorsd, Optorss
from tests.hw.apart.interferometer import Ids3010
from tests.hw.apart.lcr import Lcr800
from tests.hw.apart.readout import Readout
from tests.hw.apart.scpi import E4980A
from tests.hw.apart.wires import ON_SOCKETS, Peer, Pty, Tcp, Wire, WireFault, wire_faults

TIMEOUT, QUIET, DEADLINE = 0.4, 0.03, 3.0
LINE = {"baud": 9600, "data_bits": 7, "parity": "even", "stop_bits": 2, "handshake": "none"}
GAUGE = {"unit": "um", "range_mm": [-1.0, 1.0]}
READINGS = 4


@dataclass(frozen=True)
class Bench:
    """How an instrument stands in a bench file. within: its stated uncertainty, SI; relative or absolute."""

    peer: Callable[[], Peer]
    driver: str
    settings: Mapping[str, Any]
    truths: tuple[float, float]
    within: float = 0.0
    relative: float = 0.0
    model: str | None = None
    serial: str | None = None
    resource: str = ""  # a socket: the resource with its port


BENCHES: Mapping[str, Bench] = {
    "OPTORSD": Bench(
        Optorsd, "millimar", GAUGE | {"protocol": "OPTORSD", "formula": "+1"}, (-4e-4, 4e-4), 0.5e-6,
        model="C1216", serial="1234/56",
    ),
    "OPTORSS": Bench(Optorss, "millimar", GAUGE | {"protocol": "OPTORSS"}, (-4e-4, 4e-4), 0.5e-6, model="C1216"),
    "M1240": Bench(M1240, "millimar", GAUGE | {"protocol": "M1240"}, (-4e-4, 4e-4), 0.5e-6, model="C1216"),
    "LCR-800": Bench(Lcr800, "lcr800", {}, (5e-6, 20e-6), relative=0.002, model="LCR-819"),
    "ND 287": Bench(
        Readout, "nd287", {"axis": "single", "range_mm": [-13.0, 13.0], "identification": "ND-287"},
        (-5e-3, 5e-3), 0.5e-6,
    ),
    "E4980A": Bench(
        E4980A, "scpi_lcr", {"profile": "keysight", "average": 1}, (5e-6, 20e-6), relative=0.002,
        model="E4980A", serial="MY46200000", resource="TCPIP::127.0.0.1::{port}::SOCKET",
    ),
    "IDS3010": Bench(
        Ids3010, "ids3010", {"axis": 0, "pass_mode": 0, "range_mm": [-1.0, 1.0]}, (-5e-4, 5e-4), 0.5e-6,
        model="IDS3010", serial="L0140001", resource="127.0.0.1:{port}",
    ),
}  # fmt: skip


def opened(bench: Bench, folder: Path, seed: int) -> tuple[Wire, Any]:
    """Return a peer at its wire and the driver of a bench file's entry at the other end."""
    peer = bench.peer()
    wire: Wire = Tcp(peer, seed) if bench.resource else Pty(peer, folder / f"line-{seed}", seed)
    times = {"timeout_s": TIMEOUT, "quiet_s": QUIET, "deadline_s": DEADLINE}
    entry: dict[str, Any] = {"driver": bench.driver, "measures": [], "model": bench.model, "serial": bench.serial}
    entry["settings"] = dict(bench.settings) | times
    if isinstance(wire, Tcp):
        entry["resource"] = bench.resource.format(port=wire.port)
    else:
        entry["link"] = LINE | {"port": wire.address}
    return wire, open_instrument("it", InstrumentEntry.model_validate(entry), lambda _: "")


@dataclass
class Outcome:
    """What a case gave: how many readings were right and refused; the wrong ones in words."""

    right: int = 0
    refused: int = 0
    wrong: list[str] = field(default_factory=list)
    slowest: float = 0.0
    crashes: list[str] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)

    def add(self, other: "Outcome") -> None:
        """Count another case in."""
        self.right += other.right
        self.refused += other.refused
        self.wrong += other.wrong
        self.crashes += other.crashes
        self.refusals += other.refusals
        self.slowest = max(self.slowest, other.slowest)


Apply = Callable[[Wire], None]


@dataclass(frozen=True)
class Case:
    """A fault at one moment. before: what happens before `connect`; between: after the first reading; undone: what
    happens before the last."""

    name: str
    kind: str  # wire, panel, untold
    before: Apply | None = None
    between: Apply | None = None
    undone: Apply | None = None


def cases(bench: Bench) -> Iterator[Case]:
    """Yield every fault at every moment."""
    for fault in wire_faults(TIMEOUT):
        if bench.resource and fault.name not in ON_SOCKETS:
            continue

        def put(wire: Wire, fault: WireFault = fault) -> None:
            wire.fault = fault

        if fault.stays:
            yield Case(f"{fault.name}, from the start", "wire", before=put)
            yield Case(f"{fault.name}, for two readings", "wire", between=put, undone=lambda w: w.clear())
        for after in (0, 1, 2, 3, 5, 8, 13, 21):

            def strike(wire: Wire, fault: WireFault = fault, after: int = after) -> None:
                wire.strike(fault, after)

            if after % 2:
                yield Case(f"{fault.name}, at message {after}", "wire", before=strike)
            else:
                yield Case(f"{fault.name}, {after} messages after a reading", "wire", between=strike)
    yield Case("plugged in again", "wire", between=lambda w: w.replug())
    sample = bench.peer()
    for kind, names in (("panel", sample.panel()), ("untold", sample.untold())):
        for name in names:

            def press(wire: Wire, name: str = name, kind: str = kind) -> None:
                keys = wire.peer.panel() if kind == "panel" else wire.peer.untold()
                keys[name]()

            def undo(wire: Wire, bench: Bench = bench) -> None:
                fresh = bench.peer()
                fresh.truth = wire.peer.truth
                wire.peer.__dict__.update(fresh.__dict__)

            yield Case(f"{name}, from the start", kind, before=press)
            yield Case(f"{name}, between readings", kind, between=press)
            yield Case(f"{name}, put back", kind, between=press, undone=undo)


def run_case(bench: Bench, case: Case, folder: Path, seed: int) -> Outcome:
    """Return what a case gave: four readings of four values."""
    dice, outcome = random.Random(seed), Outcome()
    wire, instrument = opened(bench, folder, seed)
    try:
        for number in range(READINGS):
            wire.peer.truth = dice.uniform(*bench.truths)
            if number == 0 and case.before:
                case.before(wire)
            if number == 1 and case.between:
                case.between(wire)
            if number == READINGS - 1 and case.undone:
                case.undone(wire)
            begun = time.monotonic()
            try:
                if number == 0:
                    instrument.connect()
                value = instrument.read().value
            except InstrumentError as e:
                outcome.refused += 1
                outcome.refusals.append(f"{case.name} [{number}]: {e}")
            except Exception as e:  # noqa: BLE001 - a traceback is what is counted
                outcome.crashes.append(f"{case.name} [{number}]: {type(e).__name__}: {e}")
            else:
                truth = wire.peer.truth
                if abs(value - truth) <= bench.within + bench.relative * abs(truth):
                    outcome.right += 1
                else:
                    outcome.wrong.append(f"{case.name} [{number}]: {value:.6g} for {truth:.6g}")
            outcome.slowest = max(outcome.slowest, time.monotonic() - begun)
    finally:
        instrument.close()
        wire.close()
    return outcome


def run(name: str, chosen: Sequence[Case] | None = None, workers: int = 8) -> Mapping[str, Outcome]:
    """Return what the cases of an instrument gave, by kind of fault."""
    bench = BENCHES[name]
    todo = list(cases(bench)) if chosen is None else chosen
    totals = {kind: Outcome() for kind in ("wire", "panel", "untold")}
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(workers) as pool:
        outcomes = pool.map(lambda x: (x[1].kind, run_case(bench, x[1], Path(folder), x[0])), enumerate(todo))
        for kind, outcome in outcomes:
            totals[kind].add(outcome)
    return totals


def main() -> None:
    """Print the table, and to stderr what was wrong."""
    print(
        "| | cases | right | refused | wrong | wrong: told by no protocol | slowest s |\n|---|---|---|---|---|---|---|"
    )
    for name in sys.argv[1:] or BENCHES:
        kinds = Counter(c.kind for c in cases(BENCHES[name]))
        totals = run(name)
        right, refused = (sum(getattr(t, key) for t in totals.values()) for key in ("right", "refused"))
        wrong = totals["wire"].wrong + totals["panel"].wrong
        slowest = max(t.slowest for t in totals.values())
        cells = (name, kinds.total(), right, refused, len(wrong), len(totals["untold"].wrong), f"{slowest:.1f}")
        print(f"| {' | '.join(map(str, cells))} |", flush=True)
        for total in totals.values():
            for line in total.crashes:
                print("CRASH", name, line, file=sys.stderr)
        for line in wrong:
            print("WRONG", name, line, file=sys.stderr)


if __name__ == "__main__":
    main()
