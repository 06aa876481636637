"""Which files pictures are written to. Loads nothing, so that a command can refuse a name before its work begins."""

from pathlib import Path

from specs.errors import AcceptError

FORMATS = ("pdf", "svg", "png")


class PictureError(AcceptError, ValueError):
    """A picture that cannot be drawn or written; the text states which and why."""


def format_of(path: Path) -> str:
    """Return the format that a file's ending names. Raises PictureError."""
    ending = path.suffix.lstrip(".").lower()
    if ending not in FORMATS:
        raise PictureError(f"{path}: the name of a picture ends in .pdf, .svg or .png")
    return ending
