"""`laboratory.toml` of a bench: what each of its certificates states of the laboratory ([ISO17025] 7.8.2.1).

The file lies in the folder of the bench (`ACCEPT_HOME`). Every key may be absent: an absent one is left out of the
certificate, and `accept spec check --iso17025` names it, with its clause and the file and key that would state it.
"""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from string import Formatter
from typing import Annotated, Any

from pydantic import ConfigDict, Field, field_validator

from accept.base.atomic_files import UNIT_FILE
from accept.base.documents.document import Document, only_if
from accept.units.unit_folder import UnitFolder
from checks.acceptance import CHECKS
from specs.spec import Spec
from specs.strict import Strict, Words, file_bytes, parse_as

LABORATORY_FILE = "laboratory.toml"
OTHERS = "others"  # method of the checks that have none of their own


class LaboratoryFile(Strict):
    """The keys of `laboratory.toml`."""

    name: Words | None = None
    address: Words | None = None
    site: Words | None = None
    accreditation: Words | None = None
    customer: Words | None = None
    sampling: Words | None = None
    certificate_number: Words | None = None
    methods: Annotated[dict[str, Words], Field(default_factory=dict)]

    @field_validator("certificate_number")
    @classmethod
    def _unique(cls, scheme: str | None) -> str | None:
        if scheme is None:
            return None
        try:
            fields = [name for _, name, _, _ in Formatter().parse(scheme) if name is not None]
            scheme.format(serial="A", attempt=1, year=2026)
        except (KeyError, IndexError, ValueError) as e:
            raise ValueError(f"'{scheme}': expected text with {{serial}}, {{attempt}} and, if wanted, {{year}}") from e
        between = re.search(r"\{serial\}(.*)\{attempt\}|\{attempt\}(.*)\{serial\}", scheme)
        if len(set(fields)) < len(fields) or between is None or not re.search(r"[^A-Za-z0-9._{}-]", between.group(0)):
            raise ValueError(
                f"'{scheme}': two certificates would have one number; expected {{serial}} and {{attempt}}, and between "
                "them a character that no serial has, such as {serial}/{attempt}"
            )
        return scheme

    @field_validator("methods")
    @classmethod
    def _of_checks(cls, methods: dict[str, str]) -> dict[str, str]:
        if unknown := [name for name in methods if name not in CHECKS and name != OTHERS]:
            raise ValueError(f"{unknown[0]}: expected a check ({', '.join(CHECKS)}) or {OTHERS}")
        return methods


class Laboratory(LaboratoryFile):
    """A `laboratory.toml` that was read."""

    sha256: str
    text: str
    path: str


_Text = Annotated[str, Field(min_length=1), only_if(bool)]


@dataclass(frozen=True)
class StatedLaboratory(Document):
    """The statements of a certificate about its laboratory, as the file has them, and the method of each check."""

    __pydantic_config__ = ConfigDict(strict=True, extra="forbid")

    name: _Text = ""
    address: _Text = ""
    site: _Text = ""
    accreditation: _Text = ""
    customer: _Text = ""
    sampling: _Text = ""
    methods: Annotated[Mapping[str, Annotated[str, Field(min_length=1)]], only_if(bool)] = field(default_factory=dict)


def laboratory_of(home: Path) -> Laboratory | None:
    """Return the content of a bench's `laboratory.toml`, None without that file. Raises SpecError."""
    path = home / LABORATORY_FILE
    if not path.exists():
        return None
    return parse_as(Laboratory, LaboratoryFile, file_bytes(path), str(path), path=str(path))


def statement_of(laboratory: LaboratoryFile, checks: Iterable[str]) -> StatedLaboratory:
    """Return a certificate's statements about the laboratory."""
    methods = {name: method for name in checks if (method := method_of(laboratory, name)) is not None}
    stated: dict[str, Any] = {each.name: getattr(laboratory, each.name) or "" for each in fields(StatedLaboratory)}
    return StatedLaboratory(**stated | {"methods": methods})


def method_of(laboratory: LaboratoryFile, check: str) -> str | None:
    """Return the method by which a check is measured, with its revision; None if it is not stated."""
    return laboratory.methods.get(check, laboratory.methods.get(OTHERS))


def contents_of(laboratory: LaboratoryFile) -> dict[str, Any]:
    """Return the keys of the file that are given, as `LaboratoryFile` takes them."""
    return laboratory.model_dump(include=set(LaboratoryFile.model_fields), exclude_defaults=True)


def number_of(scheme: str, serial: str, attempt: int, year: int, taken: Collection[str]) -> str:
    """Return the number of a certificate by a scheme. A second certificate of the same attempt, as after it was judged
    again, has the next number that is not taken."""
    number = scheme.format(serial=serial, attempt=attempt, year=year)
    again = (f"{number}-{n}" for n in range(2, len(taken) + 3))
    return number if number not in taken else next(other for other in again if other not in taken)


OF_LABORATORY = {  # clause, what, key of laboratory.toml
    "name": ("7.8.2.1 b", "name of the laboratory"),
    "address": ("7.8.2.1 b", "address of the laboratory"),
    "site": ("7.8.2.1 c", "place where the unit is measured"),
    "certificate_number": ("7.8.2.1 d", "number of the certificate"),
    "sampling": ("7.8.2.1 k", "sampling (how units are chosen, or that every unit is measured)"),
}
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
    if (laboratory is None or laboratory.customer is None) and not (unit and "customer" in unit.header.origin):
        where = f"{LABORATORY_FILE}, customer, or {UNIT_FILE}, [origin] customer"
        found.append(Missing("7.8.2.1 e", "name of the customer", where))
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
