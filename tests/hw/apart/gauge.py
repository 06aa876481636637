"""Millimar C1208/C1216/C1240 by its manual, pages 58 to 70: OPTORSD, OPTORSS and M1240."""

from collections.abc import Callable, Sequence

from tests.hw.apart.wires import Peer, set_to

DIVISORS = {"mm": 1e-3, "in": 25.4e-3, "um": 1e-6}
FORMATS = {"mm": "{:+.4f}", "in": "{:+.5f}", "um": "{:+07.1f}"}
FORMULAS = ("+1", "-1", "+2", "-2", "+1+2", "+1-2", "+2-1", "-1-2")


class Gauge(Peer):
    """What all three protocols share. Probe 1 measures `truth`, probe 2 lies still at 30 um. factor: of the feature."""

    skipped = b"\n"

    def __init__(self) -> None:
        super().__init__()
        self.unit, self.formula, self.factor = "um", "+1", 1.0
        self.model, self.serial = "C1216", "1234/56"
        self.held: float | None = None

    def power_cycle(self) -> None:
        super().power_cycle()
        self.unit, self.formula = "mm", "+1+2"

    def length(self) -> float:
        """Return what the display stands for, in metres."""
        if self.held is not None:
            return self.held
        probes = {"1": self.truth, "2": 30e-6}
        signs = [(self.formula[i], self.formula[i + 1]) for i in range(0, len(self.formula), 2)]
        return self.factor * sum((1 if sign == "+" else -1) * probes[probe] for sign, probe in signs)

    def number(self) -> bytes:
        return FORMATS[self.unit].format(self.length() / DIVISORS[self.unit]).encode()

    def hold(self) -> None:
        """Hold the display."""
        self.held = self.length()

    def shared_panel(self) -> dict[str, Callable[[], None]]:
        units = {f"unit {u}": set_to(self, unit=u) for u in DIVISORS if u != "um"}
        errors = {f"error {e}": set_to(self, refuses=e.encode()) for e in ("ERR1", "ERR3", "ERR5", "ERR6", "OV")}
        other = {"menu open": set_to(self, silent=True), "sends by itself": set_to(self, streams=True)}
        return units | errors | other

    def untold(self) -> dict[str, Callable[[], None]]:
        return {"factor 2": set_to(self, factor=2.0), "display held": self.hold}


class Optorsd(Gauge):
    """Queries and settings; replies end CR LF."""

    def value(self) -> bytes:
        return (self.refuses or self.number() + self.unit.encode()) + b"\r\n"

    def unasked(self) -> bytes:
        return self.value()

    def answer(self, message: bytes) -> Sequence[bytes]:
        word = message.decode("latin-1")
        if word == "?":
            return [self.value()]
        told = {
            "ID?": f"MAHR GMBH,{self.model} ",
            "VER?": "1.04 ",
            "UNI?": f"{self.unit} ",
            "SER?": self.serial,
            "CHA?": "".join(f"{self.formula[i]}C{self.formula[i + 1]}" for i in range(0, len(self.formula), 2)),
        }
        if word in told:
            return [told[word].encode() + b"\r\n"]
        if word in DIVISORS:
            self.unit = word
        elif word.startswith("CHA") and word[3:] in FORMULAS:
            self.formula = word[3:]
        elif not word.startswith("DIS "):
            return [b"ERR1\r\n"]
        return [b"\r\n"]

    def panel(self) -> dict[str, Callable[[], None]]:
        formulas = {f"formula {f}": set_to(self, formula=f) for f in FORMULAS if f != "+1"}
        swapped = {
            "another model": set_to(self, model="C1208"),
            "another serial number": set_to(self, serial="6543/21"),
        }
        return self.shared_panel() | formulas | swapped | {"power off and on": self.power_cycle}


class Optorss(Gauge):
    """`?` and nothing else."""

    def unasked(self) -> bytes:
        return (self.refuses or self.number() + self.unit.encode()) + b"\r\n"

    def answer(self, message: bytes) -> Sequence[bytes]:
        return [self.unasked()] if message == b"?" else []

    def panel(self) -> dict[str, Callable[[], None]]:
        return self.shared_panel()

    def untold(self) -> dict[str, Callable[[], None]]:
        formulas = {f"formula {f}": set_to(self, formula=f) for f in FORMULAS if f != "+1"}
        return super().untold() | formulas | {"power off and on": self.power_cycle}


class M1240(Gauge):
    """Replies end with CR; values carry no unit; a setting is acknowledged by CR alone."""

    def unasked(self) -> bytes:
        return (self.refuses or b"M1, " + self.number()) + b"\r"

    def answer(self, message: bytes) -> Sequence[bytes]:
        word = message.decode("latin-1")
        if word == "I":
            return [f"I,MAHRGMBH,{self.model},V1.04 \r".encode()]
        if word in ("M", "M1"):
            return [self.unasked()]
        if word.startswith("P86,") and word[4:] in ("1", "2", "3"):
            self.unit = ("mm", "in", "um")[int(word[4:]) - 1]
            return [b"\r"]
        if word in ("F1", "F2", "F3", "R"):
            return [message + b"\r"]
        return [b"\r"] if not word else [b"ERR1\r"]

    def panel(self) -> dict[str, Callable[[], None]]:
        return self.shared_panel() | {"another model": set_to(self, model="C1208")}

    def untold(self) -> dict[str, Callable[[], None]]:
        formulas = {f"formula {f}": set_to(self, formula=f) for f in FORMULAS if f != "+1"}
        return super().untold() | formulas | {"power off and on": self.power_cycle}
