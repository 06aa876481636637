"""Units of a universal file: data set 164 and the specific data types of records 8 to 10 of data set 58.

Source: SDRC, Universal Datasets 58 and 164 (UC-SDRL, ceas3.uc.edu/sdrluff). Values are divided by the factors of data
set 164, by the exponents of length and force that a specific data type has."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from checks.errors import RecordError

FOOT, INCH, POUND, KILOPOND, POUNDAL = 0.3048, 0.0254, 4.4482216152605, 9.80665, 0.138254954376
# Code: name, length and force of the system in SI.
SYSTEMS = {
    1: ("m, N", 1.0, 1.0),
    2: ("ft, lbf", FOOT, POUND),
    3: ("m, kgf", 1.0, KILOPOND),
    4: ("ft, poundal", FOOT, POUNDAL),
    5: ("mm, mN", 1e-3, 1e-3),
    6: ("cm, cN", 1e-2, 1e-2),
    7: ("in, lbf", INCH, POUND),
    8: ("mm, kgf", 1e-3, KILOPOND),
    10: ("mm, N", 1e-3, 1.0),
}
USER = 9
AGREE = 1e-3  # relative: factors are written with four digits or more


@dataclass(frozen=True)
class UnitSystem:
    """Units of a file: name, and the length [m] and force [N] that it counts in."""

    name: str
    length: float
    force: float

    @property
    def si(self) -> bool:
        return math.isclose(self.length, 1.0, rel_tol=1e-9) and math.isclose(self.force, 1.0, rel_tol=1e-9)


def unit_system(file: str, lines: Sequence[str]) -> UnitSystem:
    """Return the units that the records of a data set 164 state. Raises RecordError if it is damaged, of an unknown
    code, or if its code and its factors contradict each other."""
    try:
        code = int(lines[0][:10])
        factors = lines[1].replace("D", "E").replace("d", "e")
        length, force = (1.0 / float(factors[at : at + 25]) for at in (0, 25))
    except (IndexError, ValueError, ZeroDivisionError) as e:
        raise RecordError(f"{file}: its data set 164 (units) has no code and factors that can be read") from e
    if not (math.isfinite(length) and math.isfinite(force) and length > 0.0 and force > 0.0):
        raise RecordError(f"{file}: its data set 164 (units) has the factors {1 / length:g} and {1 / force:g}")
    if code == USER:
        return UnitSystem(f"{length:.6g} m, {force:.6g} N", length, force)
    if code not in SYSTEMS:
        raise RecordError(f"{file}: its data set 164 has the units code {code}; 1 to 10 are known")
    name, metres, newtons = SYSTEMS[code]
    if not (math.isclose(length, metres, rel_tol=AGREE) and math.isclose(force, newtons, rel_tol=AGREE)):
        raise RecordError(
            f"{file}: its data set 164 has the units code {code} ({name}) and the factors {1 / length:.6g} and "
            f"{1 / force:.6g}, which are {1 / metres:.6g} and {1 / newtons:.6g} of that code; correct one of them"
        )
    return UnitSystem(name, metres, newtons)
