"""Certificates: drawn to the byte, signed by technician and quality assurance, verified by anyone.

The names below are loaded when first used: who only draws pages does not wait for the signing library.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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

_WHERE = {
    "Attachments": ("contents", "Attachments"),
    "Dossier": ("dossier", "Dossier"),
    "DossierError": ("dossier", "DossierError"),
    "Rejudge": ("contents", "Rejudge"),
    "Report": ("verification", "Report"),
    "SigningRefused": ("signing", "SigningRefused"),
    "dossier_of": ("dossier", "of"),
    "render": ("pdf", "render"),
    "sign": ("signing", "sign"),
    "verify": ("verification", "verify"),
}


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    module, inside = _WHERE[name]
    return getattr(import_module(f"{__name__}.{module}"), inside)
