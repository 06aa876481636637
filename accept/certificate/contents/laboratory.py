"""`laboratory.toml` in the folder of the bench (`ACCEPT_HOME`): what each of its certificates states of the laboratory
([ISO17025] 7.8.2.1). An absent key is left out of the certificate, and `accept spec check --iso17025` names it."""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from string import Formatter
from typing import Annotated, Any

from pydantic import ConfigDict, Field, field_validator

from accept.base.documents.document import Document, only_if
from checks.acceptance import CHECKS
from specs.strict import Strict, Words, file_bytes, parse_as

LABORATORY_FILE = "laboratory.toml"
OTHERS = "others"  # method of the checks that have none of their own


class LaboratoryFile(Strict):
    """The keys of `laboratory.toml`."""

    name: Words | None = None
    address: Words | None = None
    contact: Words | None = None
    site: Words | None = None
    accreditation: Words | None = None
    customer: Words | None = None
    customer_contact: Words | None = None
    sampling: Words | None = None
    certificate_number: Words | None = None
    methods: Annotated[dict[str, Words], Field(default_factory=dict)]

    @field_validator("certificate_number")
    @classmethod
    def _unique(cls, scheme: str | None) -> str | None:
        if scheme is None:
            return None
        try:
            parsed = [each for each in Formatter().parse(scheme) if each[1] is not None]
            fields = [name for _, name, _, _ in parsed]
            if {*fields} - {"serial", "attempt", "year"} or any(how or also for *_, how, also in parsed):
                raise ValueError  # a format could make it of any length
        except ValueError as e:
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


_Text = Annotated[str, Field(min_length=1), only_if(bool)]


@dataclass(frozen=True)
class StatedLaboratory(Document):
    """The statements of a certificate about its laboratory, as the file has them, and the method of each check."""

    __pydantic_config__ = ConfigDict(strict=True, extra="forbid")

    name: _Text = ""
    address: _Text = ""
    contact: _Text = ""
    site: _Text = ""
    accreditation: _Text = ""
    customer: _Text = ""
    customer_contact: _Text = ""
    sampling: _Text = ""
    methods: Annotated[Mapping[str, Annotated[str, Field(min_length=1)]], only_if(bool)] = field(default_factory=dict)


def statement_of(laboratory: LaboratoryFile, checks: Iterable[str]) -> StatedLaboratory:
    """Return a certificate's statements about the laboratory."""
    methods = {name: method for name in checks if (method := method_of(laboratory, name)) is not None}
    stated: dict[str, Any] = {each.name: getattr(laboratory, each.name) or "" for each in fields(StatedLaboratory)}
    return StatedLaboratory(**stated | {"methods": methods})


def method_of(laboratory: LaboratoryFile, check: str) -> str | None:
    """Return the method by which a check is measured, with its revision; None if it is not stated."""
    return laboratory.methods.get(check, laboratory.methods.get(OTHERS))


def number_of(scheme: str, serial: str, attempt: int, year: int, taken: Collection[str]) -> str:
    """Return the number of a certificate by a scheme. A second certificate of the same attempt, as after it was judged
    again, has the next number that is not taken."""
    number = scheme.format(serial=serial, attempt=attempt, year=year)
    again = (f"{number}-{n}" for n in range(2, len(taken) + 3))
    return number if number not in taken else next(other for other in again if other not in taken)


class Laboratory(LaboratoryFile):
    """A `laboratory.toml` that was read."""

    sha256: str
    text: str
    path: str


def laboratory_of(home: Path) -> Laboratory | None:
    """Return the content of a bench's `laboratory.toml`, None without that file. Raises SpecError."""
    path = home / LABORATORY_FILE
    if not path.exists():
        return None
    return parse_as(Laboratory, LaboratoryFile, file_bytes(path), str(path), path=str(path))


def contents_of(laboratory: LaboratoryFile) -> dict[str, Any]:
    """Return the keys of the file that are given, as `LaboratoryFile` takes them."""
    return laboratory.model_dump(include=set(LaboratoryFile.model_fields), exclude_defaults=True)
