"""Drivers against peers written from the documents: no sequence of faults gives a value that is neither right nor
refused, and what the documents print is read.

2,000 sequences per driver with ACCEPT_SOAK=1, 50 otherwise. The clock is the line's own: nothing waits.
"""

import random
from collections import Counter
from pathlib import Path

import pytest

from hw.instruments import open_instrument
from specs.bench import parse_bench
from tests.hw.peers.faults import BENCHES, IN_WORDS, READINGS, RIGHT, alone, kinds_of, play, tables
from tests.hw.peers.heidenhain import HeidenhainPeer
from tests.hw.peers.lcr800 import Lcr800Peer
from tests.hw.peers.line import KINDS, Line, random_faults
from tests.hw.peers.millimar import MillimarPeer
from tests.soak import SOAK

SEQUENCES = 2000 if SOAK else 50
DOCS = Path(__file__).parents[3] / "docs"


@pytest.mark.parametrize("kind", BENCHES)
def test_no_value_is_neither_right_nor_refused(kind):
    outcomes = Counter()
    for seed in range(SEQUENCES):
        rng = random.Random(f"{kind} {seed}")
        found, wrong = play(kind, random_faults(rng, kinds=kinds_of(kind)), rng)
        assert not wrong, wrong
        outcomes += found
    assert outcomes[RIGHT] > SEQUENCES / 2, f"nearly everything was refused: {outcomes}"
    assert len(outcomes) > 3, f"the faults were too tame: {outcomes}"


@pytest.mark.parametrize("fault", sorted(set(KINDS)))
@pytest.mark.parametrize("kind", BENCHES)
def test_every_fault_at_every_moment(kind, fault):
    """One fault alone, at each message of a session and a reading: driver by fault."""
    if fault in kinds_of(kind):
        _, wrong = alone(kind, fault, 1 if SOAK else 8)
        assert not wrong, wrong


@pytest.mark.soak
def test_the_tables_of_the_page_are_these():
    """Every fault, every change at every panel; a wrong value would stand in them."""
    assert set(IN_WORDS) == set(KINDS) - {"panel"}
    made = "\n".join(tables())
    assert "wrong" not in made.replace("wrong parity", "")
    assert made in (DOCS / "explanation" / "readings.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", BENCHES)
def test_without_faults_everything_is_read(kind):
    for seed in range(20):
        assert play(kind, [], random.Random(seed)) == (Counter(right=READINGS), [])


def test_the_bench_file_of_the_documentation_reads_instruments_that_answer_as_printed():
    page = (DOCS / "how-to" / "instruments.md").read_text(encoding="utf-8")
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
