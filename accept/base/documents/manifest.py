"""manifest.json inside a certificate: what is attached, who and which program judged, and where the bench stood."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from accept.base.documents.document import Document

MODEL_FOLDER = "spec-models"  # of the attached model files; no file of a unit has its name
ModelFiles = Mapping[str, bytes]  # of a model that is a file: its TOML first, then the files of matrices that it names


@dataclass(frozen=True)
class JudgingProgram(Document):
    """The program that judged."""

    version: str
    code_sha256: str


@dataclass(frozen=True)
class AttachedSpec(Document):
    """The spec, which is attached as spec.toml."""

    name: str
    title: str
    sha256: str


@dataclass(frozen=True)
class InputFile(Document):
    """A file of the unit folder that was judged."""

    sha256: str
    attached: Annotated[bool, "false for a file too large to attach"]
    bytes: Annotated[int | None, "its size; null for a name that is reserved"] = None


@dataclass(frozen=True)
class Manifest(Document):
    """The statements that are not in the other attachments of a certificate, and the hash of every input."""

    format: Annotated[int, "2; 1 for certificates of early versions, which lack the keys marked *later*"]
    serial: str
    record_sha256: Annotated[str, "of the attached results.json"]
    accept: JudgingProgram
    drawn_with: Annotated[Mapping[str, str], "versions of the programs that drew the page"]
    spec: AttachedSpec
    operator: str
    instruments: Annotated[Mapping[str, str], "by check, in words of the spec"]
    statement: Annotated[str, "of the decision rule"]
    inputs: Annotated[Mapping[str, InputFile], "by name"]
    models: Annotated[Mapping[str, tuple[str, ...]], "files of each model that the spec names"] = field(
        default_factory=dict
    )
    provenance: Annotated[Mapping[str, Any], "attempt, what it replaces, approval, head of the store, bench"] = field(
        default_factory=dict
    )


def hashes(evidence: Mapping[str, ModelFiles]) -> dict[str, dict[str, str]]:
    """Return name -> file name -> sha256, as a result stores it."""
    return {
        name: {file: hashlib.sha256(content).hexdigest() for file, content in files.items()}
        for name, files in sorted(evidence.items())
    }
