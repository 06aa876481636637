"""Labels of a model's values for people."""

from checks.model import ModalApa, Model
from specs.units import model_label


def value_label(model: Model, name: str) -> str:
    """Return the label of a value, such as "APA: mode stiffness 3 (1243 Hz)", with the frequency of that free mode."""
    f_Hz = model.apa.frequencies_Hz.get(name) if isinstance(model.apa, ModalApa) else None
    return model_label(name) if f_Hz is None else f"{model_label(name)} ({f_Hz:.0f} Hz)"
