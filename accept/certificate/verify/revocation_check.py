"""The authority's list of revoked keys that is attached to a certificate, against its signatures."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from typing import Any

from cryptography import x509

from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.outcome import InvalidCertificate, Step, quoted
from accept.certificate.trust import authority
from accept.certificate.trust.revocation import RevocationError, RevocationList, Revoked, is_canonical, parsed
from accept.certificate.verify.signatures import Signed, doubt_of


def attached_list(contents: CertificateContent, ca: x509.Certificate) -> RevocationList | None:
    """Return the list of an authority that was attached when the unit was judged, None if it is of another one."""
    given = contents.stated.crl
    try:
        return parsed(given.encode(), "the attached list", ca) if given else None
    except RevocationError:
        return None


def attached_entries(contents: CertificateContent, roots: Sequence[x509.Certificate]) -> list[Revoked]:
    """Return the entries of the list that was attached when the unit was judged, none without one. Raises
    InvalidCertificate if it is not of a trusted authority, or not as this program writes it."""
    if not contents.stated.crl:
        return []
    if not is_canonical(contents.stated.crl):
        raise InvalidCertificate("provenance.crl is not a list of revoked keys as this program writes it")
    found = next(filter(None, (attached_list(contents, ca) for ca in roots)), None)
    if found is None:
        raise InvalidCertificate("the attached list of revoked keys is of no trusted authority")
    return list(found.entries)


def doubted_by(revoked: Sequence[Revoked], signatures: Sequence[Signed]) -> tuple[Signed, ...]:
    """Return the signatures with the doubts of one more list. Raises InvalidCertificate if a key had been revoked when
    it signed."""
    return tuple(replace(s, doubt=s.doubt or doubt_of(s.certificate, s.when, revoked, s.stamped)) for s in signatures)


def _stated(content: Any) -> Iterator[x509.Certificate]:
    """Yield every certificate of a key in a document, read as the checks of its signature read it."""
    if isinstance(content, Mapping | list | tuple):
        for each in content.values() if isinstance(content, Mapping) else content:
            yield from _stated(each)
    elif isinstance(content, str) and "CERTIFICATE" in content:
        with suppress(ValueError):  # other words
            yield x509.load_pem_x509_certificate(content.encode())


def only_by_clock(
    contents: CertificateContent, signatures: Sequence[Signed], revoked: Sequence[Revoked], now: datetime
) -> list[Step]:
    """Return a remark on every key that signed anything here, a decision or an approval too, and was revoked later,
    because its owner left, and on every signer's that ran out, but for a signature with a trusted timestamp."""
    stated = (*_stated(contents.provenance), *_stated(contents.result))
    signers = [s.certificate for s in signatures if not (s.stamped and s.stamped.trusted)]
    left = {entry.serial_number: entry.since for entry in revoked if not entry.compromised}
    ends = [(c, "was revoked", left.get(c.serial_number)) for c in (*stated, *signers)]
    ends += [(c, "ran out", c.not_valid_after_utc) for c in signers if c.not_valid_after_utc < now]
    said = [f"the key of {quoted(authority.person_of(c))} {how} on {day:%Y-%m-%d}" for c, how, day in ends if day]
    return [Step("", remark=f"{words}; that it signed before, only a clock says") for words in dict.fromkeys(said)]
