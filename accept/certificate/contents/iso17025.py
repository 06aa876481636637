"""The statements that [ISO17025] 7.8 asks of a certificate, the file and key of each, and which are missing."""

from collections.abc import Iterable
from dataclasses import dataclass

from accept.certificate.contents.laboratory import LABORATORY_FILE, Laboratory, method_of
from accept.units import UnitFolder
from specs.files import UNIT_FILE
from specs.spec import Spec

OF_LABORATORY = {  # clause, what, key of laboratory.toml
    "name": ("7.8.2.1 b", "name of the laboratory"),
    "address": ("7.8.2.1 b", "address of the laboratory"),
    "contact": ("7.8.2.1 b", "contact of the laboratory"),
    "site": ("7.8.2.1 c", "place where the unit is measured"),
    "certificate_number": ("7.8.2.1 d", "number of the certificate"),
    "sampling": ("7.8.2.1 k", "sampling (how units are chosen, or that every unit is measured)"),
}
OF_CUSTOMER = {"customer": "name of the customer", "customer_contact": "contact of the customer"}
OF_ORIGIN = {  # key of [origin]
    "manufacturer": ("7.8.2.1 g", "manufacturer of the unit"),
    "type": ("7.8.2.1 g", "type of the unit"),
    "condition": ("7.8.2.1 g", "condition of the unit"),
    "received": ("7.8.2.1 h", "day of receipt"),
}
ENVIRONMENT = {"temperature_C": ("7.8.3.1 a", "temperature"), "humidity_percent": ("7.8.3.1 a", "humidity")}


@dataclass(frozen=True)
class Missing:
    """A statement that a certificate lacks. where: the file and key that would state it."""

    clause: str
    what: str
    where: str

    @property
    def words(self) -> str:
        """The statement in one line: `7.8.2.1 h: day of receipt is not stated (unit.toml, [origin] received)`."""
        return f"{self.clause}: {self.what} is not stated ({self.where})"


def missing_statements(laboratory: Laboratory | None, spec: Spec, unit: UnitFolder | None = None) -> list[Missing]:
    """Return the statements that the certificates of a spec would lack, by clause. unit: a folder whose own statements
    are counted; without it, only what its customer could state instead of the laboratory is."""
    found = [
        Missing(clause, what, f"{LABORATORY_FILE}, {key}")
        for key, (clause, what) in OF_LABORATORY.items()
        if laboratory is None or getattr(laboratory, key) is None
    ]
    own = {} if unit is None else unit.header.origin
    for key, what in OF_CUSTOMER.items():  # a unit with a customer of its own states that customer's contact too
        if key not in own and (laboratory is None or getattr(laboratory, key) is None or "customer" in own):
            where = f"{LABORATORY_FILE}, {key}, or {UNIT_FILE}, [origin] {key}"
            found.append(Missing("7.8.2.1 e", what, where))
    without = [check for check in spec.checks if laboratory is None or method_of(laboratory, check) is None]
    if without:
        found.append(Missing("7.8.2.1 f", f"method of {', '.join(without)}", f"{LABORATORY_FILE}, [methods]"))
    return sorted([*found, *(_of_unit(unit, spec) if unit else ())], key=lambda one: one.clause)


def _of_unit(unit: UnitFolder, spec: Spec) -> Iterable[Missing]:
    for key, (clause, what) in OF_ORIGIN.items():
        if key not in unit.header.origin:
            yield Missing(clause, what, f"{UNIT_FILE}, [origin] {key}")
    if days := [name for name in unit.sections if name not in unit.measured]:
        yield Missing("7.8.2.1 i", f"day of measuring of {', '.join(days)}", f"{UNIT_FILE}, [measured]")
    for key, (clause, what) in ENVIRONMENT.items():
        if key not in unit.header.environment:
            yield Missing(clause, what, f"{UNIT_FILE}, [environment] {key}")
    stated = (u for check in spec.checks.values() for u in check.uncertainty.values())
    temperature = unit.header.environment.get("temperature_C")
    if temperature is not None and temperature.U is None and any(u.percent_per_C is not None for u in stated):
        where = f"{UNIT_FILE}, [environment] temperature_C = {{ value = {temperature.value:g}, U = ... }}"
        yield Missing("7.8.3.1 c", "uncertainty of the temperature, on which results depend,", where)
