"""The scan: what is there, a bench file that is one, and not a byte to an unknown instrument."""

import os
import pty
import tty
from types import SimpleNamespace

import pytest
from serial.tools.list_ports_common import ListPortInfo

from accept.base.exit_codes import Exit
from accept.commands.bench import scan as command
from hw.instruments import find
from specs.bench import parse_bench
from tests.hw.peers.ids3010 import Ids3010Peer
from tests.hw.peers.network import served
from tests.hw.peers.scpi_lcr import E4980aPeer


@pytest.fixture
def ports(monkeypatch):
    """A port that is there, one that is gone; the master end of the first."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    there = [ListPortInfo(os.ttyname(slave))]
    there[0].description = "FT232R USB UART"
    gone = SimpleNamespace(device="/dev/ttyUSB99", description="CP2102 USB")
    monkeypatch.setattr(find, "comports", lambda: [*there, gone])
    for module in ("pyvisa_py.serial", "pyvisa_py.prologix"):
        monkeypatch.setattr(f"{module}.comports", lambda *_: there)
    yield master
    os.close(master)
    os.close(slave)


@pytest.mark.slow
def test_ports_are_listened_to_and_never_written_to(ports, capsys):
    """By none of the names under which a VISA library lists a serial port either: pyvisa-py has ASRL, and PRLGX-ASRL
    for a bridge that might stand there, to which it writes as soon as it is opened."""
    os.set_blocking(ports, False)
    assert command.scan() is Exit.ACCEPTED
    said = capsys.readouterr()
    assert "FT232R USB UART; free, silent" in said.err
    assert "no such port" in said.err
    assert "unclosed" not in said.err  # what the search leaves to the collector is nobody's news
    assert "link = { port" in said.out
    with pytest.raises(BlockingIOError):  # nothing came
        os.read(ports, 10)


@pytest.mark.slow
def test_a_meter_is_proposed_as_an_entry_that_opens(ports, capsys):
    with served(E4980aPeer()) as where:
        host, number = where.split(":")
        command.scan([f"TCPIP::{host}::{number}::SOCKET", "TCPIP::127.0.0.1::9::SOCKET"])
    said = capsys.readouterr()
    bench = parse_bench(said.out.encode(), "proposed")
    assert (bench.instruments["lcr"].serial, bench.instruments["lcr"].model) == ("MY46412345", "E4980A")
    assert "127.0.0.1::9::SOCKET: nothing answers there" in said.err


@pytest.mark.slow
def test_an_interferometer_at_its_address_is_proposed(ports, capsys):
    with served(Ids3010Peer()) as where, served(E4980aPeer()) as other:
        command.scan([where, other, "127.0.0.1:9"])
    said = capsys.readouterr()
    entry = parse_bench(said.out.encode(), "proposed").instruments["interferometer"]
    assert (entry.driver, entry.serial, entry.resource) == ("ids3010", "L01234567", where)
    assert f"{where}: IDS3010 L01234567: ids3010" in said.err
    assert f"{other}: " in said.err
    assert "127.0.0.1:9: nothing answers there" in said.err


@pytest.mark.slow
def test_a_library_that_is_not_there_is_said_in_one_line(ports, capsys):
    assert command.scan(library="/absent/visa.so") is Exit.ACCEPTED
    assert "VISA: " in capsys.readouterr().err


@pytest.mark.slow
def test_another_instrument_is_named_and_not_proposed(ports, capsys):
    with served(E4980aPeer(model="34465A")) as where:
        command.scan(["TCPIP::{}::{}::SOCKET".format(*where.split(":"))])
    said = capsys.readouterr()
    assert "no driver here knows it" in said.err
    assert "[instruments.lcr]" not in said.out
