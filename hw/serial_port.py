"""A serial port as pyserial opens it, with its damaged characters marked, and its errors as one clear line.

pyserial leaves parity unchecked on POSIX (it clears INPCK and PARMRK), so a damaged character would pass as a good one.
Here the system is told to mark it, and a mark is an error of the line. Windows puts a replacement character in its
place. Nothing here reads a modem line: a pseudo-terminal has none, and neither have two-wire adapters."""

import ctypes
import errno
import os
import sys
from dataclasses import dataclass
from typing import Any, Protocol

import serial

from hw.errors import SettingsError

try:
    import termios
except ImportError:  # Windows
    TERMIOS = False
else:
    TERMIOS = True

PARITIES = {"none": serial.PARITY_NONE, "even": serial.PARITY_EVEN, "odd": serial.PARITY_ODD}
STOP_BITS = (1, 2)
DATA_BITS = (7, 8)
HANDSHAKES = ("none", "xonxoff", "rtscts")
POLL_S = 0.02  # how long one look at the port may wait; a deadline is kept to within it
WRITE_TIMEOUT_S = 1.0  # some bytes at 1200 baud take a tenth of that
MARK = 0xFF  # before a damaged character (termios: PARMRK); on Windows in its place


@dataclass(frozen=True)
class LineSettings:
    """The settings of the line. Settings that the manual leaves open have no default; read them at the instrument."""

    port: str
    baud: int
    data_bits: int
    parity: str
    stop_bits: int
    handshake: str

    def __post_init__(self) -> None:
        for name, value, known in (
            ("data_bits", self.data_bits, DATA_BITS),
            ("parity", self.parity, tuple(PARITIES)),
            ("stop_bits", self.stop_bits, STOP_BITS),
            ("handshake", self.handshake, HANDSHAKES),
        ):
            if value not in known:
                words = ", ".join(map(str, known))
                raise SettingsError(f"{self.port}: {name} = {value!r}, expected one of {words}")
        if not 50 <= self.baud <= 921_600:
            raise SettingsError(f"{self.port}: baud = {self.baud}, expected 50 to 921600")

    def __str__(self) -> str:
        return f"{self.port} at {self.baud} {self.data_bits}{self.parity[0].upper()}{self.stop_bits}"


class Port(Protocol):
    """The interface of a port to a link: read returns the bytes of the last `POLL_S`, at most n. `read` raises
    DamagedCharacter, or OSError if the port is gone."""

    @property
    def in_waiting(self) -> int: ...
    def read(self, size: int = 1, /) -> bytes: ...
    def write(self, b: bytes, /) -> int | None: ...
    def close(self) -> None: ...


class DamagedCharacter(Exception):
    """A character came with wrong parity or without its stop bit: the bytes around it cannot be trusted."""


def open_serial(settings: LineSettings) -> Port:
    """Open a port whose damaged characters are marked. Raises OSError (pyserial's SerialException is one), and
    SettingsError if the port does not take the settings."""
    try:
        opened = serial.Serial(
            port=settings.port,
            baudrate=settings.baud,
            bytesize=settings.data_bits,
            parity=PARITIES[settings.parity],
            stopbits=settings.stop_bits,
            xonxoff=settings.handshake == "xonxoff",
            rtscts=settings.handshake == "rtscts",
            timeout=POLL_S,
            write_timeout=WRITE_TIMEOUT_S,
            exclusive=True,
        )
        return MarkedPort(opened, doubled=_mark_damaged(opened, settings.parity))
    except Exception as e:
        if TERMIOS and isinstance(e, termios.error):  # no OSError, and pyserial lets it through
            raise SettingsError(f"{settings}: the port does not take these settings ({e.args[-1]})") from e
        raise


def _mark_damaged(port: Any, parity: str) -> bool | None:
    """Have the system mark damaged characters. True: by MARK, 0 and the character, MARK itself doubled (termios);
    False: by MARK in place of the character (Windows); None: a port without a descriptor marks nothing."""
    if TERMIOS and hasattr(port, "fd"):
        attributes = termios.tcgetattr(port.fd)
        attributes[0] |= termios.PARMRK | (termios.INPCK if parity != "none" else 0)
        attributes[0] &= ~(termios.IGNPAR | termios.ISTRIP)
        termios.tcsetattr(port.fd, termios.TCSANOW, attributes)
        return True
    if hasattr(port, "_port_handle"):
        mark_on_windows(port, sys.modules["serial.win32"])
        return False
    return None


def mark_on_windows(port: Any, win32: Any) -> None:
    """Have Windows replace characters of wrong parity by MARK. win32: pyserial's `serial.win32`."""
    state = win32.DCB()
    handle = port._port_handle  # noqa: SLF001 - pyserial has no public name for it
    win32.GetCommState(handle, ctypes.byref(state))
    state.fErrorChar, state.ErrorChar = 1, bytes([MARK])
    if not win32.SetCommState(handle, ctypes.byref(state)):
        raise OSError(errno.EINVAL, "its parity check cannot be set up")


class MarkedPort:
    """A port that removes the marks from received bytes. doubled: the return value of `_mark_damaged`."""

    def __init__(self, port: Any, doubled: bool | None) -> None:
        self._port, self._doubled, self._half = port, doubled, b""

    @property
    def in_waiting(self) -> int:
        return int(self._port.in_waiting)

    def read(self, size: int = 1, /) -> bytes:
        """Return bytes without marks. Raises DamagedCharacter, OSError."""
        try:
            received: bytes = self._half + self._port.read(size)
        except TypeError as e:  # so pyserial fails where another thread has closed the port meanwhile
            raise OSError(errno.EBADF, "it was closed while it was read") from e
        self._half = b""
        if self._doubled is None or MARK not in received:
            return received
        return self._unmarked(received)

    def _unmarked(self, came: bytes) -> bytes:
        if not self._doubled:
            raise DamagedCharacter("a character with wrong parity")
        plain, at = bytearray(), 0
        while at < len(came):
            if came[at] != MARK:
                plain.append(came[at])
                at += 1
                continue
            if at + 1 == len(came):  # the other half of the mark is still on its way
                self._half = came[at:]
                break
            if came[at + 1] != MARK:
                raise DamagedCharacter("a character with wrong parity or without its stop bit")
            plain.append(MARK)
            at += 2
        return bytes(plain)

    def write(self, b: bytes, /) -> int | None:
        written: int | None = self._port.write(b)
        return written

    def close(self) -> None:
        self._port.close()


TAKEN = (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK)
FORBIDDEN = (errno.EACCES, errno.EPERM)
GONE = (errno.ENOENT, errno.ENODEV, errno.ENXIO, errno.EIO)
SILENT = (errno.ECONNREFUSED, errno.EHOSTUNREACH, errno.ENETUNREACH, errno.ETIMEDOUT)
WINDOWS_WORDS = (
    ("PermissionError(13", errno.EBUSY),
    ("FileNotFoundError(2", errno.ENOENT),
    ("OSError(22", errno.ENXIO),
)


def why_not_opened(port: str, error: Exception) -> str:
    """Return why a port cannot be opened and the remedy, in one line, for Linux, macOS and Windows."""
    number = _number(error)
    if number in TAKEN:
        return "another program has the port open: end that program, or log out its session"
    if number in FORBIDDEN:
        if port.upper().startswith("COM") or "\\" in port:
            return "another program has the port open: end that program"
        words = "on Linux, join its group (sudo usermod -aG dialout $USER) and log in again"
        return f"you have no right to use the port: {words}"
    if number in SILENT:
        return f"nothing answers there ({cause(error)}): is the instrument on, on this network, and is this its port?"
    if number in GONE:
        return f"there is no such port: is the adapter plugged in? {_where_to_look(port)}"
    return f"it cannot be opened ({cause(error)}): is it plugged in and free?"


def _where_to_look(port: str) -> str:
    if port.upper().startswith("COM") or port.startswith("\\\\"):
        return "The Device Manager lists its number under Ports (COM & LPT)"
    if port.startswith(("/dev/cu.", "/dev/tty.")):
        return "`ls /dev/cu.*` lists what is there"
    return "`ls /dev/serial/by-id` lists what is there"


def _number(error: Exception) -> int | None:
    """Return the number of an error; pyserial's errors of Windows and of the lock have it only in their words."""
    number = getattr(error, "errno", None)
    if number is None:
        number = next((n for words, n in WINDOWS_WORDS if words in str(error)), None)
    return number


def cause(error: Exception) -> str:
    """Return the cause in few words: pyserial puts the port and the number of the error into its own."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error) or type(error).__name__
