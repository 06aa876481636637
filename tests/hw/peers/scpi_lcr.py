"""A Keysight E4980A, by its command list: long and short forms, numbers as it writes them, one answer per question."""

import re

CONNECTED_S = 0.3
POWER_ON = {
    "FUNC:IMP": "CPD", "FUNC:IMP:RANG:AUTO": "1", "FUNC:DEV1:MODE": "OFF", "FUNC:DEV2:MODE": "OFF", "BIAS:STAT": "0",
    "FREQ": "+1.00000E+03", "VOLT": "+1.00000E+00", "APER": "MED,1", "CORR:LENG": "0", "CORR:OPEN:STAT": "1",
    "CORR:SHOR:STAT": "1", "CORR:LOAD:STAT": "0", "TRIG:SOUR": "INT",
}  # fmt: skip
NUMBERS = ("FREQ", "VOLT")
NOMINAL_F, D = 4e-6, 0.0145


class E4980aPeer:
    """truth: series capacitance [F] at 1 kHz and 1 V. serial: of *IDN?."""

    byte_s = 1e-6

    def __init__(self, serial: str = "MY46412345", model: str = "E4980A") -> None:
        self.truth, self.serial, self.model, self.status = 0.0, serial, model, 0
        self.switch_on()
        changes = {
            "FUNC:IMP": "CPD", "FUNC:DEV1:MODE": "ABS", "BIAS:STAT": "1", "FREQ": "+1.20000E+02",
            "VOLT": "+5.00000E-03", "APER": "SHOR,1", "CORR:LENG": "4", "CORR:OPEN:STAT": "0", "CORR:LOAD:STAT": "1",
            "TRIG:SOUR": "INT", "FUNC:IMP:RANG:AUTO": "0",
        }  # fmt: skip
        self.panel = {
            f"{key} {value}": (lambda k=key, v=value: self.set.update({k: v})) for key, value in changes.items()
        }
        self.panel |= {"open on": lambda: self.set.update({"CORR:OPEN:STAT": "1", "CORR:LOAD:STAT": "0"})}
        self.panel |= {"no contact": lambda: setattr(self, "status", 1 - self.status)}

    def switch_on(self) -> None:
        self.set, self._heard, self._shown = dict(POWER_ON), b"", None

    def alone(self, now: float) -> list[bytes]:
        return []

    def hear(self, data: bytes) -> list[tuple[float, bytes]]:
        *messages, self._heard = (self._heard + data).split(b"\n")
        said = []
        for message in messages:
            answers = [
                answer for part in message.decode().split(";") if (answer := self._said(part.lstrip(":").strip()))
            ]
            if answers:
                said.append((CONNECTED_S if b"FETC" in message else 0.002, (";".join(answers) + "\n").encode()))
        return said

    def _said(self, message: str) -> str | None:
        if message == "*IDN?":
            return f"Agilent Technologies,{self.model},{self.serial},A.02.10"
        if message == "TRIG:IMM":
            self._shown = self._measured()
        elif message == "FETC?":
            return self._shown
        elif message.endswith("?"):
            return self.set.get(message[:-1])
        elif found := re.fullmatch(r"(\S+) (.+)", message):
            key, value = found.groups()
            on = {"ON": "1", "OFF": "0"}.get(value, value) if key.endswith(("STAT", "AUTO")) else value
            if key in self.set:
                self.set[key] = f"{float(value):+.5E}" if key in NUMBERS else on
        return None

    def _measured(self) -> str:
        farads = self.truth * (1.0 if float(self.set["VOLT"]) > 0.5 else 0.9975)
        farads *= 1.0 if float(self.set["FREQ"]) == 1000 else 1.01
        farads *= {"0": 1.0, "1": 1.06}[self.set["BIAS:STAT"]] * {"1": 1.003, "4": 1.02}.get(self.set["CORR:LENG"], 1.0)
        farads /= 1.003 if self.set["CORR:LENG"] == "1" else 1.0
        farads *= 1.0 if self.set["CORR:OPEN:STAT"] == "1" else 1.004
        farads *= 1.0 if self.set["CORR:LOAD:STAT"] == "0" else 0.98
        if self.set["FUNC:DEV1:MODE"] == "ABS":
            farads -= NOMINAL_F
        if self.status:
            return "+9.90000E+37,+9.90000E+37,+1"
        return f"{farads:+.5E},{D:+.5E},+0"
