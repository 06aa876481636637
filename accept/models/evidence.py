"""The model files behind a verdict: read once, hashed, attached to the certificate and opened again from there.

The modules that open models are loaded if a spec names a model; most specs name none."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from accept.base.documents.manifest import ModelFiles, hashes
from checks.acceptance import CHECKS
from checks.errors import ModelError
from specs.model import builtin_models, load_model, parse_model
from specs.model_sections import LearnedBenchRecord
from specs.spec import CheckSpec, Spec
from specs.strict import SpecError

if TYPE_CHECKING:
    from accept.models.model_file import OpenedModel
    from checks.model import Model


@dataclass
class Models:
    """Opens the models of a spec, each once, and keeps the files of those that are not built in.

    given : model files of a certificate by the spec's names; then no other is opened. place : folder to unpack them,
    each in a folder of its own, numbered in order of name."""

    given: Mapping[str, ModelFiles] | None = None
    place: Path = Path()
    _opened: "dict[str, OpenedModel]" = field(default_factory=dict, init=False, repr=False)

    def hashes(self, spec: Spec) -> dict[str, dict[str, str]]:
        """Return name -> file name -> sha256 of every model file that a spec names."""
        if self.given is None:
            return hashes(evidence_of(named_models(spec)))
        return hashes(self.given)

    def open(self, name: str) -> "Model":
        """Raise SpecError, ModelError, OSError."""
        return self._model_of(name).model

    def learned_bench(self, name: str) -> LearnedBenchRecord | None:
        """Return the learned bench of a model; None if it has none. Raise SpecError, ModelError, OSError."""
        return self._model_of(name).spec.learned_bench

    def _model_of(self, name: str) -> "OpenedModel":
        if name not in self._opened:
            self._opened[name] = self._open(name)
        return self._opened[name]

    def _open(self, name: str) -> "OpenedModel":
        from accept.models.model_file import model_of_spec
        from hw.superelement import matrices_of

        if name in builtin_models() or self.given is None:
            return model_of_spec(load_model(name))
        if not self.given.get(name):
            raise SpecError(name, ["is a model file of the spec, but is not attached"])
        folder = self.place / str(sorted(self.given).index(name))
        file, content = next(iter(self.given[name].items()))
        return model_of_spec(parse_model(content, file, folder), partial(matrices_of, folder=folder))


def named_models(spec: Spec) -> list[str]:
    """Return the models of a spec by built-in name or file: those of its checks and that of the responses."""
    names = [name for check, asked in spec.checks.items() if (name := model_of(check, asked)) is not None]
    if spec.gap is not None:
        names.append(spec.gap.model)
    return list(dict.fromkeys(names))


def model_of(check: str, asked: CheckSpec) -> str | None:
    """Return the name or file of the model that a check compares with; None if it uses no model."""
    declared = CHECKS[check]
    if declared.model is None:
        return None
    default = next(s.default for s in declared.settings if s.name == declared.model)
    return str(asked.settings.get(declared.model, default))


def evidence_of(names: Iterable[str]) -> dict[str, ModelFiles]:
    """Return the files of every model that is not built in, by name. An unreadable model has none."""
    return {name: _read(name) for name in names if name not in builtin_models()}


def _read(name: str) -> dict[str, bytes]:
    from hw.superelement import contents_of

    try:
        spec = load_model(name)
        return {Path(name).name: spec.text.encode()} | ({} if spec.apa_file is None else contents_of(spec.apa_file))
    except (SpecError, ModelError, OSError):
        return {}
