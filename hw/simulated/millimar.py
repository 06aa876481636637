"""A Millimar: its display, and its answers by OPTORSD, OPTORSS or M1240 ([MILLIMAR] pages 67 to 70; blanks as printed).

Assumed, and a parameter: the acknowledgement `OK`, `ERR1` for an unknown command, `ERR5` without a probe, `ERR3` out of
range, and that the display has steps of 0.1 um, 0.0001 mm or 0.00001 inch; by M1240 that `P86` is answered by CR."""

import re
from abc import abstractmethod

from hw.simulated.device import Device, Source

UNITS = {"mm": 1e3, "in": 1 / 25.4e-3, "um": 1e6}
DECIMALS = {"mm": 4, "in": 5, "um": 1}  # one resolution, as a display of 0.1 um has it
FORMULAS = {f: re.sub(r"([+-])", r"\1C", f) for f in ("+1", "-1", "+2", "-2", "+1+2", "+1-2", "+2-1", "-1-2")}


class MillimarDevice(Device):
    """source: displacement [m]. unit: of its display, until it is changed at the instrument."""

    def __init__(self, source: Source, model: str, unit: str) -> None:
        super().__init__(source)
        self.model, self.unit = model, unit

    @property
    def shown_unit(self) -> str:
        return "in" if self.other_unit else self.unit

    def set_unit(self, unit: str) -> None:
        self.unit, self.other_unit = unit, False

    def _messages(self) -> list[bytes]:
        return self._lines(b"\r")

    def _value(self) -> bytes:
        if self.overrange:
            return b"ERR3"
        metres = self.source()
        if metres is None:
            return b"ERR5"
        number = f"{metres * UNITS[self.shown_unit]:.{DECIMALS[self.shown_unit]}f}"
        return self._of_number(number).encode("ascii")

    @abstractmethod
    def _of_number(self, number: str) -> str:
        """Return the reply that holds a number."""


class OptorsDevice(MillimarDevice):
    """duplex: OPTORSD, else OPTORSS."""

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
        super().__init__(source, model, unit)
        self.serial, self.duplex = serial, duplex
        self.formula, self.display = "-1-2", ""
        self._acknowledgement = acknowledgement

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

    def _of_number(self, number: str) -> str:
        return number + self.shown_unit

    def _question(self, message: bytes) -> bytes | None:
        answers = {
            b"ID?": f"MAHR GMBH,{self.model} ",
            b"VER?": "1.02 ",
            b"UNI?": f"{self.shown_unit} ",
            b"SER?": self.serial,
            b"CHA?": FORMULAS[self.formula],
        }
        return answers[message].encode("ascii") if message in answers else None

    def _set(self, message: str) -> bool:
        if message in UNITS:
            self.set_unit(message)
        elif message.removeprefix("CHA") in FORMULAS and message.startswith("CHA"):
            self.formula = message.removeprefix("CHA")
        elif re.fullmatch(r"DIS .{0,7}", message):
            self.display = message.removeprefix("DIS ")
        else:
            return False
        return True


CODES = {b"P86,1": "mm", b"P86,2": "in", b"P86,3": "um"}


class M1240Device(MillimarDevice):
    """stored: values for M70, which deletes them. mastering: after Z, silent until its key is pressed."""

    def __init__(
        self,
        source: Source,
        *,
        model: str = "C1216",
        unit: str = "mm",
        acknowledgement: str = "cr",
        stored: tuple[float, ...] = (),
    ) -> None:
        super().__init__(source, model, unit)
        self.stored = list(stored)
        self.mastering = self.running = False
        self._acknowledgement = acknowledgement

    def press_key(self) -> None:
        self.mastering = False

    def answer(self, message: bytes) -> list[bytes]:
        if self.mastering:
            return []
        return [reply + b"\r" for reply in self._replies(message)]

    def _replies(self, message: bytes) -> list[bytes]:
        if message == b"I":
            return [f"I,MAHRGMBH,{self.model},V1.02".encode("ascii")]
        if message in CODES:
            self.set_unit(CODES[message])
            return {"cr": [b""], "echo": [message], "none": []}[self._acknowledgement]
        if message == b"M":
            return [self._value()]
        if message == b"M70":
            values, self.stored = self.stored, []
            return [f"{1:05d}, {v * UNITS[self.unit]:.3f}".encode("ascii") for v in values]
        if message in (b"F1", b"F2", b"F3", b"R", b"Z"):
            self.running = message in (b"F1", b"F2")
            self.mastering = message == b"Z"
            return [message]
        return [b"ERR1"]

    def _of_number(self, number: str) -> str:
        return f"M1, {number}"
