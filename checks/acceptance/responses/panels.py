"""Pictures of the responses: Bode plots with confidence regions, the fits, with and without the encoder."""

from dataclasses import replace

import numpy as np

from checks.picture import Band, Item, Line, Mark, Panel, PanelKind
from checks.record import MOTIONS, Record
from checks.signals.spectral.bode import bode
from checks.signals.spectral.frf import Frf
from checks.signals.spectral.lpm import lpm_record
from checks.signals.spectral.resonance import Resonance
from checks.signals.spectral.zeros import Zero

UNITS = {"Vs": "V/V", "de": "m/V", "da": "m/V"}
SHOWN = 0.15  # of the resonance, each side, in the zoom
COLOURS = ("data", "before")
POINTS = 300  # of a coherence as it is drawn


def curves(frf: Frf, merge_Hz: float) -> dict[str, Panel]:
    """Return the magnitude of every channel, all phases in one panel, and coherence, from 1 Hz up."""
    top = 0.4 * 2 * float(frf.f[-1])  # the converters' filters begin there
    panels = bode(frf.band(1.0, top), UNITS, merge_Hz=merge_Hz)
    phases = {name: panels.pop(f"{name} phase") for name in frf.channels}
    one = phases[frf.channels[0]]
    lines = [replace(p.items[0], label=name, role="auto") for name, p in phases.items() if isinstance(p.items[0], Line)]
    marks = [item for item in one.items if isinstance(item, Mark)]
    return panels | {"phase": replace(one, title=f"phase against {frf.input}", items=(*lines, *marks))}


def zoom(low: Record, first: Resonance, second: Resonance | None) -> dict[str, Panel]:
    """Return the motions around the resonance, free of leakage, with the fit and the 95 % region of the response."""
    reach = SHOWN if second is None else max(SHOWN, 1.15 * abs(second.f_Hz / first.f_Hz - 1))
    motions = tuple(c for c in MOTIONS if c in first.fit.window.channels)
    part = _near(low, motions, (1 - reach) * first.f_Hz, (1 + reach) * first.f_Hz)
    items: list[Item] = []
    for c, role in zip(range(len(motions)), COLOURS, strict=False):
        size, r = np.abs(part.H[:, c]), part.radius()[:, c]
        items.append(Band(part.f, np.maximum(size - r, 0.1 * size), np.minimum(size + r, 10 * size)))
        items.append(Line(part.f, size, part.channels[c], role=role))
    w = first.fit.window
    shown = (w.f >= part.f[0]) & (w.f <= part.f[-1])
    fitted = np.abs(first.fit.response()[shown, w.channels.index(motions[0])])
    items.append(Line(w.f[shown], fitted, "local fit", "dashed", "model"))
    items += [Mark(m.f_Hz, label=f"{m.f_Hz:.2f} Hz", role="model") for m in (first, second) if m is not None]
    title = "axial resonance" if second is None else "double resonance"
    return {
        "resonance": Panel(title, "frequency [Hz]", "magnitude [m/V]", tuple(items), y_log=True, kind=PanelKind.CURVE)
    }


def _near(record: Record, channels: tuple[str, ...], f_lo: float, f_hi: float) -> Frf:
    bins = max(1, round((f_hi - f_lo) * record.duration / POINTS))
    return lpm_record(record, "Va", channels, f_lo, f_hi, bins)


def zero(low: Record, found: Zero) -> dict[str, Panel]:
    """Return Vs around its zero with the fitted polynomial."""
    part = _near(low, ("Vs",), found.f[0], found.f[-1])
    size, r = np.abs(part.H[:, 0]), part.radius()[:, 0]
    items: tuple[Item, ...] = (
        Band(part.f, np.maximum(size - r, 0.1 * size), np.minimum(size + r, 10 * size), "95 % region"),
        Line(part.f, size, "measured", role="data"),
        Line(found.f, np.abs(found.response), "local fit", "dashed", "model"),
        Mark(found.f_Hz, label=f"{found.f_Hz:.2f} Hz", role="model"),
    )
    return {
        "zero": Panel(
            f"zero of Vs, {found.side}", "frequency [Hz]", "magnitude [V/V]", items, y_log=True, kind=PanelKind.CURVE
        )
    }


def without_encoder(frf: Frf, without: Frf) -> dict[str, Panel]:
    """Return Vs and da with and without the encoder ([STB] 5.1)."""
    out = {}
    for channel in ("Vs", "da"):
        lines = tuple(
            Line(x.f[x.f > 1.0], np.abs(x.H[x.f > 1.0, x.index(channel)]), words, role=role)
            for x, words, role in ((frf, "with encoder", "data"), (without, "without", "before"))
        )
        label = f"magnitude [{UNITS[channel]}]"
        out[f"{channel} without encoder"] = Panel(
            channel, "frequency [Hz]", label, lines, x_log=True, y_log=True, kind=PanelKind.CURVE
        )
    return out
