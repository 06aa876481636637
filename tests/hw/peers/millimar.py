"""A Millimar C1208/C1216/C1240 as pages 31, 58, 60, 67, 69 and 70 of its manual print it.

What the pages leave open is varied: the acknowledgement, how a sign and leading zeros are shown, what an unknown
command gets.
"""

FORMULAS = ("+1", "-1", "+2", "-2", "+1+2", "+1-2", "+2-1", "-1-2")
SHOWN = {"mm": (1e3, 4), "in": (1 / 25.4e-3, 5), "um": (1e6, 1)}
WHOLE = {"mm": 2, "in": 1, "um": 4}
CODES = {"P86,1": "mm", "P86,2": "in", "P86,3": "um"}
SECOND_PROBE_M = 0.31e-3


class MillimarPeer:
    """protocol: "OPTORSD", "OPTORSS" or "M1240". truth: at probe C1 [m]; C2 stands elsewhere. open_points: choices of
    what the manual does not print."""

    byte_s = 11 / 4800
    stream_s = 0.25

    def __init__(self, protocol: str, acknowledgement: str | None = "OK", padded: bool = True, sign: str = "") -> None:
        self.protocol, self.acknowledgement, self.padded, self.sign = protocol, acknowledgement, padded, sign
        self.truth, self.model, self.serial = 0.0, "C1216", "1234/56"
        self.unit, self.formula = "um", "+1"
        self._heard, self._sent = b"", 0.0
        self.switch_on()
        self.panel = {
            "unit mm": lambda: self._to("unit", "mm"),
            "unit in": lambda: self._to("unit", "in"),
            "unit um": lambda: self._to("unit", "um"),
            "menu": lambda: self._to("menu", not self.menu),
            "sending by itself": lambda: self._to("streaming", not self.streaming),
            "panel locked": lambda: self._to("locked", not self.locked),
            "probe away": lambda: self._to("no_probe", not self.no_probe),
        }
        if protocol == "OPTORSD":  # the other protocols have no question for it
            self.panel |= {f"formula {f}": (lambda f=f: self._to("formula", f)) for f in FORMULAS}

    def switch_on(self) -> None:
        """Unit and formula are kept; what was being done is not."""
        self.menu = self.streaming = self.locked = self.no_probe = False
        self._heard = b""

    def _to(self, what: str, value: object) -> None:
        setattr(self, what, value)

    def hear(self, data: bytes) -> list[tuple[float, bytes]]:
        *messages, self._heard = (self._heard + data).split(b"\r")
        if self.menu:  # "no data is sent while the catalogue is open"
            return []
        end = b"\r" if self.protocol == "M1240" else b"\r\n"
        said = [self._said(message.decode("latin-1")) for message in messages]
        return [(0.02, reply.encode("latin-1") + end) for replies in said for reply in replies]

    def alone(self, now: float) -> list[bytes]:
        if not self.streaming or self.menu or now < self._sent + self.stream_s:
            return []
        self._sent = now
        return [self._value().encode("latin-1") + b"\r\n"]

    def _said(self, message: str) -> list[str]:
        if self.protocol == "M1240":
            return self._m1240(message)
        if message == "?":
            return [self._value()]
        if self.protocol == "OPTORSS":
            return []
        printed = {
            "ID?": f"MAHR GMBH,{self.model} ",
            "VER?": "1.03_",
            "UNI?": f"{self.unit} ",
            "SER?": self.serial,
            "CHA?": "".join(f"{c}C" if c in "+-" else c for c in self.formula).removeprefix("+"),
        }
        if message in printed:
            return [printed[message]]
        if message in SHOWN:
            self._set("unit", message)
        elif message.startswith("CHA") and message[3:] in FORMULAS:
            self._set("formula", message[3:])
        else:
            return ["ERR1"]
        return [] if self.acknowledgement is None else [self.acknowledgement]

    def _m1240(self, message: str) -> list[str]:
        if message == "I":
            return [f"I,MAHRGMBH,{self.model},V1.03 "]
        if message == "M":
            return ["ERR5" if self.no_probe else f"M1, {self._number()}"]
        if message in CODES:
            self._set("unit", CODES[message])
            return {None: [], "echo": [message]}.get(self.acknowledgement, [""])
        return []

    def _set(self, what: str, value: str) -> None:
        if not self.locked:
            setattr(self, what, value)

    def _value(self) -> str:
        return "ERR5" if self.no_probe else self._number() + self.unit

    def _number(self) -> str:
        probes = {"1": self.truth, "2": SECOND_PROBE_M}
        signs = zip(self.formula[::2], self.formula[1::2], strict=True)
        scale, decimals = SHOWN[self.unit]
        shown = sum((-1 if sign == "-" else 1) * probes[probe] for sign, probe in signs) * scale
        width = WHOLE[self.unit] + 1 + decimals
        number = f"{abs(shown):0{width}.{decimals}f}" if self.padded else f"{abs(shown):.{decimals}f}"
        sign = "-" if shown < 0 else self.sign
        return f"{sign}{number}" if self.padded else f"{sign}{number}".rjust(width + 1)
