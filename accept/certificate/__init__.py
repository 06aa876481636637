"""Certificates: drawn to the byte, signed by technician and quality assurance, verified by anyone."""

from accept.certificate.dossier import Dossier, DossierError
from accept.certificate.dossier import of as dossier_of
from accept.certificate.render import render

__all__ = ["Dossier", "DossierError", "dossier_of", "render"]
