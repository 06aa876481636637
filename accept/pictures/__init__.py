"""Pictures: panels, which are data, drawn with matplotlib for files and for the certificate."""

from accept.pictures.draw import FORMATS, PictureError, draw, picture
from accept.pictures.jsonform import panels_from_json, panels_to_json
from accept.pictures.reduce import reduced

__all__ = ["FORMATS", "PictureError", "draw", "panels_from_json", "panels_to_json", "picture", "reduced"]
