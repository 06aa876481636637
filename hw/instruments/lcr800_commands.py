"""Messages of an LCR-800 beside those of a measurement: what can be set, asked for and zeroed.

Known from [LCR800] (pages 87-90): `MAIN:SPEE:FAST`, `MAIN:FREQ 1.00000`, `MEMO:STOR 100.`, `SORT:NOMV +32.0000`, a
field has a fixed number of characters, on and off have four (`ON..`, `OFF.`). Known from drivers: the other names, the
values that they take, the widths of the fields, `OPEN:OK` and `OPEN:FAIL`. Assumed: that the ranges of the drivers are
the meter's.
"""

from collections.abc import Mapping
from dataclasses import dataclass

CHOICES: Mapping[str, tuple[str, ...]] = {
    "SPEE": ("SLOW", "MEDI", "FAST"),
    "DISP": ("VALU",),
    "MODE": ("RQ", "CD", "CR", "LQ", "LR", "ZQ"),
    "CIRC": ("SERI", "PARA"),
    "TRIG": ("AUTO", "MANU"),
}
SWITCHES = ("R.H.", "C.V.", "INTB", "EXTB", "PPM.")  # range hold, constant voltage, internal and external bias, ppm
ZEROINGS = ("OPEN", "SHOR")


@dataclass(frozen=True)
class Number:
    """header: before the number. lo, hi: what it may be, in `unit`. form: how it is written, cut to `width`."""

    header: str
    lo: float
    hi: float
    unit: str
    form: str
    width: int

    def message(self, value: float) -> str:
        return f"{self.header} {format(value, self.form)[: self.width]}"


NUMBERS: Mapping[str, Number] = {
    "FREQ": Number("MAIN:FREQ", 0.012, 200.0, "kHz", ".5f", 7),
    "VOLT": Number("MAIN:VOLT", 0.005, 1.275, "V", ".3f", 5),
    "AVER": Number("STEP:AVER", 1.0, 255.0, "measurements", ".2f", 4),
    "STOR": Number("MEMO:STOR", 1.0, 100.0, "(place)", ".2f", 4),
    "NOMV": Number("SORT:NOMV", -999.0, 999.0, "of the display", "+.6f", 8),
}
QUESTIONS: Mapping[str, str] = {
    **{name: f"MAIN:{name}" for name in (*CHOICES, *SWITCHES, "BIAS", "FREQ", "VOLT")},
    **{name: NUMBERS[name].header for name in ("AVER", "NOMV")},
}


def setting(function: str, value: str | float | bool) -> str:
    """The message that sets a function to a choice, to a number, or on (True) and off. Raises ValueError: nothing that
    the meter does not have is ever sent."""
    if function in SWITCHES and isinstance(value, bool):
        return f"MAIN:{function}:{'ON..' if value else 'OFF.'}"
    if function in CHOICES and value in CHOICES[function]:
        return f"MAIN:{function}:{value}"
    number = NUMBERS.get(function)
    if number is not None and not isinstance(value, str | bool) and number.lo <= value <= number.hi:
        return number.message(value)
    raise ValueError(f"{function} = {value!r}: expected {_known(function)}; nothing sent")


def _known(function: str) -> str:
    if function in SWITCHES:
        return "True or False"
    if function in CHOICES:
        return ", ".join(CHOICES[function])
    if function in NUMBERS:
        n = NUMBERS[function]
        return f"{n.lo:g} to {n.hi:g} {n.unit}"
    return f"one of {', '.join((*CHOICES, *SWITCHES, *NUMBERS))}"
