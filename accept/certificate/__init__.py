"""Certificates: drawn to the byte, signed by technician and quality assurance, verified by anyone."""

from accept.certificate.contents import Attachments, Rejudge
from accept.certificate.dossier import Dossier, DossierError
from accept.certificate.dossier import of as dossier_of
from accept.certificate.pdf import render
from accept.certificate.signing import SigningRefused, sign
from accept.certificate.verification import Report, verify

__all__ = [
    "Attachments",
    "Dossier",
    "DossierError",
    "Rejudge",
    "Report",
    "SigningRefused",
    "dossier_of",
    "render",
    "sign",
    "verify",
]
