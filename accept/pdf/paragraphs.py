"""Paragraphs of text that comes from outside."""

from html import escape
from typing import Any

from reportlab.platypus import Paragraph

from accept.pdf import page_style
from accept.pictures.words import pretty


def words(text: object, style: Any = page_style.BODY) -> Paragraph:
    """Paragraph of any text: markup in it stays text, control characters become blanks."""
    plain = "".join(c if c.isprintable() else " " for c in pretty(str(text)))
    return Paragraph(escape(plain, quote=False), style)
