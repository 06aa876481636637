"""GW Instek LCR-800 by its manual, pages 23 to 110; echoes and questions as four public drivers have them."""

from collections.abc import Callable, Sequence

from tests.hw.apart.wires import Peer, set_to

DEFAULTS = {
    "SPEE": "SLOW", "DISP": "VALU", "MODE": "CD", "CIRC": "SERI", "TRIG": "AUTO", "R.H.": "OFF.", "C.V.": "OFF.",
    "INTB": "OFF.", "EXTB": "OFF.", "PPM.": "OFF.",
}  # fmt: skip
CHOICES = {
    "SPEE": ("SLOW", "MEDI", "FAST"), "DISP": ("VALU", "DELP", "DELT"), "MODE": ("RQ", "CD", "CR", "LQ", "LR", "ZQ"),
    "CIRC": ("SERI", "PARA"), "TRIG": ("AUTO", "MANU"), "R.H.": ("OFF.", "ON.."), "C.V.": ("OFF.", "ON.."),
    "INTB": ("OFF.", "ON.."), "EXTB": ("OFF.", "ON.."), "PPM.": ("OFF.", "ON.."),
}  # fmt: skip


class Lcr800(Peer):
    """A capacitor of `truth` farad with D 0.0145. online: the session of the PC is open."""

    ends = b"\n\r"

    def __init__(self) -> None:
        super().__init__()
        self.set = dict(DEFAULTS)
        self.frequency, self.voltage, self.loss = 1.0, 1.0, 0.0145
        self.online, self.out_of_range, self.nominal = False, "", 10e-6
        self.scale = 1.0  # of a fixture that was not zeroed

    def power_cycle(self) -> None:
        super().power_cycle()
        self.set, self.frequency, self.voltage, self.online = dict(DEFAULTS), 1.0, 1.0, False

    @property
    def streams(self) -> bool:
        """AUTO sends by itself, once the session is open."""
        return self.online and self.set["TRIG"] == "AUTO" and not self.silent

    @streams.setter
    def streams(self, _: bool) -> None: ...

    def unasked(self) -> bytes:
        return b"".join(self.results())

    def results(self) -> list[bytes]:
        """Return the two lines of a result."""
        if self.out_of_range:
            return [b"SECO:OVERuF\n" if line == "SECO" else f"PRIM:{line}\n".encode() for line in [self.out_of_range]]
        farad = self.truth * self.scale
        if self.set["CIRC"] == "PARA":
            farad /= 1 + self.loss**2
        if self.frequency < 0.5:
            farad *= 1.02  # a stack holds more at 120 Hz
        micro = farad * 1e6
        if self.set["DISP"] == "DELP":
            micro = (farad / self.nominal - 1) * 100
        elif self.set["DISP"] == "DELT":
            micro = (farad - self.nominal) * 1e6
        mode = self.set["MODE"]
        ohm = 1 / (6283.2 * self.frequency * farad)
        first, unit = (micro, "uF") if mode[0] == "C" else (ohm, "  ") if mode in ("RQ", "ZQ") else (ohm, "mH")
        second = self.loss if mode[1] == "D" else 1 / self.loss if mode[1] == "Q" else ohm * self.loss
        units = unit + ("  " if mode[1] == "R" else "")
        return [b"MAIN:PRIM " + _seven(first) + b"\n", b"MAIN:SECO " + _six(second) + units.encode() + b"\n"]

    def answer(self, message: bytes) -> Sequence[bytes]:
        word = message.decode("latin-1").rstrip()
        if not word:
            return []
        if word == "COMU?":
            return [b"COMU:ON..\n"]
        if word.startswith("COMU:"):
            self.online = word == "COMU:OVER"
            return [message + b"\n"]
        if not self.online or not word.startswith("MAIN:"):
            return []  # a malformed command: silence
        head, value = word[5:9], word[9:].strip(": ")
        if word == "MAIN:STAR":
            return self.results() if self.set["TRIG"] == "MANU" else []
        if head in self.set:
            if value == "?":
                return [f"MAIN:{head}:{self.set[head]}\n".encode()]
            if value not in CHOICES[head]:
                return []
            self.set[head] = value
            return [message + b"\n"]
        if head in ("FREQ", "VOLT"):
            name, form = ("frequency", "{:.5f}") if head == "FREQ" else ("voltage", "{:.3f}")
            if value == "?":
                digits = form.format(getattr(self, name))[:7]
                return [f"MAIN:{head} {digits}\n".encode()]
            setattr(self, name, float(value))
            return [message + b"\n"]
        if head == "BIAS" and value == "?":
            return [b"MAIN:BIAS:OFF.\n"]
        return []

    def press(self, head: str, value: str) -> Callable[[], None]:
        """Return a press of a key of the panel."""

        def act() -> None:
            self.set[head] = value

        return act

    def panel(self) -> dict[str, Callable[[], None]]:
        wanted = DEFAULTS | {"TRIG": "MANU"}
        keys = {
            f"{head} {value}": self.press(head, value)
            for head, values in CHOICES.items()
            for value in values
            if value != wanted[head]
        }
        knobs = {
            "frequency 120 Hz": set_to(self, frequency=0.12),
            "frequency 10 kHz": set_to(self, frequency=10.0),
            "level 0.1 V": set_to(self, voltage=0.1),
        }
        over = {f"out of range {w}": set_to(self, out_of_range=w) for w in ("OV01", "OVER", "SECO")}
        other = {
            "menu open": set_to(self, silent=True),
            "session ended at the panel": set_to(self, online=False),
            "power off and on": self.power_cycle,
        }
        return keys | knobs | over | other

    def untold(self) -> dict[str, Callable[[], None]]:
        return {"leads not zeroed": set_to(self, scale=1.02)}


def _seven(value: float) -> bytes:
    """Return seven characters: a blank or the sign, and five digits with a point."""
    for decimals in (5, 4, 3, 2, 1, 0):
        text = f"{abs(value):.{decimals}f}"
        if len(text) <= 6:
            break
    return (("-" if value < 0 else " ") + text[:6].rjust(6)).encode()


def _six(value: float) -> bytes:
    """Return six characters: a blank and four digits with a point, without a zero before it."""
    for decimals in (4, 3, 2, 1, 0):
        text = f"{value:.{decimals}f}"
        text = text[1:] if text.startswith("0.") else text
        if len(text) <= 5:
            break
    return (" " + text[:5].rjust(5)).encode()
