"""The answer of `accept misalign --json`."""

from dataclasses import dataclass
from typing import Annotated

from accept.base.documents.document import Document, Number


@dataclass(frozen=True)
class Offset(Document):
    """An offset of the APA along one axis."""

    value: Annotated[Number | None, "[um]; null without a result"] = None
    U: Annotated[Number | None, "expanded uncertainty (k = 2) [um]"] = None


@dataclass(frozen=True)
class MisalignmentDocument(Document):
    """Misalignment of the APA of a strut."""

    serial: str
    dx_um: Offset
    dy_um: Offset
    verdict: Annotated[str, "`pass` or `no_result`"]
    reason: Annotated[str | None, "why there is no result"]
