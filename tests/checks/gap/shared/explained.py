"""An answer of the gap workflow, as it is stored, and its pictures: for what shows it."""

import numpy as np

from checks.picture import Image, Line, Panel

FOUND = {
    "model": "strut",
    "start": "strut",
    "model_sha256": "0" * 64,
    "verdict": "explained",
    "reason": None,
    "gap_before": {"G": 37.2, "channels": {"Vs": 1.4, "de": 81.0, "da": 1.1}},
    "where": [{"channel": "de", "f_lo_Hz": 170.0, "f_hi_Hz": 215.0, "p": 1e-9, "excess_dB": 14.2}],
    "named": [
        {
            "effect": "misalignment",
            "parameters": {
                "dx_um": {"value": 12.0, "ci95": [7.5, 16.5]},
                "dy_um": {"value": 149.0, "ci95": [143.0, 155.0]},
            },
            "evidence": {"delta_lnL": 8123.0, "p": 1e-12},
            "sentence": "The APA sits 12 um (x) and 149 um (y) beside the axis of the joints.",
        }
    ],
    "ambiguous": [],
    "unnamed": [],
    "detection_limits": {"loop_delay": {"tau_us": 1.9}},
    "gap_after": {"G": 1.03, "channels": {"Vs": 1.05, "de": 1.02, "da": 1.0}},
}

_F = np.geomspace(10.0, 1000.0, 200)


_BUMP = 12.0 * np.exp(-((np.linspace(1.0, 3.0, 60) - 2.3) ** 2) / 0.02)


def _mode(f0: float) -> np.ndarray:
    return np.abs(1.0 / (1.0 - (_F / f0) ** 2 + 0.02j * _F / f0))


def _magnitude(name: str) -> Panel:
    lines = (
        Line(_F, _mode(95.0) * (1 + 0.2 * _mode(197.0)), "measured", "points", "data"),
        Line(_F, _mode(95.0), "model before", "dashed", "before"),
        Line(_F, _mode(95.0) * (1 + 0.2 * _mode(197.0)), "model after", "solid", "model"),
    )
    return Panel(f"{name} / Va", "frequency [Hz]", f"|{name} / Va|", lines, True, True)


PANELS = {
    "map": Panel(
        "Chance of the residual before (channels: 0 Vs, 1 de, 2 da)",
        "log10 of frequency [Hz]",
        "",
        (Image(np.linspace(1.0, 3.0, 60), np.arange(3.0), np.outer([0.1, 1.0, 0.2], _BUMP)),),
    ),
    "de magnitude": _magnitude("de"),
    "de residual": Panel(
        "de: what is left",
        "frequency [Hz]",
        "|data - model| / |data|",
        (
            Line(_F, 0.2 * _mode(197.0), "before", "solid", "before"),
            Line(_F, 0.01 * np.ones(200), "after", "solid", "model"),
        ),
        True,
        True,
    ),
}
