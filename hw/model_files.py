"""A model by name or file, with the matrices it names read from theirs."""

from pathlib import Path

from checks.model.build import build, file_nodes
from checks.model.model import Model
from checks.model.structure.superelement import Superelement
from hw.superelement import read_superelement
from specs.model import ModelSpec, load_model


def open_model(name: str | Path) -> Model:
    """Model by built-in name or TOML file. Raises SpecError for the file, ModelError for what it describes."""
    return model_of(load_model(name))


def model_of(spec: ModelSpec) -> Model:
    """Model of a description that was read already. Raises ModelError."""
    return build(spec, matrices_of(spec))


def matrices_of(spec: ModelSpec) -> Superelement | None:
    """The superelement that a description names, read and checked; None where it names none."""
    return None if spec.apa_file is None else read_superelement(spec.apa_file, file_nodes(spec))
