"""Does the page name the spec and the person as they are? What it states beside the result is the signer's own word."""

from accept.base import version
from accept.certificate.contents.content import BEFORE, STATEMENT, CertificateContent
from accept.certificate.contents.errors import InvalidCertificate
from accept.certificate.trust.authority import same_person
from specs.spec import parse
from specs.strict import SpecError


def check_stated(contents: CertificateContent, technician: str | None) -> None:
    """The spec's name, title and instruments are those in its text; the operator is who signed as technician, None
    for a demonstration, which signs for everybody; and what the verdicts mean is said as this program says it.

    Raises InvalidCertificate."""
    try:
        spec = parse(contents.spec_text.encode(), "the attached spec")
    except SpecError as e:
        raise InvalidCertificate(f"the attached spec cannot be used: {e}") from e
    for what, stated, there in (
        ("name", contents.spec_name, spec.name),
        ("title", contents.spec_title, spec.title),
        ("list of instruments", dict(contents.instruments), spec.instruments),
    ):
        if stated != there:
            raise InvalidCertificate(f"the page gives the spec another {what} than the attached spec has: '{there}'")
    if technician and contents.format > BEFORE and not same_person(contents.operator, technician):
        raise InvalidCertificate(f"the operator is {contents.operator}, but {technician} signed as technician")
    if contents.code_sha256 == version.code_sha256() and contents.statement != STATEMENT:
        raise InvalidCertificate("the page says of the verdicts what this program does not say")
