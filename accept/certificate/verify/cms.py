"""The one CMS that a certificate, a digest and a signature value make (PAdES baseline: [RFC5652], [RFC5035], DER)."""

import hashlib

from asn1crypto import algos, cms, tsp, x509

_SHA256 = {"algorithm": "sha256"}
_ECDSA = {"algorithm": "sha256_ecdsa"}


def build(signer: bytes, root: bytes, digest: bytes, signature: bytes, token: bytes | None = None) -> bytes:
    """Return the DER encoding of the CMS. signer, root : their certificates in DER. digest : SHA-256 of the signed
    bytes. token : timestamp of the signature, as its authority gave it."""
    certificate = x509.Certificate.load(signer)
    info = {
        "version": "v1",
        "sid": cms.SignerIdentifier("issuer_and_serial_number", _issuer_and_serial(certificate)),
        "digest_algorithm": algos.DigestAlgorithm(_SHA256),
        "signed_attrs": _signed_attributes(certificate, digest),
        "signature_algorithm": algos.SignedDigestAlgorithm(_ECDSA),
        "signature": signature,
    }
    if token is not None:
        stamp = {"type": "signature_time_stamp_token", "values": [cms.ContentInfo.load(token)]}
        info["unsigned_attrs"] = cms.CMSAttributes([cms.CMSAttribute(stamp)])
    carried = [cms.CertificateChoices("certificate", x509.Certificate.load(c)) for c in (root, signer)]
    content = {
        "version": "v1",
        "digest_algorithms": [algos.DigestAlgorithm(_SHA256)],
        "encap_content_info": {"content_type": "data"},
        "certificates": carried,
        "signer_infos": [info],
    }
    built: bytes = cms.ContentInfo({"content_type": "signed_data", "content": cms.SignedData(content)}).dump()
    return built


def _signed_attributes(certificate: x509.Certificate, digest: bytes) -> cms.CMSAttributes:
    identified = {
        "hash_algorithm": _SHA256,
        "cert_hash": hashlib.sha256(certificate.dump()).digest(),
        "issuer_serial": {
            "issuer": [x509.GeneralName("directory_name", certificate.issuer)],
            "serial_number": certificate.serial_number,
        },
    }
    values = {
        "content_type": "data",
        "message_digest": digest,
        "signing_certificate_v2": tsp.SigningCertificateV2({"certs": [tsp.ESSCertIDv2(identified)]}),
    }
    return cms.CMSAttributes([cms.CMSAttribute({"type": kind, "values": [value]}) for kind, value in values.items()])


def _issuer_and_serial(certificate: x509.Certificate) -> cms.IssuerAndSerialNumber:
    return cms.IssuerAndSerialNumber({"issuer": certificate.issuer, "serial_number": certificate.serial_number})
