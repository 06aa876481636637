"""Simulated instruments on pseudo-terminals, byte for byte as their protocols, with faults on demand.

    with SimulatedBench(setup, folder) as bench:  # setup: a `BenchSetup`, the truth
        bench.gauge.inject(LineFault(FaultKind.HALF_LINE, after=3))  # the fourth reply is cut

The stage is what a technician has set up: where the probe stands, which leads are connected, at which voltage."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from hw.simulated.bench import BenchFault, SimulatedBench
    from hw.simulated.heidenhain import HeidenhainDevice
    from hw.simulated.lcr800 import Lcr800Device
    from hw.simulated.millimar import M1240Device, OptorsDevice
    from hw.simulated.server import FaultKind, LineFault, Server
    from hw.simulated.world import BenchSetup, Stage, StageFile
else:
    __getattr__ = door(__name__)
