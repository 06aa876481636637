"""The lists of revoked keys that a verification looks at: beside the authority's certificate, in the bench's store, in
the list that benches publish, and attached to the certificate itself. The newest counts; the one beside the authority's
certificate must not be older than any other, nor be missing."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from cryptography import x509

from accept.base.home import home
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.outcome import Step
from accept.certificate.trust import authority
from accept.certificate.trust.published_list import REVOKED, BenchList
from accept.certificate.trust.revocation import RevocationList, Revoked, aged, merged, read_list
from accept.certificate.trust.revocation_record import REMEDY, fault, newest_stored
from accept.certificate.verify.revocation_check import attached_list
from accept.store import StoreError


class ListsBeside:
    """The lists of revoked keys of the trusted authorities. entries: of these lists and of the bench's store."""

    def __init__(self, files: Mapping[Path, x509.Certificate]) -> None:
        """Read them. files: place of the list -> certificate of its authority. Raises RevocationError."""
        self._lists = {path: (ca, read_list(path, ca)) for path, ca in files.items()}
        self._stored = {path: _newest_in_store(ca) for path, ca in files.items()}
        known = [[one for one in (self._lists[path][1], self._stored[path]) if one is not None] for path in files]
        self.entries: list[Revoked] = [entry for each in known for entry in merged(each)]

    def steps(self, contents: CertificateContent, published: Sequence[BenchList]) -> list[Step]:
        """Return a step for each authority: number and age of its list. It is not complete if the list is missing, is
        dated in the future, or is older than one that the store, a published list or the certificate has."""
        found = []
        for path, (ca, listed) in self._lists.items():
            known = ((self._stored[path], "the one in the store"), (attached_list(contents, ca), "the attached one"))
            problems = (fault(listed, path, other, where) for other, where in known)
            words = next(filter(None, problems), "") or _older_than_published(path, ca, listed, published)
            if listed is not None:
                said = f"number {listed.number} of {listed.dated:%Y-%m-%d}{aged(listed.dated)}"
                found.append(Step(f"the list of revoked keys: {said}"))
            found += [Step(words, complete=False)] if words else []
        return found


def _newest_in_store(ca: x509.Certificate) -> RevocationList | None:
    try:
        return newest_stored(home(), ca)[0]
    except StoreError:
        return None  # which the comparison with the store says


def _older_than_published(
    path: Path, ca: x509.Certificate, listed: RevocationList | None, published: Sequence[BenchList]
) -> str:
    own = authority.fingerprint(ca)
    for one in published:
        number = max((e.attempt for e in one.entries if e.what == REVOKED and e.unit == own), default=0)
        if listed is not None and number > listed.number:
            words = (
                f"the list of revoked keys, {path}, has number {listed.number} and is older than the one of {one.name}"
            )
            return f"{words}, number {number}; {REMEDY}"
    return ""
