"""The port below: damaged characters are marked and refused, errors tell what to do, by every system's names."""

import ctypes
import errno
import os
import pty
import termios
import tty
from types import SimpleNamespace

import pytest
import serial

from hw.errors import Garbled, Unplugged
from hw.link import Link
from hw.serial_port import DamagedCharacter, LineSettings, MarkedPort, mark_on_windows, open_serial
from tests.hw.instruments.dialogue import LINE


class Bytes:
    """A port of pyserial's that gives these pieces, one a read."""

    def __init__(self, *pieces: bytes) -> None:
        self.pieces = list(pieces)

    @property
    def in_waiting(self) -> int:
        return len(self.pieces[0]) if self.pieces else 0

    def read(self, size: int) -> bytes:
        return self.pieces.pop(0) if self.pieces else b""


@pytest.mark.parametrize("parity", ["even", "odd", "none"])
def test_parity_is_checked_and_damage_is_marked(parity):
    """The terminal's own flags, read back: pyserial clears them."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    port = open_serial(LineSettings(os.ttyname(slave), 9600, 7, parity, 2, "none"))
    flags = termios.tcgetattr(slave)[0]
    assert flags & termios.PARMRK
    assert bool(flags & termios.INPCK) == (parity != "none")
    assert not flags & (termios.IGNPAR | termios.ISTRIP)
    os.write(master, b"1.0\xff\r\n")  # the system doubles the mark where it is a character
    assert port.read(20) + port.read(20) == b"1.0\xff\r\n"
    port.close()
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize("pieces", [(b"1\xff\x002",), (b"1\xff", b"\x002"), (b"1", b"\xff", b"\x00A")])
def test_a_marked_character_is_no_character(pieces):
    """As termios gives it, in one piece or several."""
    port = MarkedPort(Bytes(*pieces), doubled=True)
    for _ in pieces[1:]:
        port.read(10)
    with pytest.raises(DamagedCharacter):
        port.read(10)


def test_a_doubled_mark_is_one_character_in_one_piece_or_two():
    assert MarkedPort(Bytes(b"a\xff\xffb"), doubled=True).read(10) == b"a\xffb"
    port = MarkedPort(Bytes(b"a\xff", b"\xffb"), doubled=True)
    assert port.read(10) + port.read(10) == b"a\xffb"


def test_a_replaced_character_on_windows():
    with pytest.raises(DamagedCharacter):
        MarkedPort(Bytes(b"1.\xff5"), doubled=False).read(10)


def test_the_link_refuses_what_came_damaged():
    port = MarkedPort(Bytes(b"0.3\xff\x0005mm\r\n"), doubled=True)
    link = Link(LINE, lambda settings: port)
    with pytest.raises(Garbled, match="parity"):
        link.read_until(b"\r\n", link.deadline(0.1))


@pytest.mark.parametrize("taken", [True, False])
def test_windows_is_told_to_replace_damaged_characters(taken):
    """Against a stand-in of pyserial's `serial.win32`, with the fields of its DCB."""

    class State(ctypes.Structure):
        _fields_ = [("fErrorChar", ctypes.c_uint32, 1), ("ErrorChar", ctypes.c_char)]

    seen = []
    win32 = SimpleNamespace(
        DCB=State,
        GetCommState=lambda handle, state: True,
        SetCommState=lambda handle, state: seen.append(state._obj) or taken,
    )
    if taken:
        mark_on_windows(SimpleNamespace(_port_handle=7), win32)
        assert (seen[0].fErrorChar, seen[0].ErrorChar) == (1, b"\xff")
    else:
        with pytest.raises(OSError, match="parity"):
            mark_on_windows(SimpleNamespace(_port_handle=7), win32)


BY_ID = "/dev/serial/by-id/usb-FTDI-1"


@pytest.mark.parametrize(
    ("port", "error", "words"),
    [
        (BY_ID, serial.SerialException(errno.EAGAIN, "Could not lock port"), "another program has the port"),
        (BY_ID, OSError(errno.EBUSY, "x"), "another program has the port"),
        (BY_ID, serial.SerialException(errno.EACCES, "could not open port"), "no right to use the port.*dialout"),
        (BY_ID, serial.SerialException(errno.ENOENT, "could not open port"), "no such port.*by-id"),
        ("/dev/cu.usbserial-1", OSError(errno.EBUSY, "Resource busy"), "another program has the port"),
        ("/dev/cu.usbserial-1", OSError(errno.ENOENT, "x"), r"no such port.*/dev/cu\.\*"),
        ("COM7", serial.SerialException("could not open port 'COM7': PermissionError(13, 'Access denied.', None, 5)"),
         "another program has the port"),
        ("COM7", serial.SerialException("could not open port 'COM7': FileNotFoundError(2, 'The system cannot find the "
         "file specified.', None, 2)"), "no such port.*Device Manager"),
        ("\\\\.\\COM12", serial.SerialException("could not open port: OSError(22, 'x', None, 433)"), "no such port"),
        (BY_ID, ValueError("odd"), "cannot be opened .odd."),
    ],
)  # fmt: skip
def test_one_line_says_why_a_port_cannot_be_opened(port, error, words):
    def opener(settings):
        raise error

    with pytest.raises(Unplugged, match=words) as caught:
        Link(LineSettings(port, 9600, 8, "none", 1, "none"), opener).drop()
    assert "\n" not in str(caught.value)


def test_a_port_that_another_program_holds():
    """Two links to one terminal: the second is told so, and gets it when the first lets go."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    settings = LineSettings(os.ttyname(slave), 9600, 8, "none", 1, "none")
    one, other = Link(settings), Link(settings)
    one.drop()
    with pytest.raises(Unplugged, match="another program has the port open"):
        other.drop()
    one.close()
    other.drop()
    other.close()
    os.close(master)
    os.close(slave)


def test_a_port_that_another_thread_closes_is_lost_and_no_fault_of_the_program() -> None:
    """The live value goes on in its thread while the screen leaves: pyserial reads a file that is None then."""

    class Closed(Bytes):
        def read(self, size: int = 1, /) -> bytes:
            raise TypeError("'NoneType' object cannot be interpreted as an integer")

    with pytest.raises(OSError, match="closed while it was read"):
        MarkedPort(Closed(), doubled=True).read(1)
