"""Pictures that take long to compute, kept beside the unit's records so that a restart shows them at once."""

import json
from collections.abc import Mapping
from pathlib import Path

from accept.base.atomic_files import write_atomic
from accept.pictures.jsonform import panels_from_json, panels_to_json
from accept.pictures.reduce import reduce_panel
from checks.picture import Panel
from specs.files import json_of


def save(folder: Path, name: str, upto: int, panels: Mapping[str, Panel]) -> None:
    """Keep the pictures of a step, judged by the entries up to `upto`. Raises OSError."""
    small = {key: reduce_panel(panel) for key, panel in panels.items()}
    write_atomic(_file(folder, name, upto), json.dumps(panels_to_json(small)).encode())


def load(folder: Path, name: str, upto: int) -> dict[str, Panel]:
    """Return the pictures that were kept, an empty mapping if they are absent or unusable: they can be drawn again."""
    try:
        return panels_from_json(json_of(_file(folder, name, upto).read_bytes()))
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def _file(folder: Path, name: str, upto: int) -> Path:
    return folder / "pictures" / f"{name}-{upto}.json"
