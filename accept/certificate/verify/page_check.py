"""Comparison of the page with the attached data: it is drawn again from them."""

import io
import re
from collections import Counter

from pyhanko.pdf_utils.generic import DictionaryObject
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.fields import enumerate_sig_fields
from pypdf import PdfReader

from accept.base import version
from accept.certificate.contents import content as certificate_content
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.errors import InvalidCertificate
from accept.certificate.contents.step import Step
from accept.certificate.page.document import render
from accept.certificate.page.fixed_parts import TECHNICIAN, is_simulated

VERDICT_WORDS = re.compile(r"\b(ACCEPTED|REJECTED|CONDITIONAL|INCOMPLETE|HELD|PASS|FAIL|NO RESULT|DEMO|SIMULATED)\b")
_SHOWN = 3  # words that are missing on a page: enough to see where it differs
_CATALOG = {"/Perms", "/Metadata", "/Extensions", "/Version", "/DSS"}  # what signing changes of it


def check_page(signed: bytes, contents: CertificateContent) -> Step:
    """Draw the page again from the attachments. Raises InvalidCertificate if the two contradict each other.

    Drawn by the same program both are the same to the byte. Drawn by another version they may differ in layout; then
    the text is compared but pictures cannot be, so the page counts as not compared.
    """
    _only_signed(signed)
    drawn = render(contents)
    same_libraries = dict(contents.drawn_with) == certificate_content.renderer()
    if signed.startswith(drawn) and not same_libraries:
        return Step("the page is as these libraries draw it, but it states others that drew it", complete=False)
    if signed.startswith(drawn):
        return Step("the page was drawn again from the attached data: identical to the byte")
    if same_libraries and contents.code_sha256 == version.code_sha256():
        raise InvalidCertificate("the page does not agree with the attached data")
    other = f"accept {contents.accept_version}, code {contents.code_sha256[:12]}"
    missing = _text_differences(signed, drawn, contents)
    words = f"other words: {', '.join(missing[:_SHOWN])}" if missing else "its text says the same"
    return Step(f"page not compared: it was drawn by another version ({other}); {words}", complete=False)


def _only_signed(signed: bytes) -> None:
    """Raise InvalidCertificate if the technician's revision changes more than the signature field: the signer writes
    that revision too, and could draw over the page in it."""
    reader = PdfFileReader(io.BytesIO(signed))
    before, after = reader.get_historical_resolver(0), reader.get_historical_resolver(1)
    rewritten = after.explicit_refs_in_revision()  # type: ignore[no-untyped-call]
    changed = {ref for ref in rewritten if not before.is_ref_unassignable(ref)}
    field = next(ref.reference for name, _, ref in enumerate_sig_fields(reader) if name == TECHNICIAN)
    may = {reader.root_ref: _CATALOG, field: {"/AP", "/V"}, reader.trailer.raw_get("/Info").reference: {"/Producer"}}
    for ref in changed:
        old, new = before(ref), after(ref)
        if ref not in may or not isinstance(old, DictionaryObject) or not isinstance(new, DictionaryObject):
            raise InvalidCertificate("the page was changed while it was signed")
        kept = (old.keys() | new.keys()) - may[ref]
        if any(not (k in old and k in new and old.raw_get(k) == new.raw_get(k)) for k in kept):
            raise InvalidCertificate("the document was changed while it was signed")


def _text_differences(signed: bytes, drawn: bytes, contents: CertificateContent) -> list[str]:
    """Return the words of either text that the other lacks. Raises InvalidCertificate if the page shows another serial
    or another verdict."""
    there, here = _text(signed), _text(drawn)
    simulated = ("SIMULATED",) if is_simulated(contents) else ()
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
