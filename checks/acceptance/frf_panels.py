"""Pictures of the frequency responses: Bode plots with what is known, the fits, with and without the encoder."""

from collections.abc import Mapping

import numpy as np

from checks.acceptance.frf_modes import Axial
from checks.picture import Band, Item, Line, Mark, Panel
from checks.signals.bode import bode
from checks.signals.frf import Frf
from checks.signals.resonance import Resonance
from checks.signals.zeros import Zero

UNITS = {"Vs": "V/V", "de": "m/V", "da": "m/V"}
SHOWN = 0.15  # of the resonance, each side, in the zoom
COLOURS = ("data", "before")


def curves(frf: Frf, merge_Hz: float) -> dict[str, Panel]:
    """Bode plots and coherence, from 1 Hz up."""
    top = 0.4 * 2 * float(frf.f[-1])  # the converters' filters begin there
    return bode(frf.band(1.0, top), UNITS, merge_Hz=merge_Hz)


def zoom(found: Axial) -> dict[str, Panel]:
    """de and da around the resonance with the fit and the 95 % region of the measured response."""
    first, second = found.first, found.second
    reach = SHOWN if second is None else max(SHOWN, 1.15 * abs(second.f_Hz / first.f_Hz - 1))
    part = found.frf.band((1 - reach) * first.f_Hz, (1 + reach) * first.f_Hz)
    items: list[Item] = []
    for channel, role in zip(("de", "da"), COLOURS, strict=True):
        c = part.index(channel)
        size, r = np.abs(part.H[:, c]), part.radius()[:, c]
        items.append(Band(part.f, np.maximum(size - r, 0.1 * size), np.minimum(size + r, 10 * size)))
        items.append(Line(part.f, size, channel, role=role))
    items += _fit(first, "de", part)
    items.append(Mark(first.f_Hz, label=f"{first.f_Hz:.2f} Hz", role="model"))
    if second is not None:
        items.append(Mark(second.f_Hz, label=f"{second.f_Hz:.2f} Hz", role="model"))
    title = "axial resonance" if second is None else "double resonance"
    return {"resonance": Panel(title, "frequency [Hz]", "magnitude [m/V]", tuple(items), y_log=True)}


def _fit(found: Resonance, channel: str, part: Frf) -> list[Item]:
    w = found.fit.window
    shown = (w.f >= part.f[0]) & (w.f <= part.f[-1])
    H = found.fit.response()[shown, w.channels.index(channel)]
    return [Line(w.f[shown], np.abs(H), "local fit", "dashed", "model")]


def zero(found: Zero) -> dict[str, Panel]:
    """Vs around its zero: the fitted polynomial."""
    items: tuple[Item, ...] = (
        Line(found.f, np.abs(found.measured), "measured", role="data"),
        Line(found.f, np.abs(found.response), "local fit", "dashed", "model"),
        Mark(found.f_Hz, label=f"{found.f_Hz:.2f} Hz", role="model"),
    )
    return {"zero": Panel(f"zero of Vs, {found.side}", "frequency [Hz]", "magnitude [V/V]", items, y_log=True)}


def beside(frf: Frf, without: Frf) -> dict[str, Panel]:
    """Vs and da with and without the encoder (seed 5.1)."""
    out = {}
    for channel in ("Vs", "da"):
        lines = tuple(
            Line(x.f[x.f > 1.0], np.abs(x.H[x.f > 1.0, x.index(channel)]), words, role=role)
            for x, words, role in ((frf, "with encoder", "data"), (without, "without", "before"))
        )
        label = f"magnitude [{UNITS[channel]}]"
        out[f"{channel} without encoder"] = Panel(channel, "frequency [Hz]", label, lines, x_log=True, y_log=True)
    return out


def merged(panels: Mapping[str, Panel], *more: Mapping[str, Panel]) -> dict[str, Panel]:
    """All panels by name."""
    return {name: panel for group in (panels, *more) for name, panel in group.items()}
