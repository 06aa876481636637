"""An LCR-800 ([LCR800] pages 87-90, 107-110, and what its drivers agree on). Takes LF, LF CR and CR LF as the end of a
message, replies with LF; does not answer unknown messages (assumed)."""

import re
import time
from collections.abc import Callable

from hw.simulated.device import Device, Source

SETTINGS = re.compile(
    r"MAIN:(SPEE:(SLOW|MEDI|FAST)|MODE:(RQ|CD|CR|LQ|LR|ZQ)|CIRC:(SERI|PARA)|TRIG:(AUTO|MANU)|DISP:VALU"
    r"|(R\.H\.|C\.V\.|INTB|EXTB|PPM\.):(OFF\.|ON\.\.)|FREQ \d*\.\d+|VOLT \d*\.\d+)|STEP:AVER [\d.]+|MEMO:STOR [\d.]+"
    r"|SORT:NOMV [+-]?[\d.]+"
)
AUTO_S = 0.3  # s: assumed, between two results that it sends by itself


class Lcr800Device(Device):
    """source: capacitance [F]. dissipation: D."""

    def __init__(self, source: Source, *, dissipation: float = 0.0145, clock: Callable[[], float] = time.monotonic):
        super().__init__(source)
        self.dissipation, self.online, self.secondary_over = dissipation, False, False
        self.settings = {"SPEE": "SPEE:FAST", "MODE": "MODE:RQ", "CIRC": "CIRC:PARA", "FREQ": "FREQ 1.00000"}
        self.settings |= {"VOLT": "VOLT 1.000", "TRIG": "TRIG:AUTO", "INTB": "INTB:OFF.", "EXTB": "EXTB:OFF."}
        self.settings |= {"BIAS": "BIAS:OFF.", "DISP": "DISP:VALU", "R.H.": "R.H.:OFF.", "C.V.": "C.V.:OFF."}
        self.settings |= {"PPM.": "PPM.:OFF.", "STEP:AVER": "STEP:AVER 1.00", "SORT:NOMV": "SORT:NOMV +0.00000"}
        self._asked, self._clock, self._sent = False, clock, 0.0

    def unsolicited(self) -> list[bytes]:
        now = self._clock()
        if self.silent or not self.online or self.settings["TRIG"] != "TRIG:AUTO" or now - self._sent < AUTO_S:
            return []
        self._sent = now
        return self._results()

    def _messages(self) -> list[bytes]:
        lines = [line.strip(b"\r") for line in self._lines(b"\n")]
        return [line for line in lines if line]

    def answer(self, message: bytes) -> list[bytes]:
        text = message.decode("latin-1")
        if text == "COMU?":
            self._asked = True
            return [b"COMU:ON..\n"]
        if text == "COMU:OVER" and self._asked:
            self.online = True
            return [b"COMU:OVER\n"]
        return self._online(text) if self.online else []

    def _online(self, text: str) -> list[bytes]:
        if text == "COMU:OFF.":
            self.online = self._asked = False
            return [b"COMU:OFF.\n"]
        if text == "MAIN:STAR":
            return self._results()
        if text in ("OFFS:OPEN", "OFFS:SHOR"):
            return [f"{text[5:]}:{'FAIL' if self.overrange else 'OK'}\n".encode("ascii")]
        if text in ("STEP:AVER?", "SORT:NOMV?"):
            return [f"{self.settings[text[:-1]]}\n".encode("ascii")]
        if found := re.fullmatch(r"MAIN:([A-Z.]{4})\?", text):
            key = found[1]
            return [f"MAIN:{self.settings[key]}\n".encode("ascii")] if key in self.settings else []
        if not SETTINGS.fullmatch(text):
            return []
        if text.startswith("MAIN:"):
            self.settings[text[5:9]] = text[5:]
        elif text[:9] in self.settings:
            self.settings[text[:9]] = text
        return [text.encode("ascii") + b"\n"]

    def _results(self) -> list[bytes]:
        farads = self.source()
        if self.overrange:
            return [b"PRIM:OVER\n"]
        if farads is None:
            return [b"PRIM:OV01\n"]
        if self.other_unit or self.settings["MODE"] != "MODE:CD":  # the mode was changed: R and Q, blank unit
            return [b"MAIN:PRIM  32.705\n", b"MAIN:SECO  .0045  \n"]
        number, unit = _scaled(farads)
        secondary = (
            f"SECO:OVER {unit}\n" if self.secondary_over else f"MAIN:SECO {_digits(self.dissipation, 4):>6}{unit}\n"
        )
        return [f"MAIN:PRIM {number:>7}\n".encode("ascii"), secondary.encode("ascii")]


def _scaled(farads: float) -> tuple[str, str]:
    for unit, scale in (("pF", 1e12), ("nF", 1e9)):
        if farads * scale < 1000.0:
            return _digits(farads * scale, 5), unit
    return _digits(farads * 1e6, 5), "uF"


def _digits(value: float, count: int) -> str:
    """Return a number in so many digits: `32.705`, `.0045`."""
    for decimals in range(count, -1, -1):
        text = f"{value:.{decimals}f}".removeprefix("0")
        if sum(c.isdigit() for c in text) <= count:
            return text if "." in text else text + "."
    return "9" * count
