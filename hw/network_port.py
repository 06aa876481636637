"""Instruments on a network or on VISA (LAN, USB, GPIB), as ports for a link. Bytes are not damaged on the way, but
answers can be late, and the instrument can disappear."""

import errno
import re
import socket
import time
from dataclasses import dataclass
from typing import Any

from hw.errors import SettingsError
from hw.serial_port import POLL_S
from specs.distribution import install

CONNECT_S = 3.0  # on a local network a device that is there answers in milliseconds
MAX_READ = 65_536  # of one read; an answer is some hundred bytes
MORE_MAY_COME = (0x3FFF0006, 0x3FFF007D)  # VISA's VI_SUCCESS_MAX_CNT and VI_SUCCESS_DEV_NPRESENT: warnings to pyvisa


@dataclass(frozen=True)
class Address:
    """port: `host:number`, or a VISA resource name."""

    port: str

    def __str__(self) -> str:
        return self.port


class TcpPort:
    """A TCP connection as a port."""

    def __init__(self, connection: socket.socket) -> None:
        self._socket, self._came = connection, b""

    @property
    def in_waiting(self) -> int:
        self._receive(0.0)
        return len(self._came)

    def read(self, size: int = 1, /) -> bytes:
        """Return the bytes that came within `POLL_S`. Raises OSError if the other end has closed."""
        if not self._came:
            self._receive(POLL_S)
        taken, self._came = self._came[:size], self._came[size:]
        return taken

    def write(self, b: bytes, /) -> int:
        """Write all bytes and return their number. Raises OSError."""
        self._socket.settimeout(CONNECT_S)
        self._socket.sendall(b)
        return len(b)

    def close(self) -> None:
        self._socket.close()

    def _receive(self, seconds: float) -> None:
        self._socket.settimeout(max(seconds, 1e-4))
        try:
            received = self._socket.recv(MAX_READ)
        except TimeoutError:
            return
        if not received:
            raise OSError(errno.EPIPE, "the instrument has closed the connection")
        self._came += received


def open_tcp(address: Address) -> TcpPort:
    """Connect to `host:number`. Raises OSError; SettingsError for another form."""
    found = re.fullmatch(r"(?P<host>[\w.:\-\[\]]+):(?P<number>\d{1,5})", address.port)
    if not found or not 0 < int(found["number"]) < 65_536:
        raise SettingsError(f"{address.port!r}: expected host:number, such as 192.168.1.1:9090")
    return TcpPort(socket.create_connection((found["host"].strip("[]"), int(found["number"])), CONNECT_S))


class VisaPort:
    """A VISA session as a port. It is read only after a question: some buses take an unanswered read amiss. One read is
    one library call for at most MAX_READ bytes, so that a link can check its deadline between two."""

    def __init__(self, session: Any, no_answer: type[Exception]) -> None:
        self._session, self._no_answer = session, no_answer
        self._came, self._asked = b"", False

    @property
    def in_waiting(self) -> int:
        return len(self._came)

    def read(self, size: int = 1, /) -> bytes:
        """Return the bytes that came within the session's own timeout, if a question is out."""
        if not self._came and self._asked:
            self._came = self._within(self._read_once)
            self._asked = not self._came
        elif not self._came:
            time.sleep(POLL_S)
        taken, self._came = self._came[:size], self._came[size:]
        return taken

    def write(self, b: bytes, /) -> int:
        """Write all bytes and return their number. Raises OSError."""
        self._asked = b"?" in b
        self._within(lambda: self._session.write_raw(b) and b"")
        return len(b)

    def close(self) -> None:
        self._session.close()

    def _read_once(self) -> bytes:
        with self._session.ignore_warning(*MORE_MAY_COME):
            return bytes(self._session.visalib.read(self._session.session, MAX_READ)[0])

    def _within(self, what: Any) -> bytes:
        try:
            return bytes(what() or b"")
        except self._no_answer as e:
            if "VI_ERROR_TMO" in str(e):
                return b""
            raise OSError(f"VISA: {e}") from e


SOCKET = re.compile(r"TCPIP\d*::(?P<host>[^:]+|\[[\da-fA-F:]+\])::(?P<number>\d{1,5})::SOCKET", re.IGNORECASE)


def visa_opener(library: str, timeout_s: float) -> Any:
    """Return an opener of VISA resources, by a library such as "@py". Raises SettingsError without the extra `visa`.

    `TCPIP::host::number::SOCKET` is a plain connection and opened as one: VISA libraries wait for the end of a line
    however long the other end sends, and drop half an answer."""

    def opened(address: Address) -> TcpPort | VisaPort:
        if plain := SOCKET.fullmatch(address.port):
            return open_tcp(Address(f"{plain['host']}:{plain['number']}"))
        try:
            import pyvisa
        except ImportError as e:
            raise SettingsError(f"this instrument needs pyvisa: {install('visa')}") from e
        try:
            session = pyvisa.ResourceManager(library).open_resource(address.port)
        except (pyvisa.errors.Error, ValueError) as e:
            raise OSError(f"VISA: {e}") from e
        session.timeout = 1000.0 * timeout_s
        return VisaPort(session, pyvisa.errors.VisaIOError)

    return opened
