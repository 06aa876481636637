"""Sweep of a parameter: poles, zeros and responses for a row of its values ([STB] 6.2, 6.3)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.model.model import Model, frequencies, frequency_and_damping
from checks.picture import Line, Panel, PanelKind
from specs.units import DIMENSIONLESS, unit_of

# Parameters that move together, and the values studied in [STB] 6.2 and 6.3.
PUBLISHED_SWEEPS: Mapping[str, tuple[tuple[str, ...], tuple[float, ...]]] = {
    "dy": (("misalignment.dy_um",), (-500.0, -100.0, 0.0, 100.0, 500.0)),
    "dx": (("misalignment.dx_um",), (-100.0, -50.0, 0.0, 50.0, 100.0)),
    "dz": (("misalignment.dz_um",), (-500.0, -100.0, 0.0, 100.0, 500.0)),
    "kz": (("joint.kz_N_per_um",), (50.0, 75.0, 100.0, 250.0)),
    "kR": (("joint.kRx_Nm_per_rad", "joint.kRy_Nm_per_rad"), (3.0, 4.0, 5.0, 6.0, 7.0)),
    "cR": (("joint.cR_Nm_s_per_rad",), (1e-3, 5e-3, 1e-2, 5e-2, 1e-1)),
}


@dataclass(frozen=True, eq=False)
class Roots:
    """Poles or zeros below the band's end: f [Hz], damping ratio (below zero: right half plane), both (r,)."""

    f: Array
    damping: Array


@dataclass(frozen=True, eq=False)
class SweepRow:
    """The response at one value: poles, zeros, H (F,) at the sweep's frequencies."""

    value: float
    poles: Roots
    zeros: Roots
    H: Complex


@dataclass(frozen=True, eq=False)
class Sweep:
    """Responses of a channel for a row of values. names: the parameters that take these values; f (F,) [Hz]."""

    names: tuple[str, ...]
    channel: str
    f: Array
    rows: tuple[SweepRow, ...]

    @property
    def table(self) -> list[dict[str, object]]:
        """Return the rows to print or to write: value, then poles and zeros [Hz] and their damping ratios."""
        return [
            {
                "value": row.value,
                "poles_Hz": [float(x) for x in row.poles.f],
                "poles_damping": [float(x) for x in row.poles.damping],
                "zeros_Hz": [float(x) for x in row.zeros.f],
                "zeros_damping": [float(x) for x in row.zeros.damping],
            }
            for row in self.rows
        ]

    @property
    def panels(self) -> tuple[Panel, Panel]:
        """Return the magnitude and phase of the swept responses."""
        unit, f, rows = "V/V" if self.channel == "Vs" else "m/V", self.f, self.rows
        of = unit_of(self.names[0]).replace(DIMENSIONLESS, "")
        labels = [f"{row.value:g} {of}".strip() for row in rows]
        size = [Line(f, np.abs(row.H), label=label) for row, label in zip(rows, labels, strict=True)]
        phase = [Line(f, np.degrees(np.angle(row.H)), label=label) for row, label in zip(rows, labels, strict=True)]
        title = f"{self.channel} / Va for values of {', '.join(self.names)}"
        x, y, ends = "frequency [Hz]", f"|{self.channel} / Va| [{unit}]", (-180.0, 180.0)
        return (
            Panel(title, x, y, tuple(size), x_log=True, y_log=True),
            Panel("phase", x, "phase [deg]", tuple(phase), x_log=True, y_range=ends, kind=PanelKind.PHASE),
        )


def sweep_parameters(model: Model, names: Iterable[str], values: Sequence[float], channel: str, f: Array) -> Sweep:
    """Return poles, zeros and response of a channel while all `names` take each of `values`, in their own unit.

    Poles and zeros are those up to the last frequency of f (F,) [Hz]. Raises ModelError for an unknown parameter."""
    names, f = tuple(names), frequencies(f)
    rows = []
    for value in values:
        changes = dict.fromkeys(names, value)
        poles = _roots(model.poles(changes), f[-1])
        zeros = _roots(model.zeros(channel, changes), f[-1])
        rows.append(SweepRow(value, poles, zeros, model.frf(f, changes, (channel,))[:, 0]))
    return Sweep(names, channel, f, tuple(rows))


def _roots(roots: Complex, end_Hz: float) -> Roots:
    f, damping = frequency_and_damping(roots)
    return Roots(f[f <= end_Hz], damping[f <= end_Hz])
