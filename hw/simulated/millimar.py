"""A Millimar that speaks OPTORSD or OPTORSS (manual pages 69, 70; blanks before CR as printed there).

Assumed, and a parameter: the acknowledgement `OK`, `ERR1` for an unknown command, `ERR5` without a probe, `ERR3` out of
range, and that the display keeps three decimals in every unit.
"""

import re

from hw.simulated.device import Device, Source

UNITS = {"mm": 1e3, "in": 1 / 25.4e-3, "um": 1e6}
FORMULAS = {f: re.sub(r"([+-])", r"\1C", f) for f in ("+1", "-1", "+2", "-2", "+1+2", "+1-2", "+2-1", "-1-2")}


class OptorsDevice(Device):
    """source: displacement [m]."""

    def __init__(
        self,
        source: Source,
        *,
        model: str = "C1216",
        serial: str = "1234/56",
        unit: str = "mm",
        duplex: bool = True,
        acknowledgement: bytes | None = b"OK",
    ) -> None:
        super().__init__(source)
        self.model, self.serial, self.unit, self.duplex = model, serial, unit, duplex
        self.formula, self.display = "-1-2", ""
        self._acknowledgement = acknowledgement

    def _messages(self) -> list[bytes]:
        return self._lines(b"\r")

    def answer(self, message: bytes) -> list[bytes]:
        if message == b"?":
            return [self._value() + b"\r\n"]
        if not self.duplex:
            return []
        reply = self._question(message)
        if reply is not None:
            return [reply + b"\r\n"]
        if not self._set(message.decode("latin-1")):
            return [b"ERR1\r\n"]
        return [] if self._acknowledgement is None else [self._acknowledgement + b"\r\n"]

    def _value(self) -> bytes:
        if self.overrange:
            return b"ERR3"
        metres = self.source()
        if metres is None:
            return b"ERR5"
        unit = "in" if self.other_unit else self.unit
        return f"{metres * UNITS[unit]:.3f}{unit}".encode("ascii")

    def _question(self, message: bytes) -> bytes | None:
        unit = "in" if self.other_unit else self.unit
        known = {
            b"ID?": f"MAHR GMBH,{self.model} ",
            b"VER?": "1.02 ",
            b"UNI?": f"{unit} ",
            b"SER?": self.serial,
            b"CHA?": FORMULAS[self.formula],
        }
        return known[message].encode("ascii") if message in known else None

    def _set(self, message: str) -> bool:
        if message in UNITS:
            self.unit, self.other_unit = message, False
        elif message.removeprefix("CHA") in FORMULAS and message.startswith("CHA"):
            self.formula = message.removeprefix("CHA")
        elif re.fullmatch(r"DIS .{0,7}", message):
            self.display = message.removeprefix("DIS ")
        else:
            return False
        return True
