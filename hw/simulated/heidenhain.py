"""An ND 287 or ND 281B ([ND287] pages 102-115; [ND281B] pages 39-62). Assumed: words of identification and errors."""

from hw.simulated.device import Device, Source

STX, ENQ, ACK, DC1, DC3, NAK, ESC = 0x02, 0x05, 0x06, 0x11, 0x13, 0x15, 0x1B
UNITS = {" ": 1e3, '"': 1 / 25.4e-3}
KNOWN = {b"F0000", b"F0100", b"S0000", b"S0001", b"S0002", b"T0100", b"T0101", b"T0102", b"T0103"}
KNOWN |= {f"T000{d}".encode("ascii") for d in range(10)}


class HeidenhainDevice(Device):
    """source: position of the probe [m]. blank_lines: sent after each value, as its parameter sets."""

    def __init__(self, source: Source, *, model: str = "ND-287", unit: str = " ", blank_lines: int = 0) -> None:
        super().__init__(source)
        self.model, self.unit, self.blank_lines = model, unit, blank_lines
        self.series, self._held, self._held_back = "A", False, list[bytes]()

    def _messages(self) -> list[bytes]:
        """Return the finished messages: a single control byte, or ESC up to CR."""
        found = []
        while self._buffer:
            if self._buffer[0] != ESC:
                found.append(bytes([self._buffer.pop(0)]))
                continue
            end = self._buffer.find(b"\r")
            if end < 0:
                break
            found.append(bytes(self._buffer[:end]))
            del self._buffer[: end + 1]
        return found

    def answer(self, message: bytes) -> list[bytes]:
        if message[0] == DC3:
            self._held = True
            return []
        if message[0] == DC1:
            self._held, released = False, self._held_back
            self._held_back = []
            return released
        replies = self._replies(message)
        if self._held:
            self._held_back += replies
            return []
        return replies

    def _replies(self, message: bytes) -> list[bytes]:
        if message[0] == STX:
            return [self._frame() + b"\r\n" * (1 + self.blank_lines)]
        if message[0] == ENQ:
            return [self._error() + b"\r\n"]
        return self._escape(message[1:]) if message[0] == ESC else []

    def _escape(self, code: bytes) -> list[bytes]:
        if code == b"A0000":
            lines = (f"{self.model:<10}", f"{'349797-01':<10}", f"{'ID 0001':<10}")
            return [bytes([STX]) + "".join(f"{line}\r\n" for line in lines).encode("ascii")]
        metres = self.source() or 0.0
        texts = {
            b"A0100": self._frame()[:13].strip(),
            b"A0200": f"{'-' if metres < 0 else '+'}{round(abs(metres) * 1e7):09d}".encode("ascii"),
            b"A0301": self._error(),
            b"A0400": b"349797-01",
            b"A0800": b"MM",
            b"A0900": b"0",
        }
        if code in texts:
            return [bytes([STX]) + texts[code] + b"\r\n"]
        if code == b"F0200":
            return [bytes([ACK]), self._frame() + b"\r\n"]
        return [bytes([ACK if code in KNOWN else NAK])]

    def _error(self) -> bytes:
        return b"SIGNAL TOO SMALL" if self.overrange else b"NO ERROR"

    def _frame(self) -> bytes:
        metres = self.source()
        if self.overrange or metres is None:
            return f"+{'0.0000':>10} ?={self.series}".encode("ascii")
        unit = '"' if self.other_unit else self.unit
        number = f"{abs(metres) * UNITS[unit]:.4f}" if unit == " " else f"{abs(metres) * UNITS[unit]:.6f}"
        return f"{'-' if metres < 0 else '+'}{number:>10} {unit}={self.series}".encode("ascii")
