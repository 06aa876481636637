"""Agilent E4980A by its user's guide (SCPI commands in their long and short form, pages DISPlay to TRIGger)."""

from collections.abc import Callable, Sequence

from tests.hw.apart.wires import Peer, set_to

# What can be set and asked, by its long form; digits in a node stay as they are.
SETTINGS = {
    "AMPLitude:ALC": "0", "APERture": "MED,1", "BIAS:STATe": "0", "COMParator:STATe": "0", "CORRection:LENGth": "1",
    "CORRection:OPEN:STATe": "1", "CORRection:SHORt:STATe": "1", "CORRection:LOAD:STATe": "0",
    "CORRection:METHod": "SING", "DISPlay:PAGE": "MEAS", "DISPlay:ENABle": "1", "FORMat:DATA": "ASC",
    "FREQuency:CW": "1000", "FUNCtion:IMPedance:TYPE": "CSD", "FUNCtion:IMPedance:RANGe:AUTO": "1",
    "FUNCtion:DEV1:MODE": "OFF", "FUNCtion:DEV2:MODE": "OFF", "FUNCtion:SMONitor:VAC:STATe": "0",
    "INITiate:CONTinuous": "1", "LIST:MODE": "SEQ", "TRIGger:SOURce": "INT", "TRIGger:DELay": "0",
    "VOLTage:LEVel": "1", "BIAS:VOLTage:LEVel": "0", "FORMat:ASCii:LONG": "0",
}  # fmt: skip
OPTIONAL = {"CW", "LEVel", "TYPE", "DATA", "IMMediate", "IMPedance:FORMatted"}
ON_OFF = {"ON": "1", "OFF": "0"}


def _fits(said: str, long: str) -> bool:
    """Return whether a node is the long or the short form of another."""
    short = "".join(c for c in long if not c.islower())
    return said.upper() in (short.upper(), long.upper())


def _find(path: str) -> str | None:
    """Return the setting that a path means, optional nodes left out or not."""
    said = path.lstrip(":").split(":")
    for name in SETTINGS:
        nodes = name.split(":")
        forms = [nodes]
        last_optional = nodes[-1] in OPTIONAL or (nodes[-1] == "STATe" and nodes[0] in ("COMParator",))
        if last_optional:
            forms.append(nodes[:-1])
        if any(len(said) == len(f) and all(map(_fits, said, f)) for f in forms):
            return name
    return None


class E4980A(Peer):
    """A capacitor of `truth` farad, D 0.0145."""

    ends = b"\n"
    skipped = b"\r"

    def __init__(self) -> None:
        super().__init__()
        self.set = dict(SETTINGS)
        self.serial, self.loss, self.errors = "MY46200000", 0.0145, [""]
        self.errors.clear()
        self.status, self.overload = 0, False
        self.latest: float | None = None
        self.scale = 1.0

    def power_cycle(self) -> None:
        super().power_cycle()
        self.set = dict(SETTINGS)
        self.latest = None

    def measure(self) -> None:
        """Take a measurement now."""
        self.latest = self.truth * self.scale

    def fetch(self) -> bytes:
        """Return the latest result, in the fields that page and comparator give it."""
        if self.refuses:
            return self.refuses + b"\n"
        if self.latest is None:
            self.measure()
        farad, second = self.latest or 0.0, self.loss
        kind = self.set["FUNCtion:IMPedance:TYPE"]
        if kind == "CPD":
            farad /= 1 + self.loss**2
        if abs(float(self.set["FREQuency:CW"]) - 1000) > 1 or self.set["DISPlay:PAGE"] == "LIST":
            farad *= 1.02
        if self.set["FUNCtion:DEV1:MODE"] == "PERC":
            farad = 3.0
        elif self.set["FUNCtion:DEV1:MODE"] == "ABS":
            farad -= 1e-6
        if self.overload:
            return b"+9.90000E+37,+9.90000E+37,%+d\n" % self.status
        if self.set["FORMat:DATA"] != "ASC":
            return b"#216\x3e\xe5\x3e\x2d\x62\x38\xda\x3c\x3f\x8d\xb2\x2d\x0e\x56\x04\x19\n"
        fields = [f"{farad:+.5E}", f"{second:+.5E}", f"{self.status:+d}"]
        if self.set["DISPlay:PAGE"] == "LIST" or self.set["COMParator:STATe"] == "1":
            fields.append("+0")
        return ",".join(fields).encode() + b"\n"

    def unasked(self) -> bytes:
        return self.fetch()

    def answer(self, message: bytes) -> Sequence[bytes]:
        replies = [r for one in message.decode("latin-1").split(";") if (r := self.one(one.strip())) is not None]
        if not replies:
            return []
        return [b";".join(r.rstrip(b"\n") for r in replies) + b"\n"]

    def one(self, word: str) -> bytes | None:
        """Return the reply to one command, None if it has none."""
        path, _, value = word.partition(" ")
        upper = path.upper().lstrip(":")
        fixed = {
            "*IDN?": f"Agilent Technologies,E4980A,{self.serial},A.02.20",
            "*OPC?": "1", "*ESR?": "0", "*STB?": "0", "*OPT?": "001",
        }  # fmt: skip
        if upper in fixed:
            return fixed[upper].encode() + b"\n"
        if upper in ("SYST:ERR?", "SYSTEM:ERROR?", "SYST:ERR:NEXT?"):
            return (self.errors.pop(0) if self.errors else '+0,"No error"').encode() + b"\n"
        if upper == "*CLS":
            self.errors.clear()
            return None
        if upper in ("ABOR", "ABORT", "*WAI", "*OPC") or not upper:
            return None
        if upper in ("*TRG", "TRIG", "TRIGGER", "TRIG:IMM", "TRIGGER:IMMEDIATE", "INIT", "INIT:IMM", "INITIATE"):
            armed = self.set["INITiate:CONTinuous"] == "1"
            if (armed and self.set["TRIGger:SOURce"] in ("BUS", "HOLD")) or upper.startswith("INIT"):
                self.measure()
                return self.fetch() if upper == "*TRG" else None
            self.errors.append('-211,"Trigger ignored"')
            return None
        if upper.startswith(("FETC", "READ")):
            if self.set["TRIGger:SOURce"] == "INT" and self.set["INITiate:CONTinuous"] == "1":
                self.measure()
            return self.fetch()
        name = _find(path.rstrip("?"))
        if name is None:
            self.errors.append('-113,"Undefined header"')
            return None
        if path.endswith("?"):
            return self.stated(name).encode() + b"\n"
        switch = SETTINGS[name] in ("0", "1")
        value = ON_OFF.get(value.strip().upper(), value.strip()) if switch else value.strip()
        self.set[name] = value
        return None

    def stated(self, name: str) -> str:
        """Return a setting in the form in which the meter states it."""
        value = self.set[name]
        if name in ("FREQuency:CW", "VOLTage:LEVel", "TRIGger:DELay", "BIAS:VOLTage:LEVel"):
            return f"{float(value.upper().removesuffix('HZ').removesuffix('V')):+.5E}"
        if name == "APERture":
            speed, _, average = value.partition(",")
            return f"{speed.upper()[:4]},{int(float(average or 1)):+d}"
        if name == "CORRection:LENGth":
            return f"{int(float(value.upper().removesuffix('M'))):+d}"
        short = {"MEASUREMENT": "MEAS", "ASCII": "ASC", "INTERNAL": "INT", "EXTERNAL": "EXT"}
        return short.get(value.upper(), value.upper())

    def press(self, name: str, value: str) -> Callable[[], None]:
        """Return a press of a key of the panel, or what another program sends."""

        def act() -> None:
            self.set[name] = value

        return act

    def panel(self) -> dict[str, Callable[[], None]]:
        pressed = {
            "DISPlay:PAGE": ("LIST", "BNUM", "CORR"), "INITiate:CONTinuous": ("0",),
            "TRIGger:SOURce": ("INT", "EXT", "HOLD"), "FORMat:DATA": ("REAL",), "AMPLitude:ALC": ("1",),
            "FUNCtion:IMPedance:TYPE": ("CPD", "CPQ", "CSRS", "LSRS", "ZTD"),
            "FUNCtion:IMPedance:RANGe:AUTO": ("0",), "FUNCtion:DEV1:MODE": ("ABS", "PERC"),
            "FREQuency:CW": ("120", "100000"), "VOLTage:LEVel": ("0.01",), "BIAS:STATe": ("1",),
            "COMParator:STATe": ("1",), "CORRection:LENGth": ("4",), "CORRection:OPEN:STATe": ("0",),
            "CORRection:SHORt:STATe": ("0",), "APERture": ("SHOR,1",),
        }  # fmt: skip
        keys = {f"{n} {v}": self.press(n, v) for n, values in pressed.items() for v in values}
        states = {f"status {n}": set_to(self, status=n) for n in (1, 3, 4)}
        return keys | states | {
            "overload": set_to(self, overload=True, status=1),
            "another serial number": set_to(self, serial="MY46299999"),
            "power off and on": self.power_cycle,
            "stuck": set_to(self, silent=True),
        }  # fmt: skip

    def untold(self) -> dict[str, Callable[[], None]]:
        return {"corrected with another fixture": set_to(self, scale=1.02)}
