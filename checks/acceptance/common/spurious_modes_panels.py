"""Pictures of the spurious modes: the impacts of each record, and its FRF with its modes."""

from collections.abc import Mapping

import numpy as np

from checks.declare import Values
from checks.picture import Band, Item, Line, Mark, Panel
from checks.signals.impact.hammer import HammerTest, ImpactFrf
from checks.signals.impact.impacts import impacts_panel
from checks.signals.impact.modal_fit import Mode


def panels(
    values: Values,
    tests: Mapping[str, HammerTest],
    modes: Mapping[str, tuple[Mode, ...]],
    band_Hz: tuple[float, float],
) -> dict[str, Panel]:
    """Return the panels "<record>_impacts" of every record that could be read, "<record>_frf" for those with an FRF."""
    out = {
        f"{key}_impacts": impacts_panel(_words(key), values[key].t, test.force, test.impacts)
        for key, test in tests.items()
    }
    for key, test in tests.items():
        if test.frf is not None:
            # The mode that only the left impact has is torsion, so the top one's FRF is drawn with it.
            top = tests["torsion_top"].frf if key == "torsion_left" and "torsion_top" in tests else None
            out[f"{key}_frf"] = frf_panel(key, test.frf, modes.get(key, ()), band_Hz, top)
    return out


def frf_panel(
    key: str, frf: ImpactFrf, modes: tuple[Mode, ...], band_Hz: tuple[float, float], beside: ImpactFrf | None = None
) -> Panel:
    """Return the magnitude of the averaged FRF with its 95 % band, the local fits and the modes."""
    s = (band_Hz[0] <= frf.f) & (frf.f <= band_Hz[1])
    magnitude, u = np.abs(frf.H[s]), np.sqrt(frf.var[s])
    items: list[Item] = [
        Band(frf.f[s], np.maximum(magnitude - 2 * u, 0.1 * magnitude), magnitude + 2 * u, "scatter between impacts"),
        Line(frf.f[s], magnitude, "measured", role="data"),
    ]
    if beside is not None:
        k = (band_Hz[0] <= beside.f) & (beside.f <= band_Hz[1])
        items.insert(1, Line(beside.f[k], np.abs(beside.H[k]), "top impact", role="before"))
    for n, m in enumerate(modes):
        items.append(Line(m.f, np.abs(m.fit), "" if n else "local fit", "dashed", "model"))
        items.append(Mark(m.f_Hz, label=f"{m.f_Hz:.4g} Hz", role="model"))
    return Panel(_words(key), "frequency [Hz]", "|rotation / force| [rad/N]", tuple(items), x_log=True, y_log=True)


def _words(key: str) -> str:
    return key.replace("_", " ")
