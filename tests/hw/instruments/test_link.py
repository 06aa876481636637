"""The serial link on real pseudo-terminals: deadlines, bounds, unplugging, transcript."""

import os
import pty
import termios
import threading
import time
import tty

import pytest
import serial

from hw.errors import Garbled, NoReply, SettingsError, Unplugged
from hw.link import Deadline, Link
from hw.serial_port import LineSettings
from tests.hw.instruments.dialogue import LINE, ScriptedPort

SLACK_S = 0.5  # a busy machine; a link without deadlines would wait for ever


@pytest.fixture
def terminal():
    """(master, path of the slave) of a raw pseudo-terminal."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    yield master, os.ttyname(slave)
    for handle in (master, slave):
        try:
            os.close(handle)
        except OSError:
            continue  # the test closed it


def settings(path: str) -> LineSettings:
    return LineSettings(path, 9600, 7, "even", 2, "none")


def test_bytes_go_and_come(terminal):
    master, path = terminal
    link = Link(settings(path))
    link.send(b"?\r")
    assert os.read(master, 10) == b"?\r"
    os.write(master, b"1.0mm\r\n2.0mm\r\nAB")
    assert link.read_until(b"\r\n", Deadline(2.0)) == b"1.0mm\r\n"
    assert link.read_until(b"\r\n", Deadline(2.0)) == b"2.0mm\r\n"
    assert link.read_exactly(2, Deadline(2.0)) == b"AB"
    link.close()


def test_every_byte_is_in_the_transcript_with_its_time(terminal):
    master, path = terminal
    before = time.time()
    link = Link(settings(path))
    link.send(bytes(range(256)))
    os.write(master, bytes(range(255, -1, -1)))
    link.read_exactly(256, Deadline(2.0))
    os.write(master, b"late")
    time.sleep(0.05)
    assert link.drop() == b"late"
    link.close()
    traffic = link.take_transcript()
    assert b"".join(t.data for t in traffic if t.way == "sent") == bytes(range(256))
    assert b"".join(t.data for t in traffic if t.way == "read") == bytes(range(255, -1, -1)) + b"late"
    assert [t.data for t in traffic if t.way == "dropped"] == [b"late"]
    assert all(before <= t.t <= time.time() for t in traffic)
    assert traffic[1].to_json()[2] == bytes(range(256)).decode("latin-1")
    assert link.take_transcript() == []


def test_silence_ends_at_the_deadline(terminal):
    link = Link(settings(terminal[1]))
    began = time.monotonic()
    with pytest.raises(NoReply, match="nothing came"):
        link.read_until(b"\n", Deadline(0.1))
    assert 0.1 <= time.monotonic() - began < 0.1 + SLACK_S


def test_half_a_reply_is_named_and_gone(terminal):
    master, path = terminal
    link = Link(settings(path))
    link.drop()
    os.write(master, b"1.0m")
    with pytest.raises(NoReply, match=r"only '1\.0m' came in time, expected a reply ending in"):
        link.read_until(b"\n", Deadline(0.1))
    os.write(master, b"2.0mm\n")
    assert link.read_until(b"\n", Deadline(2.0)) == b"2.0mm\n"


def test_a_line_without_end_is_bounded(terminal):
    master, path = terminal
    link = Link(settings(path))
    link.drop()
    os.write(master, b"x" * 300)
    with pytest.raises(Garbled, match="without"):
        link.read_until(b"\n", Deadline(2.0), limit=100)


def test_a_line_that_never_falls_silent(terminal):
    master, path = terminal
    link, stop = Link(settings(path)), threading.Event()

    def chatter():
        while not stop.wait(0.005):
            os.write(master, b"0.1mm\r\n")

    thread = threading.Thread(target=chatter)
    thread.start()
    try:
        with pytest.raises(Garbled, match="continuous"):
            link.drop_until_quiet(0.1, Deadline(0.3))
    finally:
        stop.set()
        thread.join()


def test_unplugged_and_plugged_again(tmp_path):
    path = tmp_path / "port"
    link = Link(settings(str(path)))
    with pytest.raises(Unplugged, match="no such port"):
        link.send(b"?")
    for number in (1, 2):
        master, slave = pty.openpty()
        tty.setraw(slave)
        path.symlink_to(os.ttyname(slave))
        link.send(b"?")
        assert os.read(master, 10) == b"?"
        assert link.opened == number
        os.write(master, b"1.0\r\n")
        time.sleep(0.05)
        link.read_exactly(1, Deadline(2.0))
        path.unlink()
        os.close(slave)
        os.close(master)
        with pytest.raises(Unplugged, match=r"went away after b'\.0"):
            link.read_exactly(20, Deadline(2.0))
        with pytest.raises(Unplugged, match="no such port"):  # what came before the loss is no answer any more
            link.read_until(b"\n", Deadline(2.0))


def test_no_modem_line_is_read(terminal, monkeypatch):
    """A pseudo-terminal has none: reading one raises. Here every attempt would be seen."""

    def forbidden(self):
        raise AssertionError("a modem line was read")

    for name in ("cts", "dsr", "ri", "cd"):
        monkeypatch.setattr(serial.Serial, name, property(forbidden))
    link = Link(settings(terminal[1]))
    link.send(b"?")
    link.drop()
    link.close()


def test_flow_control_that_stops_the_line(monkeypatch):
    class Stopped(ScriptedPort):
        def write(self, data, /):
            raise serial.SerialTimeoutException("Write timeout")

    link = Link(LINE, lambda s: Stopped(()))
    with pytest.raises(NoReply, match="flow control"):
        link.send(b"?")


def test_the_line_is_opened_as_the_bench_file_says(monkeypatch):
    seen = {}

    def fake(**given):
        seen.update(given)
        return ScriptedPort(())

    monkeypatch.setattr("hw.serial_port.serial.Serial", fake)
    Link(LineSettings("/dev/x", 4800, 7, "odd", 2, "rtscts")).drop()
    assert (seen["port"], seen["baudrate"], seen["bytesize"]) == ("/dev/x", 4800, 7)
    assert (seen["parity"], seen["stopbits"], seen["rtscts"], seen["xonxoff"]) == ("O", 2, True, False)
    assert seen["exclusive"]


def test_a_port_that_does_not_take_the_settings(monkeypatch):
    """pyserial lets an error through that is no OSError."""

    def refuses(**given):
        raise termios.error(22, "Invalid argument")

    monkeypatch.setattr("hw.serial_port.serial.Serial", refuses)
    with pytest.raises(SettingsError, match=r"9600 7E2: the port does not take these settings \(Invalid argument\)"):
        Link(settings("/dev/x")).drop()


@pytest.mark.parametrize(
    "wrong", [{"baud": 5}, {"data_bits": 9}, {"parity": "E"}, {"stop_bits": 3}, {"handshake": "hardware"}]
)
def test_settings_that_cannot_be(wrong):
    good = {"port": "/dev/x", "baud": 9600, "data_bits": 8, "parity": "none", "stop_bits": 1, "handshake": "none"}
    with pytest.raises(SettingsError, match=next(iter(wrong))):
        LineSettings(**{**good, **wrong})


def test_nothing_has_a_default():
    with pytest.raises(TypeError):
        LineSettings("/dev/x")


def test_a_transcript_that_nobody_takes_is_bounded_and_says_so(monkeypatch):
    monkeypatch.setattr("hw.link.MAX_TRAFFIC", 10)
    link = Link(LINE, lambda s: ScriptedPort(()))
    for number in range(12):
        link.note(str(number))
    kept = [t.data for t in link.take_transcript()]
    assert b"5 entries before this" in kept[0]
    assert kept[-1] == b"11"
    assert len(kept) <= 10
