"""An LCR-800 as pages 87 to 90 and 107 to 110 of its manual print it, and what its drivers agree on (COMU, echoes).

Every key of its panel works at any moment. A positive number is written with a blank in the place of its sign (page
89), in settings that are echoed too.
"""

import re

TAKES_S = {"SLOW": 0.9, "MEDI": 0.4, "FAST": 0.25}
POWER_ON = {
    "SPEE": "SLOW", "DISP": "VALU", "MODE": "CD", "CIRC": "SERI", "TRIG": "AUTO", "R.H.": "OFF.", "C.V.": "OFF.",
    "PPM.": "OFF.", "INTB": "OFF.", "EXTB": "OFF.", "FREQ": "1.00000", "VOLT": "1.000",
}  # fmt: skip
CHOICES = {
    "SPEE": ("SLOW", "MEDI", "FAST"), "DISP": ("VALU", "DELT", "DELP"), "MODE": ("RQ", "CD", "CR", "LQ", "LR", "ZQ"),
    "CIRC": ("SERI", "PARA"), "TRIG": ("AUTO", "MANU"),
    **dict.fromkeys(("R.H.", "C.V.", "PPM.", "INTB", "EXTB"), ("OFF.", "ON..")),
}  # fmt: skip
NOMINAL_F = 4e-6
D = 0.0145


class Lcr800Peer:
    """truth: series capacitance [F] at 1 kHz and 1 V. blank: before positive numbers that it writes."""

    byte_s = 10 / 38400

    def __init__(self, blank: bool = True) -> None:
        self.truth, self.blank, self._sent = 0.0, " " if blank else "", 0.0
        self.switch_on()
        self.panel = {
            f"{key} {choice}": (lambda key=key, choice=choice: self.set.update({key: choice}))
            for key, choices in CHOICES.items()
            for choice in choices
        }
        self.panel |= {f"FREQ {f}": (lambda f=f: self.set.update(FREQ=f)) for f in ("0.12000", "10.0000")}
        self.panel |= {f"VOLT {v}": (lambda v=v: self.set.update(VOLT=v)) for v in ("0.005", "0.100")}

    def switch_on(self) -> None:
        """As delivered, not connected."""
        self.set, self.asked, self.online, self._heard = dict(POWER_ON), False, False, b""

    def hear(self, data: bytes) -> list[tuple[float, bytes]]:
        *messages, self._heard = (self._heard + data).split(b"\n")
        replies = []
        for message in messages:
            replies += self._said(message.strip(b"\r").decode("latin-1"))
        return replies

    def alone(self, now: float) -> list[bytes]:
        if not self.online or self.set["TRIG"] != "AUTO" or now < self._sent + TAKES_S[self.set["SPEE"]]:
            return []
        self._sent = now
        return self._results()

    def _said(self, message: str) -> list[tuple[float, bytes]]:
        if message == "COMU?":
            self.asked = True
            return [(0.02, b"COMU:ON..\n")]
        if message == "COMU:OVER" and self.asked:
            self.online = True
        if not self.online:
            return []
        if message == "MAIN:STAR":
            first, *rest = self._results()
            return [(TAKES_S[self.set["SPEE"]], first), *((0.0, line) for line in rest)]
        if message == "COMU:OFF.":
            self.online = self.asked = False
        elif found := re.fullmatch(r"MAIN:([A-Z.]{4})\?", message):
            return [(0.02, f"{self._told(found[1])}\n".encode("ascii"))] if found[1] in self.set else []
        elif found := re.fullmatch(r"MAIN:(FREQ|VOLT) +([\d.]+)", message):
            self.set[found[1]] = found[2]
            message = self._told(found[1])
        elif found := re.fullmatch(r"MAIN:([A-Z.]{4}):(\S+)", message):
            if found[2] not in CHOICES.get(found[1], ()):
                return []
            self.set[found[1]] = found[2]
        elif message != "COMU:OVER":
            return []
        return [(0.02, f"{message}\n".encode("ascii"))]

    def _told(self, key: str) -> str:
        number = key in ("FREQ", "VOLT")
        return f"MAIN:{key} {self.blank}{self.set[key]}" if number else f"MAIN:{key}:{self.set[key]}"

    def _shown_F(self) -> float:
        """Less at a higher frequency and at a small level, as a stack has it."""
        farads = self.truth * (1.0 - 0.01 * (float(self.set["FREQ"]) - 1.0) / 9.0)
        farads *= {"1.000": 1.0, "0.100": 0.999}.get(self.set["VOLT"], 0.9975)
        if self.set["CIRC"] == "PARA":
            farads /= 1.0 + D**2
        if self.set["INTB"] == "ON.." or self.set["EXTB"] == "ON..":
            farads *= 1.06
        return farads

    def _results(self) -> list[bytes]:
        farads = self._shown_F()
        if self.set["R.H."] == "ON..":
            farads *= 1.004  # in a range that does not fit
        if self.set["MODE"] == "RQ":
            return [b"MAIN:PRIM  32.705\n", b"MAIN:SECO  .0145  \n"]
        if self.set["MODE"] in ("LQ", "LR", "ZQ"):
            return [b"PRIM:OV01\n"]
        if self.set["DISP"] == "DELP":
            return [f"MAIN:PRIM {digits(100 * (farads / NOMINAL_F - 1), 5):>7}\n".encode(), b"MAIN:SECO  .0145uF\n"]
        if self.set["DISP"] == "DELT":
            farads -= NOMINAL_F
        seconds = {"CD": " .0145", "CR": ".00045"}[self.set["MODE"]]
        number, unit = digits(farads * 1e6, 5), "uF"
        if abs(farads) < 1e-6:
            number, unit = digits(farads * 1e9, 5), "nF"
        more = "k " if self.set["MODE"] == "CR" else ""
        return [f"MAIN:PRIM {number:>7}\n".encode(), f"MAIN:SECO {seconds}{unit}{more}\n".encode()]


def digits(value: float, count: int) -> str:
    """So many digits and a point, without a zero before it."""
    for decimals in range(count, -1, -1):
        text = f"{abs(value):.{decimals}f}".removeprefix("0")
        if sum(c.isdigit() for c in text) <= count:
            break
    return ("-" if value < 0 else "") + (text if "." in text else text + ".")
