"""A Keysight E4980A by its programming manual: long and short forms, numbers as it writes them (pages 261 and 265), the
data of each display page, the trigger system, the comparator's bin, the error queue.

Page 261: A and B as SN.NNNNNESNN, the status in two characters (-1 no data, 0, +1 overload, +3, +4), the bin only while
the comparator is on. In a list sweep the fourth field says in or out. The trigger system: a trigger counts only while
the meter waits for one (`INIT:CONT ON`) and comes from the source that is set; another one is error -211.
"""

import re
import struct

CONNECTED_S = 0.3
POWER_ON = {
    "FUNCtion:IMPedance[:TYPE]": "CPD", "FUNCtion:IMPedance:RANGe:AUTO": "1", "FUNCtion:DEV1:MODE": "OFF",
    "FUNCtion:DEV2:MODE": "OFF", "BIAS:STATe": "0", "FREQuency[:CW]": "+1.00000E+03",
    "VOLTage[:LEVel]": "+1.00000E+00", "AMPLitude:ALC": "0", "APERture": "MED,1", "CORRection:LENGth": "0",
    "CORRection:OPEN[:STATe]": "1", "CORRection:SHORt[:STATe]": "1", "CORRection:LOAD[:STATe]": "0",
    "TRIGger:SOURce": "INT", "INITiate:CONTinuous": "1", "DISPlay:PAGE": "MEAS", "FORMat[:DATA]": "ASC",
    "COMParator[:STATe]": "0",
}  # fmt: skip
CHOICES = {
    "TRIG:SOUR": ("INT", "HOLD", "EXT", "BUS"), "FORM": ("ASC", "REAL"),
    "DISP:PAGE": ("MEAS", "BNUM", "BCO", "LIST", "MSET", "CSET", "LTAB", "LSET", "CAT", "SYST", "SELF"),
}  # fmt: skip
NUMBERS = ("FREQ", "VOLT")
NOMINAL_F, D, LIST_HZ = 4e-6, 0.0145, 120.0
NO_DATA = "+9.90000E+37,+9.90000E+37,-1"


def short(header: str) -> str:
    """`FREQuency[:CW]` -> `FREQ`."""
    return re.sub(r"\[.*?\]|[a-z]", "", header)


def pattern(header: str) -> re.Pattern[str]:
    """What matches a header in its short and long forms, with or without the node in brackets."""

    def node(name: str) -> str:
        return f"(?:{re.escape(re.sub('[a-z]', '', name))}|{re.escape(name.upper())})"

    forms = [
        f"(?::{node(part[0] or part[1])}){'?' if part[0] else ''}" for part in re.findall(r"\[:(\w+)\]|(\w+)", header)
    ]
    return re.compile("".join(forms))


HEADERS = {short(header): pattern(header) for header in POWER_ON}


class E4980aPeer:
    """truth: series capacitance [F] at 1 kHz and 1 V. serial: of *IDN?."""

    byte_s = 1e-6

    def __init__(self, serial: str = "MY46412345", model: str = "E4980A") -> None:
        self.truth, self.serial, self.model, self.status = 0.0, serial, model, 0
        self.switch_on()
        changes = {
            "FUNC:IMP": "CPD", "FUNC:DEV1:MODE": "ABS", "BIAS:STAT": "1", "FREQ": "+1.20000E+02",
            "VOLT": "+5.00000E-03", "AMPL:ALC": "1", "APER": "SHOR,1", "CORR:LENG": "4", "CORR:OPEN": "0",
            "CORR:LOAD": "1", "TRIG:SOUR": "INT", "INIT:CONT": "0", "FUNC:IMP:RANG:AUTO": "0", "DISP:PAGE": "LIST",
            "FORM": "REAL", "COMP": "1",
        }  # fmt: skip
        self.panel = {
            f"{key} {value}": (lambda k=key, v=value: self.set.update({k: v})) for key, value in changes.items()
        }
        self.panel |= {"open on": lambda: self.set.update({"CORR:OPEN": "1", "CORR:LOAD": "0"})}
        self.panel |= {"no contact": lambda: setattr(self, "status", 1 - self.status)}

    def switch_on(self) -> None:
        self.set = {short(header): value for header, value in POWER_ON.items()}
        self._heard, self._data, self.errors = b"", NO_DATA, []

    def alone(self, now: float) -> list[bytes]:
        return []

    def hear(self, data: bytes) -> list[tuple[float, bytes]]:
        *messages, self._heard = (self._heard + data).split(b"\n")
        said = []
        for message in messages:
            answers = [answer for part in message.decode().split(";") if (answer := self._said(part.strip()))]
            if answers:
                said.append((CONNECTED_S if b"FETC" in message else 0.002, b";".join(answers) + b"\n"))
        return said

    def _said(self, message: str) -> bytes | None:
        header, _, value = message.upper().partition(" ")
        if header == "*IDN?":
            return f"Agilent Technologies,{self.model},{self.serial},A.02.10".encode()
        if header == "*OPC?":
            return b"+1"
        if header == "*CLS":
            self.errors.clear()
            return None
        plain = ":" + header.lstrip(":").rstrip("?")
        if re.fullmatch(":TRIG(GER)?(:IMM(EDIATE)?)?", plain):
            if self.set["TRIG:SOUR"] != "BUS" or self.set["INIT:CONT"] == "0":
                self._wrong(-211, "Trigger ignored")
            else:
                self._data = self._measured()
            return None
        if re.fullmatch(":FETC(H)?(:IMP(EDANCE)?)?(:FORM(ATTED)?)?", plain) and header.endswith("?"):
            if self.set["TRIG:SOUR"] == "INT" and self.set["INIT:CONT"] == "1":
                self._data = self._measured()
            return self._formatted(self._data)
        if re.fullmatch(":SYST(EM)?:ERR(OR)?", plain) and header.endswith("?"):
            return (self.errors.pop(0) if self.errors else '+0,"No error"').encode()
        key = next((key for key, known in HEADERS.items() if known.fullmatch(plain)), None)
        if key is None or key not in self.set:
            self._wrong(-113, "Undefined header")
        elif header.endswith("?"):
            return self.set[key].encode()
        elif key in NUMBERS:
            self.set[key] = f"{float(value):+.5E}"
        elif key in CHOICES and value not in CHOICES[key]:
            self._wrong(-224, "Illegal parameter value")
        else:
            self.set[key] = {"ON": "1", "OFF": "0"}.get(value, value) if self.set[key] in ("0", "1") else value
        return None

    def _wrong(self, number: int, words: str) -> None:
        self.errors.append(f'{number},"{words}"')

    def _formatted(self, data: str) -> bytes:
        if self.set["FORM"] == "ASC":
            return data.encode()
        block = b"".join(struct.pack(">d", float(field)) for field in data.split(","))
        return f"#2{len(block):02d}".encode() + block

    def _measured(self) -> str:
        listed = self.set["DISP:PAGE"] == "LIST"
        farads = self.truth * (1.0 if float(self.set["VOLT"]) > 0.5 else 0.9975)
        farads *= 1.0 if float(self.set["FREQ"]) == 1000 and not listed else 1.01
        farads *= {"0": 1.0, "1": 1.06}[self.set["BIAS:STAT"]] * {"1": 1.003, "4": 1.02}.get(self.set["CORR:LENG"], 1.0)
        farads *= 1.002 if self.set["AMPL:ALC"] == "1" else 1.0
        farads /= 1.003 if self.set["CORR:LENG"] == "1" else 1.0
        farads *= 1.0 if self.set["CORR:OPEN"] == "1" else 1.004
        farads *= 1.0 if self.set["CORR:LOAD"] == "0" else 0.98
        if self.set["FUNC:DEV1:MODE"] == "ABS":
            farads -= NOMINAL_F
        fourth = ",+0" if listed else ",+1" if self.set["COMP"] == "1" else ""
        if self.status:
            return "+9.90000E+37,+9.90000E+37,+1" + fourth
        return f"{farads:+.5E},{D:+.5E},+0{fourth}"
