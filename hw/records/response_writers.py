"""Frequency responses and state-space models as files for others: CSV with real and imaginary parts, and MATLAB structs
whose fields are those of `frd` and `ss`."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from checks.arrays import Array, Complex
from hw.records.writers import HEADER, HEADER_TEXT_BYTES


def response_csv(
    f: Array, H: Complex, channels: Sequence[str], units: Mapping[str, str], more: Mapping[str, Array]
) -> bytes:
    """Return a table with f [Hz] and of each channel its real and imaginary part, with its unit in the header.

    H (F, C); units: "m/V" by channel; more: further columns (F, C) by the end of their name, "coherence", "var"; NaN
    and infinite values are left out with their column."""
    columns: dict[str, Array] = {"f [Hz]": f}
    for i, c in enumerate(channels):
        unit = f" [{units[c]}]" if units.get(c) else ""
        columns |= {f"{c}_re{unit}": H[:, i].real, f"{c}_im{unit}": H[:, i].imag}
        columns |= {f"{c}_{name}": x[:, i] for name, x in more.items() if np.isfinite(x[:, i]).all()}
    rows = zip(*(x.tolist() for x in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    return ("\n".join(lines) + "\n").encode("utf-8")


def frd_mat(
    f: Array,
    H: Complex,
    channels: Sequence[str],
    input: str,
    units: Mapping[str, str],
    more: Mapping[str, Any],
) -> bytes:
    """Return a MATLAB file with a struct `response` of the fields of an frd object: ResponseData (C, 1, F), Frequency
    (F,) [Hz], names and units; more: further fields."""
    fields = {
        "ResponseData": H.T[:, None, :],
        "Frequency": f[:, None],
        "FrequencyUnit": "Hz",
        "InputName": _cells([input]),
        "OutputName": _cells(channels),
        "InputUnit": _cells([units.get(input, "")]),
        "OutputUnit": _cells([units.get(c, "") for c in channels]),
        **more,
    }
    return _mat({"response": fields})


def ss_mat(matrices: Mapping[str, Array], states: Sequence[str], more: Mapping[str, Any]) -> bytes:
    """Return a MATLAB file with a struct `model`: A, B, C, D and the names and units of an ss object."""
    lists = {name: _cells(value) if isinstance(value, list | tuple) else value for name, value in more.items()}
    return _mat({"model": {**matrices, "StateName": _cells(states), **lists}})


def _cells(words: Sequence[str]) -> Any:
    """Return a column of cells of text, empty ones too."""
    cells = np.empty((len(words), 1), dtype=object)
    for i, word in enumerate(words):
        cells[i, 0] = word
    return cells


def _mat(content: Mapping[str, Any]) -> bytes:
    from scipy.io import savemat  # loads slowly: only when wanted

    out = io.BytesIO()
    savemat(out, dict(content))
    return HEADER.ljust(HEADER_TEXT_BYTES) + out.getvalue()[HEADER_TEXT_BYTES:]
