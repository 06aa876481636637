"""The /Contents placeholder, which the signature does not cover: the only such part of the file.

Nothing in it may be free. Its content is built again from the signer's certificate, the digest of the document and the
signature value, and must be the same to the byte; zeros follow to the end. Those three cannot be exchanged: the
certificate's hash and the digest are signed, and of the two valid signature values only the lower one is accepted.
"""

import hashlib
from binascii import unhexlify
from collections.abc import Sequence

from asn1crypto import algos, cms, tsp
from asn1crypto import x509 as asn1_x509
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature, encode_dss_signature
from cryptography.hazmat.primitives.serialization import Encoding

from accept.certificate.contents.outcome import InvalidCertificate
from accept.certificate.trust.authority import P256_ORDER

_DIGITS = frozenset(b"0123456789ABCDEF")


def byte_range(given: Sequence[object], whole: int) -> tuple[int, int, int]:
    """Return (start of the placeholder, its end, end of the signed bytes) of a /ByteRange in a file of `whole`
    bytes."""
    numbers = [int(n) if isinstance(n, int) else -1 for n in given]
    if len(numbers) != 4 or numbers[0] != 0 or min(numbers) < 0:
        raise InvalidCertificate(f"the signed range {numbers} is not two parts from the start of the file")
    start, end = numbers[1], numbers[2]
    last = end + numbers[3]
    if not start < end <= last <= whole:
        raise InvalidCertificate(f"the signed range {numbers} does not lie within the file of {whole} bytes")
    return start, end, last


def read_hole(pdf: bytes, start: int, end: int) -> bytes:
    """Return the bytes in pdf[start:end], padding included. They must be "<", upper-case hexadecimal, ">"."""
    if pdf[start : start + 1] != b"<" or pdf[end - 1 : end] != b">":
        raise InvalidCertificate("the hole of the signature is not exactly the string of its contents")
    digits = pdf[start + 1 : end - 1]
    if not _DIGITS.issuperset(digits) or len(digits) % 2:
        raise InvalidCertificate("the hole of the signature holds more than upper-case hexadecimal digits")
    return unhexlify(digits)


def check_hole(content: bytes, digest: bytes, trusted: Sequence[x509.Certificate]) -> x509.Certificate:
    """Return the signer's certificate in a placeholder whose content is canonical to the last byte of its padding.

    digest : SHA-256 of the bytes outside the placeholder. The signature value is checked later, by pyhanko.
    """
    signed = cms.ContentInfo.load(content)["content"]
    if len(signed["signer_infos"]) != 1:
        raise InvalidCertificate("there is not exactly one signer in the signature")
    info = signed["signer_infos"][0]
    stated = [a["values"].native for a in info["signed_attrs"] if a["type"].native == "message_digest"]
    if stated != [[digest]]:
        raise InvalidCertificate("the document was changed after it was signed")
    signer, root = _certificates(signed, trusted)
    canonical = _built(signer, root, digest, _lower(info["signature"].native), token_of(content))
    if not content.startswith(canonical):
        raise InvalidCertificate(
            "the signature is not encoded canonically, or carries more than certificate, digest and value"
        )
    if any(content[len(canonical) :]):
        raise InvalidCertificate("the padding behind the signature is not zero")
    return x509.load_der_x509_certificate(signer)


def token_of(content: bytes) -> bytes | None:
    """Return the timestamp beside a signature, None if it has none. Raises InvalidCertificate if another attribute is
    found there."""
    info = cms.ContentInfo.load(content)["content"]["signer_infos"][0]
    beside = list(info["unsigned_attrs"])
    if not beside:
        return None
    if len(beside) != 1 or beside[0]["type"].native != "signature_time_stamp_token" or len(beside[0]["values"]) != 1:
        raise InvalidCertificate("the signature carries more than a timestamp beside it")
    return bytes(beside[0]["values"][0].dump())


def signature_of(content: bytes) -> bytes:
    """Return the signature value in a placeholder's content."""
    return bytes(cms.ContentInfo.load(content)["content"]["signer_infos"][0]["signature"].native)


def _lower(value: bytes) -> bytes:
    """Return the signature value with its s in the lower half, in DER: the accepted one of each pair of valid
    values."""
    r, s = decode_dss_signature(value)
    return encode_dss_signature(r, min(s, P256_ORDER - s))


def _certificates(signed: cms.SignedData, trusted: Sequence[x509.Certificate]) -> tuple[bytes, bytes]:
    """Return (signer's, CA's) certificate. Exactly two are carried, and one of them is a trusted one to the byte."""
    carried = [choice.chosen.dump() for choice in signed["certificates"]]
    roots = {c.public_bytes(Encoding.DER) for c in trusted}
    own, known = [c for c in carried if c not in roots], [c for c in carried if c in roots]
    if not known:
        raise InvalidCertificate("the signature was not made under a trusted CA")
    if len(own) != 1 or len(known) != 1:
        raise InvalidCertificate(
            f"the signature carries {len(carried)} certificates, expected the signer's and the CA's"
        )
    return own[0], known[0]


_SHA256 = {"algorithm": "sha256"}
_ECDSA = {"algorithm": "sha256_ecdsa"}


def _built(signer: bytes, root: bytes, digest: bytes, signature: bytes, token: bytes | None = None) -> bytes:
    """Return the one CMS that certificate, digest and signature value make (PAdES baseline: [RFC5652], [RFC5035]), in
    DER. signer, root : their certificates in DER. digest : SHA-256 of the signed
    bytes. token : timestamp of the signature, as its authority gave it."""
    certificate = asn1_x509.Certificate.load(signer)
    identifier = cms.IssuerAndSerialNumber({"issuer": certificate.issuer, "serial_number": certificate.serial_number})
    info = {
        "version": "v1",
        "sid": cms.SignerIdentifier("issuer_and_serial_number", identifier),
        "digest_algorithm": algos.DigestAlgorithm(_SHA256),
        "signed_attrs": _signed_attributes(certificate, digest),
        "signature_algorithm": algos.SignedDigestAlgorithm(_ECDSA),
        "signature": signature,
    }
    if token is not None:
        stamp = {"type": "signature_time_stamp_token", "values": [cms.ContentInfo.load(token)]}
        info["unsigned_attrs"] = cms.CMSAttributes([cms.CMSAttribute(stamp)])
    carried = [cms.CertificateChoices("certificate", asn1_x509.Certificate.load(c)) for c in (root, signer)]
    content = {
        "version": "v1",
        "digest_algorithms": [algos.DigestAlgorithm(_SHA256)],
        "encap_content_info": {"content_type": "data"},
        "certificates": carried,
        "signer_infos": [info],
    }
    return bytes(cms.ContentInfo({"content_type": "signed_data", "content": cms.SignedData(content)}).dump())


def _signed_attributes(certificate: asn1_x509.Certificate, digest: bytes) -> cms.CMSAttributes:
    identified = {
        "hash_algorithm": _SHA256,
        "cert_hash": hashlib.sha256(certificate.dump()).digest(),
        "issuer_serial": {
            "issuer": [asn1_x509.GeneralName("directory_name", certificate.issuer)],
            "serial_number": certificate.serial_number,
        },
    }
    values = {
        "content_type": "data",
        "message_digest": digest,
        "signing_certificate_v2": tsp.SigningCertificateV2({"certs": [tsp.ESSCertIDv2(identified)]}),
    }
    return cms.CMSAttributes([cms.CMSAttribute({"type": kind, "values": [value]}) for kind, value in values.items()])
