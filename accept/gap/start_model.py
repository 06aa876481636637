"""Whether a unit's responses are to be explained, from which model, and whether that was done before."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accept.base.documents.analyses import REFUSED
from accept.units import UnitFolder
from checks.errors import ModelError
from specs.spec import Spec
from specs.strict import SpecError


@dataclass(frozen=True)
class StartModel:
    """The model that the workflow starts from, by name or file, with its hash; None if it cannot be opened."""

    model: str
    sha256: str | None

    @classmethod
    def of(cls, spec: Spec, model: str | None = None) -> "StartModel | None":
        """Return the start model by name, else the spec's; None if neither names one: then no workflow is run."""
        name = model or (spec.gap.model if spec.gap else None)
        return None if name is None else cls.at(name)

    @classmethod
    def at(cls, name: str) -> "StartModel":
        return cls(name, _sha256(name))

    def answer(self, found: Mapping[str, Any]) -> dict[str, Any]:
        """Return the key `gap` of a result: gap.json without the serial, and the model it began from."""
        return {key: value for key, value in found.items() if key != "serial"} | self._about | {"reason": None}

    def refused(self, reason: str) -> dict[str, Any]:
        """Return the key `gap` of a result for a workflow that gave no answer."""
        return self._about | {"verdict": REFUSED, "reason": reason}

    @property
    def _about(self) -> dict[str, Any]:
        return {"start": self.model, "model_sha256": self.sha256}


def stands(known: Mapping[str, Any] | None, start: StartModel | None, out: Path) -> bool:
    """Return whether a stored explanation, or None, has the start model of a new one, unchanged, and the improved model
    that it names is in `out`."""
    if known is None or start is None:
        return known is None and start is None
    improved = known.get("improved")
    same = (known.get("start"), known.get("model_sha256")) == (start.model, start.sha256)
    return same and (improved is None or (out / str(improved)).is_file())


def applies(folder: UnitFolder) -> bool:
    """Return whether there are responses to explain."""
    section = folder.sections.get("frf")
    return section is not None and bool(section.entries)


def _sha256(model: str) -> str | None:
    from accept.models.model_file import open_model

    try:
        return open_model(model).sha256
    except (SpecError, ModelError, OSError):
        return None
