"""Pictures that take long to compute, kept beside the unit's records so that a restart shows them at once. The bench
signs them with its own key: a file that was edited, or copied from another unit or step, is drawn again."""

import json
from collections.abc import Mapping
from pathlib import Path

from accept.base.atomic_files import write_atomic
from accept.base.home import home
from accept.pictures.jsonform import panels_from_json, panels_to_json
from accept.pictures.reduce import reduce_panel
from accept.store import BENCH_KEY, Sealer
from checks.picture import Panel
from specs.files import json_of, read_bounded


def save(folder: Path, name: str, upto: int, panels: Mapping[str, Panel]) -> None:
    """Keep the pictures of a step, judged by the entries up to `upto`. Raises OSError."""
    small = {key: reduce_panel(panel) for key, panel in panels.items()}
    file = _file(folder, name, upto)
    write_atomic(file, _sealer(file).signed(json.dumps({"of": _of(file), "panels": panels_to_json(small)})))


def load(folder: Path, name: str, upto: int) -> dict[str, Panel]:
    """Return the pictures that were kept, an empty mapping if they are absent or unusable: they can be drawn again."""
    file = _file(folder, name, upto)
    try:
        kept = json_of(_sealer(file).text_of(read_bounded(file)) or "")
        return panels_from_json(kept["panels"]) if kept["of"] == _of(file) else {}
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def _file(folder: Path, name: str, upto: int) -> Path:
    return folder / "pictures" / f"{name}-{upto}.json"


def _of(file: Path) -> list[str]:
    return list(file.absolute().parts[-3:])


def _sealer(file: Path) -> Sealer:
    return Sealer(file, home() / BENCH_KEY)
