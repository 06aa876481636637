"""Heidenhain ND 287 by its manual, pages 102 to 115, and ND 281B, pages 39 to 62."""

from collections.abc import Callable, Sequence

from tests.hw.apart.wires import Answers, Peer, set_to

STX, ESC, ACK, NAK, ENQ = b"\x02", b"\x1b", b"\x06", b"\x15", b"\x05"


class Readout(Peer):
    """Ctrl-B latches and sends 17 characters; ESC sequences ask and set."""

    ends = b"\r"
    skipped = b"\n"

    def __init__(self) -> None:
        super().__init__()
        self.name, self.unit, self.sorting, self.status = b"ND-287", b" ", b" ", b" "
        self.decimals, self.datum, self.scaling = 5, 0.0, 1.0
        self.held: float | None = None

    def hear(self, data: bytes) -> Answers:
        """Ctrl-B and the other control characters stand alone; the rest ends with CR."""
        answers: Answers = []
        for byte in data:
            one = bytes([byte])
            if one == STX and not self._heard:
                answers += [] if self.silent else [(0.02, self.unasked())]
            elif one == ENQ and not self._heard:
                answers += [] if self.silent else [(0.0, STX + b"NO ERROR\r\n")]
            elif one in b"\x11\x13\n" and not self._heard:
                continue
            else:
                answers += super().hear(one)
        return answers

    def length(self) -> float:
        """Return what the display stands for, in metres."""
        return self.held if self.held is not None else self.scaling * (self.truth - self.datum)

    def unasked(self) -> bytes:
        if self.refuses:
            return self.refuses + b"\r\n"
        value = self.length() / (25.4e-3 if self.unit == b'"' else 1e-3)
        number = f"{abs(value):10.{self.decimals}f}".encode()
        sign = b"-" if value < 0 else b"+"
        return sign + number + b" " + self.unit + self.sorting + self.status + b"\r\n"

    def answer(self, message: bytes) -> Sequence[bytes]:
        if not message.startswith(ESC):
            return []
        word = message[1:]
        if word == b"A0000":
            lines = (self.name, b"349797-01", b"V1.03")
            return [STX + b"".join(line.ljust(10) + b"\r\n" for line in lines)]
        if word == b"A0400":
            return [STX + b"349797-01 \r\n"]
        if word == b"A0301":
            return [STX + b"\r\n"]
        if word[:1] in b"TFS" and len(word) == 5:
            return [ACK] + ([self.unasked()] if word == b"F0200" else [])
        return [NAK]

    def reset(self) -> None:
        """Set the datum here, as CL and ENT do."""
        self.datum = self.truth

    def hold(self) -> None:
        """Hold the display."""
        self.held = self.length()

    def panel(self) -> dict[str, Callable[[], None]]:
        units = {f"unit {u.decode()}": set_to(self, unit=u) for u in (b'"', b"?", b"G", b"M", b"R", b"m", b"U")}
        series = {f"series {c}": set_to(self, status=c.encode()) for c in "SGD"}
        axes = {f"axis {c}": set_to(self, status=c.encode()) for c in "12F"}
        digits = {f"{n} decimals": set_to(self, decimals=n) for n in (1, 2, 6)}
        errors = {
            "gauge fault": set_to(self, refuses=b"+      ----   ?  "),
            "overflow": set_to(self, refuses=b"OVERFLOW"),
        }
        other = {
            "menu open": set_to(self, silent=True),
            "sends by itself": set_to(self, streams=True),
            "another readout": set_to(self, name=b"ND-281B"),
        }
        return units | series | axes | digits | errors | other

    def untold(self) -> dict[str, Callable[[], None]]:
        return {"scaling 2": set_to(self, scaling=2.0), "display held": self.hold, "datum set": self.reset}
