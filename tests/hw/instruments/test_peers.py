"""Drivers against peers written from the documents: no sequence of faults gives a value that is neither right nor
refused, and what the documents print is read.

2,000 sequences per driver with ACCEPT_SOAK=1, 100 otherwise. The clock is the line's own: nothing waits.
"""

import random
from collections import Counter
from pathlib import Path

import pytest

from hw.errors import InstrumentError
from hw.instruments import Heidenhain, Lcr800, MillimarM1240, MillimarOptors, open_instrument
from hw.instruments.heidenhain import Nd287Settings
from hw.instruments.ids3010 import Ids3010, Ids3010Settings
from hw.instruments.lcr800 import Lcr800Settings
from hw.instruments.millimar_m1240 import M1240Settings
from hw.instruments.millimar_optors import OptorsSettings
from hw.instruments.scpi_lcr import ScpiLcr, ScpiLcrSettings
from hw.link import Link
from specs.bench import parse_bench
from tests.hw.instruments.dialogue import LINE
from tests.hw.peers.heidenhain import HeidenhainPeer
from tests.hw.peers.ids3010 import Ids3010Peer
from tests.hw.peers.lcr800 import Lcr800Peer
from tests.hw.peers.line import KINDS, Fault, Line, random_faults
from tests.hw.peers.millimar import MillimarPeer
from tests.hw.peers.scpi_lcr import E4980aPeer
from tests.soak import SOAK

CAPACITANCE = ("LCR-800", "E4980A")
SEQUENCES = 2000 if SOAK else 100
READINGS = 4
RANGE = {"range_mm": [-1.0, 1.0]}
GAUGE = {"unit": "um", "integer_digits": 4, "decimals": 1, **RANGE}


def optorsd(rng):
    peer = MillimarPeer("OPTORSD", rng.choice(("", "OK", "um", None)), sign=rng.choice(("", "+", " ")))
    settings = OptorsSettings(protocol="OPTORSD", formula="+1", acknowledged=peer.acknowledgement is not None, **GAUGE)
    return peer, lambda link: MillimarOptors("gauge", link, settings, "C1216", "1234/56")


def optorss(rng):
    peer = MillimarPeer("OPTORSS", sign=rng.choice(("", "+", " ")))
    return peer, lambda link: MillimarOptors("gauge", link, OptorsSettings(protocol="OPTORSS", **GAUGE))


def m1240(rng):
    peer = MillimarPeer("M1240", rng.choice(("cr", "echo", None)), padded=rng.random() < 0.5)
    settings = M1240Settings(protocol="M1240", unit="um", acknowledged=peer.acknowledgement or "none", **RANGE)
    return peer, lambda link: MillimarM1240("gauge", link, settings, "C1216")


def lcr(rng):
    return Lcr800Peer(blank=rng.random() < 0.5), lambda link: Lcr800("lcr", link, Lcr800Settings(), "LCR-819")


def nd287(rng):
    peer = HeidenhainPeer(axes=rng.choice((1, 2)), blank_lines=rng.choice((0, 0, 2)))
    settings = Nd287Settings(axis="X1" if peer.axes == 2 else "single", identification="ND-287", **RANGE)
    return peer, lambda link: Heidenhain("probe", link, settings)


def scpi(_):
    settings = ScpiLcrSettings(profile="keysight", quiet_s=0.05)
    return E4980aPeer(), lambda link: ScpiLcr("lcr", link, settings, "E4980A", "MY46412345")


def ids(_):
    settings = Ids3010Settings(axis=0, pass_mode=0, quiet_s=0.05, **RANGE)
    return Ids3010Peer(), lambda link: Ids3010("ids", link, settings, None, "L01234567")


BENCHES = {
    "OPTORSD": optorsd,
    "OPTORSS": optorss,
    "M1240": m1240,
    "LCR-800": lcr,
    "ND 287": nd287,
    "E4980A": scpi,
    "IDS3010": ids,
}
OF_A_NETWORK = ("panel", "panel", "late", "lost", "power", "unplug")  # it damages no byte


def kinds_of(kind):
    return OF_A_NETWORK if kind in ("E4980A", "IDS3010") else KINDS


def truth_of(kind, rng):
    """Another one for every reading, far from the one before: a stale value would show."""
    return rng.uniform(2e-6, 12e-6) if kind in CAPACITANCE else rng.uniform(-900e-6, 900e-6)


def tolerance_of(kind, truth):
    """What two answers that agree may be off: half of the agreement, half of the last digit, and for the LCR 0.02 %,
    the difference of the circuits, which its own agreement hides."""
    return 0.0008 * truth if kind in CAPACITANCE else 0.31e-6


def play(kind, faults, rng):
    """A run of readings under faults: each outcome, and what happened on the line."""
    peer, make = BENCHES[kind](rng)
    line = Line(peer, faults)
    driver = make(Link(LINE, line.open, line.clock))
    outcomes = Counter()
    for nth in range(READINGS + 2):
        try:
            if nth == 0:
                driver.connect()
            elif nth > READINGS:
                driver.confirm()
            else:
                peer.truth = truth_of(kind, rng)
                reading = driver.read()
                off = abs(reading.value - peer.truth)
                assert off <= tolerance_of(kind, peer.truth), (reading, peer.truth, line.log)
                outcomes["right"] += 1
        except InstrumentError as e:
            outcomes[type(e).__name__] += 1
    return outcomes


@pytest.mark.parametrize("kind", BENCHES)
def test_no_value_is_neither_right_nor_refused(kind):
    outcomes = Counter()
    for seed in range(SEQUENCES):
        rng = random.Random(f"{kind} {seed}")
        outcomes += play(kind, random_faults(rng, kinds=kinds_of(kind)), rng)
    assert outcomes["right"] > SEQUENCES / 2, f"nearly everything was refused: {outcomes}"
    assert len(outcomes) > 3, f"the faults were too tame: {outcomes}"


@pytest.mark.parametrize("fault", sorted(set(KINDS)))
@pytest.mark.parametrize("kind", BENCHES)
def test_every_fault_at_every_moment(kind, fault):
    """One fault alone, at each message of a session and a reading: driver by fault."""
    if fault not in kinds_of(kind):
        return
    for at in range(0, 40, 1 if SEQUENCES > 100 else 4):
        for answered in (False, True):
            rng = random.Random(f"{kind} {fault} {at}")
            play(kind, [Fault(fault, at, answered, at)], rng)


@pytest.mark.parametrize("kind", BENCHES)
def test_without_faults_everything_is_read(kind):
    for seed in range(20):
        assert play(kind, [], random.Random(seed)) == Counter(right=READINGS)


def test_the_bench_file_of_the_documentation_reads_instruments_that_answer_as_printed():
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "instruments.md").read_text(encoding="utf-8")
    bench = parse_bench(page.split("```toml\n")[1].split("```")[0].encode(), "docs/how-to/instruments.md")
    peers = {"gauge": MillimarPeer("OPTORSD"), "lcr": Lcr800Peer(), "probe": HeidenhainPeer()}
    wired = {name: entry for name, entry in bench.instruments.items() if entry.link is not None}
    assert set(wired) == set(peers)
    for name, entry in wired.items():
        peers[name].truth = 4.99e-6 if name == "lcr" else 12.3e-6
        line = Line(peers[name])
        instrument = open_instrument(name, entry, input)
        instrument.link._opener, instrument.link.clock = line.open, line.clock
        instrument.connect()
        assert instrument.read().value == pytest.approx(peers[name].truth, rel=0.01)
        instrument.confirm()
