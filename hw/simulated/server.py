"""A simulated instrument on a pseudo-terminal, in a thread of its own.

`path` is a link that stays the same when the line is cut and back, as /dev/serial/by-id does. A pseudo-terminal keeps
neither parity nor word length and does not pace bytes, so wrong line settings appear as damaged bytes, and pacing is
done here."""

import os
import random
import select
import threading
import time
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from hw.errors import SettingsError
from hw.simulated.device import Device


class FaultKind(StrEnum):
    """The kinds of fault on a line."""

    UNPLUG = "unplug"  # the line is cut in the middle of a reply and is back after `seconds`
    GARBAGE = "garbage"  # bytes of a reply replaced, lost or added
    HALF_LINE = "half_line"  # the rest of a reply never comes
    SLOW = "slow"  # `seconds` between the bytes of a reply
    ECHO_LOST = "echo_lost"  # a whole reply is lost
    LATE = "late"  # a whole reply comes `seconds` late
    WRONG_UNIT = "wrong_unit"  # the unit or the mode was changed at the instrument
    OVERRANGE = "overrange"
    MENU_OPEN = "menu_open"  # it says nothing
    SWAPPED = "swapped"  # another instrument is on this line


OF_THE_LINE = {
    FaultKind.UNPLUG, FaultKind.GARBAGE, FaultKind.HALF_LINE, FaultKind.SLOW, FaultKind.ECHO_LOST, FaultKind.LATE,
}  # fmt: skip


@dataclass(frozen=True)
class LineFault:
    """A fault of the line. after: replies before it strikes. at: position in the reply. seconds: duration, for some
    kinds. seed: of the damage."""

    kind: FaultKind
    after: int = 0
    at: int = 0
    seconds: float = 0.2
    seed: int = 0


def damaged(reply: bytes, fault: LineFault) -> bytes:
    """Return a reply with one to four bytes replaced, removed or added anywhere, also digits by digits."""
    rng = random.Random(fault.seed)
    data = bytearray(reply)
    for _ in range(rng.randint(1, 4)):
        where = rng.randrange(len(data)) if data else 0
        byte = rng.choice((rng.randrange(256), rng.choice(b"0123456789.-+ \r\n")))
        how = rng.choice(("replace", "remove", "add"))
        if how == "add" or not data:
            data.insert(where, byte)
        elif how == "remove":
            del data[where]
        else:
            data[where] = byte
    return bytes(data)


try:
    import pty
    import termios
    import tty
except ImportError:  # Windows has no pseudo-terminals
    TERMINALS = False
else:
    TERMINALS = True

LOOK_S = 0.02  # how often a silent line is looked at


class Server:
    """Runs a device behind `path`; a context manager. byte_s: time that one byte takes on the line [s]."""

    def __init__(self, device: Device, path: Path, byte_s: float = 0.0) -> None:
        self.device, self.path, self.byte_s = device, path, byte_s
        self._faults: list[LineFault] = []
        self._lock = threading.Lock()
        self._stop, self._calm = threading.Event(), threading.Event()
        self._master = self._slave = -1
        self._thread = threading.Thread(target=self._run, name=f"simulated {path.name}", daemon=True)

    def __enter__(self) -> "Server":
        if not TERMINALS:
            raise SettingsError("simulated instruments need pseudo-terminals, which this system does not have")
        self._plug()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._calm.set()
        self._thread.join(timeout=10.0)
        self._unplug()

    def inject(self, fault: LineFault) -> None:
        """Let a fault strike. `SWAPPED` needs two servers: `swap_with`."""
        self._calm.clear()
        if fault.kind in OF_THE_LINE:
            with self._lock:
                self._faults.append(fault)
        elif fault.kind is FaultKind.MENU_OPEN:
            self.device.silent = True
        elif fault.kind is FaultKind.OVERRANGE:
            self.device.overrange = True
        elif fault.kind is FaultKind.WRONG_UNIT:
            self.device.other_unit = True
        else:
            raise ValueError(f"{fault.kind} needs two servers: a.swap_with(b)")

    def swap_with(self, other: "Server") -> None:
        """Put each instrument on the other's line."""
        self.device, other.device = other.device, self.device

    def clear(self) -> None:
        """End all faults, including those under way: bytes that they held back are sent at once."""
        with self._lock:
            self._faults.clear()
        self._calm.set()
        self.device.silent = self.device.overrange = self.device.other_unit = False

    def _run(self) -> None:
        while not self._stop.is_set():
            ready, _, _ = select.select([self._master], [], [], LOOK_S)
            try:
                self._stay_settable()
                replies = self.device.feed(os.read(self._master, 4096)) if ready else self.device.unsolicited()
                for reply in replies:
                    self._reply(reply)
            except OSError:  # the line was cut under our hands: as an instrument, carry on without it
                self.device.unplugged()

    def _stay_settable(self) -> None:
        """Keep the line settable: a pseudo-terminal takes no parity, and a call that changes only that is an error. Its
        speed is kept at another value, so that every call changes something."""
        attributes = termios.tcgetattr(self._slave)
        if attributes[4] != termios.B50:
            attributes[4] = attributes[5] = termios.B50
            termios.tcsetattr(self._slave, termios.TCSANOW, attributes)

    def _reply(self, reply: bytes) -> None:
        """Send a reply as a fault changes it; an `ECHO_LOST` sends nothing."""
        fault = self._due()
        first = fault.at % max(1, len(reply)) if fault else 0
        match fault.kind if fault else None:
            case None:
                self._send(reply)
            case FaultKind.GARBAGE if fault:
                self._send(damaged(reply, fault))
            case FaultKind.HALF_LINE:
                self._send(reply[:first])
            case FaultKind.SLOW if fault:
                for byte in reply:
                    os.write(self._master, bytes([byte]))
                    self._calm.wait(fault.seconds)
            case FaultKind.LATE if fault:
                self._calm.wait(fault.seconds)
                self._send(reply)
            case FaultKind.UNPLUG if fault:
                self._cut(reply[:first], fault.seconds)

    def _due(self) -> LineFault | None:
        """Return the fault that strikes this reply; the others come one reply nearer."""
        with self._lock:
            due = next((f for f in self._faults if f.after <= 0), None)
            if due is not None:
                self._faults.remove(due)
            self._faults = [LineFault(f.kind, f.after - 1, f.at, f.seconds, f.seed) for f in self._faults]
        return due

    def _send(self, data: bytes) -> None:
        if self.byte_s <= 0:
            os.write(self._master, data)
            return
        for byte in data:
            os.write(self._master, bytes([byte]))
            self._stop.wait(self.byte_s)

    def _cut(self, first: bytes, seconds: float) -> None:
        self._send(first)
        time.sleep(0.005)  # so that the first bytes are read before the line is gone, now and then
        self._unplug()
        self.device.unplugged()
        self._calm.wait(seconds)
        self._plug()

    def _plug(self) -> None:
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)  # no echo, no translation of CR and LF, before anybody opens it
        new = self.path.with_name(self.path.name + ".new")
        new.unlink(missing_ok=True)
        new.symlink_to(os.ttyname(self._slave))
        new.replace(self.path)

    def _unplug(self) -> None:
        self.path.unlink(missing_ok=True)
        for handle in (self._slave, self._master):
            if handle >= 0:
                os.close(handle)
        self._master = self._slave = -1
