"""Every driver against its peer under every fault: what comes of it. `python -m tests.hw.peers.faults` prints the
tables of docs/explanation/readings.md.

Each fault strikes once, at each of the first messages of a session with four readings, before it is heard and after it
is answered.
"""

import random
from collections import Counter
from collections.abc import Iterator

from hw.errors import InstrumentError
from hw.instruments import Heidenhain, Lcr800, MillimarM1240, MillimarOptors
from hw.instruments.heidenhain import Nd287Settings
from hw.instruments.ids3010 import Ids3010, Ids3010Settings
from hw.instruments.lcr800 import Lcr800Settings
from hw.instruments.millimar_protocols import M1240Settings, OptorsSettings
from hw.instruments.scpi_lcr import ScpiLcr, ScpiLcrSettings
from hw.link import Link
from tests.hw.instruments.dialogue import LINE
from tests.hw.peers.heidenhain import HeidenhainPeer
from tests.hw.peers.ids3010 import Ids3010Peer
from tests.hw.peers.lcr800 import Lcr800Peer
from tests.hw.peers.line import KINDS, Fault, Line
from tests.hw.peers.millimar import MillimarPeer
from tests.hw.peers.scpi_lcr import E4980aPeer

CAPACITANCE = ("LCR-800", "E4980A")
READINGS = 4
PAUSE_S = 1.0  # after an error, as a capture makes it before it tries again
MESSAGES = 40  # of a session, at each of which a fault strikes once
RIGHT, REFUSED, WRONG = "right", "refused", "wrong"
IN_WORDS = {
    "noise": "characters changed, lost or added",
    "lost_byte": "a character lost, once or in every reply",
    "parity": "wrong parity",
    "echo": "what is sent comes back",
    "glued": "two replies as one",
    "late": "a reply up to 12 s late",
    "lost": "a reply lost",
    "half": "half a reply",
    "power": "power off and on",
    "unplug": "unplugged and plugged in again",
    "chatter": "bytes that nobody asked for",
}
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
    """A run of readings under faults: each outcome, each error by its class, and a line for each wrong value."""
    peer, make = BENCHES[kind](rng)
    line = Line(peer, faults)
    driver = make(Link(LINE, line.open, line.clock))
    outcomes, wrong = Counter(), []
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
                if off <= tolerance_of(kind, peer.truth):
                    outcomes[RIGHT] += 1
                else:
                    wrong.append(f"{reading}, in truth {peer.truth}: {line.log}")
        except InstrumentError as e:
            outcomes[type(e).__name__] += 1
            outcomes[REFUSED] += 0 < nth <= READINGS
            line.now += PAUSE_S
    return outcomes, wrong


def alone(kind, fault, step=1):
    """One fault at every `step`th message of a session, before and after its answer."""
    total, wrong = Counter(), []
    for at in range(0, MESSAGES, step):
        for answered in (False, True):
            rng = random.Random(f"{kind} {fault} {at}")
            outcomes, more = play(kind, [Fault(fault, at, answered, at)], rng)
            total, wrong = total + outcomes, wrong + more
    return total, wrong


def _cell(kind, *faults):
    if faults[0] not in kinds_of(kind) and not faults[0].startswith("panel:"):
        return "-"
    total, wrong = Counter(), []
    for fault in faults:
        outcomes, more = alone(kind, fault)
        total, wrong = total + outcomes, wrong + more
    return f"{total[RIGHT]} / {total[REFUSED]}" + (f" / **{len(wrong)} {WRONG}**" if wrong else "")


def tables() -> Iterator[str]:
    """Lines of Markdown."""
    yield f"| right / refused | {' | '.join(BENCHES)} |"
    yield f"|---|{'---|' * len(BENCHES)}"
    for fault, words in IN_WORDS.items():
        yield f"| {words} | {' | '.join(_cell(kind, fault) for kind in BENCHES)} |"
    yield ""
    yield "| changed at the panel | | right / refused |"
    yield "|---|---|---|"
    for kind in BENCHES:
        names = sorted({name for seed in range(9) for name in BENCHES[kind](random.Random(seed))[0].panel})
        yield f"| {kind} | {', '.join(names)} | {_cell(kind, *(f'panel:{name}' for name in names))} |"


if __name__ == "__main__":
    for row in tables():
        print(row, flush=True)
