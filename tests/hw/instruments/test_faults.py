"""Random faults on real pseudo-terminals: a right value or a clear error within the deadline, and then right again.

1,000 sequences per driver with ACCEPT_SOAK=1, 25 otherwise.
"""

import random
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial

import pytest

from hw.errors import InstrumentError
from hw.instruments import Heidenhain, Lcr800, MillimarM1240, MillimarOptors
from hw.instruments.heidenhain import Nd287Settings
from hw.instruments.lcr800 import Lcr800Settings
from hw.instruments.millimar_protocols import M1240Settings, OptorsSettings
from hw.link import Link
from hw.serial_port import LineSettings
from hw.simulated import FaultKind, HeidenhainDevice, Lcr800Device, LineFault, M1240Device, OptorsDevice, Server
from tests.soak import SOAK

SEQUENCES = 1000 if SOAK else 25
# Short, so that 50 sequences take seconds; the driver under test has no other clock. A reply takes under 1 ms here.
TIMES = {"timeout_s": 0.12, "quiet_s": 0.06, "deadline_s": 0.6}
# One look at the port (20 ms) beyond the deadline, reopening it, and a machine busy with other tests.
SLACK_S = 0.4
BENCHES = 10  # side by side: nearly all of the time is waiting
KINDS = [kind for kind in FaultKind if kind is not FaultKind.SWAPPED]


class Bench:
    """A driver, its simulated instrument, and another instrument to swap it with. tolerance: of a right value [SI]."""

    def __init__(self, kind, folder):
        self.truth = 0.0
        # Two readings may differ by 0.5 um and the mean is taken; half a digit of the display comes on top.
        self.tolerance, device, other = 0.31e-6, None, HeidenhainDevice(lambda: 1e-3)
        self.deadline_s = TIMES["deadline_s"]
        line = LineSettings(str(folder / "port"), 9600, 7, "even", 2, "none")
        link = Link(line)
        if kind in ("OPTORSD", "OPTORSS"):
            device = OptorsDevice(self.source, serial="1234/56", unit="um", duplex=kind == "OPTORSD")
            settings = OptorsSettings(protocol=kind, unit="um", formula="+1", range_mm=[-1.0, 1.0], **TIMES)
            self.driver = MillimarOptors("gauge", link, settings, "C1216", "1234/56")
        elif kind == "M1240":
            device = M1240Device(self.source, unit="um")
            settings = M1240Settings(protocol="M1240", unit="um", range_mm=[-1.0, 1.0], **TIMES)
            self.driver = MillimarM1240("gauge", link, settings, "C1216")
        elif kind == "LCR":
            device, other = Lcr800Device(self.source), OptorsDevice(lambda: 1e-3)
            self.tolerance = 6.1e-9  # in the same way half of 0.1 %, of at most 12 uF
            self.deadline_s = 2.5  # its settings are asked before and after each value: some forty exchanges
            settings = Lcr800Settings(result_s=0.12, **TIMES | {"deadline_s": self.deadline_s})
            self.driver = Lcr800("lcr", link, settings, "LCR-819")
        else:
            device, other = HeidenhainDevice(self.source), OptorsDevice(lambda: 1e-3)
            settings = Nd287Settings(range_mm=[-1.0, 1.0], axis="single", identification="ND-287", **TIMES)
            self.driver = Heidenhain("probe", link, settings)
        self.capacitance = kind == "LCR"
        self.server, self.other = Server(device, folder / "port"), Server(other, folder / "other")

    def source(self):
        return self.truth

    def change(self, rng):
        """Another value for every sequence, far from the one before: a stale reading would be seen."""
        self.truth = rng.uniform(2e-6, 12e-6) if self.capacitance else rng.uniform(-900e-6, 900e-6)

    def right(self, value):
        return abs(value - self.truth) <= self.tolerance


def random_fault(rng):
    seconds = rng.choice((0.01, 0.05, 0.2))
    return LineFault(rng.choice(KINDS), rng.randrange(8), rng.randrange(40), seconds, rng.randrange(10**9))


def sequence(bench, rng, outcomes):
    """One to three faults, readings while they last, then one without: that must succeed."""
    bench.change(rng)
    swapped = rng.random() < 0.1
    for _ in range(rng.randint(1, 3)):
        bench.server.inject(random_fault(rng))
    if swapped:
        bench.server.swap_with(bench.other)
    for _ in range(rng.randint(1, 3)):
        began = time.monotonic()
        try:
            reading = bench.driver.read()
        except InstrumentError as e:
            outcomes[type(e).__name__] += 1
        else:
            assert not swapped or bench.right(reading.value), "a swapped instrument was read"
            assert bench.right(reading.value), f"{reading.value} was read, {bench.truth} is true: {reading.raw}"
            outcomes["right"] += 1
        assert time.monotonic() - began < bench.deadline_s + SLACK_S, "the deadline passed"
    if swapped:
        bench.server.swap_with(bench.other)
    bench.server.clear()
    assert bench.right(recovered(bench.driver)), "wrong after the faults"


def recovered(driver):
    """The first reading after the fault is gone. What is on its way may still come: up to a second may pass."""
    until = time.monotonic() + 2.0
    while time.monotonic() < until:
        with suppress(InstrumentError):
            return driver.read().value
    return driver.read().value  # its error says why it does not recover


def run(kind, tmp_path, seeds):
    folder = tmp_path / str(seeds.start)
    folder.mkdir()
    bench, outcomes = Bench(kind, folder), Counter()
    with bench.server, bench.other:
        for seed in seeds:
            sequence(bench, random.Random(f"{kind} {seed}"), outcomes)
    bench.driver.close()
    return outcomes


@pytest.mark.parametrize("kind", ["OPTORSD", "OPTORSS", "M1240", "LCR", "ND"])
@pytest.mark.slow
def test_random_faults(kind, tmp_path):
    shares = [range(n, SEQUENCES, BENCHES) for n in range(BENCHES)]
    with ThreadPoolExecutor(BENCHES) as pool:
        outcomes = sum(pool.map(partial(run, kind, tmp_path), shares), Counter())
    assert outcomes["right"] > 0
    assert len(outcomes) > 3, f"the faults were too tame: {outcomes}"
