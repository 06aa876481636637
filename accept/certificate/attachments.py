"""What is inside a certificate: do the attachments belong together, does the page say what they say."""

import hashlib
import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from pyhanko.pdf_utils.generic import ArrayObject
from pyhanko.pdf_utils.reader import PdfFileReader
from pypdf import PdfReader

from accept.base import version
from accept.base.atomic_files import write_atomic
from accept.certificate import content as certificate_content
from accept.certificate.content import RESERVED, CertificateContent, ContentError
from accept.certificate.document import render
from accept.certificate.errors import InvalidCertificate
from accept.certificate.result_diff import differences

_SHOWN = 3  # differences named in the reason; the details have all


@dataclass(frozen=True, eq=False)
class Attachments:
    """What `verify` hands to the judge.

    result : the attached entry of results.json. spec_text : the attached spec. files : attached inputs by name.
    missing : inputs that were too large to attach; with any, the unit cannot be judged again.
    """

    result: Mapping[str, Any]
    spec_text: str
    files: Mapping[str, bytes]
    missing: tuple[str, ...] = ()

    def unpack(self, folder: Path) -> Path:
        """Write the inputs as the unit folder they were. Raises Refused on a name that leads out of the folder."""
        for name, content in self.files.items():
            parts = PurePosixPath(name).parts
            if not parts or name.startswith("/") or ".." in parts or "\\" in name or ":" in name:
                raise InvalidCertificate(f"the attachment '{name}' has a name that leads out of its folder")
            write_atomic(folder / name, content)
        return folder


Rejudge = Callable[[Attachments], Mapping[str, Any]]
"""Judges the attached unit by the attached spec and returns its entry as in results.json (`UnitResult.to_json()`)."""


def embedded(reader: PdfFileReader) -> dict[str, bytes]:
    """Name -> content of the files embedded in a PDF."""
    names = reader.root["/Names"]["/EmbeddedFiles"]["/Names"]
    if not isinstance(names, ArrayObject) or len(names) % 2:
        raise InvalidCertificate("the list of attachments is damaged")
    keys = [str(names[n]) for n in range(0, len(names), 2)]
    if len(set(keys)) != len(keys):
        raise InvalidCertificate("two attachments have the same name")
    return {key: names[2 * n + 1]["/EF"]["/F"].data for n, key in enumerate(keys)}


def read(signed: bytes) -> CertificateContent:
    """The certificate's content inside a signed PDF, its attachments held against their hashes. Raises Refused."""
    try:
        contents = certificate_content.read(embedded(PdfFileReader(io.BytesIO(signed))))
    except KeyError as e:
        raise InvalidCertificate("nothing is attached to it: it is not a certificate of this program") from e
    except ContentError as e:
        raise InvalidCertificate(str(e)) from e
    _check_hashes(contents)
    return contents


def check_page(signed: bytes, contents: CertificateContent) -> str:
    """Draw the page again from the attachments; says in words what came of it. Raises Refused where they differ."""
    drawn = render(contents)
    if signed.startswith(drawn):
        return "the page was drawn again from the attached data: identical to the byte"
    same_program = (
        contents.code_sha256 == version.code_sha256() and dict(contents.drawn_with) == certificate_content.renderer()
    )
    if same_program:
        raise InvalidCertificate("the page does not agree with the attached data")
    _check_words(signed, contents)
    return (
        f"the page was drawn by another version (accept {contents.accept_version}, code {contents.code_sha256[:12]}); "
        "its serial and verdict were found, its bytes were not compared"
    )


def check_result(contents: CertificateContent, rejudge: Rejudge | None) -> str:
    """Judge again from the attached data; says in words what came of it. Raises Refused where the results differ."""
    missing = tuple(name for name in contents.inputs if name not in contents.files)
    if rejudge is None:
        return "not judged again"
    if missing:
        return f"not judged again: {', '.join(missing)} too large to be attached (hash in manifest.json)"
    again = rejudge(Attachments(contents.result, contents.spec_text, contents.files, missing))
    found = differences(contents.result, again)
    if found:
        more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
        raise InvalidCertificate(
            f"judged again from the attached data it differs: {'; '.join(found[:_SHOWN])}{more}{_other(contents)}"
        )
    searched = "; what its responses lack in the model was not searched for again" if "gap" in contents.result else ""
    return f"judged again from the attached data: the same result{searched}{_other(contents)}"


def _other(contents: CertificateContent) -> str:
    if contents.code_sha256 == version.code_sha256():
        return ""
    return f" (certificate: accept {contents.accept_version}, code {contents.code_sha256[:12]}; here: another)"


def _check_hashes(contents: CertificateContent) -> None:
    if dict(contents.result.get("inputs", {})) != dict(contents.inputs):
        raise InvalidCertificate("results.json and manifest.json name different inputs")
    for name, content in contents.files.items():
        if hashlib.sha256(content).hexdigest() != contents.inputs.get(name):
            raise InvalidCertificate(f"the attached {name} is not the file that was judged")
    attached = set(contents.attachments()) - set(RESERVED)
    if not attached <= set(contents.inputs):
        raise InvalidCertificate("a file is attached that was not judged")


def _check_words(signed: bytes, contents: CertificateContent) -> None:
    text = PdfReader(io.BytesIO(signed)).pages[0].extract_text()
    for word in (contents.serial, str(contents.result["verdict"]).upper()):
        if word not in text:
            raise InvalidCertificate(f"the page does not show '{word}', which the attached data say")
