"""Signing with a key that never leaves its token (PKCS#11). Needs `python-pkcs11`, which the bench does without."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from pyhanko.config.pkcs11 import TokenCriteria
from pyhanko.sign.pkcs11 import PKCS11Signer, open_pkcs11_session
from pyhanko_certvalidator.registry import CertificateStore, SimpleCertificateStore

from accept.certificate.signature.long_term import loaded
from accept.certificate.signature.signing import LowS
from accept.certificate.trust.keys import Credential


@dataclass(frozen=True)
class Token:
    """The place of a key: library of the token's maker, label of the token, label of the key (EC P-256)."""

    library: str
    label: str
    key_label: str


class TokenSigner(LowS, PKCS11Signer):
    """Carries just the signer's and the CA's certificate: pyhanko would carry the signer's twice."""

    @property
    def cert_registry(self) -> CertificateStore:
        store = SimpleCertificateStore()  # type: ignore[no-untyped-call]
        store.register_multiple(c for c in super().cert_registry if c.dump() != self.signing_cert.dump())
        return store


@contextmanager
def token_signer(token: Token, pin: str, credential: Credential) -> Iterator[TokenSigner]:
    """Yield a signer for `sign(..., signer=...)`, open as long as the token's session."""
    certificate, root = loaded([credential.certificate, credential.ca])
    with open_pkcs11_session(token.library, token_criteria=TokenCriteria(label=token.label), user_pin=pin) as session:
        yield TokenSigner(
            session,
            signing_cert=certificate,
            ca_chain=[root],
            key_label=token.key_label,
            use_raw_mechanism=True,  # the digest is made here: every token can sign one, not every one can make it
        )
