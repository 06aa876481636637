"""Comparison of the page with the attached data: it is drawn again from them."""

import io
import re
from collections import Counter
from collections.abc import Sequence

from cryptography import x509
from pyhanko.pdf_utils.generic import ArrayObject, DictionaryObject
from pyhanko.pdf_utils.reader import PdfFileReader
from pypdf import PdfReader

from accept.base import version
from accept.certificate.contents import content as certificate_content
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.outcome import InvalidCertificate, Step
from accept.certificate.signature.long_term import revocation_data_of
from accept.certificate.trust import authority
from accept.certificate.verify.ports import Ports
from accept.certificate.verify.signatures import Signed

VERDICT_WORDS = re.compile(r"\b(ACCEPTED|REJECTED|CONDITIONAL|INCOMPLETE|HELD|PASS|FAIL|NO RESULT|DEMO|SIMULATED)\b")
_SHOWN = 3  # words that are missing on a page: enough to see where it differs
_ACTING = {"/OpenAction", "/AA", "/JavaScript", "/JS", "/RichMedia"}  # keys
_ACTIONS = {
    "/JavaScript",
    "/Launch",
    "/SubmitForm",
    "/ImportData",
    "/GoToE",
    "/GoToR",
    "/Rendition",
    "/RichMediaExecute",
}
_DEEPEST = 32  # levels of arrays and dictionaries in one object; a certificate has some eight


def check_page(
    pdf: bytes,
    contents: CertificateContent,
    signatures: Sequence[Signed],
    roots: Sequence[x509.Certificate],
    ports: Ports,
) -> Step:
    """Draw the page again from the attachments and sign it again. Raises InvalidCertificate if the two contradict each
    other.

    Drawn by the same program both are the same to the byte. Drawn by another version they may differ in layout; then
    the text is compared but pictures cannot be, so the page counts as not compared.
    """
    signed = pdf[: signatures[0].place[2]]
    drawn = ports.draw(contents)
    same_libraries = dict(contents.drawn_with) == certificate_content.renderer()
    if signed.startswith(drawn) and same_libraries:
        _check_revisions(pdf, drawn, contents, signatures, roots, ports)
        return Step("page and signatures were drawn again from the attached data: identical to the byte")
    _check_actions(pdf)
    if signed.startswith(drawn):
        return Step("the page is as these libraries draw it, but it states others that drew it", complete=False)
    if same_libraries and contents.code_sha256 == version.code_sha256():
        raise InvalidCertificate("the page does not agree with the attached data")
    other = f"accept {contents.accept_version}, code {contents.code_sha256[:12]}"
    missing = _text_differences(signed, drawn, contents)
    words = f"other words: {', '.join(missing[:_SHOWN])}" if missing else "its text says the same"
    return Step(f"page not compared: it was drawn by another version ({other}); {words}", complete=False)


def _check_revisions(
    pdf: bytes,
    drawn: bytes,
    contents: CertificateContent,
    signatures: Sequence[Signed],
    roots: Sequence[x509.Certificate],
    ports: Ports,
) -> None:
    """Raise InvalidCertificate if a signature's revision is not what this program writes for its certificate and time:
    a signer writes that revision, and could lead a reader to another page in it. Only the hole with the signature
    itself is left out, which `signature_contents` builds again."""
    before, held = drawn, 0
    for signed in signatures:
        start, end, last = signed.place
        ca = next(root for root in roots if authority.issued_by(signed.certificate, root))
        kept = revocation_data_of(PdfFileReader(io.BytesIO(pdf[:last])))
        already, held = held, sum(map(len, (kept.certificates, kept.lists, kept.answers)))
        if held > already and signed.stamped is None:
            raise InvalidCertificate(f"the {signed.role}'s revision keeps revocation data (/DSS) without a timestamp")
        again = ports.sign_again(before, signed, ca, kept, contents.simulated)
        if pdf[:start] != again[:start] or pdf[end:last] != again[end:]:
            raise InvalidCertificate(
                f"the {signed.role}'s revision holds more than a signature: what a reader shows is not what was judged"
            )
        before = pdf[:last]


def _check_actions(pdf: bytes) -> None:
    """Raise InvalidCertificate if an object of any revision acts when it is opened or touched. The program writes no
    such object; what it wrote itself is compared to the byte instead."""
    reader = PdfFileReader(io.BytesIO(pdf))
    for revision in range(reader.xrefs.total_revisions):
        objects = reader.get_historical_resolver(revision)
        for ref in objects.explicit_refs_in_revision():  # type: ignore[no-untyped-call]
            if found := _action(objects(ref)):
                raise InvalidCertificate(f"it holds an object that acts by itself ({found})")


def _action(held: object, depth: int = 0) -> str:
    if depth > _DEEPEST:
        return "nested too deeply"
    if isinstance(held, DictionaryObject):
        keys = _ACTING & held.keys()
        kind = held.raw_get("/S") if "/S" in held else ""
        if keys or kind in _ACTIONS:
            return min(keys) if keys else str(kind)
        return next((found for key in held if (found := _action(held.raw_get(key), depth + 1))), "")
    if isinstance(held, ArrayObject):
        return next((found for n in range(len(held)) if (found := _action(held.raw_get(n), depth + 1))), "")
    return ""


def _text_differences(signed: bytes, drawn: bytes, contents: CertificateContent) -> list[str]:
    """Return the words of either text that the other lacks. Raises InvalidCertificate if the page shows another serial
    or another verdict."""
    there, here = _text(signed), _text(drawn)
    simulated = ("SIMULATED",) if contents.simulated else ()
    for word in (contents.serial, str(contents.result["verdict"]).upper(), *simulated):
        if word not in there:
            raise InvalidCertificate(f"the page does not show '{word}', which the attached data say")
    verdicts = set(VERDICT_WORDS.findall(there)) - set(VERDICT_WORDS.findall(here))
    if verdicts:
        raise InvalidCertificate(f"the page shows '{min(verdicts)}', which the attached data do not say")
    one, other = Counter(there.split()), Counter(here.split())
    return sorted((one - other) | (other - one))


def _text(pdf: bytes) -> str:
    return "\n".join(page.extract_text() for page in PdfReader(io.BytesIO(pdf)).pages)
