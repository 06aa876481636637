"""An ND 287 as pages 102, 108 and 115 of its operating instructions print it; an ND 281B as its pages 39 to 62."""

IDENTIFICATION = {"ND-287": ("ND-287", "344996-02", "246271-06"), "ND-281B": ("ND-281B", "349797-01", "246271-06")}
UNITS = {"mm": (" ", 1e3), "in": ('"', 1 / 25.4e-3)}
X2_M = 0.2e-3


class HeidenhainPeer:
    """truth: at X1 [m]. axes: encoder inputs; refuses: answers A0000 by NAK; blank_lines: after each value."""

    byte_s = 11 / 9600

    def __init__(self, model: str = "ND-287", axes: int = 1, refuses: bool = False, blank_lines: int = 0) -> None:
        self.model, self.axes, self.refuses, self.blank_lines = model, axes, refuses, blank_lines
        self.truth, self.unit, self.decimals = 0.0, "mm", 4
        self.axis = "1" if axes == 2 else "A"
        self.switch_on()
        self.panel = {
            "unit in": lambda: self._to("unit", "in"),
            "unit mm": lambda: self._to("unit", "mm"),
            "resolution 10 um": lambda: self._to("decimals", 2),
            "resolution 0.1 um": lambda: self._to("decimals", 4),
            "series MIN": lambda: self._to("series", "S"),
            "series MAX": lambda: self._to("series", "G"),
            "series DIFF": lambda: self._to("series", "D"),
            "series off": lambda: self._to("series", ""),
            "gauge fault": lambda: self._to("fault", not self.fault),
            "menu": lambda: self._to("menu", not self.menu),
        }
        if axes == 2:
            self.panel |= {f"display {a}": (lambda a=a: self._to("axis", a)) for a in "12ASF"}

    def switch_on(self) -> None:
        self.series, self.fault, self.menu, self._heard = "", False, False, b""

    def _to(self, what: str, value: object) -> None:
        setattr(self, what, value)

    def hear(self, data: bytes) -> list[tuple[float, bytes]]:
        if self.menu:
            return []
        replies, self._heard = [], self._heard + data
        while self._heard:
            if self._heard[:1] == b"\x1b":
                command, end, rest = self._heard[1:].partition(b"\r")
                if not end:
                    break
                self._heard = rest
                replies.append((0.02, self._escape(command)))
            else:
                if self._heard[:1] == b"\x02":
                    replies.append((0.05, self._value() + b"\r\n" * (1 + self.blank_lines)))
                self._heard = self._heard[1:]
        return replies

    def alone(self, now: float) -> list[bytes]:
        return []

    def _escape(self, command: bytes) -> bytes:
        if command == b"A0000" and not self.refuses:
            return b"\x02" + b"".join(f"{line:<10}\r\n".encode() for line in IDENTIFICATION[self.model])
        return b"\x15"

    def _value(self) -> bytes:
        symbol, scale = UNITS[self.unit]
        shown = {"1": self.truth, "2": X2_M, "A": self.truth + X2_M * (self.axes == 2), "S": self.truth - X2_M}
        extremes = {"S": -0.9e-3, "G": 0.9e-3, "D": 1.8e-3, "": shown.get(self.axis, 0.0)}
        decimals = self.decimals + 2 if self.unit == "in" else self.decimals
        number = extremes[self.series] * scale
        unit = "?" if self.fault else symbol
        frame = f"{'-' if number < 0 else '+'}{abs(number):10.{decimals}f} {unit}={self.series or self.axis}"
        return frame.encode("ascii")
