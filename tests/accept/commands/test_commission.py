"""Commissioning at peers that answer as the documents print, by a technician who turns what is asked for."""

import json
import re
from datetime import date
from pathlib import Path

import pytest
from typer.testing import CliRunner

from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.certificate.trust import commissioning, keys
from accept.certificate.trust.commissioned import is_proven
from accept.cli.main import app
from accept.commands.bench import commission as command
from accept.judging import calibration
from hw.instruments import open_instrument
from hw.simulated.replay import replay
from specs.bench import load_bench
from specs.spec import CheckSpec
from tests.hw.peers.lcr800 import Lcr800Peer
from tests.hw.peers.line import Line

BENCH = """name = "bench 1"
[instruments.lcr]
driver = "lcr800"
measures = ["capacitance"]
model = "LCR-819"
serial = "E1"
link = { port = "/dev/x", baud = 38400, data_bits = 8, parity = "none", stop_bits = 1, handshake = "none" }
calibration = { certificate = "GW-7", due = 2099-03-01 }
[instruments.scale]
driver = "offline"
measures = ["stiffness"]
"""
PANEL = {
    "DELTA,": "DISP DELT", "DELTA %": "DISP DELP", "mode": "MODE RQ", "circuit": "CIRC PARA", "level": "VOLT 0.005",
    "frequency": "FREQ 0.12000", "speed": "SPEE FAST", "range": "R.H. ON..",
}  # fmt: skip
BACK = ("DISP VALU", "MODE CD", "CIRC SERI", "SPEE SLOW", "R.H. OFF.")


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    path = tmp_path / "bench.toml"
    path.write_text(BENCH)
    keys.init(home(), "correct horse", "Ann", "Bob", "battery staple")
    return path


@pytest.fixture
def peer(monkeypatch: pytest.MonkeyPatch) -> Lcr800Peer:
    """A meter on the line, and a technician at its keys."""
    peer = Lcr800Peer()
    peer.truth = 4.99e-6
    line = Line(peer)

    def opened(name, entry, ask):
        instrument = open_instrument(name, entry, ask)
        instrument.link._opener, instrument.link.clock = line.open, line.clock
        return instrument

    def technician(words: str) -> str:
        if words.startswith("Set it back"):
            for key in BACK:
                peer.panel[key]()
        elif "switch the meter off" in words.lower():
            peer.switch_on()
        elif found := next((key for word, key in PANEL.items() if word in words), None):
            peer.panel[found]()
        return "yes"

    monkeypatch.setattr(command, "open_instrument", opened)
    monkeypatch.setattr(command, "ask_at_terminal", technician)
    return peer


def said_of(path: Path) -> str:
    row = commissioning.commissioned(load_bench(path), home())["lcr"] | {"model": "LCR-819", "serial": "E1"}
    assert is_proven(row, [keys.ca(home())])
    return row["commissioned"]


def test_from_unproven_to_commissioned_on_the_certificate(bench, peer):
    assert said_of(bench) == "unproven: never commissioned"
    assert command.commission("lcr", bench, "Ann") is Exit.ACCEPTED
    assert re.fullmatch(r"commissioned on \d{4}-\d\d-\d\d by Ann", said_of(bench))
    file = json.loads((bench.parent / "commissioning" / "lcr.json").read_text())
    outcomes = {outcome["trial"]: outcome["found"] for outcome in file["record"]["outcomes"]}
    assert len(outcomes) == 11  # a first reading, nine trials, the value back
    assert sum(outcome["how"] == "refused" for outcome in file["record"]["outcomes"]) == 9
    stated = calibration.statement(
        load_bench(bench), {name: CheckSpec(required=False) for name in ("capacitance", "stiffness")},
        date(2026, 6, 1),
        commissioning.commissioned(load_bench(bench), home()),
    )  # fmt: skip
    capacitance, stiffness = calibration.notes(calibration.checked(stated, {}))
    assert capacitance.endswith("by Ann")
    assert "commissioned" not in stiffness  # no program reads it


def test_enter_does_not_pass(bench, peer, monkeypatch):
    """Nothing is changed at the meter: every value is the same, and nobody saw a change."""
    answers = iter(["", "yes"])  # connected; the display shows what was read
    monkeypatch.setattr(command, "ask_at_terminal", lambda _: next(answers, ""))
    assert command.commission("lcr", bench, "Ann") is Exit.INSTRUMENT
    assert "did not pass" in said_of(bench)
    file = json.loads((bench.parent / "commissioning" / "lcr.json").read_text())
    assert {outcome["how"] for outcome in file["record"]["outcomes"]} == {"read", "not seen"}


def test_a_setting_that_the_driver_asks_must_be_refused(bench, peer):
    """A meter that answers SERI when it stands on PARA: 0.02 % at this D, within what a reading may scatter."""
    told = peer._told
    peer._told = lambda key: "MAIN:CIRC:SERI" if key == "CIRC" else told(key)
    assert command.commission("lcr", bench, "Ann") is Exit.INSTRUMENT
    file = json.loads((bench.parent / "commissioning" / "lcr.json").read_text())
    (circuit,) = [o for o in file["record"]["outcomes"] if "parallel" in o["trial"]]
    assert (circuit["passed"], circuit["how"]) == (False, "passed over")


def test_a_record_from_before_changes_were_confirmed_proves_nothing(bench, peer):
    command.commission("lcr", bench, "Ann")
    path = bench.parent / "commissioning" / "lcr.json"
    record = json.loads(path.read_text())["record"]
    for outcome in record["outcomes"]:
        del outcome["how"]
    path.write_bytes(commissioning.signed(record, command._credential()))
    assert said_of(bench).startswith("unproven: its commissioning on")


def test_the_record_s_bytes_are_printed_and_play_the_instrument(bench, peer):
    assert command.commission("lcr", bench, "Ann") is Exit.ACCEPTED
    path = bench.parent / "commissioning" / "lcr.json"
    done = CliRunner().invoke(app, ["hw", "transcript", str(path)])
    assert done.exit_code == 0
    assert "sent    'COMU?\\n\\r'" in done.stdout
    assert CliRunner().invoke(app, ["hw", "transcript", str(path), "--instrument", "gauge"]).exit_code == 6
    entries = json.loads(path.read_text())["record"]["transcript"]
    first = next(n for n, (_, way, text) in enumerate(entries) if way == "note" and text == "closed")
    entry = load_bench(bench).instruments["lcr"]
    instrument = open_instrument("lcr", entry, input)
    instrument.link, port = replay(entries[:first], instrument.link.settings)
    instrument.connect()
    assert instrument.read().value == pytest.approx(4.99e-6, rel=1e-3)
    assert not port.is_over  # the first trial follows
    assert CliRunner().invoke(app, ["hw", "transcript", "APA-99"]).exit_code == 6


def test_a_meter_that_hides_a_change_does_not_pass(bench, peer):
    """One that answers VALU whatever it shows: the value of the trial is wrong, and the record says so."""
    told = peer._told
    peer._told = lambda key: "MAIN:DISP:VALU" if key == "DISP" else told(key)
    assert command.commission("lcr", bench, "Ann") is Exit.INSTRUMENT
    assert "did not pass" in said_of(bench)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda file: file["record"].update(on="2030-01-01"), "does not verify"),
        (lambda file: file.pop("signature"), "unsigned"),
        (lambda file: file.update(certificate="x"), "does not verify"),
        (lambda file: file.update(signature="%%"), "does not verify"),
    ],
)
def test_a_record_that_was_changed_proves_nothing(bench, peer, change, words):
    command.commission("lcr", bench, "Ann")
    path = bench.parent / "commissioning" / "lcr.json"
    file = json.loads(path.read_text())
    change(file)
    path.write_text(json.dumps(file))
    assert words in said_of(bench)
    path.write_bytes(b"\xff{")
    assert "does not verify" in said_of(bench)


def test_other_settings_are_not_commissioned_and_another_port_is(bench, peer):
    command.commission("lcr", bench, "Ann")
    bench.write_text(BENCH.replace("/dev/x", "/dev/y"))
    assert "by Ann" in said_of(bench)
    bench.write_text(BENCH.replace('serial = "E1"', 'serial = "E2"'))
    assert "other settings" in said_of(bench)


def test_without_a_passphrase_it_stays_unproven(bench, peer, monkeypatch):
    monkeypatch.delenv("ACCEPT_PASSPHRASE")
    assert command.commission("lcr", bench, "Ann") is Exit.ACCEPTED
    assert said_of(bench) == "unproven: its commissioning record is unsigned"


def test_what_is_not_on_a_wire_cannot_be_commissioned(bench):
    assert command.commission("scale", bench, "Ann") is Exit.BAD_INPUT
    assert command.commission("nothing", bench, "Ann") is Exit.BAD_INPUT
