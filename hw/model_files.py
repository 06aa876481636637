"""The model of a description, with the matrices that it names read from their file."""

from checks.model.build import build, file_nodes
from checks.model.model import Model
from checks.model.structure.superelement import Superelement
from hw.superelement import read_superelement
from specs.model import ModelSpec


def model_of(spec: ModelSpec) -> Model:
    """Model of a description that was read already. Raises ModelError."""
    return build(spec, matrices_of(spec))


def matrices_of(spec: ModelSpec) -> Superelement | None:
    """The superelement that a description names, read and checked; None where it names none."""
    return None if spec.apa_file is None else read_superelement(spec.apa_file, file_nodes(spec))
