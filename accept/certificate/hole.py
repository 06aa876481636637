"""The hole that a signature leaves for itself: the one part of the file that no signature covers.

Nothing in it may be free. Its hexadecimal digits are those of one canonical CMS, zeros follow, and every part of the
CMS is either covered by the signature value, or pinned: certificates, algorithms, number and form of everything else.
"""

from binascii import unhexlify
from collections.abc import Sequence

from asn1crypto import algos, cms
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature, encode_dss_signature
from cryptography.hazmat.primitives.serialization import Encoding

from accept.certificate import der as canonical
from accept.certificate.refused import Refused
from accept.certificate.signing import P256_ORDER

_SHA256 = algos.DigestAlgorithm({"algorithm": "sha256"}).dump()
_ECDSA = algos.SignedDigestAlgorithm({"algorithm": "sha256_ecdsa"}).dump()
_ATTRIBUTES = ["content_type", "message_digest", "signing_certificate_v2"]
_DIGITS = frozenset(b"0123456789ABCDEF")


def byte_range(given: Sequence[object], whole: int) -> tuple[int, int, int]:
    """(start of the hole, end of the hole, end of what is signed) of a /ByteRange in a file of `whole` bytes."""
    numbers = [int(n) if isinstance(n, int) else -1 for n in given]
    if len(numbers) != 4 or numbers[0] != 0 or min(numbers) < 0:
        raise Refused(f"the signed range {numbers} is not two parts from the start of the file")
    start, end = numbers[1], numbers[2]
    last = end + numbers[3]
    if not start < end <= last <= whole:
        raise Refused(f"the signed range {numbers} does not lie within the file of {whole} bytes")
    return start, end, last


def read_hole(pdf: bytes, start: int, end: int) -> bytes:
    """The CMS in pdf[start:end], which must be "<", canonical CMS in upper-case hexadecimal, zeros, ">"."""
    if pdf[start : start + 1] != b"<" or pdf[end - 1 : end] != b">":
        raise Refused("the hole of the signature is not exactly the string of its contents")
    digits = pdf[start + 1 : end - 1]
    if not _DIGITS.issuperset(digits) or len(digits) % 2:
        raise Refused("the hole of the signature holds more than upper-case hexadecimal digits")
    content = unhexlify(digits)
    der = content[: _length(content)]
    if any(content[len(der) :]):
        raise Refused("the padding behind the signature is not zero")
    return der


def check_cms(der: bytes, digest: bytes, trusted: Sequence[x509.Certificate]) -> x509.Certificate:
    """The signer's certificate of a CMS that is canonical and holds nothing that is neither signed nor pinned.

    digest : SHA-256 of the bytes outside the hole. That the signature value fits is checked later, by pyhanko.
    """
    try:
        canonical.check(der)
    except canonical.NotCanonical as e:
        raise Refused(f"the signature is not encoded canonically: it {e}") from e
    content = cms.ContentInfo.load(der, strict=True)
    if content["content_type"].native != "signed_data":
        raise Refused("the signature is not CMS signed data")
    signed = content["content"]
    _check_container(signed)
    info = signed["signer_infos"][0]
    _check_signer(info)
    signed_digest = next(a for a in info["signed_attrs"] if a["type"].native == "message_digest")["values"].native
    if signed_digest != [digest]:
        raise Refused("the document was changed after it was signed")
    return _signer_certificate(signed, info, trusted)


def _length(content: bytes) -> int:
    """Length of the DER value at the start: tag, length in its shortest form, contents."""
    if len(content) < 6 or content[0] != 0x30 or content[1] != 0x82:
        raise Refused("the hole of the signature holds no CMS")
    length = 4 + int.from_bytes(content[2:4], "big")
    if length > len(content):
        raise Refused("the CMS is longer than the hole of the signature")
    return length


def _check_container(signed: cms.SignedData) -> None:
    digests = [d.dump() for d in signed["digest_algorithms"]]
    if len(digests) != 1 or digests[0] != signed["signer_infos"][0]["digest_algorithm"].dump():
        raise Refused("the signature names other digest algorithms than its signer's")
    if len(signed["signer_infos"]) != 1:
        raise Refused("there is not exactly one signer in the signature")
    if signed["version"].native != "v1" or len(signed["crls"] or ()):
        raise Refused("the signature carries what this program never writes")
    inner = signed["encap_content_info"]
    if inner["content_type"].native != "data" or inner["content"].native is not None:
        raise Refused("the signature carries content of its own")


def _check_signer(info: cms.SignerInfo) -> None:
    if len(info["unsigned_attrs"] or ()):
        raise Refused("the signature carries unsigned attributes")
    if info["version"].native != "v1" or info["sid"].name != "issuer_and_serial_number":
        raise Refused("the signer is not named by issuer and serial number")
    for part, expected in (("digest_algorithm", _SHA256), ("signature_algorithm", _ECDSA)):
        if info[part].dump() != expected:
            raise Refused(f"the signature's {part.replace('_', ' ')} is not the one this bench uses")
    value = info["signature"].native
    r, s = decode_dss_signature(value)
    if encode_dss_signature(r, s) != value or not (0 < r < P256_ORDER and 0 < s <= P256_ORDER // 2):
        raise Refused("the signature value is not in its one canonical form")
    kinds = sorted(attribute["type"].native for attribute in info["signed_attrs"])
    if kinds != _ATTRIBUTES:
        raise Refused(f"the signature signs the attributes {', '.join(kinds)}, not {', '.join(_ATTRIBUTES)}")


def _signer_certificate(
    signed: cms.SignedData, info: cms.SignerInfo, trusted: Sequence[x509.Certificate]
) -> x509.Certificate:
    """The certificate that is not the CA's; there must be just these two, the CA's to the byte a trusted one."""
    carried = [choice.chosen.dump() for choice in signed["certificates"] if choice.name == "certificate"]
    if len(carried) != 2 or len(signed["certificates"]) != 2:
        raise Refused(f"the signature carries {len(signed['certificates'])} certificates, expected signer and CA")
    roots = {c.public_bytes(Encoding.DER) for c in trusted}
    own = [der for der in carried if der not in roots]
    if len(own) != 1:
        raise Refused("the signature was not made under a trusted CA")
    certificate = x509.load_der_x509_certificate(own[0])
    if info["sid"].chosen["serial_number"].native != certificate.serial_number:
        raise Refused("the signer named in the signature is not the one whose certificate it carries")
    return certificate
